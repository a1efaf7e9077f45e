"""The web server of the page: logins and messages in, the newest state out. Free of ROS.

`robot` (RobotView in web_teleop_node) is the robot of the pages: `send(twist)`, `press_emergency_stop()`,
`release_emergency_stop()`, `goal(x, y)`, `cancel()`, `give_back()`, `reset_odometry()`, which never wait, and
`stopped`, `pressed_at`, `state()`, `status()`, `scan()`, `map_picture()`, `camera_picture()`.
"""

import asyncio
import json
import time
from pathlib import Path
from typing import Any, NamedTuple, Tuple

import tornado.httpserver
import tornado.netutil
import tornado.web

from robotont_teleop.driving_seat import DrivingSeat
from robotont_teleop.foxglove import Channels, FoxgloveSocket
from robotont_teleop.messages import LONGEST, read_message
from robotont_teleop.metrics import metrics
from robotont_teleop.page_socket import GOING_AWAY, PageSocket
from robotont_teleop.web_handlers import (
    CameraHandler,
    FileHandler,
    LoginHandler,
    MapHandler,
    MetricsHandler,
    read_files,
)

LARGEST_BODY, LARGEST_HEADER = 1024, 8192  # [bytes] of a request
IDLE, BODY_TIMEOUT = 20.0, 5.0  # [s] an HTTP connection may be idle, a body may take
GOODBYE = 0.05  # [s] for the last messages at the server's end


class ServerSettings(NamedTuple):
    """Settings of the user."""

    names: Tuple[str, ...]  # host names under which browsers may come, beside the address itself
    scheme: str             # http or https
    rate: float             # [Hz] of the state that pages get
    oldest: float           # [s] an older command is dropped
    dead_man: float         # [s] without a command of a moving page the robot stops
    max_pages: int          # open pages
    max_connections: int    # open connections, pages among them
    speeds: Any             # Speeds that no page exceeds
    robot: str = "Robotont"  # name that people know it by


class WebServer:
    """All open pages, the seat from which one of them drives, and the loop that feeds them."""

    def __init__(self, robot, access, settings, folder, viewer_topics=None):
        self.robot = robot
        self.access = access
        self.settings = settings
        self.seat = DrivingSeat(settings.speeds, settings.oldest, settings.dead_man)
        self.pages = set()
        self.files = read_files(Path(folder), settings.robot)
        self.refused = 0        # messages and requests that were malformed, foreign or too many
        self.commands = 0       # sent to the robot
        self._next_id = 1
        self._dead_man = None   # the timer's handle
        self._loop = asyncio.get_running_loop()
        self.channels = Channels(viewer_topics, self._loop)
        self._feeder = None
        self._server = None

    def listen(self, address, port, tls=None):
        """Serve; returns the port (another one than `port` where that is 0). Raises OSError."""
        sockets = tornado.netutil.bind_sockets(port, address)
        self._server = LimitedServer(
            self._application(), limit=self.settings.max_connections, ssl_options=tls, max_header_size=LARGEST_HEADER,
            max_body_size=LARGEST_BODY, max_buffer_size=8 * LARGEST_HEADER, idle_connection_timeout=IDLE,
            body_timeout=BODY_TIMEOUT)
        self._server.add_sockets(sockets)
        self._feeder = self._loop.create_task(self._feed())
        return sockets[0].getsockname()[1]

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

    def admit(self, stream):
        """Somebody who may come in has sent a request on this connection; it is not closed in favour of newer ones."""
        self._server.admit(stream)

    def add(self, page):
        """A page has opened; returns its number, or None when there are too many."""
        if len(self.pages) >= self.settings.max_pages:
            self.refused += 1
            return None
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
            self._send(self.seat.command(page.number, message.seen, message.values, now, self.robot.stopped))
        elif message.kind == "ping":
            page.send({"kind": "pong", "time": message.time})
        elif message.kind == "stop":
            self.robot.press_emergency_stop()
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
            if message.seen > self.robot.pressed_at:
                self.robot.release_emergency_stop()
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
        period = 1.0 / self.settings.rate
        status, scan_number, due = None, None, self._loop.time()
        while True:
            due = max(due + period, self._loop.time())
            await asyncio.sleep(due - self._loop.time())
            if not self.pages:
                continue
            new = {"kind": "status", "pages": len(self.pages), **self.robot.status()}
            if new != status:
                status = new
                text = json.dumps(status)
                for page in self.pages:
                    page.waiting["status"] = text
            scan = self.robot.scan()
            if scan is not None and scan["number"] != scan_number:
                scan_number = scan["number"]
                text = json.dumps({"kind": "scan", **scan})
                for page in self.pages:
                    page.waiting["scan"] = text
            self._feed_pages(status)

    def _feed_pages(self, status):
        now = time.monotonic()
        text = json.dumps({"kind": "state", "time": round(now * 1000.0, 1), "driver": self.seat.driver,
                           "hands_off": self.seat.hands_off, **self.robot.state()})
        for page in tuple(self.pages):
            if page.fresh:
                page.fresh = False
                page.waiting["status"] = json.dumps(status)
            page.feed(text, now)

    async def metrics(self):
        """Text for Prometheus."""
        return metrics(*self.robot.figures())

    def _application(self):
        application = tornado.web.Application(
            [(r"/socket", PageSocket), (r"/login", LoginHandler), (r"/map\.png", MapHandler),
             (r"/camera\.jpg", CameraHandler), (r"/foxglove", FoxgloveSocket), (r"/metrics", MetricsHandler),
             (r"/(.*)", FileHandler)],
            websocket_max_message_size=2 * LONGEST, websocket_ping_interval=5.0, websocket_ping_timeout=10.0,
            log_function=lambda handler: None)
        application.web_server = self
        return application


class LimitedServer(tornado.httpserver.HTTPServer):
    """Beyond the limit closes the oldest connection on which nobody has shown that he may come in, or else the new one.

    So strangers can take the connections from each other only.
    """

    def initialize(self, *arguments, limit, **options):
        """Called by tornado. limit: open connections."""
        super().initialize(*arguments, **options)
        self._limit = limit
        self._known = set()
        self._strangers = {}  # an ordered set

    def handle_stream(self, stream, address):
        """Called by tornado for a new connection."""
        self._known = {other for other in self._known if not other.closed()}
        self._strangers = {other: None for other in self._strangers if not other.closed()}
        if len(self._known) >= self._limit:
            stream.close()
            return
        if len(self._known) + len(self._strangers) >= self._limit:
            oldest = next(iter(self._strangers))
            del self._strangers[oldest]
            oldest.close()
        self._strangers[stream] = None
        super().handle_stream(stream, address)

    def admit(self, stream):
        """Somebody who may come in has sent a request on it."""
        if stream in self._strangers:
            del self._strangers[stream]
            self._known.add(stream)
