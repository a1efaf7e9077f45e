#!/usr/bin/env python3
"""path_node on its own: odom in, path out."""


import rospy
import rostest
from nav_msgs.msg import Odometry
from nav_msgs.msg import Path as PathMessage

from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest

PERIOD = 0.02  # [s] between odometry messages


class PathNodeTest(NodeTest):
    """Drives of a robot that is only odometry."""

    def start(self, *arguments):
        self.paths = self.listen("/path", PathMessage)
        node = self.processes.start(places.program("robotont_driver", "path_node"), *arguments)
        self.addCleanup(self.processes.stop, node)
        self.odometry = self.publisher("/odom", Odometry)

    def drive(self, steps, start=0):
        """Ahead with 1 m/s, a message per PERIOD of the stamps and per millisecond of the clock."""
        for step in range(start, start + steps):
            message = Odometry()
            message.header.frame_id = "odom"
            message.header.stamp = rospy.Time.from_sec(100.0 + self.clock)
            message.pose.pose.position.x = step * PERIOD
            message.pose.pose.orientation.w = 1.0
            message.twist.twist.linear.x = 1.0
            self.odometry.publish(message)
            self.clock += PERIOD
            rospy.sleep(0.002)

    def setUp(self):
        super().setUp()
        self.clock = 0.0

    def wait_for_path(self, condition, what):
        return wait_for(lambda: self.paths and condition(self.paths[-1]) and self.paths[-1], what)

    def test_first_pose_then_a_bounded_path_then_a_reset(self):
        self.start()
        self.drive(1)
        path = self.wait_for_path(lambda path: len(path.poses) == 1, "a path as soon as there is odometry")
        self.assertEqual(path.header.frame_id, "odom")
        self.drive(3200, start=1)
        path = self.wait_for_path(lambda path: path.poses[-1].pose.position.x > 63.8, "the end of the drive")
        self.assertEqual(len(path.poses), 1000)
        steps = [after.pose.position.x - before.pose.position.x
                 for before, after in zip(path.poses, path.poses[1:])]
        self.assertGreater(min(steps), 0.0499)
        self.assertAlmostEqual(sorted(steps)[500], 0.06, delta=1e-6)  # on a busy machine messages are missing
        self.assertEqual(path.header.stamp, path.poses[-1].header.stamp)
        self.assertTrue(all(pose.header.frame_id == "odom" and pose.pose.orientation.w == 1.0 for pose in path.poses))
        self.drive(2)  # from the origin again
        path = self.wait_for_path(lambda path: len(path.poses) < 1000, "a new path after the reset")
        self.assertEqual([pose.pose.position.x for pose in path.poses], [0.0])


if __name__ == "__main__":
    rostest.rosrun("robotont_driver", "path_node", PathNodeTest)
