"""roslaunch for ./robotont: launch.py FILE ARGUMENT ...

The exit status is 1 where a part cannot start, or a required node has ended with an error, which is 0 for roslaunch.
With simulation.launch it prints how to go on, once the robot runs.
"""

# ruff: noqa: E402
import signal

signal.signal(signal.SIGINT, signal.SIG_DFL)  # ends without a traceback while nothing is there yet

import contextlib
import os
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import rospkg
from rosgraph.names import ns_join
from roslaunch import configure_logging
from roslaunch.core import RLException
from roslaunch.parent import ROSLaunchParent
from roslaunch.pmon import ProcessListener
from roslaunch.rlutil import get_or_generate_uuid

ROBOTONT = Path(__file__).resolve().parents[3] / "robotont"
REFUSED = "Cannot load command parameter"  # the command has said why
NO_MAP = ("empty", "line")  # worlds in which nothing stands
USUAL_MASTER = ("", "http://localhost:11311", "http://127.0.0.1:11311")
NEXT_STEPS = """
The robot runs. {page}In another terminal{master}:
{keys}  by a topic   {robotont} shell -c 'rostopic pub -r 10 {namespace}cmd_vel geometry_msgs/Twist "{{linear: {{x: 0.2}}, angular: {{z: 0.5}}}}"'
{view}{navigation}  ROS' tools   {robotont} shell    (in it rostopic, rosnode, rosrun find the robot and its packages)
Ctrl-C here ends all of it.
"""  # noqa: E501
KEYS = """  by keys      {robotont} keys{remapping}
"""
VIEW = """  see it       {robotont} rviz{argument}
"""
NAVIGATION = """  navigate     {robotont} shell -c 'roslaunch robotont_bringup navigation.launch {arguments}'
               then set a goal: {page}2D Nav Goal in RViz
"""


class Deaths(ProcessListener):
    """Hears which processes end."""

    def __init__(self):
        self.failed = set()  # names of those that ended with an error

    def process_died(self, process_name, exit_code):
        """Called by roslaunch."""
        if exit_code:
            self.failed.add(process_name.rpartition("-")[0])


def show_next_steps(arguments):
    """Print them once the simulated robot runs, and its page is there."""
    given = dict(argument.partition(":=")[::2] for argument in arguments)
    name = "robot1" if given.get("robots", "1") != "1" else given.get("namespace", "").strip("/")
    namespace = f"/{name}/" if name else "/"
    for topic in ("odom", "emergency_stop/pressed_by"):  # driver_node's, which says it as it starts
        heard = ["rostopic", "echo", "-n", "1", namespace + topic]  # ends at once without a master; with one it waits
        while subprocess.call(heard, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL):
            time.sleep(1.0)
    page, port, address = "", given.get("web_port", "8100"), given.get("address", "127.0.0.1")
    address = "127.0.0.1" if address in ("", "0.0.0.0", "::") else address
    while given.get("teleop") == "true" and not page:
        with contextlib.suppress(OSError, ValueError):
            socket.create_connection((address, int(port))).close()
            scheme = "https" if given.get("certificate") else "http"
            host = f"[{address}]" if ":" in address else address
            page = f"{'Drive' if has_mux(given) else 'See'} it in a browser: {scheme}://{host}:{port}/\n"
        time.sleep(0.5)
    master = os.environ.get("ROS_MASTER_URI", "")
    print(NEXT_STEPS.format(
        page=page, robotont=ROBOTONT, namespace=namespace, navigation=navigation_step(given, name),
        keys=KEYS.format(robotont=ROBOTONT, remapping=f" __ns:=/{name}" if name else "") if has_mux(given) else "",
        view="" if given.get("rviz") == "true" else VIEW.format(
            robotont=ROBOTONT, argument=f" --namespace {name}" if name else ""),
        master="" if master in USUAL_MASTER else f", after  export ROS_MASTER_URI={master}"), flush=True)


def has_mux(given):
    """Whether a hand is heard."""
    return given.get("mux") != "false" or given.get("teleop") == given.get("start_mux") == "true"


def navigation_step(given, name):
    """How to let a robot `name`, or "", navigate in a world that has a map, with the navigation stack; else empty.

    By the ground truth: amcl would begin at the world's start, wherever the robot has been driven since.
    """
    if (given.get("world", "empty") in NO_MAP or given.get("world_map") == "false"
            or "move_base" not in rospkg.RosPack().list()):
        return ""
    arguments = "localization:=fake map:=none"  # the simulator publishes the world's own
    arguments += f" namespace:={name}" if name else ""
    arguments += "" if has_mux(given) else " cmd_vel:=cmd_vel"
    page = "press long on the page's map, or " if given.get("teleop") == "true" else ""
    return NAVIGATION.format(robotont=ROBOTONT, arguments=arguments, page=page)


def main():
    """Run roslaunch; returns the exit status."""
    file, *arguments = sys.argv[1:]
    run_id, deaths = get_or_generate_uuid(None, False), Deaths()
    configure_logging(run_id)
    launch = ROSLaunchParent(run_id, [(file, arguments)], process_listeners=[deaths], show_summary=False)
    try:
        launch.start()
    except RLException as error:
        if REFUSED not in str(error):
            print(f"robotont: {error}", file=sys.stderr)
        return 1
    if Path(file).name == "simulation.launch":
        threading.Thread(target=show_next_steps, args=(arguments,), daemon=True).start()
    launch.spin()
    return int(any(node.required and ns_join(node.namespace, node.name).lstrip("/") in deaths.failed
                   for node in launch.config.nodes))


if __name__ == "__main__":
    sys.exit(main())
