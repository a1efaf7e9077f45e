#!/usr/bin/env python3
"""goto: goals that are cancelled, by hand, after a time, or by another goal."""

import os
import signal

import rostest
from geometry_msgs.msg import Twist
from goto_test import GotoTest

from robotont_testing.harness import wait_for


class CancelledTest(GotoTest):
    def check_interruption(self, how):
        goto = self.start_goto("2", "2", "0")
        wait_for(self.moving, "motion")
        os.killpg(goto.pid, how)
        status, lines = self.end(goto)
        self.assertEqual(status, 130, lines)
        self.assertEqual(lines[-1], "interrupted; the goal is cancelled")
        wait_for(lambda: self.commands[-1] == Twist(), "a zero Twist")
        moved = max(number for number, message in enumerate(self.commands) if message != Twist())
        self.assertEqual(len(self.commands) - moved, 2)  # one zero Twist, and nothing after it

    def test_ctrl_c_cancels(self):
        self.check_interruption(signal.SIGINT)

    def test_kill_cancels(self):
        self.check_interruption(signal.SIGTERM)

    def test_too_long(self):
        status, lines = self.end(self.start_goto("2", "2", "0", "--timeout", "1"))
        self.assertEqual(status, 5, lines)
        self.assertEqual(lines[-1], "not there after 1 s; the goal is cancelled")

    def test_a_move_base_that_does_not_hear_of_the_cancellation_at_once(self):
        self.start_server("/deaf", repeat=True, deaf=7.0)
        status, lines = self.end(self.start_goto("2", "2", "0", "--timeout", "1"))
        self.assertEqual((status, lines[-1]), (5, "not there after 1 s; the goal is cancelled"))
        self.assertTrue(any("s  cancelled; not confirmed yet" in line for line in lines), lines)

    def test_a_move_base_that_never_confirms_and_one_who_does_not_wait_for_it(self):
        self.start_server("/deafer", repeat=True, deaf=1000.0)
        hasty = self.start_goto("2", "2", "0", "--timeout", "1", log="hasty")
        self.log = self.processes.folder / "hasty"
        wait_for(lambda: "not confirmed yet" in self.log.read_text(), "words about the cancellation")
        os.killpg(hasty.pid, signal.SIGINT)
        words = "not there after 1 s; cancelled, but move_base has not confirmed it within {} s: the robot may " \
                "still move"
        status, lines = self.end(hasty, 5.0)
        self.assertEqual(status, 5, lines)
        self.assertRegex(lines[-1], words.format("[1-5]"))
        status, lines = self.end(self.start_goto("2", "2", "0", "--timeout", "1"), 60.0)
        self.assertEqual((status, lines[-1]), (5, words.format(20)))

    def test_another_goal_takes_its_place(self):
        first = self.start_goto("2", "2", "0")
        wait_for(self.moving, "motion")
        second = self.start_goto("3", "3", "0", log="second")
        self.log = self.processes.folder / "goto"
        status, lines = self.end(first)
        self.assertEqual(status, 4, lines)
        self.assertIn("another goal took its place", lines[-1])
        self.assertIsNone(second.poll())


if __name__ == "__main__":
    rostest.rosrun("robotont_map_navigation", "goto_cancelled", CancelledTest)
