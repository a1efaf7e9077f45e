"""The web server of the fleet's page: logins and orders in, all robots out. Free of zenoh and of ROS."""

import asyncio
import json
import math
import time
from typing import Any, Callable, Dict, NamedTuple, Optional, Tuple

import tornado.netutil
import tornado.web

from robotont_fleet.fleet import REPEAT
from robotont_teleop.metrics import metrics
from robotont_teleop.web_handlers import FileHandler, Guarded, LoginHandler, MetricsHandler
from robotont_teleop.web_server import BODY_TIMEOUT, IDLE, LARGEST_BODY, LARGEST_HEADER, LimitedServer

MAX_CONNECTIONS = 64
FARTHEST = 1000.0  # [m] of a goal


class FleetSettings(NamedTuple):
    """Settings of the user."""

    names: Tuple[str, ...]  # host names under which browsers may come, beside the address itself
    scheme: str             # http or https
    ground: Optional[Tuple[bytes, Dict[str, Any]]] = None  # PNG of the map and where it lies


class FleetServer:
    """One page for a Fleet. values(): what `metrics` wants; may take its time."""

    def __init__(self, fleet, access, settings, files, values: Callable[[], Dict]):
        self.fleet = fleet
        self.access = access
        self.settings = settings
        self.files = files
        self.values = values
        self.refused = 0
        self._loop = asyncio.get_running_loop()

    def listen(self, address, port, tls=None):
        """Serve; returns the port. Raises OSError."""
        sockets = tornado.netutil.bind_sockets(port, address)
        application = tornado.web.Application(
            [(r"/robots", RobotsHandler), (r"/order", OrderHandler), (r"/metrics", MetricsHandler),
             (r"/map\.png", MapHandler), (r"/login", LoginHandler), (r"/(.*)", FileHandler)],
            log_function=lambda handler: None)
        application.web_server = self
        self._server = LimitedServer(
            application, limit=MAX_CONNECTIONS, ssl_options=tls, max_header_size=LARGEST_HEADER,
            max_body_size=LARGEST_BODY, idle_connection_timeout=IDLE, body_timeout=BODY_TIMEOUT)
        self._server.add_sockets(sockets)
        return sockets[0].getsockname()[1]

    def admit(self, stream):
        """Somebody who may come in has sent a request on this connection."""
        self._server.admit(stream)

    async def metrics(self):
        """Text for Prometheus."""
        values = await asyncio.get_running_loop().run_in_executor(None, self.values)
        return metrics(self.fleet.view(time.monotonic())["robots"], values)

    async def repeat_stops(self):
        """For ever: what is not confirmed is sent again."""
        while True:
            self.fleet.repeat()
            await asyncio.sleep(REPEAT)


class RobotsHandler(Guarded, tornado.web.RequestHandler):
    """All robots, for the page."""

    def get(self):
        """Called by tornado."""
        ground = self.server.settings.ground
        self.finish({**self.server.fleet.view(time.monotonic()), "ground": ground and ground[1]})


class OrderHandler(Guarded, tornado.web.RequestHandler):
    """An order of the page: {"kind": "stop"}, {"kind": "stop" or "cancel", "name"}, {"kind": "goal", ...}."""

    def post(self):
        """Called by tornado."""
        if not self.origin_allowed:
            raise tornado.web.HTTPError(403, reason="foreign origin")
        fleet = self.server.fleet
        try:
            order = json.loads(self.request.body)
            kind, name = order["kind"], order.get("name")
            if name is not None and not any(name == one["name"] for one in fleet.view(0.0)["robots"]):
                raise ValueError("no such robot")
            if kind == "stop":
                fleet.stop(name)
            elif kind == "cancel" and name:
                fleet.cancel(name)
            elif kind == "goal" and name:
                x, y = float(order["x"]), float(order["y"])
                if not math.hypot(x, y) <= FARTHEST:
                    raise ValueError("too far")
                fleet.goal(name, str(order["id"]), int(order["seen"]), x, y)
            else:
                raise ValueError("no such order")
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise tornado.web.HTTPError(400, reason="no order") from error
        self.set_status(204)
        self.finish()


class MapHandler(Guarded, tornado.web.RequestHandler):
    """The map that all robots are drawn on."""

    def get(self):
        """Called by tornado."""
        if not self.server.settings.ground:
            raise tornado.web.HTTPError(404)
        self.set_header("Content-Type", "image/png")
        self.finish(self.server.settings.ground[0])
