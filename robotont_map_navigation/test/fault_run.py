#!/usr/bin/env python3
"""Drives the simulated robot with the real navigation stack, and lets one fault after the other happen on the way.

fault_run.py [--world NAME] [--only WORDS]... prints JSON, all of it on the last line: for each fault the seconds until
the robot stood and, after the fault's end, until it drove again by itself (None: it did not), the way [m] that it went
meanwhile, the status and last line of goto, those of a second one, and how far off the localization is at the end.
Needs move_base.
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
from typing import Any, Callable, NamedTuple

import numpy as np
import rospy
from geometry_msgs.msg import PoseWithCovariance, PoseWithCovarianceStamped, Twist, Vector3
from navigation_run import Run, speed, standing, way
from std_msgs.msg import Bool, Header
from std_srvs.srv import Empty, SetBool, Trigger

from robotont_driver.kinematics.se2 import compose
from robotont_map_navigation.readings import Frames, message_of
from robotont_testing.harness import Master, wait_for
from robotont_testing.node_test import twist
from robotont_testing.places import program

ROUTE = {"room": ((1.2, 1.0, 1.57), (1.2, 5.0, 1.57)), "maze": ((0.5, 0.5, 1.57), (0.5, 3.6, 1.57))}
UNDER_WAY = 0.8      # [m] from the start, where the fault begins
PATIENCE = 100       # [s] in which goto has to end by itself
BY_ITSELF = 2.0      # [s] after a fault, for which goto is listened to before anybody mends anything
MOVES = 0.1          # [m/s] from here on it drives


class Fault(NamedTuple):
    """A fault on the way, and what is expected of goto."""

    name: str
    begin: Callable
    end: Callable = lambda rig: None
    seconds: float = 0.0          # that it lasts
    statuses: Any = (0,)          # that goto may end with


class Rig(Run):
    """navigation.launch, a robot on its way, and who can press what."""

    def __init__(self, master, world):
        super().__init__(master, [], "thesis", world)
        self.master, self._route, self._frames = master, ROUTE[world], Frames()
        self._carry = rospy.Publisher("simulator_node/carry", Vector3, queue_size=5)
        self.visitor = rospy.Publisher("simulator_node/visitor", Vector3, queue_size=5)
        self._initial = rospy.Publisher("initialpose", PoseWithCovarianceStamped, queue_size=5)
        self.hand = rospy.Publisher("cmd_vel/hand", Twist, queue_size=5)
        self.button = rospy.Publisher("emergency_stop", Bool, queue_size=5)
        for topic in self._carry, self.visitor, self._initial, self.hand, self.button:
            wait_for(topic.get_num_connections, f"who listens to {topic.name}", 60)
        wait_for(lambda: self._initial.get_num_connections() > 1, "amcl and navigation_monitor", 60)
        rospy.wait_for_service("move_base/clear_costmaps", 60)
        self._clear = rospy.ServiceProxy("move_base/clear_costmaps", Empty)

    def carry(self, x, y, yaw):
        """Put the robot down somewhere."""
        self._carry.publish(Vector3(x, y, yaw))
        wait_for(lambda: math.dist(self.pose()[:2], (x, y)) < 0.05, "the robot there")

    def start(self):
        """The robot at the start of the route, which amcl knows, and nobody else there."""
        leave(self)
        place = self._route[0]
        self.carry(*place)
        believed = PoseWithCovariance(message_of(place), (0.0025 * np.eye(6)).ravel().tolist())
        self._initial.publish(PoseWithCovarianceStamped(Header(frame_id="map"), believed))
        wait_for(lambda: self.error() < 0.1, "amcl there")
        wait_for(lambda: self.reports and self.reports[-1].level == 0, "a monitor that is content", 30)
        self._clear()
        self.truth[:] = self.truth[-1:]

    def error(self):
        """[m] between the robot and where the localization has it; inf when nobody knows."""
        found = self._frames.robot_in("map")
        return math.dist(found[:2], self.pose()[:2]) if found else math.inf

    def tool(self, name, *words):
        """A tool of this package as a process."""
        return subprocess.Popen([program("robotont_map_navigation", name), *map(str, words)], text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def end(self, process):
        """The last line of a tool when it has ended."""
        return process.communicate(timeout=PATIENCE)[0].strip().splitlines()[-1]

    def suffer(self, fault):
        """Drive, let the fault happen, and see what becomes of it; the row of the table."""
        self.start()
        goal = self._route[1]
        goto = self.tool("goto", *goal)
        first = self.pose()
        wait_for(lambda: math.dist(self.pose()[:2], first[:2]) > UNDER_WAY, "a robot under way", 60)
        fault.begin(self)
        begun = time.monotonic()
        wait_for(lambda: standing(self.truth[-1]) or time.monotonic() > begun + fault.seconds + 6.0,
                 "a robot that stands", fault.seconds + 10.0)  # also where goto has ended before it stands
        stood = round(time.monotonic() - begun, 2) if standing(self.truth[-1]) else None
        wait_for(lambda: time.monotonic() >= begun + fault.seconds, "the fault's end", fault.seconds + 1)
        number = len(self.truth) - 1
        fault.end(self)
        ended = time.monotonic()
        try:
            words = self.end(goto)
        except subprocess.TimeoutExpired:
            goto.send_signal(signal.SIGINT)
            words, goto.returncode = "waits for ever: " + self.end(goto), -1
        over = round(time.monotonic() - begun, 1)
        wait_for(lambda: time.monotonic() - ended > BY_ITSELF, "what happens by itself")
        after = self.truth[number:]
        drives = next((index / 50 for index, message in enumerate(after) if speed(message) > MOVES), None)
        row = {"fault": fault.name, "stood_s": stood, "drove_again_s": drives, "way_after_m": round(way(after), 3),
               "goto_ended_s": over, "status": goto.returncode, "words": words}
        if goto.returncode:
            if "relocalize" in words:
                self.end(self.tool("relocalize"))
            leave(self)
            again = self.tool("goto", *goal)
            row["again_words"], row["again"] = self.end(again), again.returncode
        wait_for(lambda: standing(self.truth[-1]), "the robot to stand", 30)
        row["pose_error_m"] = round(self.error(), 3)
        row["goal_error_m"] = round(math.dist(self.pose()[:2], goal[:2]), 3)
        return row


def kill(node):
    """A node dies without a chance to do anything; roslaunch starts it again."""
    def begin(rig):
        rig.killed = rig.master.node_uri("/" + node)
        os.kill(rig.master.pid("/" + node), signal.SIGKILL)

    def end(rig):
        wait_for(lambda: rig.master.node_uri("/" + node) != rig.killed, f"{node} again", 30, period=0.1)
    return Fault(f"{node} killed", begin, end, statuses=(0, 3))


def emergency_stop(seconds):
    """Pressed for so long; nothing moves by its release."""
    return Fault(f"emergency stop for {seconds} s", lambda rig: rig.button.publish(True),
                 lambda rig: rig.button.publish(False), seconds, statuses=(4,))


def take_over(rig):
    """The hand turns the robot for a second."""
    for turn in [0.8] * 20 + [0.0]:
        rig.hand.publish(twist(turn=turn))
        time.sleep(0.05)


def visit(rig):
    """Somebody stands before the robot."""
    x, y, _ = compose(rig.pose(), (0.9, 0.0, 0.0))
    rig.visitor.publish(Vector3(x, y, 0.0))


def leave(rig):
    """Who stood there goes."""
    rig.visitor.publish(Vector3(math.nan, math.nan, 0.0))


def kidnap(x, y, turn):
    """Somebody carries the robot away, as seen along the map's axes [m], [rad]."""
    def begin(rig):
        now = rig.pose()
        rig.carry(now[0] + x, now[1] + y, now[2] + turn)
    return begin


