#!/usr/bin/env python3
"""goto: goals that are cancelled, by hand, after a time, or by another goal."""

import os
import signal
from unittest import mock

import rostest
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from geometry_msgs.msg import Twist
from goto_test import GotoTest

from robotont_map_navigation.goal import Goal
from robotont_map_navigation.goto import GOING_ON, GoTo
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

    def test_a_cancellation_that_overtakes_its_goal_ends_the_goal_before_it_too(self):
        self.start_server("", repeat=True)
        statuses = self.listen("/move_base/status", GoalStatusArray)
        goto = GoTo("map", lambda _line: None)
        self.assertTrue(goto.wait_for_server(20.0))
        goto.send(Goal(2.0, 2.0, 0.0))
        wait_for(self.moving, "motion")
        on_the_way = []
        goals = goto._client.action_client.manager
        with mock.patch.object(goals, "send_goal_fn", on_the_way.append):
            goto.send(Goal(3.0, 3.0, 0.0))
            goto.leave(cancel=True)
        recalled = wait_for(lambda: [status for status in statuses[-1].status_list
                                     if status.status == GoalStatus.RECALLING], "the cancellation of an unknown goal")
        self.assertEqual(recalled[0].goal_id.id, on_the_way[0].goal_id.id)
        goals.send_goal_fn(on_the_way[0])
        wait_for(lambda: not any(status.status in GOING_ON for status in statuses[-1].status_list),
                 "the end of both goals")

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
