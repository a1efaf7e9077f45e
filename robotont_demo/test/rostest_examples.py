#!/usr/bin/env python3
"""Each file of examples/, side by side, on a robot of its own with ideal motors: it does what its first line says."""

import signal
import sys
from pathlib import Path

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan

from robotont_driver.kinematics.se2 import between, pose_of
from robotont_testing.harness import START, wait_for
from robotont_testing.node_test import NodeTest
from robotont_testing.robots import SHIPPED
from robotont_testing.stand_in_board import Board

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
WALL = 1.0  # [m] ahead of where the robot starts


class Robot:
    """An example that drives a robot in a namespace of its name; the odometry is the truth."""

    def __init__(self, test, name, program=""):
        board = Board(str(test.processes.folder / name))
        board.plug()
        test.addCleanup(board.close)
        rospy.set_param(f"/{name}", {**SHIPPED, "serial_com_node": {"port": board.link},
                                     "odom_node": {"publish_tf": False}})
        test.processes.node("robotont_node", f"__ns:=/{name}")
        self.odom = test.listen(f"/{name}/odom", Odometry)
        wait_for(lambda: self.odom, f"odometry of {name}", START)
        example = EXAMPLES / f"{program or name}.py"
        self.program = test.processes.start(sys.executable, example, ROS_NAMESPACE=f"/{name}")

    def stands(self):
        """Whether it has stood for a second."""
        return len(self.odom) > 50 and not any(
            message.twist.twist.linear.x or message.twist.twist.linear.y or message.twist.twist.angular.z
            for message in self.odom[-50:])

    def poses(self):
        """Its way (x, y, yaw) once the example has ended by itself and the robot stands."""
        wait_for(lambda: self.program.poll() is not None and self.stands(), "the end", timeout=90)
        assert self.program.returncode == 0
        start = pose_of(self.odom[0].pose.pose)
        return np.array([between(start, pose_of(message.pose.pose)) for message in self.odom])


class ExamplesTest(NodeTest):
    def check(self, poses, corners, near, end):
        """The way passes each corner [m] within `near` [m], and ends within `end` [m] of its start."""
        for corner in corners:
            self.assertLess(np.linalg.norm(poses[:, :2] - corner, axis=1).min(), near, corner)
        self.assertLess(np.linalg.norm(poses[-1, :2]), end)

    def test_ctrl_c_sends_a_zero(self):
        commands = self.listen("/cut/cmd_vel", Twist)
        robot = Robot(self, "cut", "square")
        wait_for(lambda: commands and commands[-1].linear.x > 0.1, "a drive")
        robot.program.send_signal(signal.SIGINT)
        wait_for(lambda: robot.program.poll() is not None, "the end of it")
        wait_for(lambda: commands[-1] == Twist(), "a zero")

    def test_each(self):
        robots = {name: Robot(self, name) for name in ("square", "square_by_odometry", "follow_path", "keep_distance")}
        keeper, scans = robots.pop("keep_distance"), self.publisher("/keep_distance/scan", LaserScan)
        gap = lambda: WALL - keeper.odom[-1].pose.pose.position.x  # noqa: E731
        wait_for(lambda: scans.publish(LaserScan(range_max=4.0, ranges=[gap()])) or
                 (abs(gap() - 0.5) < 0.03 and keeper.stands()), "half a metre to the wall", period=0.1)
        keeper.program.send_signal(signal.SIGINT)
        wait_for(lambda: keeper.program.poll() is not None, "the end of it")
        self.check(robots["square"].poses(), [(0.5, 0.0), (0.5, 0.5), (0.0, 0.5)], 0.15, 0.2)
        poses = robots["square_by_odometry"].poses()
        self.check(poses, [(0.5, 0.0), (0.5, 0.5), (0.0, 0.5)], 0.08, 0.08)
        self.assertLess(abs(np.sin(poses[-1, 2])), 0.1)
        poses = robots["follow_path"].poses()
        self.check(poses, [(0.6, 0.0), (0.9, 0.3), (0.6, 0.6), (0.0, 0.6)], 0.06, 0.03)
        self.assertLess(np.abs(poses[:, 2]).max(), 0.05)


if __name__ == "__main__":
    rostest.rosrun("robotont_demo", "examples_test", ExamplesTest)
