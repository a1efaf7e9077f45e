#!/usr/bin/env python3
"""cmd_vel_mux with a laser that hangs backwards and a range sensor on the left: who is slowed, and what is said."""

import math

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan, Range

from robotont_testing.harness import wait_for
from robotont_testing.node_test import OK, WARN, NodeTest, twist

STATUS = "cmd_vel_mux: guard"
STOP = (0.0, 0.0, 0.0)


class GuardTest(NodeTest):
    def setUp(self):
        super().setUp()
        self.commands = []
        self.listen("cmd_vel", Twist, lambda message: self.commands.append(
            (message.linear.x, message.linear.y, message.angular.z)), publishers=1)
        self.scan = self.publisher("scan", LaserScan)
        self.hand, self.sonar = self.publisher("cmd_vel/hand", Twist), self.publisher("range", Range)
        self.odom = self.publisher("odom", Odometry)

    def look(self, behind=math.inf, left=math.inf, beside=3.0, frame="laser", age=0.0, odometry=True):
        """Everything around is free for 3 m, but for a wall ahead, behind the laser's back, and something beside.

        beside: [m] by the laser, whose left is the robot's left because it looks backwards and hangs.
        """
        now = rospy.Time.now()
        scan = LaserScan(angle_min=-math.pi, angle_increment=math.pi / 180, range_min=0.1, range_max=4.0)
        scan.header.frame_id, scan.header.stamp = frame, now - rospy.Duration(age)
        angles = np.arange(360) - 180
        scan.ranges = np.where(abs(angles) > 150, behind, np.where(abs(angles - 90) < 30, beside, 3.0)).tolist()
        self.scan.publish(scan)
        sonar = Range(field_of_view=0.4, min_range=0.04, max_range=4.0, range=left)
        sonar.header.frame_id, sonar.header.stamp = "sonar", now
        self.sonar.publish(sonar)
        if odometry:
            self.odom.publish(Odometry())

    def said(self, words):
        status = self.status.get(STATUS)
        return status and status.level == WARN and words in status.message

    def drive(self, wanted, until, look=lambda: None, hand=None):
        """Command again and again, with readings, until a command passes that is wanted."""
        def passed():
            look()
            (hand or self.hand).publish(twist(*wanted))
            return next((command for command in reversed(self.commands) if until(command)), None)
        self.commands.clear()
        return wait_for(passed, f"{wanted}", period=0.05)

    def test_1_before_a_scanner_has_spoken_it_is_slow(self):
        self.wait_for_status(STATUS, OK, "at most 0.30 m/s where no sensor sees: ahead")
        self.drive((0.8, 0.0, 0.0), lambda command: 0.0 < command[0] < 0.31)

    def test_2_a_hand_stops_before_what_is_in_the_way_and_drives_on_beside_it(self):
        near = (lambda: self.look(behind=0.2)), (lambda: self.look(left=0.06)), (lambda: self.look(beside=0.21))
        for (x, y), look, side in (((0.8, 0.0), near[0], "ahead, 0.05 m"),
                                   ((0.0, 0.8), near[1], "on the left, 0.01 m"),
                                   ((0.0, 0.8), near[2], "on the left, 0.06 m")):
            self.drive((-x, -y, 0.5), lambda command, x=x, y=y: command == (-x, -y, 0.5), look)
            self.drive((x, y, 0.5), lambda command: command == STOP, look)
            self.drive((x, y, 0.5), lambda _, side=side: self.said(f"in the way: something {side}"), look)
        self.wait_for_status(STATUS, OK)

    def test_3_what_comes_between_two_commands_slows_the_newest(self):
        def slowed():
            self.drive((0.8, 0.0, 0.0), lambda command: command == (0.8, 0.0, 0.0), self.look)
            rospy.sleep(0.05)  # the hand's last command arrives
            seen = len(self.commands)
            self.look(behind=0.4)
            rospy.sleep(0.2)  # only then the hand falls silent
            return any(0.5 < x < 0.65 for x, _, _ in self.commands[seen:])
        wait_for(slowed, "a slower command that no hand has sent")

    def test_4_a_scan_that_cannot_be_used_is_named_and_slows(self):
        def free():
            self.look(frame="/laser")
        self.drive((0.8, 0.0, 0.0), lambda command: command == (0.8, 0.0, 0.0), free)
        for look, words in (((lambda: self.look(frame="unknown")), "/tf_static does not tell where it is in base_link"),
                            ((lambda: self.look(age=5.0)), "no odometry within 2 s of its stamps")):
            self.drive((0.8, 0.0, 0.0), lambda command: 0.0 < command[0] < 0.31, look)
            self.drive((0.8, 0.0, 0.0), lambda _, words=words: self.said(words), look)
        self.drive((0.8, 0.0, 0.0), lambda _: self.said("no odometry within 2 s"), lambda: self.look(odometry=False))
        self.drive((0.8, 0.0, 0.0), lambda command: command == (0.8, 0.0, 0.0), free)
        self.wait_for_status(STATUS, OK)

    def test_5_others_and_a_mux_without_it_are_left_alone(self):
        self.wait_for_status("cmd_vel_mux: who drives", WARN, "no driver_node hears its commands")
        wait_for(lambda: self.values("cmd_vel_mux: who drives")["drives"] == "nobody", "the end of the hand's rest")
        for topic in ("cmd_vel/navigation", "cmd_vel/default"):
            sender = self.publisher(topic, Twist)
            self.drive((0.8, 0.0, 0.0), lambda command: command == (0.8, 0.0, 0.0), lambda: self.look(0.2), sender)
        commands, hand = self.listen("off/cmd_vel", Twist, publishers=1), self.publisher("off/cmd_vel/hand", Twist)
        scan = self.publisher("off/scan", LaserScan, subscribers=0)
        wait_for(lambda: hand.publish(twist(0.8)) or commands, "the command", period=0.05)
        self.assertEqual((commands[0].linear.x, scan.get_num_connections()), (0.8, 0))

    def test_6_a_robot_that_comes_after_the_mux_has_a_guard_too(self):
        name, hand = "late/" + STATUS, self.publisher("late/cmd_vel/hand", Twist)
        self.wait_for_status(name, WARN, "cannot be used: no robot's wheels")
        self.listen("late/cmd_vel", Twist, lambda message: self.commands.append((message.linear.x, "late")),
                    publishers=1)
        self.drive((0.8, 0.0, 0.0), lambda command: command == (0.8, "late"), hand=hand)
        for key in ("wheelAmount", "wheelRads", "wheelDistanceFromCenter", "wheelRadius", "gearboxReductionRatio",
                    "encoderEdgesPerMotorRevolution", "pidControlFrequency"):
            rospy.set_param("late/" + key, rospy.get_param(key))
        self.wait_for_status(name, OK, "no scan and no range: does not interfere")
        self.drive((0.8, 0.0, 0.0), lambda command: command == (0.8, "late"), hand=hand)
        self.scan, self.odom = self.publisher("late/scan", LaserScan), self.publisher("late/odom", Odometry)
        self.drive((0.8, 0.0, 0.0), lambda command: command == (0.0, "late"), lambda: self.look(behind=0.2), hand)


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "guard_test", GuardTest)
