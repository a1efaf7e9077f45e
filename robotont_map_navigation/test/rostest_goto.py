#!/usr/bin/env python3
"""goto, as a user runs it, against a stand-in for move_base: every end that a goal can have."""

import itertools
import os
import re
import signal
import sys
from pathlib import Path
from unittest import mock

import numpy as np
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist
from move_base_msgs.msg import MoveBaseActionGoal
from navigation_messages import grid, latched, walled

from robotont_driver.kinematics.se2 import pose_of
from robotont_map_navigation.goal import Goal
from robotont_map_navigation.goto_client import GOING_ON, GoTo
from robotont_testing import places
from robotont_testing.harness import Processes, wait_for
from robotont_testing.node_test import ERROR, NodeTest

DOUBLE = Path(__file__).resolve().parent / "move_base_double.py"
SHARED = "/shared"  # namespace of the one stand-in that drives on until its goal is cancelled


class Goto(NodeTest):
    """Tests that end their server have a namespace of their own, so that nothing of it is left to others."""

    numbers = itertools.count()

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.server = Processes()
        cls.server.start(DOUBLE, f"__ns:={SHARED}", log=cls.server.folder / "log")

    @classmethod
    def tearDownClass(cls):
        text = (cls.server.folder / "log").read_text()
        cls.server.close()
        assert "Traceback" not in text, text

    def setUp(self):
        super().setUp()
        self.use(SHARED)

    def use(self, space):
        """Watch a namespace, and run goto in it."""
        self.space = space
        self.commands = self.listen(space + "/cmd_vel", Twist)

    def start_server(self, space, **parameters):
        self.use(space)
        words = [f"_{name}:={value}" for name, value in parameters.items()]
        return self.processes.start(DOUBLE, f"__ns:={space}", *words)

    def start_goto(self, *words):
        log = self.processes.folder / f"goto{next(self.numbers)}"
        process = self.processes.start(places.program("robotont_map_navigation", "goto"), *words, f"__ns:={self.space}",
                                       log=log)
        process.log = log
        return process

    def end(self, process, timeout=30.0):
        """(exit status, lines) of goto when it has ended."""
        wait_for(lambda: process.poll() is not None, "the end of goto", timeout)
        text = process.log.read_text()
        self.assertNotIn("Traceback", text)
        return process.returncode, text.splitlines()

    def start_in_root(self):
        self.server_in_root = self.start_server("")
        goto = GoTo(lambda _line: None)
        self.assertTrue(goto.wait_for_server(20.0))
        return goto

    def moving(self):
        return any(message.linear.x for message in self.commands)


class GotoTest(Goto):
    def test_reached(self):
        self.use("/late")
        goals = self.listen("/late/move_base/goal", MoveBaseActionGoal)
        goto = self.start_goto("2", "-2.2", "1.2")
        wait_for(lambda: "waiting for" in goto.log.read_text(), "words about waiting")
        self.start_server("/late", seconds=3.0)
        status, lines = self.end(goto)
        self.assertEqual(status, 0, lines)
        self.assertEqual(lines[:2], [f"waiting for {self.space}/move_base", "going to (2.00, -2.20, 1.20)"])
        self.assertRegex(lines[-1], r"^reached \(2.00, -2.20, 1.20\) after ([2-9]|\d\d)\.\d s, within")
        self.assertTrue(any("m and" in line and "to go" in line for line in lines[2:-1]), lines)
        target = goals[0].goal.target_pose
        self.assertEqual(target.header.frame_id, "map")
        np.testing.assert_allclose(pose_of(target.pose), (2.0, -2.2, 1.2))
        self.assertEqual(len(goals), 1)

    def test_a_goal_waits_where_the_way_is_barred_says_why_and_goes_on_by_itself(self):
        self.use("/barred")
        ill = DiagnosticStatus(name="barred/serial_com_node: link", level=ERROR, message="unplugged")
        diagnostics = self.publisher("/diagnostics", DiagnosticArray, subscribers=0)
        goto = self.start_goto("2", "-2.2", "1.2")
        self.start_server("/barred", seconds=3.0, barred=3)
        wait_for(lambda: diagnostics.publish(DiagnosticArray(status=[ill])) or goto.poll() is not None, "the goal",
                 timeout=60, period=0.2)
        status, lines = self.end(goto)
        self.assertEqual(status, 0, lines)
        self.assertTrue(any(re.match(r"waits, \d of 60 s: barred/serial_com_node: link: unplugged", line)
                            for line in lines), lines)

    def test_a_cancellation_that_overtakes_its_goal_ends_the_goal_before_it_too(self):
        goto, statuses = self.start_in_root(), self.listen("/move_base/status", GoalStatusArray)
        goto.send(Goal(2.0, 2.0, 0.0))
        wait_for(self.moving, "motion")
        on_the_way = []
        goals = goto._client.manager
        with mock.patch.object(goals, "send_goal_fn", on_the_way.append):
            goto.send(Goal(3.0, 3.0, 0.0))
            goto.leave(cancel=True)
        recalled = wait_for(lambda: [status for status in statuses[-1].status_list
                                     if status.status == GoalStatus.RECALLING], "the cancellation of an unknown goal")
        self.assertEqual(recalled[0].goal_id.id, on_the_way[0].goal_id.id)
        goals.send_goal_fn(on_the_way[0])
        wait_for(lambda: not any(status.status in GOING_ON for status in statuses[-1].status_list),
                 "the end of both goals")


