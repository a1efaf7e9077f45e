#!/usr/bin/env python3
"""simulation.launch robots:=2: each has its namespace; they see and touch each other."""

import math

import rospy
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan

from robotont_simulator.surroundings import APART
from robotont_testing.harness import Processes, wait_for
from robotont_testing.node_test import NodeTest

RADIUS = 0.15  # [m] of a robot


class TwoRobotsTest(NodeTest):
    def setUp(self):
        super().setUp()
        processes = Processes()
        self.addCleanup(processes.close)
        processes.launch("simulation.launch", "robots:=2", f"port:={processes.folder}/board", "description:=false",
                         "composed:=true", "mux:=false", "scan_field_of_view:=6.2831853")
        self.truth = [self.listen(f"/robot{number}/ground_truth/odom", Odometry) for number in (1, 2)]
        self.scans = [self.listen(f"/robot{number}/scan", LaserScan) for number in (1, 2)]

    def gap(self):
        first, second = (messages[-1].pose.pose.position for messages in self.truth)
        return math.hypot(first.x - second.x, first.y - second.y) - 2 * RADIUS

    def least(self, robot):
        """[m] to the other's side, as a robot's scan has it."""
        return min(abs(distance) for distance in self.scans[robot][-1].ranges)

    def test_they_see_and_touch_each_other(self):
        wait_for(lambda: all(self.truth) and all(self.scans), "both robots", timeout=60)
        self.assertAlmostEqual(self.gap(), APART - 2 * RADIUS, delta=0.02)
        away = rospy.Publisher("/robot1/cmd_vel", Twist, queue_size=1)
        command = Twist()
        command.linear.y = -0.3
        wait_for(lambda: away.publish(command) or self.gap() > 0.6, "robot1 to go away", timeout=60, period=0.05)
        for robot in (0, 1):
            wait_for(lambda robot=robot: abs(self.least(robot) - self.gap() - RADIUS) < 0.05, "the other in the scan")
        command.linear.y = 0.3
        other = self.truth[1][-1].pose.pose.position.y
        wait_for(lambda: away.publish(command) or self.gap() < 0.02, "the touch", timeout=60, period=0.05)
        until = self.truth[0][-1].header.stamp.to_sec() + 1.0
        wait_for(lambda: away.publish(command) or self.truth[0][-1].header.stamp.to_sec() > until,
                 "a second of pushing", period=0.05)
        self.assertGreater(self.gap(), -0.02)
        self.assertGreater(self.truth[1][-1].pose.pose.position.y, other - 0.02)


if __name__ == "__main__":
    rostest.rosrun("robotont_simulator", "two_robots_test", TwoRobotsTest)
