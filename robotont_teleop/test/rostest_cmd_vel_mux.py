#!/usr/bin/env python3
"""cmd_vel_mux with driver_node behind it: what is on the wire, and what outlives a restart."""

import itertools
import math
import signal
import threading
import time

import rospy
import rostest
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool, Float32, String
from std_srvs.srv import Trigger

from robotont_driver.ros.worker import Worker
from robotont_testing import places
from robotont_testing.harness import Processes, suspended, wait_for
from robotont_testing.node_test import OK, WARN, NodeTest, twist

HAND, NAVIGATION = (0.1, 0.0, 0.0), (0.0, 0.2, 0.0)
OTHER_HAND = (-0.1, 0.0, 0.0)
STOP = (0.0, 0.0, 0.0)
STOPPED = "0.00:0.00:0.00;\n"


class CmdVelMuxTest(NodeTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.packets = []   # (time [s], packet)
        cls.commands, cls.drivers = [], []
        rospy.Subscriber("serial_write", String,
                         lambda message: cls.packets.append((time.monotonic(), message.data)), tcp_nodelay=True)
        rospy.Subscriber("cmd_vel", Twist, lambda message: cls.commands.append(
            (message.linear.x, message.linear.y, message.angular.z)), tcp_nodelay=True)
        rospy.Subscriber("cmd_vel/driven_by", String, lambda message: cls.drivers.append(message.data))
        cls.emergency_stop = rospy.Publisher("emergency_stop", Bool, queue_size=5, tcp_nodelay=True)
        cls.inputs = {name: rospy.Publisher(f"cmd_vel/{name}", Twist, queue_size=5, tcp_nodelay=True)
                      for name in ("hand", "navigation")}
        cls.repeated = {}
        Worker(cls.repeat)
        cls.nodes = Processes()
        cls.start_mux()

    @classmethod
    def tearDownClass(cls):
        cls.nodes.close()

    @classmethod
    def start_mux(cls):
        cls.mux = cls.nodes.start(places.program("robotont_teleop", "cmd_vel_mux"), "_hand_rest:=0.5")
        wait_for(lambda: all(one.get_num_connections() for one in (*cls.inputs.values(), cls.emergency_stop)),
                 "cmd_vel_mux and driver_node")
        wait_for(lambda: cls.packets and cls.drivers, "both nodes")

    def setUp(self):
        super().setUp()
        self.addCleanup(self.send, hand=None, navigation=None)
        self.press(False)
        self.driven_by("nobody")

    @classmethod
    def send(cls, **commands):
        """Send commands now, and then again and again at 20 Hz; None: nothing more."""
        cls.repeated = {**cls.repeated, **commands}
        cls.repeat(commands)

    @classmethod
    def repeat(cls, commands=None):
        for name, command in (commands or cls.repeated).items():
            if command is not None:
                cls.inputs[name].publish(twist(*command))
        return 0.05

    def driven_by(self, name):
        wait_for(lambda: self.drivers[-1] == name, f"{name} driving")

    def moving(self):
        wait_for(lambda: self.packets[-1][1] != STOPPED, "motion")

    def let_go_and_drive_by_hand(self):
        """As somebody who holds the stick while it should be let go first."""
        commands = itertools.cycle((STOP, HAND))
        wait_for(lambda: self.send(hand=next(commands)) or self.packets[-1][1] != STOPPED, "motion", period=0.06)
        self.send(hand=HAND)

    def press(self, pressed):
        """Press or release the emergency stop; returns the time [s]."""
        now = time.monotonic()
        self.emergency_stop.publish(pressed)
        return now

    def stopped_after(self, start):
        return wait_for(lambda: next((at for at, packet in self.packets if at > start and packet == STOPPED), None),
                        "the stop")

    def next_packets(self):
        seen = len(self.packets)
        wait_for(lambda: len(self.packets) > seen + 5, "packets")
        return {packet for _, packet in self.packets[seen:]}

    def test_the_hand_takes_over_from_navigation_and_gives_back_on_request(self):
        before = len(self.commands)
        self.send(navigation=NAVIGATION)
        self.driven_by("navigation")
        self.send(hand=HAND)
        self.driven_by("hand")
        wait_for(lambda: self.commands[-1] == HAND, "the hand's command")
        self.send(hand=None)
        answer = rospy.ServiceProxy("cmd_vel_mux/give_back", Trigger)()
        self.assertEqual((answer.success, answer.message), (True, "navigation drives"))
        wait_for(lambda: self.commands[-1] == NAVIGATION, "navigation's command")
        changes = [command for command, _ in itertools.groupby([STOP, *self.commands[before:]])]
        self.assertEqual(changes, [STOP, NAVIGATION, STOP, HAND, STOP, NAVIGATION])

    def test_commands_that_waited_while_the_mux_was_stopped_do_not_drive(self):
        self.send(hand=HAND)
        self.moving()
        with suspended(self.mux.pid):
            self.send(hand=OTHER_HAND)
            wait_for(lambda: self.packets[-1][1] == STOPPED, "driver_node's time-out")
            self.send(hand=None)  # its sender dies after that
            seen, packets = len(self.commands), len(self.packets)
        wait_for(lambda: len(self.packets) > packets + 15, "packets afterwards")
        self.assertNotIn(OTHER_HAND, self.commands[seen:])
        self.assertEqual(self.packets[-1][1], STOPPED)
        under_way = sum(command != STOP for command in self.commands[seen:])
        self.assertLessEqual(under_way, 1, "one command may have been under way when the mux was stopped")

    def test_its_end_is_a_zero_and_an_emergency_stop_outlives_it(self):
        self.send(hand=HAND)
        self.moving()
        ended = threading.Event()
        self.addCleanup(ended.set)
        Worker(lambda: 3600.0 if ended.is_set() else self.repeat({"hand": HAND}) / 50)  # until the very end
        self.nodes.stop(self.mux, signal.SIGTERM)
        wait_for(lambda: self.commands[-1] == STOP, "the zero")
        ended.set()
        self.start_mux()
        self.moving()
        stop = self.stopped_after(self.press(True))
        self.driven_by("emergency stop")
        self.nodes.stop(self.mux)
        self.status.clear()
        self.start_mux()
        self.wait_for_status("cmd_vel_mux: who drives", WARN, "emergency stop")
        self.next_packets()
        self.assertEqual({packet for at, packet in self.packets if at >= stop}, {STOPPED})
        self.press(False)
        self.driven_by("nobody")
        wait_for(lambda: rospy.get_param("cmd_vel_mux_held", []) == [rospy.get_name()], "who has to stop first")
        self.nodes.stop(self.mux, signal.SIGKILL)
        seen = len(self.commands)
        self.drivers.clear()
        self.start_mux()
        time.sleep(1.0)  # nothing happens
        self.assertFalse([command for command in self.commands[seen:] if command != STOP], "it has not let go yet")
        self.send(navigation=STOP)  # of the same node, which has to stop on each input
        self.let_go_and_drive_by_hand()

    def test_the_zero_of_each_lock_is_on_the_wire_within_50_ms_and_all_goals_are_cancelled(self):
        delays = []
        cancelled = self.listen("move_base/cancel", GoalID, publishers=1)
        for _ in range(3):
            self.let_go_and_drive_by_hand()
            cancelled.clear()
            pressed = self.press(True)
            delays.append(self.stopped_after(pressed) - pressed)
            self.driven_by("emergency stop")
            wait_for(lambda: GoalID() in cancelled, "the end of all goals")
            self.send(navigation=NAVIGATION)
            wait_for(lambda: len(cancelled) > 2, "the end of a goal that drives in vain")  # the press sends one
            self.send(navigation=None)
            cancelled.clear()
            self.press(False)
            self.driven_by("nobody")
            wait_for(lambda: cancelled, "the end of goals that came during the stop")
        self.assertLess(max(delays), 0.05, delays)

    def test_straight_publishers_drive_and_are_a_warning_only_beside_somebody_else(self):
        direct = self.publisher("cmd_vel", Twist, subscribers=2)
        wait_for(lambda: direct.publish(twist(0.2)) or self.packets[-1][1] == "-18.90:0.00:18.90;\n", "motion",
                 period=0.05)
        wait_for(lambda: self.values("cmd_vel_mux: who drives")["other publishers of cmd_vel"] == rospy.get_name(),
                 "its name")
        self.wait_for_status("cmd_vel_mux: who drives", OK)  # alone it disturbs nobody
        self.send(hand=HAND)
        words = self.wait_for_status("cmd_vel_mux: who drives", WARN, "commands mix").message
        self.assertIn(rospy.get_name(), words)
        self.send(hand=None)
        self._publishers.pop("cmd_vel").unregister()
        self.wait_for_status("cmd_vel_mux: who drives", OK)

    def test_commands_that_no_robot_can_do_are_refused_and_stop(self):
        for x, z in ((math.nan, 0.0), (math.inf, 0.0), (0.1, 1.0)):
            self.send(hand=HAND)
            wait_for(lambda: self.commands and self.commands[-1] == HAND, "motion")
            self.send(hand=None)
            message = twist(x)
            message.linear.z = z
            seen = len(self.commands)
            self.inputs["hand"].publish(message)
            wait_for(lambda seen=seen: STOP in self.commands[seen:], "the stop")
        self.assertTrue(all(math.isfinite(value) for command in self.commands for value in command))

    def test_navigation_stands_when_it_is_told_to_and_goes_on_by_itself(self):
        stand = self.publisher("navigation/stand", Float32)
        self.send(navigation=NAVIGATION)
        wait_for(lambda: self.commands and self.commands[-1] == NAVIGATION, "motion")
        for senseless in (math.nan, -1.0, 1e9):
            stand.publish(Float32(senseless))
        seen, begin = len(self.commands), time.monotonic()
        stand.publish(Float32(0.5))
        wait_for(lambda: STOP in self.commands[seen:], "the stand")
        seen += self.commands[seen:].index(STOP)
        wait_for(lambda: NAVIGATION in self.commands[seen:], "motion again")
        self.assertGreaterEqual(time.monotonic() - begin, 0.5)
        self.assertEqual(self.drivers[-1], "navigation")


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "cmd_vel_mux_test", CmdVelMuxTest)
