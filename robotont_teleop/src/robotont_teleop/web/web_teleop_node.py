"""The node of the web page: parameters, token, address; then the server and the robot's view are brought together."""

import asyncio
import contextlib
import gc
import io
import os
import signal
import socket
import ssl
import sys
from pathlib import Path

import qrcode
import rospkg
import rospy

from robotont_driver.parameters.parameters import Parameter, ParameterError
from robotont_driver.ros.diagnostics import OK, WARN, Health, robot_name
from robotont_driver.ros.lifecycle import init_node, signals_wait
from robotont_driver.ros.node_parameters import own_parameters, refuse, running_wheels
from robotont_driver.ros.rospy_end import end_soon
from robotont_teleop.hand.speeds import Speeds
from robotont_teleop.web.access import Access, is_loopback_address, read_or_make_token
from robotont_teleop.web.page_setup import host_names, own_address
from robotont_teleop.web.robot_view import RobotView
from robotont_teleop.web.viewer_topics import ViewerTopics
from robotont_teleop.web.web_server import ServerSettings, WebServer

PARAMETERS = (
    Parameter("address", "127.0.0.1", "where the page can be opened from: 127.0.0.1 = this computer only; 0.0.0.0 = "
              "the network, with the token only"),
    Parameter("port", 8100, "of the page", minimum=0, maximum=65535),
    Parameter("host_names", "", "further names of this computer in the page's address, separated by commas"),
    Parameter("token_file", "", "file of the token, made at the first start; empty: robotont_teleop_token in "
              "ROS_HOME"),
    Parameter("certificate", "", "file of a TLS certificate and its private key, for https; empty: http"),
    Parameter("max_linear_speed", 0.5, "of a stick pushed to its rim", "m/s", minimum=0.01, maximum=100.0),
    Parameter("max_angular_speed", 2.0, "of a stick pushed to its rim", "rad/s", minimum=0.01, maximum=100.0),
    Parameter("oldest_command", 0.2, "motion asked for longer ago is dropped", "s", minimum=0.02, maximum=2.0,
              reason="older commands surprise"),
    Parameter("dead_man", 0.25, "the robot stops after this long without a command of the page that drives it", "s",
              minimum=0.05, maximum=2.0,
              reason="for so long the robot drives on when the page dies"),
    Parameter("camera", "camera/color/image_raw/compressed", "topic of the camera's JPEG pictures"),
)
LIGHT_ON_BLACK, RESET = "\x1b[97;40m", "\x1b[0m"  # of a terminal (ECMA-48)


class SetUpError(Exception):
    """The page cannot be served; states the found and the allowed values."""


def make_access(parameters):
    """(Access, token, its file): the token only where others than this computer can connect. Raises SetUpError."""
    if is_loopback_address(parameters["address"]):
        return Access(None), None, None
    home = os.environ.get("ROS_HOME") or str(Path.home() / ".ros")
    path = parameters["token_file"] or str(Path(home) / "robotont_teleop_token")
    try:
        token = read_or_make_token(path)
    except (OSError, ValueError) as error:
        raise SetUpError(f"~token_file: {error}") from None
    return Access(token), token, path


def make_tls(certificate):
    """ssl.SSLContext, or None without a certificate. Raises SetUpError."""
    if not certificate:
        return None
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        context.load_cert_chain(certificate, password=_refuse_password)
    except (OSError, ValueError) as error:  # ssl.SSLError is an OSError
        raise SetUpError(f"~certificate {certificate}: {error}") from None
    return context


def _refuse_password():
    """Called for an encrypted key; else OpenSSL would ask for it on the terminal, and wait."""
    raise ValueError("the key is encrypted; allowed: one without a password (openssl pkey -in KEY -out PLAIN_KEY)")


def invitation(url, token, file, terminal):
    """Lines that tell how to get in where a token is asked for.

    The token and its QR code for a terminal only, light on black whatever its colours are: all else may be a log that
    others read. Those are told the token's file.
    """
    if not token:
        return []
    if not terminal:
        return [f"token, asked for once: cat {file}"]
    code = qrcode.QRCode(border=2)
    code.add_data(f"{url}#token={token}")  # the part after # is sent to no server and written to no log
    picture = io.StringIO()
    code.print_ascii(picture, invert=True)
    rows = picture.getvalue().replace("\xa0", " ").splitlines()
    return ["", *(LIGHT_ON_BLACK + row + RESET for row in rows if row), "", f"token, asked for once: {token}"]


