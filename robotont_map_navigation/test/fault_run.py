#!/usr/bin/env python3
"""Drives the simulated robot with the real navigation stack, and lets one fault after the other happen on the way.

fault_run.py [--only WORDS]... [--long] [--goals N] prints a table, and JSON on the last line: for each fault the
seconds until the robot stood and, after the fault's end, until it drove again by itself (None: it did not), the way [m]
that it went meanwhile, the status and last line of goto, what mended it, and the localization's error at the end.
--long: emergency stops of 60 s, too. --goals N: N goals after each fault, with errors and memory. Needs move_base.
"""

import argparse
import asyncio
import json
import math
import os
import pty
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
from navigation_run import Run, pose, random_goals, standing
from std_msgs.msg import Bool
from std_srvs.srv import Empty, SetBool, Trigger
from tornado.httpclient import HTTPRequest
from tornado.websocket import websocket_connect

from robotont_driver.kinematics.se2 import yaw_of
from robotont_testing.harness import Master, free_port, wait_for
from robotont_testing.places import program

ROUTE = {"room": ((1.2, 1.0, 1.57), (1.2, 5.0, 1.57)), "maze": ((0.5, 0.5, 1.57), (0.5, 3.6, 1.57))}
UNDER_WAY = 0.8      # [m] from the start, where the fault begins
PATIENCE = 100       # [s] in which goto has to end by itself
BY_ITSELF = 2.0      # [s] after a fault, for which goto is listened to before anybody mends anything
AFTER_STOP = 0.3     # [s] that the page stays after its message
MOVES = 0.1          # [m/s] from here on it drives
NODES = ("move_base", "amcl", "map_server", "navigation_monitor", "cmd_vel_mux", "driver_node",
         "serial_com_node", "odom_node")
SHORT = 2.0          # [m] to the next of the goals after a fault, at most


class Fault(NamedTuple):
    """A fault on the way, and what is expected of goto."""

    name: str
    begin: Callable               # may return when [s] it has happened
    end: Callable = lambda rig: None
    seconds: float = 0.0          # that it lasts
    statuses: Any = (0,)          # that goto may end with
    mend: str = ""                # program that a person starts when goto has said so
    world: str = "room"


