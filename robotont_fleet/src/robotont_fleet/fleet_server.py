"""The web server of the fleet's page: logins and orders in, all robots out. Free of zenoh and of ROS."""

import tornado.web

from robotont_driver.link.boot_clock import boot_time
from robotont_fleet.known_robots import SILENT
from robotont_fleet.messages import TO_PAGE, read_order
from robotont_fleet.zenoh_keys import check_name
from robotont_teleop.web.metrics import metrics
from robotont_teleop.web.page_server import PageServer
from robotont_teleop.web.web_handlers import Guarded


class FleetServer(PageServer):
    """One page for a Fleet. ground: as of `read_ground`, or None. stop_file: keeps the Fleet's stops (`StopFile`)."""

    def __init__(self, fleet, access, names, files, ground, stop_file):
        super().__init__(access, names, files)
        self.fleet = fleet
        self.stop_file = stop_file
        self.map_picture, self.ground = ground or (None, None)

    def listen(self, address, port):
        """Serve; returns the page's URL. Raises SetUpError."""
        return self.serve([(r"/robots", RobotsHandler), (r"/order", OrderHandler)], address, port)

    def metrics(self):
        """For Prometheus."""
        robots = self.fleet.view(boot_time())["robots"]
        return metrics([{**one, "up": one["present"] and one.get("driver") and one["age"] <= SILENT}
                        for one in robots], {})


class RobotsHandler(Guarded, tornado.web.RequestHandler):
    """All robots, for the page."""

    def get(self):
        """Called by tornado."""
        self.finish({**self.server.fleet.view(boot_time()), "ground": self.server.ground})


class OrderHandler(Guarded, tornado.web.RequestHandler):
    """An order of the page: one of TO_PAGE; a stop with the name of a robot, or without one for all."""

    async def post(self):
        """Called by tornado."""
        if not self.origin_allowed:
            raise tornado.web.HTTPError(403, reason="foreign origin")
        fleet = self.server.fleet
        try:
            order = read_order(self.request.body, TO_PAGE)
            kind = order.pop("kind")
            if "name" in order and not fleet.knows(check_name(order["name"])) and kind != "stop":
                raise ValueError("no such robot")
        except ValueError as error:
            raise tornado.web.HTTPError(400, reason="no order") from error
        if getattr(fleet, kind)(**order) is False:
            raise tornado.web.HTTPError(409, reason="STOP was pressed again meanwhile")
        if kind in ("stop", "release"):
            await self.server.stop_file.kept()
        self.set_status(204)
        self.finish()  # not awaited: who has gone meanwhile is no fault