class NightlyGotoTest(Goto):
    """Once a day."""

    def test_no_server(self):
        self.use("/nowhere")
        patient = self.start_goto("2", "2", "0")
        status, lines = self.end(self.start_goto("2", "2", "0", "--wait", "1"))
        self.assertEqual(status, 3, lines)
        self.assertEqual(lines[-1], "no /nowhere/move_base after 1 s: is navigation.launch running?")
        self.assertEqual(patient.log.read_text(), "waiting for /nowhere/move_base\n")
        os.killpg(patient.pid, signal.SIGINT)
        status, lines = self.end(patient)
        self.assertEqual((status, lines[-1]), (130, "interrupted"))

    def test_the_server_dies(self):
        mortal = self.start_server("/mortal")
        goto = self.start_goto("2", "2", "0")
        wait_for(self.moving, "motion")
        self.processes.stop(mortal, signal.SIGKILL)
        status, lines = self.end(goto)
        self.assertEqual((status, lines[-1]), (3, "move_base has not been heard for 3 s: has it died?"))

    @mock.patch("robotont_map_navigation.goto_client.SILENCE", 60.0)  # a busy machine starts no node within 3 s
    def test_the_server_dies_and_is_started_again(self):
        goto, goal = self.start_in_root(), Goal(2.0, 2.0, 0.0)
        goto.send(goal)
        wait_for(self.moving, "motion")
        self.processes.stop(self.server_in_root, signal.SIGKILL)
        self.start_server("")
        status, words = goto.follow(goal, 0.0)
        self.assertEqual(status, 3)
        self.assertRegex(words, r"^move_base died after \d+\.\d s and was started again: send the goal again$")

    def test_a_goal_that_the_map_shows_to_be_out_of_reach_is_refused(self):
        """Two rooms, (0, 0) to (4, 2) [m], without a door."""
        self.start_server("/mapped")
        goals = self.listen("/mapped/move_base/goal", MoveBaseActionGoal)
        rospy.set_param("/mapped/move_base/global_costmap", {"robot_radius": 0.15, "footprint_padding": 0.01})
        rooms = walled(40, 80)
        rooms[:, 40] = 100
        pose = PoseWithCovarianceStamped()
        pose.pose.pose.position.x = pose.pose.pose.position.y = 1.0
        self.latched = latched("/mapped/map", grid(rooms)), latched("/mapped/amcl_pose", pose)
        for x, y, words in ((1, 0.1, r"\(1.00, 0.10\) is 0.08 m from a wall of the map, and the robot needs 0.16 m"),
                            (3, 1, r"no way from the robot at \(1.00, 1.00\) to \(3.00, 1.00\): walls of the map.*")):
            status, lines = self.end(self.start_goto(str(x), str(y), "0"))
            self.assertEqual(status, 6, lines)
            self.assertRegex(lines[-1], rf"^refused after \d+\.\d s: {words}$")
        self.assertEqual([*goals, *self.commands], [])
        self.start_goto("1.5", "1", "0")
        wait_for(self.moving, "motion to a goal within reach")

    def test_too_long(self):
        status, lines = self.end(self.start_goto("2", "2", "0", "--timeout", "1"))
        self.assertEqual((status, lines[-1]), (5, "not there after 1 s; the goal is cancelled"))

    def test_a_move_base_that_confirms_no_cancellation(self):
        self.start_server("/deaf", deaf=1000.0)
        status, lines = self.end(self.start_goto("2", "2", "0", "--timeout", "1"))
        self.assertEqual((status, lines[-1]), (5, "not there after 1 s; cancelled, but move_base has not confirmed it "
                                               "within 5 s: the robot may still move"))


if __name__ == "__main__":
    rostest.rosrun("robotont_map_navigation", "goto", NightlyGotoTest if "nightly" in sys.argv else GotoTest)
