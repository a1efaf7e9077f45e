#!/usr/bin/env python3
"""Drives the simulated robot with the real navigation stack, and lets one fault after the other happen on the way.

fault_run.py [--only WORDS] [argument of navigation.launch] prints JSON: the memory of the nodes before and after, and
for each fault of this arrangement the seconds until the robot stood and, after the fault's end, until it drove again by
itself (null: it did not), the way [m] that it went meanwhile, the status and last line of goto, what mended it, and the
localization's error at the end. Needs move_base.
"""

import argparse
import json
import math
import os
import signal
import subprocess
import sys
import time
import xmlrpc.client
from pathlib import Path
from typing import Any, Callable, NamedTuple

import rospy
import tf2_ros
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist, Vector3
from navigation_run import Run, pose, standing
from std_msgs.msg import Bool
from std_srvs.srv import Empty, SetBool, Trigger

from robotont_driver.kinematics.se2 import yaw_of
from robotont_testing.harness import Master, wait_for
from robotont_testing.node_test import twist
from robotont_testing.places import program

ROUTE = {"room": ((1.2, 1.0, 1.57), (1.2, 5.0, 1.57)), "maze": ((0.5, 0.5, 1.57), (0.5, 3.6, 1.57))}
UNDER_WAY = 0.8      # [m] from the start, where the fault begins
PATIENCE = 100       # [s] in which goto has to end by itself
BY_ITSELF = 2.0      # [s] after a fault, for which goto is listened to before anybody mends anything
MOVES = 0.1          # [m/s] from here on it drives
NODES = ("move_base", "amcl", "map_server", "navigation_monitor", "cmd_vel_mux", "robotont_node", "driver_node",
         "serial_com_node", "odom_node")


class Fault(NamedTuple):
    """A fault on the way, and what is expected of goto."""

    name: str
    begin: Callable
    end: Callable = lambda rig: None
    seconds: float = 0.0          # that it lasts
    statuses: Any = (0,)          # that goto may end with
    mend: str = ""                # program that a person starts when goto has said so


