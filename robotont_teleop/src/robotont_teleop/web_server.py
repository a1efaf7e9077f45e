"""The web server of the page: logins and messages in, the newest state out. Free of ROS.

`robot` (RobotView in web_teleop_node) is the robot of the pages: `send(twist)`, `emergency_stop(pressed)`,
`goal(x, y)`, `cancel()`, `give_back()`, `reset_odometry()`, which never wait, and `state()`, `status()`, `scan()`,
`map_picture()`, `camera_picture()`.
"""

import asyncio
import contextlib
import json
import mimetypes
import socket
import time
from pathlib import Path
from typing import Any, NamedTuple, Optional, Tuple

import tornado.httpserver
import tornado.web
import tornado.websocket
from tornado.iostream import StreamClosedError

from robotont_teleop.access import LONGEST_TOKEN, host_allowed, origin_allowed
from robotont_teleop.driving_seat import DrivingSeat, MessageRate
from robotont_teleop.messages import LONGEST, MessageError, read_message

COOKIE = "robotont_teleop"
COOKIE_DAYS = 90
PAGE, LOGIN_PAGE = "index.html", "login.html"
MESSAGES_PER_SECOND = 100.0   # of one page; it sends 30 to 60
LARGEST_BODY, LARGEST_HEADER = 1024, 8192  # [bytes] of a request
IDLE, BODY_TIMEOUT = 20.0, 5.0  # [s] an HTTP connection may be idle, a body may take
SEND_BUFFER = 16384           # [bytes] of a page's socket, so that little can wait in it
SLOWEST_READER = 5.0          # [s] a page that has not read for so long is closed
CAMERA_WAIT = 5.0             # [s] a request waits for a new picture
WRONG_MESSAGES = 10           # of one page before it is closed
NOT_OURS, TOO_MANY = 1008, 1013  # close codes (RFC 6455): policy violation, try again later


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


class WebServer:
    """All open pages, the seat from which one of them drives, and the loop that feeds them."""

    def __init__(self, robot, access, settings, folder):
        self.robot = robot
        self.access = access
        self.settings = settings
        self.seat = DrivingSeat(settings.speeds, settings.oldest, settings.dead_man)
        self.pages = set()
        self.files = _read_files(Path(folder))
        self.refused = 0        # messages and requests that were malformed, foreign or too many
        self.commands = 0       # sent to the robot
        self._next_id = 1
        self._dead_man = None   # the timer's handle
        self._loop = asyncio.get_running_loop()
        self._feeder = None
        self._server = None

    def listen(self, address, port, tls=None):
        """Serve; returns the port (another one than `port` where that is 0). Raises OSError."""
        sockets = tornado.netutil.bind_sockets(port, address)
        self._server = _LimitedServer(
            self._application(), limit=self.settings.max_connections, ssl_options=tls, max_header_size=LARGEST_HEADER,
            max_body_size=LARGEST_BODY, max_buffer_size=8 * LARGEST_HEADER, idle_connection_timeout=IDLE,
            body_timeout=BODY_TIMEOUT)
        self._server.add_sockets(sockets)
        self._feeder = self._loop.create_task(self._feed())
        return sockets[0].getsockname()[1]

    async def close(self):
        """Stop serving; the robot stands."""
        self._server.stop()
        self._feeder.cancel()
        if self.seat.driver is not None:
            self._send(self.seat.leave(self.seat.driver))
        for page in tuple(self.pages):
            page.close(1001, "the server ends")
        await asyncio.sleep(0.05)

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
            self._send(self.seat.command(page.number, message.time / 1000.0, message.values, now))
        elif message.kind == "ping":
            page.send({"kind": "pong", "time": message.time})
        elif message.kind == "stop":
            self.seat.stop()
            self.robot.emergency_stop(True)
            self.robot.cancel()
        elif message.kind == "take":
            self._send(self.seat.take(page.number))
        else:
            if self.seat.driver is None:
                self.seat.take(page.number)
            if page.number == self.seat.driver:
                self._order(message)
            else:
                page.send({"kind": "refused", "what": message.kind})

    def _order(self, message):
        """Requests that only the driving page may make."""
        if message.kind == "release":
            self.robot.emergency_stop(False)
        elif message.kind == "goal":
            self.robot.goal(*message.values)
        else:
            getattr(self.robot, message.kind)()  # cancel, give_back, reset_odometry

    def _send(self, twist):
        if twist is not None:
            self.commands += 1
            self.robot.send(twist)
        left = self.seat.time_left(time.monotonic())
        if left is not None and self._dead_man is None:
            self._dead_man = self._loop.call_later(left, self._look)

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

    def _application(self):
        application = tornado.web.Application(
            [(r"/socket", PageSocket), (r"/login", LoginHandler), (r"/map\.png", MapHandler),
             (r"/camera\.jpg", CameraHandler), (r"/(.*)", FileHandler)],
            websocket_max_message_size=2 * LONGEST, websocket_ping_interval=5.0, websocket_ping_timeout=10.0,
            log_function=lambda handler: None)
        application.web_server = self
        return application


