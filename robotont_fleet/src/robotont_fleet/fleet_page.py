"""One page for all robots: zenoh's router and a web server in one process.

On the teacher's computer only, unless --network opens both to others: the page
with a token, the router with a password for each robot, which --add makes.
docs/fleet.md
"""

import argparse
import asyncio
import contextlib
import io
import json
import signal
import sys
import time
from pathlib import Path

import yaml
from PIL import Image

from robotont_driver.parameters.command_line import CommandLine
from robotont_fleet import zenoh_keys as keys
from robotont_fleet.fleet_server import FleetServer
from robotont_fleet.free_fleet import free_fleet_text
from robotont_fleet.known_robots import Fleet
from robotont_fleet.zenoh_setup import (
    ABSENT,
    TEACHER,
    add_users,
    client_settings,
    nested,
    open_session,
    read_users,
    router_settings,
    send,
    zenoh,
)
from robotont_teleop.web.page_setup import SetUpError, host_names, invitation, make_access, own_address, ros_home
from robotont_teleop.web.web_handlers import read_files

ANSWERS = 1.0  # [s] that robots have to answer the page


def arguments(given=None):
    """Of the command line."""
    parser = CommandLine(prog="./robotont fleet", description=__doc__,
                         formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--network", action="store_true", help="other computers may come, with token and passwords")
    parser.add_argument("--port", type=int, default=8110, help="of the page [8110]")
    parser.add_argument("--router-port", type=int, default=7447, help="of the router, to which robots connect [7447]")
    parser.add_argument("--router", default="", help="another router to use, as zenoh writes it: tcp/ADDRESS:7447")
    parser.add_argument("--zenoh-config", default="", help="file of zenoh's own settings for the router, as for TLS")
    parser.add_argument("--map", default="", help="the map that the robots share: map_server's .yaml")
    parser.add_argument("--certificate", default="", help="TLS certificate and private key of the page, for https")
    parser.add_argument("--host-names", default="", help="further names of this computer, between commas")
    parser.add_argument("--add", nargs="+", metavar="ROBOT", help="make robots' passwords, print them, and end")
    parser.add_argument("--write-router", metavar="FILE", help="write zenohd's configuration for these robots, and end")
    parser.add_argument("--free-fleet", nargs="+", metavar="ROBOT", help="print free_fleet's configuration, and end")
    parser.add_argument("--robot", default="", help="of config/robots, or a folder, for --free-fleet [thesis]")
    return parser.parse_args(given)


def read_ground(path):
    """(PNG, {x, y, width, height} [m]) of a map_server map. Raises SetUpError."""
    try:
        described = yaml.safe_load(Path(path).read_text())
        picture = Image.open(Path(path).parent / described["image"]).convert("L")
        x, y, yaw = map(float, described["origin"])
        scale = float(described["resolution"])
        if yaw or not scale > 0:
            raise ValueError("a turned map, or one without a resolution")
    except (OSError, ValueError, KeyError, TypeError, yaml.YAMLError) as error:
        raise SetUpError(f"--map {path}: {error}") from None
    output = io.BytesIO()
    picture.save(output, "PNG")
    return output.getvalue(), {"x": x, "y": y, "width": picture.width * scale, "height": picture.height * scale}


def page_files():
    """The page's files by name: its own, and the login and the style of robotont_teleop's."""
    return {**read_files("robotont_teleop", "Robotont fleet"), **read_files("robotont_fleet")}


def zenoh_settings(options):
    """For the router, or for a client of another one. Raises SetUpError where the network would stand open."""
    try:
        users = read_users(users_file())
    except (OSError, ValueError) as error:
        raise SetUpError(str(error)) from None
    if options.router:
        return client_settings(options.router, TEACHER, users.get(TEACHER, ""))
    if not options.network:
        return router_settings(f"tcp/127.0.0.1:{options.router_port}")
    if not users:
        raise SetUpError("--network: no robot has a password: ./robotont fleet --add ROBOT ... makes them")
    return router_settings(f"tcp/0.0.0.0:{options.router_port}", users, users_file())


def users_file():
    """Names and passwords, in the form of zenoh."""
    return ros_home() / "robotont_fleet_users"


class ZenohSide:
    """The robots behind a session; everything that they say goes to the Fleet in the loop's thread."""

    def __init__(self, session, loop):
        self._session = session
        self._loop = loop
        self.fleet = Fleet(self._send)
        session.liveliness().declare_subscriber(keys.alive_key(), self._on_token, history=True)
        session.declare_subscriber(keys.state_key(), self._on_state)
        for reply in session.get(keys.state_key(), timeout=ANSWERS):  # of those that are there already
            if reply.ok:
                self._on_state(reply.ok)

    def _tell(self, call, *values):
        with contextlib.suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(call, *values)

    def _on_token(self, sample):
        name, _, identity = str(sample.key_expr).split("/")[1:4]
        self._tell(self.fleet.hear_token, name, identity, sample.kind == zenoh.SampleKind.PUT)

    def _on_state(self, sample):
        self._tell(self.fleet.hear_state, keys.robot_of(sample.key_expr), sample.payload.to_bytes(), time.monotonic())

    def _send(self, name, order):
        send(self._session, keys.order_key(name), json.dumps(order))

    def values(self):
        """{robot: {task: {key: number}}} of all that answer in time."""
        found = {}
        for reply in self._session.get(keys.values_key(), timeout=ANSWERS):
            with contextlib.suppress(ValueError, AttributeError):
                tasks = json.loads(reply.ok.payload.to_bytes()) if reply.ok else {}
                if tasks:
                    found[keys.robot_of(reply.ok.key_expr)] = {
                        task: {key: number for key, number in numbers.items() if isinstance(number, (int, float))}
                        for task, numbers in tasks.items()}
        return found


async def serve(options, session):
    """Serve the page until a signal ends it. Raises SetUpError."""
    loop = asyncio.get_running_loop()
    ended = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, ended.set)
    address = "0.0.0.0" if options.network else "127.0.0.1"
    access = make_access(address, str(ros_home() / "robotont_fleet_token"), "robotont_fleet")
    ground = read_ground(options.map) if options.map else None
    side = await loop.run_in_executor(None, ZenohSide, session, loop)
    server = FleetServer(side.fleet, access, host_names(options.host_names), page_files(), ground, side.values)
    url = server.listen(address, options.port, options.certificate)
    print(f"all robots on one page: {url}", *invitation(url, access, sys.stdout.isatty()), sep="\n")
    router = f"tcp/{own_address() if options.network else address}:{options.router_port}"
    print(f"robots connect to {options.router or router}", flush=True)
    stops = loop.create_task(server.repeat_stops())
    await asyncio.wait([stops, loop.create_task(ended.wait())], return_when=asyncio.FIRST_COMPLETED)
    if stops.done():
        stops.result()  # raises what ended it


