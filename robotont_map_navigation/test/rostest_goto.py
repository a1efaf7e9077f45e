#!/usr/bin/env python3
"""goto: goals that are reached, given up or refused, and servers that are not there or die."""

import os
import re
import signal

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import TransformStamped
from goto_test import GotoTest
from move_base_msgs.msg import MoveBaseActionGoal
from nav_msgs.msg import OccupancyGrid
from tf2_msgs.msg import TFMessage

from robotont_testing.harness import wait_for


class GoalsTest(GotoTest):
    def test_reached(self):
        self.use("/late")
        goals = self.listen("/late/move_base/goal", MoveBaseActionGoal)
        goto = self.start_goto("2", "-2.2", "1.2", "--frame", "odom")
        wait_for(lambda: "waiting for" in self.log.read_text(), "words about waiting")
        self.start_server("/late", hurry=4.0)
        status, lines = self.end(goto)
        self.assertEqual(status, 0, lines)
        self.assertEqual(lines[:2], [f"waiting for {self.space}/move_base", "going to (2.00, -2.20, 1.20) in odom"])
        self.assertRegex(lines[-1], r"^reached \(2.00, -2.20, 1.20\) after [23]\.\d s, within")
        self.assertTrue(any("m and" in line and "to go" in line for line in lines[2:-1]), lines)
        target = goals[0].goal.target_pose
        self.assertEqual(target.header.frame_id, "odom")
        self.assertEqual((target.pose.position.x, target.pose.position.y), (2.0, -2.2))
        self.assertAlmostEqual(target.pose.orientation.z, 0.5646425, places=6)  # sin(0.6)
        self.assertAlmostEqual(target.pose.orientation.w, 0.8253356, places=6)
        self.assertEqual(len(goals), 1)

    def test_move_base_gives_up(self):
        status, lines = self.end(self.start_goto("101", "0", "0"))
        self.assertEqual(status, 1, lines)
        self.assertEqual(lines[-1], "move_base gave up (ABORTED): Failed to find a valid plan. "
                                    "Even after executing recovery behaviors")

    def test_no_server(self):
        self.use("/nowhere")
        patient = self.start_goto("2", "2", "0", log="patient")
        status, lines = self.end(self.start_goto("2", "2", "0", "--wait", "1"))
        self.assertEqual(status, 3, lines)
        self.assertEqual(lines[-1], "no /nowhere/move_base after 1 s: is navigation.launch running?")
        self.log = self.processes.folder / "patient"
        self.assertEqual(self.log.read_text(), "waiting for /nowhere/move_base\n")
        os.killpg(patient.pid, signal.SIGINT)
        status, lines = self.end(patient)
        self.assertEqual((status, lines[-1]), (130, "interrupted"))

    def test_the_server_dies(self):
        server = self.start_server("/mortal", repeat=True)
        goto = self.start_goto("2", "2", "0")
        wait_for(self.moving, "motion")
        self.processes.stop(server, signal.SIGKILL)
        status, lines = self.end(goto)
        self.assertEqual(status, 3, lines)
        self.assertEqual(lines[-1], "move_base has not been heard for 3 s: has it died?")

    def test_the_server_dies_and_is_started_again(self):
        server = self.start_server("/respawned", repeat=True)
        goto = self.start_goto("2", "2", "0")
        wait_for(self.moving, "motion")
        self.processes.stop(server, signal.SIGKILL)
        self.start_server("/respawned")
        status, lines = self.end(goto)
        self.assertEqual(status, 3, lines)
        self.assertRegex(lines[-1], r"^move_base died after \d+\.\d s and was started again: send the goal again$")

    def show_map(self, robot):
        """A latched map of two rooms, (0, 0) to (4, 2), without a door; the robot is at x = `robot` [m]."""
        cells = np.zeros((40, 80), np.int8)
        cells[[0, -1]] = cells[:, [0, 40, -1]] = 100
        message = OccupancyGrid(data=cells.ravel().tolist())
        message.header.frame_id = "map"
        message.info.resolution, message.info.width, message.info.height = 0.05, 80, 40
        message.info.origin.orientation.w = 1.0
        transform = TransformStamped()
        transform.header.frame_id, transform.child_frame_id = "map", self.space[1:] + "/base_link"
        transform.transform.translation.x, transform.transform.translation.y = robot, 1.0
        transform.transform.rotation.w = 1.0
        for name, value in (("robot_base_frame", self.space[1:] + "/base_link"), ("robot_radius", 0.15),
                            ("footprint_padding", 0.01)):
            rospy.set_param(f"{self.space}/move_base/global_costmap/{name}", value)
        self.latched = [rospy.Publisher(self.space + "/map", OccupancyGrid, queue_size=1, latch=True),
                        rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True)]
        for publisher, what in zip(self.latched, (message, TFMessage([transform]))):
            publisher.publish(what)

    def test_a_goal_that_the_map_shows_to_be_out_of_reach_is_refused(self):
        self.start_server("/mapped", repeat=True)
        goals = self.listen("/mapped/move_base/goal", MoveBaseActionGoal)
        self.show_map(robot=1.0)
        for x, y, words in ((9, 1, r"\(9.00, 1.00\) is off the map, which is 4.0 m x 2.0 m large"),
                            (2.02, 1, r"\(2.02, 1.00\) is in a wall of the map"),
                            (1, 0.1, r"\(1.00, 0.10\) is 0.08 m from a wall of the map, and the robot needs 0.16 m"),
                            (3, 1, r"no way from the robot at \(1.00, 1.00\) to \(3.00, 1.00\): walls of the map.*")):
            status, lines = self.end(self.start_goto(str(x), str(y), "0"))
            self.assertEqual(status, 6, lines)
            found = re.fullmatch(rf"refused after (\d\.\d) s: {words}", lines[-1])
            self.assertTrue(found, lines)
            self.assertLess(float(found.group(1)), 1.0)
        self.assertEqual(goals, [])
        self.assertEqual(self.commands, [])
        self.start_goto("1.5", "1", "0")
        wait_for(self.moving, "motion to a goal within reach")


if __name__ == "__main__":
    rostest.rosrun("robotont_map_navigation", "goto", GoalsTest)
