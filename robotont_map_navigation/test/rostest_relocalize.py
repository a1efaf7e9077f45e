#!/usr/bin/env python3
"""relocalize on the simulated robot: what it tells amcl, and when nothing turns."""

import math
import re

import rospy
import rostest
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from std_msgs.msg import Bool

from robotont_driver.kinematics.se2 import pose_of
from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest


class RelocalizeTest(NodeTest):
    """In the room, with its own map; this test stands in for amcl."""

    def relocalize(self):
        """(exit status, words) of a run."""
        log = self.processes.folder / "relocalize"
        process = self.processes.start(places.program("robotont_map_navigation", "relocalize"), log=log)
        wait_for(lambda: process.poll() is not None, "the end of relocalize", 120)
        self.assertNotIn("Traceback", log.read_text())
        return process.returncode, log.read_text().strip()

    def test_it_finds_the_robot_and_says_why_it_cannot(self):
        told = self.listen("initialpose", PoseWithCovarianceStamped)
        truth = self.listen("ground_truth/odom", Odometry)
        self.processes.launch("simulation.launch", "world:=room", "world_map:=true",
                              f"port:={self.processes.folder / 'board'}")
        wait_for(lambda: truth, "the simulator", 60)
        status, words = self.relocalize()
        self.assertEqual(status, 0, words)
        self.assertTrue(re.fullmatch(r"found at \(.*\): the map explains \d+% of what is seen, at other places "
                                     r"\d+% at most", words), words)
        x, y, yaw = pose_of(told[-1].pose.pose)
        true = pose_of(truth[-1].pose.pose)
        self.assertLess(math.dist((x, y), true[:2]), 0.1)
        self.assertLess(abs(math.remainder(yaw - true[2], math.tau)), 0.1)
        self.assertEqual(len(told), 1)
        button = rospy.Publisher("emergency_stop", Bool, queue_size=1, latch=True)
        button.publish(True)
        status, words = self.relocalize()
        self.assertEqual(status, 1, words)
        self.assertIn("does not turn: is the emergency stop pressed", words)
        self.assertEqual(len(told), 1)


if __name__ == "__main__":
    rostest.rosrun("robotont_map_navigation", "relocalize", RelocalizeTest)
