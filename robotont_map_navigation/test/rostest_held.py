#!/usr/bin/env python3
"""navigation_monitor: a robot that something holds, by its wheels."""

import time

import rospy
import rostest
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
from navigation_messages import latched
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Float32, String

from robotont_testing.harness import wait_for
from robotont_testing.node_test import ERROR, NodeTest, twist

TASK = "navigation_monitor: motion"


class HeldTest(NodeTest):
    """What the wheels say of a motion that navigation commands."""

    def setUp(self):
        super().setUp()
        self.cancelled = self.listen("move_base/cancel", GoalID)
        self.stands = self.listen("navigation/stand", Float32)
        self.felt = self.listen("navigation/felt", PointCloud2)
        self.told = self.listen("navigation/held", String)
        self.odom = self.publisher("odom", Odometry)
        self.command = self.publisher("cmd_vel/limited", Twist)
        self.driver = latched("cmd_vel/driven_by", String("navigation"))

    def drive(self, until, what, moves=0.0):
        """Command 0.2 m/s while the wheels move the robot at a share of it."""
        odometry = Odometry()
        odometry.twist.twist = twist(0.2 * moves)

        def step():
            self.command.publish(twist(0.2))
            odometry.header.stamp = rospy.Time.now()
            self.odom.publish(odometry)
            return until()
        wait_for(step, what, period=0.02)

    def test_a_robot_that_is_held_loses_its_goals_and_a_new_one_tries_again(self):
        self.drive(lambda: self.stands, "a stand")
        self.assertEqual(self.cancelled, [])
        felt = wait_for(lambda: [cloud for cloud in self.felt if cloud.width], "what it has felt")
        xs, _, _ = zip(*point_cloud2.read_points(felt[0]))
        self.assertGreaterEqual(min(xs), 0.0)
        self.assertGreater(max(xs), 0.05)
        wait_for(lambda: not self.felt[-1].width, "a cloud of nothing: else costmaps would never forget the one before")
        self.drive(lambda: self.cancelled and self.told[-1].data.startswith("something holds the robot"), "the end")
        self.wait_for_status(TASK, ERROR, "something holds the robot")
        self.publisher("move_base/current_goal", PoseStamped).publish(PoseStamped())
        wait_for(lambda: not self.told[-1].data, "a new try")

    def test_nothing_is_cancelled_while_the_robot_moves_or_somebody_else_drives(self):
        begin = time.monotonic()
        self.drive(lambda: time.monotonic() - begin > 2.0, "two seconds of driving", moves=0.9)
        self.driver.publish(String("hand"))
        wait_for(lambda: self.values(TASK)["driven by"] == "hand", "navigation_monitor to hear who drives")
        begin = time.monotonic()
        self.drive(lambda: time.monotonic() - begin > 2.0, "two seconds by hand")
        self.assertEqual([*self.cancelled, *self.stands], [])


if __name__ == "__main__":
    rostest.rosrun("robotont_map_navigation", "held", HeldTest)
