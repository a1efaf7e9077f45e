#!/usr/bin/env python3
"""goto, as a user runs it, against a stand-in for move_base."""

import os
import signal

import actionlib
import numpy as np
import rostest
from move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback

from robotont_driver.kinematics.se2 import pose_of
from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest


class GotoTest(NodeTest):
    """`server` stands in for move_base, and pursues a goal until it is cancelled."""

    def pursue(self, goal):
        """Called with the goal, in a thread of its own."""
        self.goal = goal.target_pose
        self.server.publish_feedback(MoveBaseFeedback(base_position=self.goal))
        wait_for(self.server.is_preempt_requested, "the cancellation", 60.0)
        self.server.set_preempted()

    def test_ctrl_c_cancels_the_goal(self):
        self.server = actionlib.SimpleActionServer("move_base", MoveBaseAction, self.pursue, auto_start=False)
        self.server.start()
        log = self.processes.folder / "goto"
        goto = self.processes.start(places.program("robotont_map_navigation", "goto"), "2", "-2.2", "1.2", log=log)
        wait_for(lambda: " to go" in log.read_text(), "a line of progress")
        self.assertEqual(self.goal.header.frame_id, "map")
        np.testing.assert_allclose(pose_of(self.goal.pose), (2.0, -2.2, 1.2))
        os.killpg(goto.pid, signal.SIGINT)
        wait_for(lambda: goto.poll() is not None, "the end of goto", 30.0)
        words = log.read_text()
        self.assertIn("going to (2.00, -2.20, 1.20)\n", words)
        self.assertEqual((goto.returncode, words.splitlines()[-1]), (130, "interrupted; the goal is cancelled"))
        wait_for(lambda: not self.server.is_active(), "the end of the goal")


if __name__ == "__main__":
    rostest.rosrun("robotont_map_navigation", "goto", GotoTest)