def unplug(pull):
    """Pull the cable, or put it back."""
    return lambda rig: rospy.ServiceProxy("simulator_node/unplug", SetBool)(pull)


def scan(comes):
    """Tell who drives by the scan who sends it: nobody, as with a camera that dies, or who does."""
    def tell(rig):
        master = xmlrpc.client.ServerProxy(rig.master.uri)
        publishers = dict(master.getSystemState("/navigation_run")[2][0])["/scan"]
        uris = [rig.master.node_uri(node) for node in publishers if comes]
        for node in ("/move_base", "/amcl", "/navigation_monitor"):
            xmlrpc.client.ServerProxy(rig.master.node_uri(node)).publisherUpdate("/navigation_run", "/scan", uris)
    return tell


FAULTS = {  # by the world
    "room": [
        Fault("hand takes over", take_over), emergency_stop(3), emergency_stop(20),
        Fault("cable unplugged for 20 s", unplug(True), unplug(False), 20.0),
        Fault("no scan for 20 s", scan(False), scan(True), 20.0),
        *map(kill, ("driver_node", "serial_com_node", "odom_node", "cmd_vel_mux", "amcl", "map_server", "move_base",
                    "navigation_monitor")),
        Fault("board restarts", lambda rig: rospy.ServiceProxy("simulator_node/brown_out", Trigger)()),
        Fault("somebody stands in the way", visit),
        Fault("somebody stands on the goal", lambda rig: rig.visitor.publish(Vector3(*ROUTE["room"][1])),
              statuses=(1, 7)),
        Fault("kidnapped by 1 m and 90 degrees", kidnap(1.0, 0.0, math.pi / 2), statuses=(8,)),
        Fault("kidnapped by 1 m and -90 degrees", kidnap(0.8, 0.6, -math.pi / 2), statuses=(8,)),
        Fault("kidnapped by 5 m", kidnap(4.0, 3.0, 0.0), statuses=(1, 8)),
    ],
    "maze": [
        Fault("the only way barred for 20 s", visit, leave, 20.0),
        Fault("the only way barred for good", visit, statuses=(1,)),
    ],
}


def main():
    """Run the faults and print what became of them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", action="append", help="faults whose name begins with these words")
    parser.add_argument("--world", default="room", choices=FAULTS)
    options = parser.parse_args()
    chosen = [fault for fault in FAULTS[options.world] if fault.name.startswith(tuple(options.only or [""]))]
    with Master() as master:
        rig = Rig(master, options.world)
        rows = []
        for fault in chosen:
            row = {**rig.suffer(fault), "expected": fault.statuses}
            rows.append(row)
            print(json.dumps(row), file=sys.stderr, flush=True)
    print(json.dumps(rows))


if __name__ == "__main__":
    main()
