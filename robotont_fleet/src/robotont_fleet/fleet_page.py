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
import re
import signal
import socket
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from PIL import Image

from robotont_driver.link.boot_clock import boot_time
from robotont_driver.parameters.argument_parser import ArgumentParser
from robotont_driver.parameters.files import read_file, write_file
from robotont_driver.parameters.yaml_file import read_mapping
from robotont_fleet import zenoh_keys as keys
from robotont_fleet.fleet_server import FleetServer
from robotont_fleet.known_robots import REPEAT, Fleet
from robotont_fleet.messages import NONE, number, read_state
from robotont_fleet.zenoh_setup import ABSENT, add_users, open_session, router_settings, send, zenoh
from robotont_teleop.web.page_setup import SetUpError, host_names, invitation, make_access, own_address, ros_home
from robotont_teleop.web.web_handlers import read_files

LARGEST_IMAGE, LARGEST_STOPS = 10 ** 8, 10 ** 7  # [bytes] of files
KEEPS = 1.0    # [s] that an order waits for the disk before it is answered


def port(text):
    """A number of a port, 0: any; a larger one would be taken for another. Raises ArgumentTypeError."""
    if not re.fullmatch("[0-9]{1,5}", text) or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"found {text!r}, allowed: 0 to 65535")
    return int(text)