def main():
    """Run the command; returns its exit status."""
    options = arguments()
    try:
        if options.add:
            users = add_users(users_file(), options.add)
            for name in options.add:
                print(f"on {name}: umask 077; echo {users[name]} >"
                      '"${ROS_HOME:-$HOME/.ros}/robotont_fleet_password"')
            print("where ./robotont starts the robot (sim, shell): in ./robotont shell; where it starts at boot: as "
                  "./robotont install-robot --fleet says\na fleet that runs takes them when it is started again")
            return 0
        if options.free_fleet:
            print(free_fleet_text(options.robot, options.free_fleet), end="")
            return 0
        if options.write_router:
            options.network = True
            Path(options.write_router).touch(0o600)
            Path(options.write_router).write_text(json.dumps(nested(zenoh_settings(options)), indent=2) + "\n")
            return 0
        if zenoh is None:
            raise SetUpError(ABSENT)
        with open_session(zenoh_settings(options), options.zenoh_config) as session:
            asyncio.run(serve(options, session))
    except (SetUpError, OSError, ValueError) as error:
        print(f"fleet: {error}", file=sys.stderr)
        return 1
    except getattr(zenoh, "ZError", ()) as error:
        print(f"fleet: zenoh: {error}", file=sys.stderr)
        return 1
    return 0
