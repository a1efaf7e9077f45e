"""The web server of the fleet's page: logins and orders in, all robots out. Free of zenoh and of ROS."""

import asyncio
import json
import math
import time

import tornado.web

from robotont_fleet.known_robots import REPEAT
from robotont_teleop.web.metrics import metrics
from robotont_teleop.web.page_server import PageServer
from robotont_teleop.web.web_handlers import Guarded

FARTHEST = 1000.0  # [m] of a goal


class FleetServer(PageServer):
    """One page for a Fleet. ground: as of `read_ground`, or None; values(): what `metrics` wants; may take its time."""

    def __init__(self, fleet, access, names, files, ground, values):
        super().__init__(access, names, files)
        self.fleet = fleet
        self.values = values
        self.map_picture, self.ground = ground or (None, None)

    def listen(self, address, port, certificate=""):
        """Serve; returns the page's URL. Raises SetUpError."""
        return self.serve([(r"/robots", RobotsHandler), (r"/order", OrderHandler)], address, port, certificate)

    async def metrics(self):
        """Text for Prometheus."""
        values = await self._loop.run_in_executor(None, self.values)
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
        self.finish({**self.server.fleet.view(time.monotonic()), "ground": self.server.ground})


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