class Rig:
    """navigation.launch, and a robot on its way."""

    def __init__(self, master, world, *arguments):
        self.master, self.world = master, world
        self.run = Run(master, list(arguments), "thesis", world)
        self._transforms = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._transforms)
        self._carry = rospy.Publisher("simulator_node/carry", Vector3, queue_size=5)
        self.visitor = rospy.Publisher("simulator_node/visitor", Vector3, queue_size=5)
        self._initial = rospy.Publisher("initialpose", PoseWithCovarianceStamped, queue_size=5)
        self.hand = rospy.Publisher("cmd_vel/hand", Twist, queue_size=5)
        self.button = rospy.Publisher("emergency_stop", Bool, queue_size=5)
        for topic in (self._carry, self.visitor, self._initial, self.hand, self.button):
            wait_for(topic.get_num_connections, f"who listens to {topic.name}", 60)
        wait_for(lambda: self._initial.get_num_connections() > 1, "amcl and navigation_monitor", 60)
        rospy.wait_for_service("move_base/clear_costmaps", 60)
        self._clear = rospy.ServiceProxy("move_base/clear_costmaps", Empty)

    def carry(self, x, y, yaw):
        self._carry.publish(Vector3(x, y, yaw))
        wait_for(lambda: math.dist(self.run.pose()[:2], (x, y)) < 0.05, "the robot there")

    def start(self):
        """The robot at the start of the route, which amcl knows, and nobody else there."""
        leave(self)
        place = ROUTE[self.world][0]
        self.carry(*place)
        message = PoseWithCovarianceStamped()
        message.header.frame_id = "map"
        pose_there = message.pose.pose
        pose_there.position.x, pose_there.position.y = place[:2]
        pose_there.orientation.z, pose_there.orientation.w = math.sin(place[2] / 2), math.cos(place[2] / 2)
        for number in (0, 7, 35):
            message.pose.covariance[number] = 0.01
        self._initial.publish(message)
        wait_for(lambda: self.error()[0] < 0.1, "amcl there")
        wait_for(lambda: self.run.reports and self.run.reports[-1].level == 0, "a monitor that is content", 30)
        self._clear()
        self.run.truth[:] = self.run.truth[-1:]

    def error(self):
        """(distance [m], turn [rad]) between the robot and where the localization has it; inf when nobody knows."""
        try:
            found = self._transforms.lookup_transform("map", "base_link", rospy.Time()).transform
        except tf2_ros.TransformException:
            return math.inf, math.inf
        x, y, yaw = self.run.pose()
        return (math.hypot(found.translation.x - x, found.translation.y - y),
                abs(math.remainder(yaw_of(found.rotation) - yaw, 2 * math.pi)))

    def pid(self, node):
        """Process id of a node; 0 when it is not there."""
        try:
            pid = self.master.pid("/" + node)
            os.kill(pid, 0)
        except (AssertionError, OSError):
            return 0
        return pid

    def tool(self, name, *words):
        return subprocess.Popen([program("robotont_map_navigation", name), *map(str, words)], text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def suffer(self, fault):
        """Drive, let the fault happen, and see what becomes of it; the row of the table."""
        self.start()
        goal = ROUTE[self.world][1]
        goto = self.tool("goto", *goal, "--wait", 60)
        first = self.run.pose()
        wait_for(lambda: math.dist(self.run.pose()[:2], first[:2]) > UNDER_WAY, "a robot under way", 60)
        fault.begin(self)
        begun = time.monotonic()
        stood = None
        while stood is None and goto.poll() is None and time.monotonic() < begun + fault.seconds + 6.0:
            stood = round(time.monotonic() - begun, 2) if standing(self.run.truth[-1]) else None
            time.sleep(0.01)
        wait_for(lambda: time.monotonic() >= begun + fault.seconds, "the fault's end", fault.seconds + 1)
        number = len(self.run.truth) - 1
        fault.end(self)
        ended = time.monotonic()
        try:
            words = goto.communicate(timeout=PATIENCE)[0].strip().splitlines()[-1]
        except subprocess.TimeoutExpired:
            goto.send_signal(signal.SIGINT)
            words = "waits for ever: " + goto.communicate()[0].strip().splitlines()[-1]
            goto.returncode = -1
        over = round(time.monotonic() - begun, 1)
        wait_for(lambda: time.monotonic() - ended > BY_ITSELF, "what happens by itself")
        speeds = [(index, message.twist.twist.linear) for index, message in enumerate(self.run.truth[number:])]
        drives = next((index / 50 for index, speed in speeds if math.hypot(speed.x, speed.y) > MOVES), None)
        row = {"fault": fault.name, "stood_s": stood, "drove_again_s": drives, "goto_ended_s": over,
               "way_after_m": round(self._way(number), 3), "status": goto.returncode, "expected": fault.statuses,
               "words": words}
        if goto.returncode and fault.mend:
            row["mended"] = self.tool(fault.mend).communicate(timeout=PATIENCE)[0].strip().splitlines()[-1]
        if goto.returncode:
            leave(self)
            again = self.tool("goto", *goal, "--wait", 60, "--timeout", PATIENCE)
            again.communicate()
            row["again"] = again.returncode
        wait_for(lambda: standing(self.run.truth[-1]), "the robot to stand", 30)
        row["pose_error_m"], row["pose_error_rad"] = (round(value, 3) for value in self.error())
        row["goal_error_m"] = round(math.dist(self.run.pose()[:2], goal[:2]), 3)
        return row

    def _way(self, number):
        """[m] since the message number `number`."""
        places = [pose(message)[:2] for message in self.run.truth[number:]]
        return sum(math.dist(one, other) for one, other in zip(places, places[1:]))

    def memory(self):
        """[MiB] of each node, proportional set size."""
        pids = {node: self.pid(node) for node in NODES}
        texts = {node: Path(f"/proc/{pid}/smaps_rollup").read_text() for node, pid in pids.items() if pid}
        return {node: round(int(text.split("\nPss:")[1].split()[0]) / 1024, 1) for node, text in texts.items()}


def kill(node):
    """The fault: a node dies without a chance to do anything; roslaunch starts it again."""
    def begin(rig):
        rig.killed = rig.pid(node)
        os.kill(rig.killed, signal.SIGKILL)

    def end(rig):
        wait_for(lambda: rig.pid(node) not in (0, rig.killed), f"{node} again", 30, period=0.1)
    return Fault(f"{node} killed", begin, end, statuses=(0, 3))


def take_over(rig):
    for _ in range(20):
        rig.hand.publish(twist(turn=0.8))
        time.sleep(0.05)
    rig.hand.publish(Twist())


def visit(ahead):
    """Somebody stands so far [m] before the robot."""
    def begin(rig):
        x, y, yaw = rig.run.pose()
        rig.visitor.publish(Vector3(x + ahead * math.cos(yaw), y + ahead * math.sin(yaw), 0.0))
    return begin


def leave(rig):
    rig.visitor.publish(Vector3(math.nan, math.nan, 0.0))


def kidnap(x, y, turn):
    """Somebody carries the robot away, as seen along the map's axes [m], [rad]."""
    def begin(rig):
        now = rig.run.pose()
        rig.carry(now[0] + x, now[1] + y, now[2] + turn)
    return begin


def unplug(pull):
    return lambda rig: rospy.ServiceProxy("simulator_node/unplug", SetBool)(pull)


def scan_reaches(nodes_of):
    """Tell who drives by the scan that `nodes_of(publishers)` send it: none, as a camera that dies, or who does."""
    def tell(rig):
        master = xmlrpc.client.ServerProxy(rig.master.uri)
        publishers = dict(master.getSystemState("/fault_run")[2][0])["/scan"]
        uris = [master.lookupNode("/fault_run", node)[2] for node in nodes_of(publishers)]
        for node in ("move_base", "amcl", "navigation_monitor"):
            xmlrpc.client.ServerProxy(master.lookupNode("/fault_run", "/" + node)[2]).publisherUpdate(
                "/fault_run", "/scan", uris)
    return tell


def emergency_stop(seconds):
    """Pressed for so long by a message, as keys, gamepad and page do; nothing moves by its release."""
    return Fault(f"emergency stop of {seconds} s", lambda rig: rig.button.publish(True),
                 lambda rig: rospy.ServiceProxy("emergency_stop/release", Trigger)(), seconds, statuses=(4,))


def faults():
    """{arguments of navigation.launch: the faults of this run}."""
    return {
        (): [
            Fault("hand takes over", take_over), emergency_stop(3), emergency_stop(20),
            Fault("cable unplugged for 3 s", unplug(True), unplug(False), 3.0),
            Fault("no scan for 5 s", scan_reaches(lambda _: []), scan_reaches(list), 5.0),
            *map(kill, ("robotont_node", "cmd_vel_mux", "amcl", "map_server", "move_base", "navigation_monitor")),
            Fault("board restarts", lambda rig: rospy.ServiceProxy("simulator_node/brown_out", Trigger)()),
            Fault("somebody stands in the way", visit(0.9)),
            Fault("somebody stands on the goal", lambda rig: rig.visitor.publish(Vector3(*ROUTE["room"][1])),
                  statuses=(1, 7)),
            Fault("kidnapped by 1 m and 90 degrees", kidnap(1.0, 0.0, math.pi / 2), statuses=(8,), mend="relocalize"),
            Fault("kidnapped by 1 m and -90 degrees", kidnap(0.8, 0.6, -math.pi / 2), statuses=(8,), mend="relocalize"),
            Fault("kidnapped by 5 m", kidnap(4.0, 3.0, 0.0), statuses=(1, 8), mend="relocalize"),
        ],
        ("composed:=false",): [kill("driver_node"), kill("serial_com_node"), kill("odom_node")],
        ("world:=maze",): [
            Fault("the only way barred for 4 s", visit(0.9), leave, 4.0),
            Fault("the only way barred for good", visit(0.9), statuses=(1,)),
        ],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="faults whose name begins with these words")
    parser.add_argument("arguments", nargs="*", help="of navigation.launch: which part of the faults")
    options = parser.parse_args()
    arguments = tuple(options.arguments)
    with Master() as master:
        world = "maze" if "world:=maze" in arguments else "room"
        rig = Rig(master, world, *(word for word in arguments if not word.startswith("world:=")))
        before, rows = rig.memory(), []
        for fault in faults()[arguments]:
            if fault.name.startswith(options.only):
                rows.append(rig.suffer(fault))
                print(json.dumps(rows[-1]), file=sys.stderr, flush=True)
        print(json.dumps({"before_mib": before, "after_mib": rig.memory(), "rows": rows}))


if __name__ == "__main__":
    main()