async def serve(robot, access, token, file, parameters):
    """Serve until ROS shuts down. token, file: as of `make_access`."""
    loop = asyncio.get_running_loop()

    def end(number, _frame):  # shuts down between two messages, never amid the publishing of one
        end_soon()
        with contextlib.suppress(RuntimeError):  # the loop has ended
            loop.call_soon_threadsafe(rospy.signal_shutdown, signal.Signals(number).name)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)
    tls = make_tls(parameters["certificate"])
    scheme = "https" if tls else "http"
    settings = ServerSettings(
        names=host_names(parameters["host_names"]), scheme=scheme, oldest=parameters["oldest_command"],
        dead_man=parameters["dead_man"], speeds=Speeds(parameters["max_linear_speed"], parameters["max_angular_speed"]),
        robot=rospy.get_namespace().strip("/") or socket.gethostname())
    folder = Path(rospkg.RosPack().get_path("robotont_teleop")) / "web"
    server = WebServer(robot, access, settings, folder, ViewerTopics())
    address, port = parameters["address"], parameters["port"]
    try:
        port = server.listen(address, port, tls)
    except OSError as error:
        raise SetUpError(f"~address {address}, ~port {port}: {error.strerror or error}; choose another one, e.g. "
                         f"web_port:={port + 1}. By keys: ./robotont keys") from None
    shown = own_address() if address in ("", "0.0.0.0", "::") else address
    url = f"{scheme}://{f'[{shown}]' if ':' in shown else shown}:{port}/"
    namespace = rospy.get_namespace().rstrip("/")
    remapping = f" __ns:={namespace}" if namespace else ""
    print(f"drive the robot in a browser: {url}", "or by keys, in a second terminal: "
          f"./robotont keys{remapping}   (rosrun robotont_teleop keyboard_teleop{remapping})",
          *invitation(url, token, file, sys.stdout.isatty()), sep="\n", flush=True)  # no log: the token is secret
    Health(robot_name(), {"web page": lambda: report(server, url, file)})
    gc.collect()
    gc.freeze()  # what exists now stays: the collector need not look through it while commands wait
    ended = asyncio.Event()
    rospy.on_shutdown(lambda: loop.call_soon_threadsafe(ended.set))
    ends = [loop.create_task(ended.wait()), loop.create_task(server.ended())]
    if not rospy.is_shutdown():
        await asyncio.wait(ends, return_when=asyncio.FIRST_COMPLETED)
    await server.close()
    for end in ends:
        if end.done() and not end.cancelled():
            end.result()  # raises what ended it


def report(server, url, file):
    """(level, words, values) for the diagnostics: how to get in, too. file: of the token, or None."""
    seat = server.seat
    values = {
        "open pages": len(server.pages),
        "page that drives": seat.driver or "none",
        "commands sent": server.commands,
        "commands dropped because they came late": seat.dropped,
        "commands of pages that do not drive": seat.foreign,
        "stops because the page fell silent": seat.timeouts,
        "messages and requests refused": server.refused,
    }
    if seat.hands_off:
        return WARN, "the page that drives fell silent or the robot was stopped: let go of the sticks once", values
    return OK, f"{url}, open pages: {len(server.pages)}" + (f"; its token: in {file}" if file else ""), values


def main():
    """Run web_teleop_node; with wrong parameters print them and exit with 1."""
    init_node("web_teleop_node", __doc__, PARAMETERS)
    try:
        with signals_wait():
            parameters = own_parameters(PARAMETERS)
            wheels = running_wheels(rospy.get_namespace())
            access, token, file = make_access(parameters)
            robot = RobotView(wheels, parameters["camera"])
        if not rospy.is_shutdown():
            asyncio.run(serve(robot, access, token, file, parameters))
    except ParameterError as error:
        refuse(error.faults)
    except SetUpError as error:
        rospy.logfatal("%s", error)
        sys.exit(1)
