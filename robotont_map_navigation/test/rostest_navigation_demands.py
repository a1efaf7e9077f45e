#!/usr/bin/env python3
"""What move_base demands of the robot, on the simulator, without move_base."""

import math
import os
import signal
import time
from pathlib import Path

import numpy as np
import rospy
import rostest
import yaml
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from tf2_msgs.msg import TFMessage

from robotont_driver.kinematics.se2 import yaw_of
from robotont_driver.nodes.driver_node import PARAMETERS
from robotont_testing import places
from robotont_testing.harness import Processes, wait_for
from robotont_testing.node_test import NodeTest, twist

DOUBLE = Path(__file__).resolve().parent / "move_base_double.py"
NAVIGATION = places.config("navigation")
CONTROLLER_PERIOD = 1.0 / yaml.safe_load((NAVIGATION / "move_base.yaml").read_text())["controller_frequency"]
PLANNER = yaml.safe_load((NAVIGATION / "dwa_local_planner.yaml").read_text())["DWAPlannerROS"]
TOLERANCE = yaml.safe_load((NAVIGATION / "costmap_common.yaml").read_text())["transform_tolerance"]


def yaw(message):
    return yaw_of(message.pose.pose.orientation)


def speeds(message):
    """(v_x, v_y, omega) of an Odometry."""
    return message.twist.twist.linear.x, message.twist.twist.linear.y, message.twist.twist.angular.z