class _LimitedServer(tornado.httpserver.HTTPServer):
    """Closes connections beyond a limit at once."""

    def initialize(self, *arguments, limit, **options):
        super().initialize(*arguments, **options)
        self._limit = limit
        self._open = set()

    def handle_stream(self, stream, address):
        self._open = {other for other in self._open if not other.closed()}
        if len(self._open) >= self._limit:
            stream.close()
            return
        self._open.add(stream)
        super().handle_stream(stream, address)


class _Guarded:
    """Checks that come before every request: Host; and, unless `public`, the cookie."""

    public = False

    @property
    def server(self):
        """The WebServer."""
        return self.application.web_server

    def set_default_headers(self):
        """Called by tornado: the page loads nothing from elsewhere, and no other site may frame it."""
        host, scheme = self.request.host, self.server.settings.scheme
        sockets = f" {scheme.replace('http', 'ws')}://{host}" if self._host_allowed() else ""
        self.set_header("Content-Security-Policy",
                        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; "
                        f"manifest-src 'self'; connect-src 'self'{sockets}; form-action 'self'; base-uri 'none'; "
                        "frame-ancestors 'none'")
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("X-Frame-Options", "DENY")
        self.set_header("Referrer-Policy", "no-referrer")
        self.set_header("Cross-Origin-Opener-Policy", "same-origin")
        self.set_header("Cross-Origin-Resource-Policy", "same-origin")
        self.set_header("Cache-Control", "no-store")
        self.clear_header("Server")

    def prepare(self):
        """Called by tornado before the request's method."""
        if not self._host_allowed():
            raise tornado.web.HTTPError(403, reason="foreign host")
        if not self.public and not self.authorised:
            raise tornado.web.HTTPError(401, reason="no token")

    def write_error(self, status_code, **_):
        """One line, without anything that the request held."""
        if status_code >= 400:
            self.server.refused += 1
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"{status_code} {self._reason}\n")

    def log_exception(self, kind, error, trace):
        """Called by tornado; a browser's mistakes are not worth a traceback."""
        if not isinstance(error, (tornado.web.HTTPError, StreamClosedError)):
            super().log_exception(kind, error, trace)

    @property
    def authorised(self):
        """Whether the browser has shown the token before."""
        return self.server.access.admits(self.get_cookie(COOKIE))

    @property
    def origin_allowed(self):
        """Whether the request comes from the page itself."""
        return origin_allowed(self.request.headers.get("Origin"), self.server.settings.scheme, self.request.host)

    def _host_allowed(self):
        connection = self.request.connection
        stream = getattr(connection, "stream", None)
        try:
            own = stream.socket.getsockname()[0]
        except (AttributeError, OSError):
            return False  # gone already
        return host_allowed(self.request.headers.get("Host"), own, self.server.settings.names)


class FileHandler(_Guarded, tornado.web.RequestHandler):
    """The files of the page, out of memory; the page itself only for who has shown the token."""

    public = True

    def get(self, name):
        """Called by tornado."""
        name = name or PAGE
        status = 200
        if name == PAGE and not self.authorised:
            name, status = LOGIN_PAGE, 401
        file = self.server.files.get(name)
        if file is None:
            raise tornado.web.HTTPError(404)
        _send_file(self, file, status)


class LoginHandler(_Guarded, tornado.web.RequestHandler):
    """Takes the token once, and gives a cookie that no script can read."""

    public = True

    def post(self):
        """Called by tornado."""
        if not self.origin_allowed:
            raise tornado.web.HTTPError(403, reason="foreign origin")
        token = self.get_body_argument("token", "")[:LONGEST_TOKEN + 1]
        answer = self.server.access.log_in(token, time.monotonic())
        if answer == "later":
            raise tornado.web.HTTPError(429, reason="too many wrong tokens: wait a minute")
        if answer == "wrong":
            raise tornado.web.HTTPError(401, reason="wrong token")
        self.set_cookie(COOKIE, self.server.access.cookie, expires_days=COOKIE_DAYS, path="/", httponly=True,
                        samesite="Strict", secure=self.server.settings.scheme == "https")
        self.redirect("/", status=303)


class MapHandler(_Guarded, tornado.web.RequestHandler):
    """The newest map."""

    def get(self):
        """Called by tornado."""
        picture = self.server.robot.map_picture()
        if picture is None:
            raise tornado.web.HTTPError(404)
        self.set_header("Content-Type", "image/png")
        self.finish(picture)