class Rig:
    """navigation.launch, a robot on its way, and who can press what."""

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
        self.page_port = free_port()
        for topic in (self._carry, self.visitor, self._initial, self.hand, self.button):
            wait_for(topic.get_num_connections, f"who listens to {topic.name}", 60)
        wait_for(lambda: self._initial.get_num_connections() > 1, "amcl and navigation_monitor", 60)
        rospy.wait_for_service("move_base/clear_costmaps", 60)
        self._clear = rospy.ServiceProxy("move_base/clear_costmaps", Empty)
        self._keys = None

    def carry(self, x, y, yaw):
        """Put the robot down somewhere."""
        self._carry.publish(Vector3(x, y, yaw))
        wait_for(lambda: math.dist(self.run.pose()[:2], (x, y)) < 0.05, "the robot there")

    def start(self):
        """The robot at the start of the route, which amcl knows, and nobody else there."""
        self.visitor.publish(Vector3(math.nan, math.nan, 0.0))
        place = ROUTE[self.world][0]
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

    def press_key(self, key):
        """A key of keyboard_teleop, which is started for the first one."""
        if self._keys is None:
            self._keys, slave = pty.openpty()
            process = subprocess.Popen([program("robotont_teleop", "keyboard_teleop")], stdin=slave, stdout=slave,
                                       stderr=slave, start_new_session=True)
            self.master._processes.append(process)
            os.close(slave)
            wait_for(lambda: "EMERGENCY" in os.read(self._keys, 9999).decode("utf-8", "replace").upper(), "the keys")
        os.write(self._keys, key)
        return time.monotonic()

    def press_page(self):
        """STOP on the page, whose server is started for it."""
        self.master.start(program("robotont_teleop", "web_teleop_node"), f"_port:={self.page_port}",
                          log=self.master.folder / "page")

        async def stop():
            socket = await websocket_connect(HTTPRequest(
                f"ws://127.0.0.1:{self.page_port}/socket", headers={"Origin": f"http://127.0.0.1:{self.page_port}"}))
            await socket.write_message(json.dumps({"kind": "stop"}))
            await asyncio.sleep(AFTER_STOP)

        def pressed():
            try:
                asyncio.run(stop())
            except OSError:
                return None
            return time.monotonic() - AFTER_STOP
        return wait_for(pressed, "the page's server", 30, period=0.2)

    def suffer(self, fault):
        """Drive, let the fault happen, and see what becomes of it; the row of the table."""
        self.start()
        goal = ROUTE[self.world][1]
        goto = self.tool("goto", *goal, "--wait", 60)
        first = self.run.pose()
        wait_for(lambda: math.dist(self.run.pose()[:2], first[:2]) > UNDER_WAY, "a robot under way", 60)
        happened = fault.begin(self)
        begun = happened if isinstance(happened, float) else time.monotonic()
        stood = self._seconds(lambda: standing(self.run.truth[-1]), begun, fault.seconds + 6.0, goto)
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
        way = self._way(number)
        speeds = [(index, message.twist.twist.linear) for index, message in enumerate(self.run.truth[number:])]
        drives = next((index / 50 for index, speed in speeds if math.hypot(speed.x, speed.y) > MOVES), None)
        row = {"fault": fault.name, "stood_s": stood, "drove_again_s": drives, "way_after_m": round(way, 3),
               "goto_ended_s": over, "status": goto.returncode, "words": words, "mended": []}
        if goto.returncode and fault.mend:
            mending = self.tool(fault.mend)
            row["mended"].append((fault.mend, mending.communicate(timeout=PATIENCE)[0].strip().splitlines()[-1]))
        if goto.returncode:
            self.visitor.publish(Vector3(math.nan, math.nan, 0.0))
            again = self.tool("goto", *goal, "--wait", 60, "--timeout", PATIENCE)
            row["mended"].append(("goto", again.communicate()[0].strip().splitlines()[-1]))
            row["again"] = again.returncode
        wait_for(lambda: standing(self.run.truth[-1]), "the robot to stand", 30)
        row["pose_error_m"], row["pose_error_rad"] = (round(value, 3) for value in self.error())
        row["goal_error_m"] = round(math.dist(self.run.pose()[:2], goal[:2]), 3)
        return row

    def _seconds(self, condition, since, timeout, goto):
        """[s] until a condition holds; None when it does not within `timeout` [s], or before goto ends."""
        while not condition():
            if time.monotonic() - since > timeout or goto.poll() is not None:
                return None
            time.sleep(0.01)
        return round(time.monotonic() - since, 2)

    def _way(self, number):
        """[m] since the message number `number`."""
        places = [pose(message)[:2] for message in self.run.truth[number:]]
        return sum(math.dist(one, other) for one, other in zip(places, places[1:]))

    def memory(self):
        """[MiB] of each node, proportional set size."""
        texts = {node: Path(f"/proc/{pid}/smaps_rollup").read_text() for node in NODES for pid in self.pids(node)}
        return {node: round(int(text.split("\nPss:")[1].split()[0]) / 1024, 1) for node, text in texts.items()}


def kill(node):
    """The fault: a node dies without a chance to do anything; roslaunch starts it again."""
    def begin(rig):
        rig.killed = rig.pids(node)
        os.kill(rig.killed[0], signal.SIGKILL)

    def end(rig):
        wait_for(lambda: rig.pids(node) not in ([], rig.killed), f"{node} again", 30, period=0.1)
    return Fault(f"{node} killed", begin, end, statuses=(0, 3))


def release(rig):
    """Release the emergency stop, as the page does."""
    rospy.ServiceProxy("emergency_stop/release", Trigger)()


def emergency_stop(way, press, seconds, release_it=release):
    """Pressed for so long; nothing moves by its release."""
    return Fault(f"emergency stop, {way}, {seconds} s", press, release_it, seconds, statuses=(4,))


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
        x, y, yaw = rig.run.pose()
        rig.visitor.publish(Vector3(x + ahead * math.cos(yaw), y + ahead * math.sin(yaw), 0.0))
    return begin


def leave(rig):
    """Who stood there goes."""
    rig.visitor.publish(Vector3(math.nan, math.nan, 0.0))


def kidnap(x, y, turn):
    """Somebody carries the robot away, as seen along the map's axes [m], [rad]."""
    def begin(rig):
        now = rig.run.pose()
        rig.carry(now[0] + x, now[1] + y, now[2] + turn)
    return begin


def unplug(pull):
    """Pull the cable, or put it back."""
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


def topic(rig):
    """Press by a message."""
    rig.button.publish(True)


