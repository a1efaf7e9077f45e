#!/usr/bin/env python3
"""goto, as a user runs it, against a stand-in for move_base."""

import os
import signal
from pathlib import Path

import numpy as np
import rostest
from geometry_msgs.msg import Twist
from move_base_msgs.msg import MoveBaseActionGoal

from robotont_driver.kinematics.se2 import pose_of
from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest

DOUBLE = Path(__file__).resolve().parent / "move_base_double.py"


class GotoTest(NodeTest):
    """Each test has a server and a namespace of its own, so that nothing of it is left to others."""

    def start_server(self, space, seconds="inf"):
        self.processes.start(DOUBLE, f"__ns:={space}", f"_seconds:={seconds}")

    def start_goto(self, space, *words):
        log = self.processes.folder / "goto"
        process = self.processes.start(places.program("robotont_map_navigation", "goto"), *words, f"__ns:={space}",
                                       log=log)
        process.log = log
        return process

    def end(self, process):
        """(exit status, lines) of goto when it has ended."""
        wait_for(lambda: process.poll() is not None, "the end of goto", 30.0)
        self.assertNotIn("Traceback", process.log.read_text())
        return process.returncode, process.log.read_text().splitlines()

    def test_reached(self):
        goals = self.listen("/late/move_base/goal", MoveBaseActionGoal)
        goto = self.start_goto("/late", "2", "-2.2", "1.2")
        wait_for(lambda: "waiting for" in goto.log.read_text(), "words about waiting")
        self.start_server("/late", seconds=3.0)
        status, lines = self.end(goto)
        self.assertEqual(status, 0, lines)
        self.assertEqual(lines[:2], ["waiting for /late/move_base", "going to (2.00, -2.20, 1.20)"])
        self.assertRegex(lines[-1], r"^reached \(2.00, -2.20, 1.20\) after ([2-9]|\d\d)\.\d s, within")
        self.assertTrue(any("m and" in line and "to go" in line for line in lines[2:-1]), lines)
        target = goals[0].goal.target_pose
        self.assertEqual(target.header.frame_id, "map")
        np.testing.assert_allclose(pose_of(target.pose), (2.0, -2.2, 1.2))
        self.assertEqual(len(goals), 1)

    def test_no_server(self):
        self.assertEqual(self.end(self.start_goto("/nowhere", "2", "2", "0", "--patience", "1")), (3, [
            "waiting for /nowhere/move_base", "no /nowhere/move_base after 1 s: is navigation.launch running?"]))

    def test_ctrl_c_cancels_the_goal(self):
        commands = self.listen("/ended/cmd_vel", Twist)
        self.start_server("/ended")
        goto = self.start_goto("/ended", "2", "2", "0")
        wait_for(lambda: any(message.linear.x for message in commands), "motion")
        os.killpg(goto.pid, signal.SIGINT)
        status, lines = self.end(goto)
        self.assertEqual((status, lines[-1]), (130, "interrupted; the goal is cancelled"))
        self.assertEqual(commands[-1], Twist())


if __name__ == "__main__":
    rostest.rosrun("robotont_map_navigation", "goto", GotoTest)