class CameraHandler(_Guarded, tornado.web.RequestHandler):
    """The newest picture, each one only once: the page asks for the next when it has shown this one."""

    async def get(self):
        """Called by tornado."""
        seen = self.get_query_argument("after", "0")
        end = time.monotonic() + CAMERA_WAIT
        while True:
            picture = self.server.robot.camera_picture()
            if picture is not None and str(picture[0]) != seen:
                break
            if time.monotonic() > end:
                raise tornado.web.HTTPError(404)
            await asyncio.sleep(0.02)
        self.set_header("Content-Type", "image/jpeg")
        self.set_header("X-Picture", str(picture[0]))
        await self.finish(picture[1])


class PageSocket(_Guarded, tornado.websocket.WebSocketHandler):
    """The connection of one open page."""

    def initialize(self):
        """Called by tornado."""
        self.number = None
        self.waiting = {}   # newest message of each slow kind that this page has not got yet
        self.fresh = True   # has got no status yet
        self._rate = MessageRate(MESSAGES_PER_SECOND)
        self._wrong = 0
        self._writing = None  # future of the newest write
        self._read_at = 0.0   # [s] when the page was last seen to read

    def check_origin(self, _origin):
        """Called by tornado; without an Origin it is not called, `prepare` sees to that."""
        return self.origin_allowed

    def prepare(self):
        """Called by tornado before the connection is upgraded."""
        super().prepare()
        if not self.origin_allowed:
            raise tornado.web.HTTPError(403, reason="foreign origin")
        if len(self.server.pages) >= self.server.settings.max_pages:
            raise tornado.web.HTTPError(503, reason="too many open pages")

    def open(self):
        """Called by tornado."""
        self.number = self.server.add(self)
        if self.number is None:
            self.close(TOO_MANY, "too many open pages")
            return
        self.set_nodelay(True)
        self.ws_connection.stream.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        self._read_at = time.monotonic()
        settings = self.server.settings
        self.send({"kind": "hello", "page": self.number, "linear": settings.speeds.linear,
                   "angular": settings.speeds.angular, "oldest": settings.oldest, "dead_man": settings.dead_man})

    def on_message(self, text):
        """Called by tornado."""
        if self.number is None:
            return
        if not self._rate.take(time.monotonic()):
            self._refuse(f"more than {MESSAGES_PER_SECOND:g} messages per second", at_once=True)
            return
        try:
            self.server.receive(self, text)
        except MessageError as error:
            self._refuse(str(error))

    def on_close(self):
        """Called by tornado."""
        if self.number is not None:
            self.server.remove(self)

    def send(self, message):
        """Send an answer now; dropped when the page does not read."""
        if self._reads():
            self._write(json.dumps(message))

    def feed(self, state, now):
        """Send the state, unless the page has not read the one before; close a page that reads no more."""
        if not self._reads():
            if now - self._read_at > SLOWEST_READER:
                self._drop()
            return
        self._read_at = now
        for text in (state, *self.waiting.values()):
            self._write(text)
        self.waiting.clear()

    def _refuse(self, words, at_once=False):
        self.server.refused += 1
        self._wrong += 1
        if at_once or self._wrong >= WRONG_MESSAGES:
            self.server.remove(self)  # stops the robot now, however long the goodbye takes
            self.number = None
            self.close(NOT_OURS, words[:100])
        else:
            self.send({"kind": "error", "words": words[:200]})

    def _reads(self):
        return self._writing is None or self._writing.done()

    def _write(self, text):
        with contextlib.suppress(tornado.websocket.WebSocketClosedError):
            self._writing = asyncio.ensure_future(_quietly(self.write_message(text)))

    def _drop(self):
        self.server.refused += 1
        connection = self.ws_connection
        if connection is not None:
            connection._abort()


async def _quietly(write):
    with contextlib.suppress(tornado.websocket.WebSocketClosedError, StreamClosedError):
        await write


class _File(NamedTuple):
    kind: str
    content: bytes


def _read_files(folder):
    """The page's files by name; nothing else can be asked for."""
    kinds = {**mimetypes.types_map, ".webmanifest": "application/manifest+json", ".js": "text/javascript"}
    files = {}
    for path in folder.iterdir():
        kind = kinds.get(path.suffix)
        if kind and path.is_file():
            text = kind.startswith("text/") or kind.endswith("json")
            files[path.name] = _File(kind + ("; charset=utf-8" if text else ""), path.read_bytes())
    return files


def _send_file(handler, file: _File, status: Optional[int] = 200):
    handler.set_status(status)
    handler.set_header("Content-Type", file.kind)
    handler.set_header("Cache-Control", "no-cache")
    handler.finish(file.content)