def faults(long):
    """{arguments of navigation.launch: the faults of this run}."""
    stops = [emergency_stop("topic", topic, seconds, lambda rig: rig.button.publish(False))
             for seconds in ((3, 20, 60) if long else (3, 20))]
    stops += [emergency_stop(way, press, seconds, release_it) for seconds in ((3, 20, 60) if long else (3,))
              for way, press, release_it in (("keys", lambda rig: rig.press_key(b" "),
                                              lambda rig: rig.press_key(b"\x15")),  # Ctrl-U
                                             ("page", Rig.press_page, release))]
    return {
        (): [
            Fault("hand takes over", take_over), *stops,
            Fault("cable unplugged for 3 s", unplug(True), unplug(False), 3.0),
            Fault("no scan for 5 s", scan_reaches(lambda _: []), scan_reaches(list), 5.0),
            *map(kill, ("driver_node", "serial_com_node", "odom_node", "cmd_vel_mux", "amcl", "map_server",
                        "move_base", "navigation_monitor")),
            Fault("board restarts", lambda rig: rospy.ServiceProxy("simulator_node/brown_out", Trigger)()),
            Fault("somebody stands in the way", visit(0.9)),
            Fault("somebody stands on the goal", lambda rig: rig.visitor.publish(Vector3(*ROUTE["room"][1])),
                  statuses=(1, 7)),
            Fault("kidnapped by 1 m and 90 degrees", kidnap(1.0, 0.0, math.pi / 2), statuses=(8,), mend="relocalize"),
            Fault("kidnapped by 1 m and -90 degrees", kidnap(0.8, 0.6, -math.pi / 2), statuses=(8,), mend="relocalize"),
            Fault("kidnapped by 5 m", kidnap(4.0, 3.0, 0.0), statuses=(1, 8), mend="relocalize"),
        ],
        ("world:=maze",): [
            Fault("the only way barred for 4 s", visit(0.9), leave, 4.0, world="maze"),
            Fault("the only way barred for good", visit(0.9), statuses=(1,), world="maze"),
        ],
    }


def in_a_row(rig, count):
    """`count` goals from where the robot is; statuses, true errors and errors of the localization [m], memory [MiB]."""
    ends, errors = [], []
    goals = random_goals(rig.run.world, rig.run.radius + 0.05, 200, seed=77)
    for _ in range(count):
        goal = next(goal for goal in goals if math.dist(goal[:2], rig.run.pose()[:2]) < SHORT)
        goals.remove(goal)
        rig.run.truth[:] = rig.run.truth[-1:]
        ends.append(rig.run.goto(*goal))
        errors.append(round(rig.error()[0], 3))
        print(ends[-1]["status"], ends[-1]["error_m"], errors[-1], ends[-1]["words"], file=sys.stderr, flush=True)
    return {"statuses": [end["status"] for end in ends], "errors_m": [end["error_m"] for end in ends],
            "pose_errors_m": errors, "memory_mib": rig.memory()}


def main():
    """Run the faults and print what became of them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", action="append", help="faults whose name begins with these words")
    parser.add_argument("--long", action="store_true", help="emergency stops of 60 s, too")
    parser.add_argument("--arguments", default="", help="of navigation.launch: which part of the faults")
    parser.add_argument("--goals", type=int, default=0, help="goals in a row after each fault")
    options = parser.parse_args()
    arguments = tuple(options.arguments.split())
    chosen = [fault for fault in faults(options.long)[arguments] if fault.name.startswith(tuple(options.only or [""]))]
    with Master() as master:
        world = next((word[len("world:="):] for word in arguments if word.startswith("world:=")), "room")
        rig = Rig(master, world, *(word for word in arguments if not word.startswith("world:=")))
        before, rows = rig.memory(), []
        for fault in chosen:
            row = rig.suffer(fault)
            row["expected"] = fault.statuses
            rows.append(row)
            print(f"{row['fault']:35} stood {row['stood_s']} s, drove again {row['drove_again_s']} s, goto ended "
                  f"{row['goto_ended_s']} s, way after {row['way_after_m']} m, pose error {row['pose_error_m']} m "
                  f"{row['pose_error_rad']} rad, status {row['status']}: {row['words']} {row['mended']}",
                  file=sys.stderr, flush=True)
            if options.goals:
                row.update(in_a_row(rig, options.goals))
    print(json.dumps({"memory_mib": before, "rows": rows}))


if __name__ == "__main__":
    main()
