"""A goal of the page goes out at once or not at all."""

import threading

from robotont_map_navigation.goal import Goal, Outcome, Status
from robotont_teleop.web import newest_goal
from robotont_teleop.web.newest_goal import NewestGoal
from robotont_testing.harness import wait_for


class Client:
    """Stands in for goto's, whose `check` waits for a master, and `follow` for the end."""

    def __init__(self):
        self.master, self.ended, self.checked, self.sent = threading.Event(), threading.Event(), [], []

    def check(self, goal):
        self.checked.append(goal)
        self.master.wait(20.0)

    def send(self, goal):
        self.ended.clear()
        self.sent.append(goal)

    def follow(self, _goal):
        self.ended.wait(20.0)
        return Outcome(Status.DONE, "there")

    def leave(self, cancel=False):
        self.ended.set()


def test_a_goal_that_the_master_has_held_up_is_not_driven_when_it_comes_back(monkeypatch):
    now, client, said = [100.0], Client(), []
    monkeypatch.setattr(newest_goal, "boot_time", lambda: now[0])
    goals = NewestGoal(client, said.append)
    goals.pursue(Goal(1.0, 0.0, 0.0))
    wait_for(lambda: client.checked, "the check")
    now[0] += 15.0
    client.master.set()
    wait_for(lambda: said and "too late" in said[0], "words")
    assert not client.sent
    goals.pursue(Goal(2.0, 0.0, 0.0))
    wait_for(lambda: client.sent, "a goal that is sent now")
    client.ended.set()
    wait_for(lambda: said[1:] == ["there"], "its end")
    assert client.sent == [Goal(2.0, 0.0, 0.0)]


def test_of_many_goals_the_newest_is_pursued_and_one_that_was_taken_back_is_not_sent():
    client, said = Client(), []
    goals = NewestGoal(client, said.append)
    for x in range(4):
        goals.pursue(Goal(float(x), 0.0, 0.0))
        wait_for(lambda: client.checked, "the first check")
    client.master.set()
    wait_for(lambda: client.sent, "a goal")
    assert goals.shown["x"] == 3.0
    client.master.clear()
    goals.pursue(Goal(4.0, 0.0, 0.0))
    wait_for(lambda: client.checked[-1].x == 4.0, "its check")
    goals.cancel()
    client.master.set()
    wait_for(lambda: goals.shown is None, "the end of all goals")
    assert client.sent == [Goal(3.0, 0.0, 0.0)]
    assert not said