def arguments(given=None):
    """Of the command line."""
    parser = ArgumentParser(prog="./robotont fleet", description=__doc__,
                            formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--network", action="store_true", help="other computers may come, with token and passwords")
    parser.add_argument("--port", type=port, default=8110, help="of the page [8110]")
    parser.add_argument("--router-port", type=port, default=7447, help="of the router, to which robots connect "
                        "[7447, as install-robot --fleet has it]")
    parser.add_argument("--map", default="", help="the map that the robots share: map_server's .yaml")
    parser.add_argument("--host-names", default="", help="further names of this computer, between commas")
    parser.add_argument("--add", nargs="+", metavar="ROBOT", help="print robots' passwords, new where missing, and end")
    return parser.parse_args(given)


def read_ground(path):
    """(PNG, {x, y, width, height} [m]) of a map_server map. Raises SetUpError."""
    allowed = "a map of map_server: image, resolution and origin"
    try:
        described, _ = read_mapping(path, allowed)
        image = Path(path).parent / str(described["image"])
        picture = Image.open(io.BytesIO(read_file(image, LARGEST_IMAGE))).convert("L")
        x, y, yaw = map(float, described["origin"])
        scale = float(described["resolution"])
        if yaw or not scale > 0 or None in map(number, (x, y, scale)):
            raise ValueError("found a turned map, or one without a resolution or a place")
    except KeyError as error:
        raise SetUpError(f"--map {path}: found no {error}, allowed: {allowed}") from None
    except (OSError, ValueError, TypeError, Image.DecompressionBombError) as error:
        raise SetUpError(f"--map {path}: {error}, allowed: {allowed}") from None
    output = io.BytesIO()
    picture.save(output, "PNG")
    return output.getvalue(), {"x": x, "y": y, "width": picture.width * scale, "height": picture.height * scale}


def page_files(router_port=7447):
    """The page's files by name: its own, and the login and the style of robotont_teleop's."""
    files = {**read_files("robotont_teleop"), **read_files("robotont_fleet")}
    kind, page = files["index.html"]
    return {**files, "index.html": (kind, page.replace(b"ADDRESS:7447", b"ADDRESS:%d" % router_port))}


class StopFile:
    """Keeps the stops of a page over its end, its computer's too. port, page: the page's, and its name."""

    def __init__(self, port):
        self.page = f"{socket.gethostname()}:{port}"
        self._path = ros_home() / f"robotont_fleet_stops_{port}.json"
        self._writer = ThreadPoolExecutor(1)  # the disk may take its time, a stop not

    def read(self):
        """What the Fleet before has kept; None where that cannot be known."""
        try:
            kept = json.loads(read_file(self._path, LARGEST_STOPS))
            return {"all": kept["all"] and str(kept["all"]), "names": [str(name) for name in kept["names"]],
                    "some": {name: str(number) for name, number in kept["some"].items()}}
        except FileNotFoundError:
            return {}
        except (OSError, *NONE) as error:
            print(f"fleet: {self._path}: {error}; so STOP ALL holds", file=sys.stderr)
            return None

    def write(self, kept):
        """Keep this from now on; returns at once."""
        self._writer.submit(self._write, json.dumps(kept))

    def _write(self, text):
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            write_file(self._path, text, 0o600)
        except OSError as error:
            print(f"fleet: stops do not survive this page's end: {error}", file=sys.stderr)

    async def kept(self):
        """Until all is on the disk, or a moment has passed."""
        await asyncio.wait([asyncio.get_running_loop().run_in_executor(self._writer, int)], timeout=KEEPS)


class ZenohSide:
    """The robots behind a session, for a Fleet, which is called in the loop's thread only."""

    def __init__(self, session, loop, stop_file):
        self._session = session
        self._loop = loop
        kept = stop_file.read()
        self.fleet = Fleet(self._send, stop_file.page, stop_file.write, kept)
        if kept is None:
            self.fleet.stop()
        session.liveliness().declare_subscriber(keys.alive_key(), self._on_token, history=True)
        session.declare_subscriber(keys.state_key(), self._on_state)

    def _tell(self, call, *values):
        with contextlib.suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(call, *values)

    def _on_token(self, sample):
        name, _, identity = keys.parts_of(sample.key_expr)
        self._tell(self.fleet.hear_token, name, identity, sample.kind == zenoh.SampleKind.PUT, boot_time())

    def _on_state(self, sample):
        with contextlib.suppress(ValueError):
            state = read_state(sample.payload)
            self._tell(self.fleet.hear_state, keys.parts_of(sample.key_expr)[0], state, boot_time())

    def _send(self, name, order):
        send(self._session, keys.order_key(name), json.dumps(order))


async def serve(options, session):
    """Serve the page, and send again what is not confirmed, until a signal ends it. Raises SetUpError."""
    loop = asyncio.get_running_loop()
    for one in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(one, asyncio.current_task().cancel)
    address = "0.0.0.0" if options.network else "127.0.0.1"
    access = make_access(address, str(ros_home() / "robotont_fleet_token"), "robotont_fleet")
    ground = read_ground(options.map) if options.map else None
    stop_file = StopFile(options.port)
    side = ZenohSide(session, loop, stop_file)
    server = FleetServer(side.fleet, access, host_names(options.host_names),
                         page_files(options.router_port), ground, stop_file)
    url = server.listen(address, options.port)
    print(f"all robots on one page: {url}", *invitation(url, access, sys.stdout.isatty()), sep="\n")
    print(f"robots connect to tcp/{own_address() if options.network else address}:{options.router_port}", flush=True)
    with contextlib.suppress(asyncio.CancelledError):
        while True:
            side.fleet.repeat(boot_time())
            await asyncio.sleep(REPEAT)


def main():
    """Run the command; returns its exit status."""
    options = arguments()
    users_file = ros_home() / "robotont_fleet_users"
    try:
        if options.add:
            users = add_users(users_file, options.add)
            for name in options.add:
                print(f"on {name}: (umask 077; "
                      'd="${ROS_HOME:-$HOME/.ros}"; mkdir -p "$d"; '
                      f'echo {users[name]} >"$d/robotont_fleet_password")')
            print("where ./robotont starts the robot (sim, shell): in ./robotont shell; where it starts at boot: as "
                  "./robotont install-robot --fleet says\na fleet that runs takes them when it is started again")
            return 0
        if zenoh is None:
            raise SetUpError(ABSENT)
        with open_session(router_settings(options.router_port, users_file if options.network else None)) as session:
            asyncio.run(serve(options, session))
    except (SetUpError, OSError, ValueError, getattr(zenoh, "ZError", OSError)) as error:
        print(f"fleet: {error}", file=sys.stderr)
        return 1
    return 0
