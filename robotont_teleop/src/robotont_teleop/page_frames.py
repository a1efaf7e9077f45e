"""The frames of one page's WebSocket: after each one everybody else has a turn, and all of them are counted."""

import asyncio

import tornado.websocket

GOODBYE = 1.0  # [s] for the words of a close to arrive; nothing more is read


class PageFrames(tornado.websocket.WebSocketProtocol13):
    """Reads for a PageSocket.

    Tornado itself reads on without a pause while there is anything to read, so that one page that sends fast enough
    holds up all; and of pings and of the parts of a message that does not end it tells nobody in time.
    """

    async def _receive_frame(self):
        """Called by tornado again and again until the connection ends."""
        if self.handler.number is None:
            await asyncio.sleep(GOODBYE)
            self._abort()
            return
        await super()._receive_frame()
        self.handler.count_frame()
        await asyncio.sleep(0)
