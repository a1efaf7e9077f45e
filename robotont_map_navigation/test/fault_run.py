#!/usr/bin/env python3
"""Drives the simulated robot with the real navigation stack, and lets one fault after the other happen on the way.

fault_run.py [--world NAME] [--only WORDS]... prints JSON, all of it on the last line: for each fault the seconds until
the robot stood and, after the fault's end, until it drove again by itself (None: it did not), the way [m] that it went
meanwhile, the status and last line of goto, what mended it, and the localization's error at the end; the memory of
navigation_monitor [MiB]. Needs move_base.
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
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist, Vector3
from navigation_run import Run, speed, standing, way
from std_msgs.msg import Bool
from std_srvs.srv import Empty, SetBool, Trigger

from robotont_map_navigation.readings import Frames
from robotont_testing.harness import Master, wait_for
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
    mend: str = ""                # program that a person starts when goto has said so


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
        message = PoseWithCovarianceStamped()
        message.header.frame_id = "map"
        pose_there = message.pose.pose
        pose_there.position.x, pose_there.position.y = place[:2]
        pose_there.orientation.z, pose_there.orientation.w = math.sin(place[2] / 2), math.cos(place[2] / 2)
        for number in (0, 7, 35):
            message.pose.covariance[number] = 0.0025
        self._initial.publish(message)
        wait_for(lambda: self.error()[0] < 0.1, "amcl there")
        wait_for(lambda: self.reports and self.reports[-1].level == 0, "a monitor that is content", 30)
        self._clear()
        self.truth[:] = self.truth[-1:]

    def error(self):
        """(distance [m], turn [rad]) between the robot and where the localization has it; inf when nobody knows."""
        found, (x, y, yaw) = self._frames.robot_in("map"), self.pose()
        if found is None:
            return math.inf, math.inf
        return math.dist(found[:2], (x, y)), abs(math.remainder(found[2] - yaw, 2 * math.pi))

    def pids(self, node):
        """[process id] of a node that is there."""
        try:
            pid = self.master.pid("/" + node)
            os.kill(pid, 0)
            return [pid]
        except (AssertionError, OSError):
            return []

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
        stood = self._seconds(lambda: standing(self.truth[-1]), begun, fault.seconds + 6.0, goto)
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
               "goto_ended_s": over, "status": goto.returncode, "words": words, "mended": []}
        if goto.returncode and fault.mend:
            row["mended"].append((fault.mend, self.end(self.tool(fault.mend))))
        if goto.returncode:
            leave(self)
            again = self.tool("goto", *goal)
            row["mended"].append(("goto", self.end(again)))
            row["again"] = again.returncode
        wait_for(lambda: standing(self.truth[-1]), "the robot to stand", 30)
        row["pose_error_m"], row["pose_error_rad"] = (round(value, 3) for value in self.error())
        row["goal_error_m"] = round(math.dist(self.pose()[:2], goal[:2]), 3)
        return row

    def _seconds(self, condition, since, timeout, goto):
        """[s] until a condition holds; None when it does not within `timeout` [s], or before goto ends."""
        while not condition():
            if time.monotonic() - since > timeout or goto.poll() is not None:
                return None
            time.sleep(0.01)
        return round(time.monotonic() - since, 2)


def memory(pid):
    """[MiB] of a process, proportional set size."""
    return round(int(Path(f"/proc/{pid}/smaps_rollup").read_text().split("\nPss:")[1].split()[0]) / 1024, 1)


def kill(node):
    """The fault: a node dies without a chance to do anything; roslaunch starts it again."""
    def begin(rig):
        rig.killed = rig.pids(node)
        os.kill(rig.killed[0], signal.SIGKILL)

    def end(rig):
        wait_for(lambda: rig.pids(node) not in ([], rig.killed), f"{node} again", 30, period=0.1)
    return Fault(f"{node} killed", begin, end, statuses=(0, 3))


def emergency_stop(seconds):
    """Pressed for so long; nothing moves by its release."""
    return Fault(f"emergency stop for {seconds} s", lambda rig: rig.button.publish(True),
                 lambda rig: rig.button.publish(False), seconds, statuses=(4,))


def take_over(rig):
    """The hand turns the robot for a second."""
    command = Twist()
    command.angular.z = 0.8
    for _ in range(20):
        rig.hand.publish(command)
        time.sleep(0.05)
    rig.hand.publish(Twist())


def visit(ahead):
    """Somebody stands so far [m] before the robot."""
    def begin(rig):
        x, y, yaw = rig.pose()
        rig.visitor.publish(Vector3(x + ahead * math.cos(yaw), y + ahead * math.sin(yaw), 0.0))
    return begin


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


def scan_reaches(nodes_of):
    """Tell who drives by the scan that `nodes_of(publishers)` send it: none, as a camera that dies, or who does."""
    def tell(rig):
        master = xmlrpc.client.ServerProxy(rig.master.uri)
        publishers = dict(master.getSystemState("/navigation_run")[2][0])["/scan"]
        uris = [master.lookupNode("/navigation_run", node)[2] for node in nodes_of(publishers)]
        for node in ("move_base", "amcl", "navigation_monitor"):
            xmlrpc.client.ServerProxy(master.lookupNode("/navigation_run", "/" + node)[2]).publisherUpdate(
                "/navigation_run", "/scan", uris)
    return tell


FAULTS = {  # by the world
    "room": [
        Fault("hand takes over", take_over), emergency_stop(3), emergency_stop(20),
        Fault("cable unplugged for 20 s", unplug(True), unplug(False), 20.0),
        Fault("no scan for 20 s", scan_reaches(lambda _: []), scan_reaches(list), 20.0),
        *map(kill, ("driver_node", "serial_com_node", "odom_node", "cmd_vel_mux", "amcl", "map_server", "move_base",
                    "navigation_monitor")),
        Fault("board restarts", lambda rig: rospy.ServiceProxy("simulator_node/brown_out", Trigger)()),
        Fault("somebody stands in the way", visit(0.9)),
        Fault("somebody stands on the goal", lambda rig: rig.visitor.publish(Vector3(*ROUTE["room"][1])),
              statuses=(1, 7)),
        Fault("kidnapped by 1 m and 90 degrees", kidnap(1.0, 0.0, math.pi / 2), statuses=(8,), mend="relocalize"),
        Fault("kidnapped by 1 m and -90 degrees", kidnap(0.8, 0.6, -math.pi / 2), statuses=(8,), mend="relocalize"),
        Fault("kidnapped by 5 m", kidnap(4.0, 3.0, 0.0), statuses=(1, 8), mend="relocalize"),
    ],
    "maze": [
        Fault("the only way barred for 20 s", visit(0.9), leave, 20.0),
        Fault("the only way barred for good", visit(0.9), statuses=(1,)),
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
        monitor = memory(rig.pids("navigation_monitor")[0])
    print(json.dumps({"navigation_monitor_mib": monitor, "rows": rows}))


if __name__ == "__main__":
    main()
