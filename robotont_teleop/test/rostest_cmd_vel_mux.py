#!/usr/bin/env python3
"""cmd_vel_mux with driver_node behind it: what is on the wire, and what outlives a restart."""

import itertools
import math
import signal
import time

import rospy
import rostest
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger

from robotont_driver.ros.worker import Worker
from robotont_testing import places
from robotont_testing.harness import suspended, wait_for
from robotont_testing.node_test import OK, WARN, NodeTest, twist

HAND, NAVIGATION = (0.1, 0.0, 0.0), (0.0, 0.2, 0.0)
OTHER_HAND = (-0.1, 0.0, 0.0)
STOP = (0.0, 0.0, 0.0)
STOPPED = "0.00:0.00:0.00;\n"


class Wire:
    """What goes on `serial_write`, `cmd_vel` and `cmd_vel/driven_by` of a namespace, and what is sent to its mux."""

    def __init__(self, namespace=""):
        self.packets = []   # (time [s], packet)
        self.commands = []
        self.drivers = []
        rospy.Subscriber(namespace + "/serial_write", String,
                         lambda message: self.packets.append((time.monotonic(), message.data)), tcp_nodelay=True)
        rospy.Subscriber(namespace + "/cmd_vel", Twist, lambda message: self.commands.append(
            (message.linear.x, message.linear.y, message.angular.z)), tcp_nodelay=True)
        rospy.Subscriber(namespace + "/cmd_vel/driven_by", String, lambda message: self.drivers.append(message.data))
        self.emergency_stop = rospy.Publisher(namespace + "/emergency_stop", Bool, queue_size=5, tcp_nodelay=True)
        self._publishers = {name: rospy.Publisher(f"{namespace}/cmd_vel/{name}", Twist, queue_size=5, tcp_nodelay=True)
                            for name in ("hand", "navigation", "default")}
        self._repeated = {}
        Worker(self._repeat)
        wait_for(lambda: all(publisher.get_num_connections() for publisher in self._publishers.values()), "cmd_vel_mux")
        wait_for(self.emergency_stop.get_num_connections, "driver_node")
        wait_for(lambda: self.packets and self.drivers, "both nodes")

    def send(self, **commands):
        """Send commands now, and then again and again at 20 Hz; None: nothing more."""
        self._repeated = {**self._repeated, **commands}
        self._repeat(commands)

    def _repeat(self, commands=None):
        for name, command in (commands or self._repeated).items():
            if command is not None:
                self._publishers[name].publish(twist(*command))
        return 0.05

    def driven_by(self, name):
        wait_for(lambda: self.drivers[-1] == name, f"{name} driving")

    def moving(self):
        wait_for(lambda: self.packets[-1][1] != STOPPED, "motion")

    def let_go_and_drive(self):
        """By hand, as somebody who holds the stick while it should be let go first."""
        commands = itertools.cycle((STOP, HAND))
        wait_for(lambda: self.send(hand=next(commands)) or self.packets[-1][1] != STOPPED, "motion", period=0.06)
        self.send(hand=HAND)

    def stopped_after(self, start):
        """Time [s] of the first stop that is sent after `start`."""
        return wait_for(lambda: next((at for at, packet in self.packets if at > start and packet == STOPPED), None),
                        "the stop")

    def press(self, pressed):
        """Press or release the emergency stop; returns the time [s]."""
        now = time.monotonic()
        self.emergency_stop.publish(pressed)
        return now


