"""The connection of one open page: its messages within their limits, and states only as fast as it reads them."""

import json
import time

import tornado.web
import tornado.websocket

from robotont_teleop.web.page_messages import MessageError
from robotont_teleop.web.web_handlers import Guarded
from robotont_teleop.web.websocket_frames import PageFrames, limit_waiting, reads, write

FRAMES_PER_SECOND = 200       # of one page, of all kinds; it sends 25, and 125 at most while a stick moves fast
SEND_BUFFER = 16384           # [bytes] of a page's socket, so that little can wait in it
LONGEST = 512                 # [bytes] of one message
MAX_PAGES = 16                # open at once
LONGEST_REASON = 123          # [bytes] of a close (RFC 6455)
GOING_AWAY, NOT_OURS = 1001, 1008  # close codes (RFC 6455): end, policy violation


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

    def check_origin(self, _origin):
        """Called by tornado; without an Origin it is not called, `prepare` sees to that."""
        return self.origin_allowed

    def prepare(self):
        """Called by tornado before the connection is upgraded."""
        super().prepare()
        if not self.origin_allowed:
            raise tornado.web.HTTPError(403, reason="foreign origin")
        if len(self.server.pages) >= MAX_PAGES:
            raise tornado.web.HTTPError(503, reason="too many open pages")

    def open(self):
        """Called by tornado."""
        self.number = self.server.add(self)
        self.set_nodelay(True)
        limit_waiting(self, SEND_BUFFER)
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
        if reads(self):
            write(self, json.dumps(message))

    def feed(self, texts):
        """Send the state, unless the page has not read the one before."""
        if reads(self):
            for text in texts:
                write(self, text)

    def end(self, code, words):
        """Take no more messages, and close; the robot stops now, however long the goodbye takes."""
        self.server.remove(self)
        self.number = None
        self.close(code, words.encode()[:LONGEST_REASON].decode(errors="ignore"))
