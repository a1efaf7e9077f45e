"""The connection of one open page: its messages within their limits, and states only as fast as it reads them.

All that is used of tornado beside its public interface stands here; `test_web_server_abuse.py` fails when it changes.
"""

import asyncio
import contextlib
import json
import socket
import time

import tornado.web
import tornado.websocket

from robotont_teleop.web.page_messages import MessageError
from robotont_teleop.web.web_handlers import Guarded

FRAMES_PER_SECOND = 200       # of one page, of all kinds; it sends 25, and 125 at most while a stick moves fast
SEND_BUFFER = 16384           # [bytes] of a page's socket, so that little can wait in it
LONGEST = 512                 # [bytes] of one message
MAX_PAGES = 16                # open at once
LONGEST_REASON = 123          # [bytes] of a close (RFC 6455)
GOODBYE = 1.0                 # [s] for the words of a close to arrive; nothing more is read
GOING_AWAY, NOT_OURS = 1001, 1008  # close codes (RFC 6455): end, policy violation


class PageFrames(tornado.websocket.WebSocketProtocol13):
    """Reads for a PageSocket: after each frame everybody else has a turn, and all of them are counted.

    Tornado itself reads on without a pause while there is anything to read, so that one page that sends fast enough
    holds up all; and of pings and of the parts of a message that does not end it tells nobody in time.
    """

    async def _receive_frame(self):
        """Called by tornado again and again until the connection ends."""
        if self.handler.number is None:
            await asyncio.sleep(GOODBYE)
            self._abort()
            return
        with contextlib.suppress(ValueError):  # a close whose reason is no UTF-8: `on_close` would never come
            await super()._receive_frame()
        self.handler.count_frame()
        await asyncio.sleep(0)


class PageSocket(Guarded, tornado.websocket.WebSocketHandler):
    """The connection of one open page."""

    max_message_size = LONGEST

    def initialize(self):
        """Called by tornado."""
        self.number = None
        self._second, self._frames = None, 0  # a second of the clock, and how many frames have come in it

    def get_websocket_protocol(self):
        """Called by tornado; None for a version of WebSockets that it does not know."""
        protocol = super().get_websocket_protocol()
        # tornado 5 (Ubuntu 20.04) has no params: it asks the handler itself, and takes options of a compression here
        return protocol and PageFrames(self, False, getattr(protocol, "params", None))

    def prepare(self):
        """Called by tornado before the connection is upgraded; without an Origin its own check would not come."""
        super().prepare()
        if not self.origin_allowed:
            raise tornado.web.HTTPError(403, reason="foreign origin")
        if len(self.server.pages) >= MAX_PAGES:
            raise tornado.web.HTTPError(503, reason="too many open pages")

    def open(self):
        """Called by tornado."""
        if self.ws_connection.stream.closed():  # gone during the handshake: `on_close` would never come
            return
        self.number = self.server.add(self)
        self.set_nodelay(True)
        self.ws_connection.stream.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        speeds = self.server.seat.speeds
        self.send({"kind": "hello", "page": self.number, "robot": self.server.robot.name,
                   "time": round(time.monotonic() * 1000.0, 1), **speeds._asdict()})

    def on_message(self, text):
        """Called by tornado."""
        if self.number is None:
            return
        try:
            self.server.receive(self, text)
        except MessageError as error:
            self.end(NOT_OURS, str(error))

    def count_frame(self):
        """A frame of any kind has come."""
        second = int(time.monotonic())
        self._frames = self._frames + 1 if second == self._second else 1
        self._second = second
        if self.number is not None and self._frames > FRAMES_PER_SECOND:
            self.end(NOT_OURS, f"more than {FRAMES_PER_SECOND} frames per second")

    def on_close(self):
        """Called by tornado."""
        if self.number is not None:
            self.server.remove(self)

    def send(self, message):
        """Send an answer now; dropped when the page does not read."""
        self.feed([json.dumps(message)])

    def feed(self, texts):
        """Send the state, unless the page has not read the one before; where that fails `on_close` comes."""
        if self.ws_connection is None or self.ws_connection.stream.writing():
            return
        for text in texts:
            with contextlib.suppress(tornado.websocket.WebSocketClosedError):
                self._writing = self.write_message(text)  # kept, for the loop holds it only weakly
                self._writing.add_done_callback(lambda done: done.cancelled() or done.exception())

    def end(self, code, words):
        """Take no more messages, and close; the robot stops now, however long the goodbye takes."""
        self.server.remove(self)
        self.number = None
        self.close(code, words.encode()[:LONGEST_REASON].decode(errors="ignore"))