class CmdVelMuxTest(NodeTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.wire = Wire()

    def setUp(self):
        super().setUp()
        self.addCleanup(self.wire.send, hand=None, navigation=None, default=None)
        self.wire.press(False)
        self.wire.driven_by("nobody")

    def test_the_hand_takes_over_from_navigation_and_gives_back_on_request(self):
        before = len(self.wire.commands)
        self.wire.send(navigation=NAVIGATION)
        self.wire.driven_by("navigation")
        self.wire.send(hand=HAND)
        self.wire.driven_by("hand")
        wait_for(lambda: self.wire.commands[-1] == HAND, "the hand's command")
        self.wire.send(hand=None)
        answer = rospy.ServiceProxy("cmd_vel_mux/give_back", Trigger)()
        self.assertEqual((answer.success, answer.message), (True, "navigation drives"))
        wait_for(lambda: self.wire.commands[-1] == NAVIGATION, "navigation's command")
        commands = self.wire.commands[before:]
        changes = [after for before, after in zip([STOP, *commands], commands) if after != before]
        self.assertEqual(changes, [NAVIGATION, STOP, HAND, STOP, NAVIGATION])

    def test_commands_that_waited_while_the_mux_was_stopped_do_not_drive(self):
        self.wire.send(hand=HAND)
        self.wire.moving()
        pid = self.processes.pid("/cmd_vel_mux")
        with suspended(pid):
            self.wire.send(hand=OTHER_HAND)
            wait_for(lambda: self.wire.packets[-1][1] == STOPPED, "driver_node's time-out")
            self.wire.send(hand=None)  # its sender dies after that
            seen, packets = len(self.wire.commands), len(self.wire.packets)
        wait_for(lambda: len(self.wire.packets) > packets + 15, "packets afterwards")
        self.assertNotIn(OTHER_HAND, self.wire.commands[seen:])
        self.assertEqual(self.wire.packets[-1][1], STOPPED)
        under_way = sum(command != STOP for command in self.wire.commands[seen:])
        self.assertLessEqual(under_way, 1, "one command may have been under way when the mux was stopped")

    def test_an_emergency_stop_is_on_the_wire_at_once_and_outlives_the_mux(self):
        def start(name, package):
            return self.processes.start(places.program(package, name), "__ns:=/restarted")
        start("driver_node", "robotont_driver")
        mux = start("cmd_vel_mux", "robotont_teleop")
        wire = Wire("/restarted")
        self.addCleanup(wire.send, hand=None)
        wire.send(hand=HAND)
        wire.moving()
        stop = wire.stopped_after(wire.press(True))
        wire.driven_by("emergency stop")
        wait_for(lambda: rospy.get_param("/restarted/emergency_stop_pressed", []), "the parameter")
        self.processes.stop(mux)
        self.status.clear()
        start("cmd_vel_mux", "robotont_teleop")
        self.wait_for_status("restarted/cmd_vel_mux: who drives", WARN, "emergency stop")
        seen = len(wire.packets)
        wait_for(lambda: len(wire.packets) > seen + 5, "packets")
        self.assertEqual({packet for at, packet in wire.packets if at >= stop}, {STOPPED})
        wait_for(wire.emergency_stop.get_num_connections, "driver_node")
        wire.press(False)
        wire.driven_by("nobody")
        seen = len(wire.packets)
        wait_for(lambda: len(wire.packets) > seen + 5, "packets")
        self.assertEqual({packet for _, packet in wire.packets[seen:]}, {STOPPED}, "the hand has not let go yet")
        wire.let_go_and_drive()

    def test_the_zero_of_each_lock_is_on_the_wire_within_50_ms_and_all_goals_are_cancelled(self):
        wire, delays = self.wire, []
        cancelled = self.listen("move_base/cancel", GoalID, publishers=1)
        for _ in range(3):
            wire.let_go_and_drive()
            cancelled.clear()
            pressed = wire.press(True)
            delays.append(wire.stopped_after(pressed) - pressed)
            wire.driven_by("emergency stop")
            wait_for(lambda: GoalID() in cancelled, "the end of all goals")
            wire.send(navigation=NAVIGATION)
            wait_for(lambda: len(cancelled) > 2, "the end of a goal that drives in vain")  # the press sends one
            wire.send(navigation=None)
            wire.press(False)
            wire.driven_by("nobody")
        self.assertLess(max(delays), 0.05, delays)

    def test_straight_publishers_still_drive_and_are_named(self):
        direct = self.publisher("cmd_vel", Twist, subscribers=2)
        wait_for(lambda: direct.publish(twist(0.2)) or self.wire.packets[-1][1] == "-18.90:0.00:18.90;\n", "motion",
                 period=0.05)
        words = self.wait_for_status("cmd_vel_mux: who drives", WARN, "cmd_vel").message
        self.assertIn(rospy.get_name(), words)
        self._publishers.pop("cmd_vel").unregister()
        self.wait_for_status("cmd_vel_mux: who drives", OK)

    def test_commands_that_no_robot_can_do_are_refused_and_stop(self):
        for x, z in ((math.nan, 0.0), (math.inf, 0.0), (0.1, 1.0)):
            self.wire.send(hand=HAND)
            wait_for(lambda: self.wire.commands and self.wire.commands[-1] == HAND, "motion")
            self.wire.send(hand=None)
            message = twist(x)
            message.linear.z = z
            seen = len(self.wire.commands)
            self.publisher("cmd_vel/hand", Twist).publish(message)
            wait_for(lambda seen=seen: STOP in self.wire.commands[seen:], "the stop")
        self.assertTrue(all(math.isfinite(value) for command in self.wire.commands for value in command))

    def test_the_limited_command_is_reported(self):
        limited = self.listen("cmd_vel/limited", Twist)
        self.wire.send(hand=(0.6, 0.0, 0.0))
        wait_for(lambda: limited and abs(limited[-1].linear.x - 0.3) < 1e-9, "the limited command")

    def test_its_end_is_a_zero(self):
        heard = self.listen("ending/cmd_vel", Twist)
        mux = self.processes.start(places.program("robotont_teleop", "cmd_vel_mux"), "__ns:=/ending")
        stick = self.publisher("ending/cmd_vel/hand", Twist)
        Worker(lambda: stick.publish(twist(*HAND)) or 0.05)
        wait_for(lambda: heard and heard[-1] == twist(*HAND), "motion")
        self.processes.stop(mux, signal.SIGTERM)
        wait_for(lambda: heard[-1] == twist(), "the zero")


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "cmd_vel_mux_test", CmdVelMuxTest)
