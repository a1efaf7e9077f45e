"""The requests of browsers other than the page's messages: who may ask, and files, login, map and camera."""

import asyncio
import mimetypes
import time
from pathlib import Path

import rospkg
import tornado.web

from robotont_teleop.web.access import host_allowed, origin_allowed

COOKIE_DAYS = 90
PAGE, LOGIN_PAGE = "index.html", "login.html"
CAMERA_WAIT = 5.0  # [s] a request waits for a new picture


class Guarded:
    """Checks that come before every request: Host; and, unless `public`, cookie or token."""

    public = False

    @property
    def server(self):
        """The WebServer."""
        return self.application.web_server

    def set_default_headers(self):
        """Called by tornado: the page loads nothing from elsewhere, and no other site may frame it."""
        host, scheme = self.request.host, self.server.scheme
        sockets = f" {scheme.replace('http', 'ws')}://{host}" if self._host_allowed() else ""
        self.set_header("Content-Security-Policy",
                        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; "
                        f"manifest-src 'self'; connect-src 'self'{sockets}; form-action 'self'; base-uri 'none'; "
                        "frame-ancestors 'none'")
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("Referrer-Policy", "same-origin")  # with "no-referrer" a form tells no Origin
        self.set_header("Cross-Origin-Opener-Policy", "same-origin")
        self.set_header("Cross-Origin-Resource-Policy", "same-origin")
        self.set_header("Cache-Control", "no-store")
        self.clear_header("Server")

    def prepare(self):
        """Called by tornado before the request's method."""
        if not self._host_allowed():
            raise tornado.web.HTTPError(403, reason="foreign host")
        if self.authorised:
            self.request.connection.stream.admitted = True
        elif not self.public:
            raise tornado.web.HTTPError(401, reason="no token")

    @property
    def authorised(self):
        """Whether the browser has shown the token before, or the request shows it, as Prometheus does."""
        access, (kind, _, token) = self.server.access, self.request.headers.get("Authorization", "").partition(" ")
        return access.admits(self.get_cookie(access.cookie_name)) or (kind == "Bearer" and access.knows(token))

    @property
    def origin_allowed(self):
        """Whether the request comes from the page itself."""
        return origin_allowed(self.request.headers.get("Origin"), self.server.scheme, self.request.host)

    def _host_allowed(self):
        try:
            own = self.request.connection.stream.socket.getsockname()[0]
        except (AttributeError, OSError):
            return False  # gone already
        return host_allowed(self.request.headers.get("Host"), own, self.server.names)


class FileHandler(Guarded, tornado.web.RequestHandler):
    """The files of the page, out of memory; the page itself only for who has shown the token."""

    public = True

    def get(self, name=PAGE):
        """Called by tornado."""
        name = name or PAGE
        if name == PAGE and not self.authorised:
            name = LOGIN_PAGE
            self.set_status(401)
        if name not in self.server.files:
            raise tornado.web.HTTPError(404)
        kind, content = self.server.files[name]
        self.set_header("Content-Type", kind)
        self.set_header("Cache-Control", "no-cache")
        self.finish(content)


class LoginHandler(FileHandler):
    """Takes the token once, and gives a cookie that no script can read; asks again for one that is wrong."""

    def get(self):
        """Called by tornado: nobody has tried a token."""
        self.redirect("/")

    def post(self):
        """Called by tornado."""
        if not self.origin_allowed:
            raise tornado.web.HTTPError(403, reason="foreign origin")
        access = self.server.access
        if not access.knows(self.get_body_argument("token", "")):
            super().get()
            return
        self.set_cookie(access.cookie_name, access.cookie, expires_days=COOKIE_DAYS, path="/", httponly=True,
                        samesite="Strict", secure=self.server.scheme == "https")
        self.redirect("/", status=303)


class MetricsHandler(Guarded, tornado.web.RequestHandler):
    """For Prometheus."""

    def get(self):
        """Called by tornado."""
        from robotont_teleop.web.metrics import KIND  # as in WebServer.metrics
        self.set_header("Content-Type", KIND)
        self.finish(self.server.metrics())


class MapHandler(Guarded, tornado.web.RequestHandler):
    """The newest map."""

    def get(self):
        """Called by tornado."""
        picture = self.server.map_picture
        if picture is None:
            raise tornado.web.HTTPError(404)
        self.set_header("Content-Type", "image/png")
        self.finish(picture)


class CameraHandler(Guarded, tornado.web.RequestHandler):
    """The newest picture, each one only once: the page asks for the next when it has shown this one."""

    async def get(self):
        """Called by tornado."""
        seen = self.get_query_argument("after", "0")
        end = time.monotonic() + CAMERA_WAIT
        while True:
            picture = self.server.robot.camera.picture()
            if picture is not None and str(picture[0]) != seen:
                break
            if time.monotonic() > end:
                raise tornado.web.HTTPError(404)
            await asyncio.sleep(0.02)
        self.set_header("Content-Type", "image/jpeg")
        self.set_header("X-Picture", str(picture[0]))
        self.finish(picture[1])  # not awaited: who has gone meanwhile is no fault


def read_files(package):
    """{name: (type, content)} of a package's page; no others."""
    kinds = {**mimetypes.types_map, ".webmanifest": "application/manifest+json", ".js": "text/javascript"}
    files = {}
    for path in (Path(rospkg.RosPack().get_path(package)) / "web").iterdir():
        kind = kinds.get(path.suffix)
        if kind and path.is_file():
            files[path.name] = kind + "; charset=utf-8" * kind.startswith("text/"), path.read_bytes()
    return files
