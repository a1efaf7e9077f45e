"""The web server of the page: logins and messages in, the newest state out. Free of ROS.

`robot` (RobotView in web_teleop_node) is the robot of the pages: `send(twist)`, `goal(x, y)`, `cancel()`, the
orders without values of page_messages, and its `emergency_stop`, which never wait; `state()`, `status()`, `figures()`,
`map_picture`, `camera`, `name`.
"""

import asyncio
import itertools
import json
import time

from robotont_teleop.web.page_messages import read_message
from robotont_teleop.web.page_server import PageServer
from robotont_teleop.web.page_socket import GOING_AWAY, PageSocket
from robotont_teleop.web.web_handlers import CameraHandler, read_files

STATE_RATE = 20.0  # [Hz] of the state that open pages get
STATUS_STATES = 4  # states to one status
PING = 5.0     # [s] between two pings; a page that answers none for two of them is closed: it reads no more, or is gone
GOODBYE = 0.05  # [s] for the last messages at the server's end


class WebServer(PageServer):
    """All open pages, the seat from which one of them drives, and the loop that feeds them."""

    def __init__(self, robot, seat, access, names):
        super().__init__(access, names, read_files("robotont_teleop"))
        self.robot, self.seat = robot, seat
        self.pages = set()
        self._numbers = itertools.count(1)
        self._dead_man = None   # the timer's handle

    def listen(self, address, port, certificate=""):
        """Serve; returns the page's URL. Raises SetUpError."""
        url = self.serve([(r"/socket", PageSocket), (r"/camera\.jpg", CameraHandler)],
                         address, port, certificate, websocket_ping_interval=PING, websocket_ping_timeout=2 * PING)
        self.feeder = self._loop.create_task(self._feed())  # ends by its failure only
        return url

    async def close(self):
        """Stop serving; the robot stands."""
        self.http_server.stop()
        self.feeder.cancel()
        for page in tuple(self.pages):
            page.end(GOING_AWAY, "the server ends")
        await asyncio.sleep(GOODBYE)

    def add(self, page):
        """A page has opened; returns its number."""
        self.pages.add(page)
        return next(self._numbers)

    def remove(self, page):
        """A page has closed."""
        self.pages.discard(page)
        self._send(self.seat.leave(page.number))

    def receive(self, page, text):
        """A message of a page; raises MessageError."""
        message = read_message(text)
        now = time.monotonic()
        late = message.seen is not None and not self.seat.is_fresh(message.seen, now)
        if late and (message.kind != "drive" or any(message.values)):
            page.send({"kind": "late", "what": message.kind})
        if message.kind == "drive":
            stopped = self.robot.emergency_stop.pressed
            self._send(self.seat.command(page.number, message.seen, message.values, now, stopped))
        elif message.kind == "stop":
            self.robot.emergency_stop.press()
            self._send(self.seat.stop())
            self.robot.cancel()
        elif message.kind == "cancel":
            self.robot.cancel()
        elif message.kind == "take" and not late:
            self._send(self.seat.take(page.number))
        elif not late:
            if self.seat.driver is None:
                self.seat.take(page.number)
            if page.number == self.seat.driver:
                self._order(page, message)
            else:
                page.send({"kind": "refused", "what": message.kind})

    def _order(self, page, message):
        """Requests that only the driving page may make."""
        if message.kind == "release":
            if message.values == (self.robot.emergency_stop.pressed_at,):  # a browser gives it back as it came
                self.robot.emergency_stop.release()
            else:  # the person had not seen that somebody has pressed it again
                page.send({"kind": "late", "what": message.kind})
        else:
            getattr(self.robot, message.kind)(*message.values)

    def _send(self, twist):
        left = self.seat.time_left(time.monotonic())
        if left is not None and self._dead_man is None:
            self._dead_man = self._loop.call_later(left, self._look)
        if twist is not None:
            self.robot.send(twist)

    def _look(self):
        self._dead_man = None
        self._send(self.seat.look(time.monotonic()))

    async def _feed(self):
        """Send all pages the newest state at STATE_RATE, and with every STATUS_STATES-th the status."""
        due = self._loop.time()
        for tick in itertools.count():
            due = max(due + 1.0 / STATE_RATE, self._loop.time())
            await asyncio.sleep(due - self._loop.time())
            if not self.pages:
                continue
            told = [{"kind": "state", "time": round(time.monotonic() * 1000.0, 1), "driver": self.seat.driver,
                     "held": sorted(self.seat.held), "pressed_at": self.robot.emergency_stop.pressed_at,
                     **self.robot.state()}]
            if tick % STATUS_STATES == 0:
                told.append({"kind": "status", **self.robot.status()})
            texts = [json.dumps(one) for one in told]
            for page in tuple(self.pages):
                page.feed(texts)

    def metrics(self):
        """Text for Prometheus."""
        from robotont_teleop.web.metrics import metrics  # here: a megabyte, for who asks
        return metrics(*self.robot.figures())

    @property
    def map_picture(self):
        """PNG of the map, or None."""
        return self.robot.map_picture
