"""Goals of the page: the newest is pursued, and none is shown that is not."""

import threading
import time

from robotont_map_navigation.goal import REPLACED, Goal, Outcome
from robotont_teleop.robot_requests import NewestGoal
from robotont_testing.harness import threads_take_turns, wait_for


class PatientGoTo:
    """Stands in for GoTo: pursues a goal until it is told to leave it."""

    def __init__(self):
        self.sent = []
        self._left = threading.Event()

    def check(self, _goal):
        return None

    def send(self, goal):
        self._left.clear()
        self.sent.append(goal)
        return goal

    def follow(self, _pursuit, _timeout):
        self._left.wait()
        return Outcome(REPLACED, "cancelled")

    def leave(self, cancel=False):
        self._left.set()


def test_a_goal_that_is_cancelled_right_behind_another_leaves_nothing_to_show():
    goto = PatientGoTo()
    newest = NewestGoal(goto, lambda words, good: None)
    with threads_take_turns(1e-6):
        for number in range(300):
            first = Goal(number, 0.0, 0.0)
            newest.pursue(first)
            wait_for(lambda first=first: goto.sent and goto.sent[-1] == first, "the first goal", period=0)
            newest.pursue(Goal(number, 1.0, 0.0))
            for _ in range(number % 30):
                time.sleep(0)  # the other thread's turn: it may be anywhere between the two goals
            newest.cancel()
            wait_for(lambda: newest.shown is None, "nothing to show", timeout=5.0, period=0)
