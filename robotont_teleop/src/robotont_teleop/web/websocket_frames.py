"""The frames of one page's WebSocket: after each one everybody else has a turn, and all of them are counted.

All that is used of tornado beside its public interface stands here; `test_web_server_abuse.py` fails when it changes.
"""

import asyncio
import contextlib
import socket

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


def limit_waiting(page, size):
    """Let no more than about `size` bytes wait in the socket of a WebSocketHandler."""
    page.ws_connection.stream.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, size)


def reads(page):
    """Whether all that was sent to a WebSocketHandler's page has left for the network."""
    return page.ws_connection is not None and not page.ws_connection.stream.writing()


def write(page, text):
    """Send a frame; where that fails the connection is closed, and `on_close` comes."""
    with contextlib.suppress(tornado.websocket.WebSocketClosedError):
        page.writing = page.write_message(text)  # kept, for the loop holds it only weakly
        page.writing.add_done_callback(lambda done: done.cancelled() or done.exception())
