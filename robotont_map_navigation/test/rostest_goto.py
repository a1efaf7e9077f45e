#!/usr/bin/env python3
"""goto, as a user runs it, against a stand-in for move_base."""

import os
import signal
import threading

import actionlib
import numpy as np
import rostest
from move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback

from robotont_driver.kinematics.se2 import pose_of
from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest


class GotoTest(NodeTest):
    """`server` stands in for move_base, and reaches each goal once it `arrives`."""

    def pursue(self, goal):
        """Called with each goal, in a thread of its own."""
        self.goal = goal.target_pose
        self.server.publish_feedback(MoveBaseFeedback(base_position=self.goal))
        wait_for(lambda: self.arrives.is_set() or self.server.is_preempt_requested(), "the goal's end", 60.0)
        if self.server.is_preempt_requested():
            self.server.set_preempted()
        else:
            self.server.set_succeeded()

    def start_goto(self, *words):
        self.goal, self.arrives, self.log = None, threading.Event(), self.processes.folder / "goto"
        return self.processes.start(places.program("robotont_map_navigation", "goto"), *words, log=self.log)

    def end(self, goto):
        """(exit status, lines) of goto when it has ended."""
        wait_for(lambda: goto.poll() is not None, "the end of goto", 30.0)
        return goto.returncode, self.log.read_text().splitlines()

    def test_without_a_server_then_with_one_then_interrupted(self):
        self.assertEqual(self.end(self.start_goto("2", "2", "0", "--patience", "1")), (3, [
            "waiting for /move_base", "no /move_base after 1 s: is navigation.launch running?"]))
        goto = self.start_goto("2", "-2.2", "1.2")
        wait_for(lambda: "waiting for" in self.log.read_text(), "words about waiting")
        self.server = actionlib.SimpleActionServer("move_base", MoveBaseAction, self.pursue, auto_start=False)
        self.server.start()
        wait_for(lambda: " to go" in self.log.read_text(), "a line of progress")
        self.arrives.set()
        status, lines = self.end(goto)
        self.assertEqual((status, lines[1]), (0, "going to (2.00, -2.20, 1.20)"))
        self.assertRegex(lines[-1], r"^reached \(2.00, -2.20, 1.20\) after \d+\.\d s, within")
        self.assertEqual(self.goal.header.frame_id, "map")
        np.testing.assert_allclose(pose_of(self.goal.pose), (2.0, -2.2, 1.2))
        goto = self.start_goto("2", "2", "0")
        wait_for(lambda: self.goal, "the goal")
        os.killpg(goto.pid, signal.SIGINT)
        status, lines = self.end(goto)
        self.assertEqual((status, lines[-1]), (130, "interrupted; the goal is cancelled"))


if __name__ == "__main__":
    rostest.rosrun("robotont_map_navigation", "goto", GotoTest)
