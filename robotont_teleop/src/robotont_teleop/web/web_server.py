"""The web server of the page: logins and messages in, the newest state out. Free of ROS.

`robot` (RobotView in web_teleop_node) is the robot of the pages: `send(twist)`, `goal(x, y)`, `cancel()`,
`give_back()`, `reset_odometry()` and its `emergency_stop`, which never wait; `state()`, `status()`, `scan()`,
`map_picture`, `camera`.
"""

import asyncio
import json
import time
from pathlib import Path
from typing import Any, NamedTuple, Tuple

from robotont_teleop.web.driving_seat import DrivingSeat
from robotont_teleop.web.foxglove import Channels, FoxgloveSocket
from robotont_teleop.web.page_messages import LONGEST, read_message
from robotont_teleop.web.metrics import metrics
from robotont_teleop.web.page_server import PageServer
from robotont_teleop.web.page_socket import GOING_AWAY, PageSocket
from robotont_teleop.web.web_handlers import CameraHandler, read_files

STATE_RATE = 20.0  # [Hz] of the state that open pages get
GOODBYE = 0.05  # [s] for the last messages at the server's end


class ServerSettings(NamedTuple):
    """Settings of the user."""

    names: Tuple[str, ...]  # host names under which browsers may come, beside the address itself
    scheme: str             # http or https
    oldest: float           # [s] an older command is dropped
    dead_man: float         # [s] without a command of a moving page the robot stops
    speeds: Any             # Speeds that no page exceeds
    robot: str = "Robotont"  # name that people know it by


class WebServer(PageServer):
    """All open pages, the seat from which one of them drives, and the loop that feeds them."""

    def __init__(self, robot, access, settings, folder, viewer_topics=None):
        super().__init__(access, settings, read_files(Path(folder), settings.robot))
        self.robot = robot
        self.seat = DrivingSeat(settings.speeds, settings.oldest, settings.dead_man)
        self.pages = set()
        self.commands = 0       # sent to the robot
        self._next_id = 1
        self._dead_man = None   # the timer's handle
        self.channels = Channels(viewer_topics, self._loop)

    def listen(self, address, port, tls=None):
        """Serve; returns the port. Raises OSError."""
        port = self.serve([(r"/socket", PageSocket), (r"/camera\.jpg", CameraHandler), (r"/foxglove", FoxgloveSocket)],
                          address, port, tls, websocket_max_message_size=2 * LONGEST, websocket_ping_interval=5.0,
                          websocket_ping_timeout=10.0)
        self._feeder = self._loop.create_task(self._feed())
        return port

    async def ended(self):
        """Until the loop that feeds the pages fails; raises what it raised."""
        await self._feeder

    async def close(self):
        """Stop serving; the robot stands."""
        self._server.stop()
        self._feeder.cancel()
        for page in tuple(self.pages):
            page.end(GOING_AWAY, "the server ends")
        await asyncio.sleep(GOODBYE)

    def add(self, page):
        """A page has opened; returns its number."""
        number, self._next_id = self._next_id, self._next_id + 1
        self.pages.add(page)
        return number

    def remove(self, page):
        """A page has closed."""
        self.pages.discard(page)
        self._send(self.seat.leave(page.number))

    def receive(self, page, text):
        """A message of a page; raises MessageError."""
        message = read_message(text)
        now = time.monotonic()
        if message.kind == "drive":
            stopped = self.robot.emergency_stop.pressed
            self._send(self.seat.command(page.number, message.seen, message.values, now, stopped))
        elif message.kind == "ping":
            page.send({"kind": "pong", "time": message.time})
        elif message.kind == "stop":
            self.robot.emergency_stop.press()
            self._send(self.seat.stop())
            self.robot.cancel()
        elif message.kind == "cancel":
            self.robot.cancel()
        elif not self.seat.is_fresh(message.seen, now):
            page.send({"kind": "late", "what": message.kind})
        elif message.kind == "take":
            self._send(self.seat.take(page.number))
        else:
            if self.seat.driver is None:
                self.seat.take(page.number)
            if page.number == self.seat.driver:
                self._order(page, message)
            else:
                page.send({"kind": "refused", "what": message.kind})

    def _order(self, page, message):
        """Requests that only the driving page may make."""
        if message.kind == "release":
            if message.seen > self.robot.emergency_stop.pressed_at:
                self.robot.emergency_stop.release()
            else:  # the page has not seen that somebody has pressed it again
                page.send({"kind": "late", "what": message.kind})
        elif message.kind == "goal":
            self.robot.goal(*message.values)
        else:
            getattr(self.robot, message.kind)()  # give_back, reset_odometry

    def _send(self, twist):
        left = self.seat.time_left(time.monotonic())
        if left is not None and self._dead_man is None:
            self._dead_man = self._loop.call_later(left, self._look)
        if twist is not None:
            self.commands += 1
            self.robot.send(twist)

    def _look(self):
        self._dead_man = None
        self._send(self.seat.look(time.monotonic()))

    async def _feed(self):
        """Send each page the newest state at the set rate, the status when it has changed."""
        period = 1.0 / STATE_RATE
        status, scan_number, due = None, None, self._loop.time()
        while True:
            due = max(due + period, self._loop.time())
            await asyncio.sleep(due - self._loop.time())
            if not self.pages:
                continue
            newest = {"kind": "status", "pages": len(self.pages), **self.robot.status()}
            news = {} if newest == status else {"status": json.dumps(newest)}
            status, scan = newest, self.robot.scan()
            if scan is not None and scan["number"] != scan_number:
                scan_number = scan["number"]
                news["scan"] = json.dumps({"kind": "scan", **scan})
            now = time.monotonic()
            text = json.dumps({"kind": "state", "time": round(now * 1000.0, 1), "driver": self.seat.driver,
                               "hands_off": self.seat.hands_off, **self.robot.state()})
            for page in tuple(self.pages):
                page.waiting.update(news)
                if page.fresh:
                    page.fresh = False
                    page.waiting["status"] = json.dumps(status)
                page.feed(text, now)

    async def metrics(self):
        """Text for Prometheus."""
        return metrics(*self.robot.figures())

    @property
    def map_picture(self):
        """PNG of the map, or None."""
        return self.robot.map_picture