class NavigationDemandsTest(NodeTest):
    """One simulator for all tests; each begins with a robot at rest."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.robot = Processes()
        cls.robot.launch("simulation.launch", f"port:={cls.robot.folder / 'board'}", log=cls.robot.folder / "log")

    @classmethod
    def tearDownClass(cls):
        text = (cls.robot.folder / "log").read_text()
        cls.robot.close()
        assert "Traceback" not in text, text

    def setUp(self):
        super().setUp()
        self.odom = self.listen("odom", Odometry)
        self.truth = self.listen("ground_truth/odom", Odometry)
        self.command = self.publisher("cmd_vel", Twist)
        wait_for(lambda: self.odom and self.truth, "odometry and ground truth", timeout=60)
        self.drive((0, 0, 0), self.at_rest, "rest")

    def at_rest(self):
        return all(abs(value) < 2e-3 for value in speeds(self.truth[-1]))

    def drive(self, command, until, what):
        """Command as often as move_base does until a condition holds."""
        due = time.monotonic()

        def step():
            nonlocal due
            if time.monotonic() >= due:
                due += CONTROLLER_PERIOD
                self.command.publish(twist(*command))
            return until()
        wait_for(step, what)

    def elapsed(self, messages, first):
        """[s] of stamps since the message number `first`."""
        return (messages[-1].header.stamp - messages[first].header.stamp).to_sec()

    def test_odometry_comes_at_least_ten_times_per_second(self):
        first = len(self.odom) - 1
        wait_for(lambda: self.elapsed(self.odom, first) > 1.0, "a second of odometry")
        gaps = np.diff([message.header.stamp.to_sec() for message in self.odom[first:]])
        self.assertGreater(1 / np.mean(gaps), 40.0)
        self.assertLess(max(gaps), 0.1)

    def test_the_twist_of_the_odometry_is_in_the_base_frame(self):
        start = yaw(self.truth[-1])
        self.drive((0, 0, 1.0), lambda: math.remainder(yaw(self.truth[-1]) - start, math.tau) > 1.5, "a turn")
        self.drive((0, 0, 0), self.at_rest, "rest")
        self.drive((0.3, 0.1, 0), lambda: speeds(self.odom[-1])[0] > 0.28, "the speed forward of the robot")
        self.assertEqual(self.odom[-1].child_frame_id, "base_link")
        self.drive((0.3, 0.1, 0), lambda: np.allclose(speeds(self.odom[-1]), (0.3, 0.1, 0), atol=0.03), "the twist")
        np.testing.assert_allclose(speeds(self.truth[-1]), (0.3, 0.1, 0), atol=0.05)

    def test_the_transform_is_fresher_than_the_tolerance(self):
        ages = []
        self.listen("/tf", TFMessage, lambda message: ages.extend(
            (rospy.Time.now() - each.header.stamp).to_sec() for each in message.transforms
            if each.child_frame_id == "base_link"))
        self.drive((0.2, 0.2, 0.5), lambda: len(ages) > 50, "transforms")
        # what a reader finds just before the next one comes: its age and a period
        stamps = [message.header.stamp.to_sec() for message in self.odom]
        self.assertLess(max(ages) + max(np.diff(stamps)), TOLERANCE)

    def test_small_commands_move_the_base(self):
        self.assertLessEqual(PLANNER["min_vel_trans"], 0.05)
        slow, turn = PLANNER["min_vel_trans"], PLANNER["min_vel_theta"]
        for command in ((slow, 0, 0), (0, slow, 0), (-slow, 0, 0), (0, -slow, 0), (0, 0, turn), (0, 0, -turn)):
            self.drive(command, lambda command=command: np.dot(speeds(self.truth[-1]), command)
                       > 0.8 * np.dot(command, command), f"motion with {command}")
            first = len(self.truth)
            # so slow, the wheels go by jerks
            self.drive(command, lambda first=first: len(self.truth) >= first + 100, "two seconds")
            speed = np.mean([speeds(message) for message in self.truth[first:]], axis=0)
            # a fifth of the command; a robot that starts at 0.05 m/s may turn a little meanwhile
            np.testing.assert_array_less(np.abs(np.subtract(speed, command)), (0.01, 0.01, 0.04))

    def test_at_rest_the_odometry_says_so(self):
        self.assertLessEqual(PLANNER["trans_stopped_vel"], 0.05)
        self.drive((0.3, -0.2, 0.5), lambda: speeds(self.odom[-1])[0] > 0.25, "motion")
        self.drive((0, 0, 0), self.at_rest, "rest")
        first = len(self.odom)
        wait_for(lambda: len(self.odom) > first + 50, "odometry at rest")
        fastest = np.max(np.abs([speeds(message) for message in self.odom[first + 5:]]), axis=0)
        stopped = PLANNER["trans_stopped_vel"], PLANNER["trans_stopped_vel"], PLANNER["theta_stopped_vel"]
        np.testing.assert_array_less(fastest, stopped)

    def test_the_watchdog_is_longer_than_a_control_period_and_stops_the_robot_when_move_base_dies(self):
        default = next(parameter.default for parameter in PARAMETERS if parameter.name == "cmd_timeout")
        timeout = rospy.get_param("driver_node/cmd_timeout", default)
        self.assertGreater(timeout, 2 * CONTROLLER_PERIOD)  # one command may be late
        double = self.processes.start(DOUBLE, "_repeat:=true")
        goto = self.processes.start(places.program("robotont_map_navigation", "goto"), "2", "2", "0")
        wait_for(lambda: math.hypot(*speeds(self.truth[-1])[:2]) > 0.3, "motion")
        self.processes.stop(goto, signal.SIGKILL)  # nobody is left to cancel
        first = len(self.truth)
        self.processes.stop(double, signal.SIGKILL)
        wait_for(lambda: math.hypot(*speeds(self.truth[-1])[:2]) < 0.05, "the stop")
        duration = self.elapsed(self.truth, first)
        self.assertLess(duration, timeout + CONTROLLER_PERIOD + 0.5)  # braking from 0.4 m/s takes 0.3 s

    def test_the_recorded_commands_of_move_base_drive_the_robot_and_one_zero_stops_it(self):
        commands = self.listen("cmd_vel", Twist)
        self.processes.start(DOUBLE)
        log = self.processes.folder / "goto"
        goto = self.processes.start(places.program("robotont_map_navigation", "goto"), "2", "2.2", "1.2", log=log)
        wait_for(lambda: math.hypot(*speeds(self.truth[-1])[:2]) > 0.3, "motion")
        self.assertGreater(abs(speeds(self.truth[-1])[1]), 0.1)  # it strafes
        self.assertNotEqual(commands[-1], Twist())
        os.killpg(goto.pid, signal.SIGINT)
        wait_for(self.at_rest, "rest")
        zeros = len(commands) - max(number for number, message in enumerate(commands) if message != Twist()) - 1
        self.assertEqual(zeros, 1)
        wait_for(lambda: goto.poll() is not None, "the end of goto")
        self.assertEqual(goto.returncode, 130, log.read_text())


if __name__ == "__main__":
    rostest.rosrun("robotont_map_navigation", "navigation_demands", NavigationDemandsTest)
