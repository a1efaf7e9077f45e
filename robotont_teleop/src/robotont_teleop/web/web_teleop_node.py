"""The node of the web page: parameters, token, address; then the server and the robot's view are brought together."""

import asyncio
import contextlib
import gc
import signal
import sys

import rospy

from robotont_driver.parameters.parameters import Parameter
from robotont_driver.ros.diagnostics import OK, WARN, Health, robot_name
from robotont_driver.ros.lifecycle import init_node, own_parameters
from robotont_driver.rospy_repairs.rospy_process import end_soon
from robotont_teleop.hand.speeds import Speeds
from robotont_teleop.web.driving_seat import DrivingSeat
from robotont_teleop.web.page_setup import SetUpError, host_names, invitation, make_access, ros_home
from robotont_teleop.web.robot_view import RobotView
from robotont_teleop.web.web_server import WebServer

PARAMETERS = (
    Parameter("address", "127.0.0.1", "where the page can be opened from: 127.0.0.1 = this computer only; 0.0.0.0 = "
              "the network, with the token only"),
    Parameter("port", 8100, "of the page", minimum=0, maximum=65535),
    Parameter("host_names", "", "further names of this computer in the page's address, separated by commas"),
    Parameter("certificate", "", "file of a TLS certificate and its private key, for https; empty: http"),
    Parameter("max_linear_speed", 0.5, "the most, at the page's speed Fast", "m/s", minimum=0.01, maximum=100.0),
    Parameter("max_angular_speed", 2.0, "likewise", "rad/s", minimum=0.01, maximum=100.0),
    Parameter("oldest_command", 0.2, "motion asked for longer ago is dropped", "s", minimum=0.1, maximum=2.0,
              reason="older commands surprise; states are up to 0.05 s old"),
    Parameter("dead_man", 0.25, "the robot stops when the newest command of the page that drives it is this old", "s",
              minimum=0.15, maximum=2.0,
              reason="for so long the robot drives on when the page dies"),
    Parameter("camera", "camera/color/image_raw/compressed", "topic of the camera's JPEG pictures"),
)


async def serve(robot, access, parameters):
    """Serve until ROS shuts down. Raises SetUpError."""
    loop = asyncio.get_running_loop()

    def end(number, _frame):  # shuts down between two messages, never amid the publishing of one
        end_soon()
        with contextlib.suppress(RuntimeError):  # the loop has ended
            loop.call_soon_threadsafe(rospy.signal_shutdown, signal.Signals(number).name)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)
    seat = DrivingSeat(Speeds(parameters["max_linear_speed"], parameters["max_angular_speed"]),
                       parameters["oldest_command"], parameters["dead_man"])
    server = WebServer(robot, seat, access, host_names(parameters["host_names"]))
    url = server.listen(parameters["address"], parameters["port"], parameters["certificate"])
    remapping = of_namespace()
    print(f"drive the robot in a browser: {url}", "or by keys, in a second terminal: "
          f"./robotont keys{remapping}   (rosrun robotont_teleop keyboard_teleop{remapping})",
          *invitation(url, access, sys.stdout.isatty()), sep="\n", flush=True)  # no log: the token is secret
    Health(robot_name(), {"web page": lambda: report(server, url)})
    gc.collect()
    gc.freeze()  # what exists now stays: the collector need not look through it while commands wait
    rospy.on_shutdown(lambda: loop.call_soon_threadsafe(server.feeder.cancel))
    try:
        with contextlib.suppress(asyncio.CancelledError):
            if not rospy.is_shutdown():
                await server.feeder  # raises what ends it
    finally:
        await server.close()


def of_namespace():
    """What keys need behind them where the robot has a namespace."""
    namespace = rospy.get_namespace().rstrip("/")
    return f" __ns:={namespace}" if namespace else ""


def report(server, url):
    """(level, words, values) for the diagnostics: how to get in, too."""
    seat, file = server.seat, server.access.file
    if seat.driver in seat.held:
        return WARN, "the page that drives fell silent or the robot was stopped: let go of the sticks once", {}
    return OK, f"{url}, open pages: {len(server.pages)}" + (f"; its token: in {file}" if file else ""), {}


def main():
    """Run web_teleop_node; with wrong parameters print them and exit with 1."""
    init_node("web_teleop_node", __doc__, PARAMETERS)
    try:
        parameters = own_parameters(PARAMETERS)
        access = make_access(parameters["address"], str(ros_home() / "robotont_teleop_token"), "robotont_teleop")
        robot = RobotView(parameters["camera"])
        if not rospy.is_shutdown():
            asyncio.run(serve(robot, access, parameters))
    except SetUpError as error:
        rospy.logfatal("%s; see address, web_port and certificate of teleop.launch. By keys: ./robotont keys%s", error,
                       of_namespace())
        sys.exit(1)
