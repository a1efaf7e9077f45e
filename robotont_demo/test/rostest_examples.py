#!/usr/bin/env python3
"""Each file of examples/, in the simulator before a wall: the robot does what the first line of the file says."""

import signal
import sys
from pathlib import Path
from typing import ClassVar

import numpy as np
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan

from robotont_driver.kinematics.se2 import between, pose_of
from robotont_testing.harness import Processes, wait_for
from robotont_testing.node_test import NodeTest, twist

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
WORLD = """
walls: [[0.0, 0.0, 3.0, 0.0], [3.0, 0.0, 3.0, 3.0], [3.0, 3.0, 0.0, 3.0], [0.0, 3.0, 0.0, 0.0]]
start: [1.0, 1.0, 0.0]
"""


class ExamplesTest(NodeTest):
    _simulation: ClassVar = None

    @classmethod
    def tearDownClass(cls):
        cls._simulation.close()

    def setUp(self):
        super().setUp()
        if not self._simulation:
            type(self)._simulation = simulation = Processes()
            world = simulation.folder / "wall.yaml"
            world.write_text(WORLD)
            simulation.launch("simulation.launch", f"port:={simulation.folder / 'board'}", f"world:={world}",
                              "description:=false")
        self.truth = self.listen("ground_truth/odom", Odometry)
        self.scan = self.listen("scan", LaserScan)
        wait_for(lambda: self.truth and self.scan, "the simulator", timeout=60)

    def stands(self, seconds=1.0):
        """Whether the robot has stood for so long [s] by its own stamps."""
        end = self.truth[-1].header.stamp.to_sec()
        newest = [message for message in self.truth if message.header.stamp.to_sec() > end - seconds]
        return end - self.truth[0].header.stamp.to_sec() > seconds and max(
            abs(message.twist.twist.linear.x) + abs(message.twist.twist.linear.y) + abs(message.twist.twist.angular.z)
            for message in newest) < 0.02

    def run_example(self, name):
        """Poses (x, y, yaw) from where it started, once the example has ended by itself and the robot stands."""
        wait_for(self.stands, "a robot that stands", timeout=60)
        start, before = pose_of(self.truth[-1].pose.pose), len(self.truth)
        process = self.processes.start(sys.executable, EXAMPLES / name)
        wait_for(lambda: process.poll() is not None, name, timeout=90)
        self.assertEqual(process.returncode, 0)
        wait_for(self.stands, "a robot that stands", timeout=60)
        return np.array([between(start, pose_of(message.pose.pose)) for message in self.truth[before:]])

    def check(self, poses, corners, near, end):
        """The way passes each corner [m] within `near` [m], and ends within `end` [m] of its start."""
        for corner in corners:
            self.assertLess(np.linalg.norm(poses[:, :2] - corner, axis=1).min(), near, corner)
        self.assertLess(np.linalg.norm(poses[-1, :2]), end)

    def test_square(self):
        self.check(self.run_example("square.py"), [(0.5, 0.0), (0.5, 0.5), (0.0, 0.5)], 0.15, 0.2)

    def test_square_by_odometry(self):
        poses = self.run_example("square_by_odometry.py")
        self.check(poses, [(0.5, 0.0), (0.5, 0.5), (0.0, 0.5)], 0.08, 0.08)
        self.assertLess(abs(np.sin(poses[-1, 2])), 0.1)

    def test_follow_path(self):
        poses = self.run_example("follow_path.py")
        self.check(poses, [(0.6, 0.0), (0.9, 0.3), (0.6, 0.6), (0.0, 0.6)], 0.06, 0.03)
        self.assertLess(np.abs(poses[:, 2]).max(), 0.05)

    def test_keep_distance(self):
        process = self.processes.start(sys.executable, EXAMPLES / "keep_distance.py")
        wait_for(lambda: abs(min(self.scan[-1].ranges) - 0.5) < 0.03 and self.stands(), "half a metre to the wall", 60)
        process.send_signal(signal.SIGINT)
        wait_for(lambda: process.poll() is not None, "the end of it")
        command = self.publisher("cmd_vel", Twist)
        wait_for(lambda: command.publish(twist(-0.3)) or self.truth[-1].pose.pose.position.x < 1.0,
                 "the way back, for the other tests", period=0.05)


if __name__ == "__main__":
    rostest.rosrun("robotont_demo", "examples_test", ExamplesTest)
