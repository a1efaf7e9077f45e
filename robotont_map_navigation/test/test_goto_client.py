"""A goal that waits, of which move_base knows nothing, beside others who cancel goals and send some; without ROS."""

import threading
from collections import defaultdict

import pytest
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus
from move_base_msgs.msg import MoveBaseActionGoal, MoveBaseActionResult
from std_msgs.msg import String

from robotont_map_navigation import goto_client
from robotont_map_navigation.goal import REPLACED, Goal
from robotont_testing.harness import wait_for


class NoWay:
    """Stands in for the topics and move_base behind them, which gives each goal up before its sender goes on."""

    def __init__(self, after=0.0):
        self.listeners = defaultdict(list)
        self.sent = 0
        self._after = after  # [s]

    def subscribe(self, topic, _kind, callback, **_):
        self.listeners[topic].append(callback)

    def hear(self, topic, message):
        for callback in self.listeners[topic]:
            callback(message)

    def advertise(self, *_, **__):
        return self

    def publish(self, message):
        self.sent += 1
        result = MoveBaseActionResult(status=GoalStatus(message.goal_id, GoalStatus.ABORTED, "no way"))
        answer = threading.Timer(self._after, self.hear, ("move_base/result", result))
        answer.start()
        if not self._after:
            answer.join()

    def replace(self, monkeypatch):
        """Stand in for rospy and its master."""
        monkeypatch.setattr(rospy, "Subscriber", self.subscribe)
        monkeypatch.setattr(rospy, "Publisher", self.advertise)
        monkeypatch.setattr(rospy, "get_name", lambda: "/goto")
        monkeypatch.setattr(rospy, "get_param", lambda _name, default: default)
        monkeypatch.setattr(rospy, "get_rostime", rospy.Time)
        monkeypatch.setattr(rospy.Time, "now", rospy.Time)


def test_without_patience_move_base_decides(monkeypatch):
    NoWay(after=0.5).replace(monkeypatch)
    goto = goto_client.GoTo("map", lambda _words: None)
    monkeypatch.setattr(goto, "check", lambda goal: None)
    assert goto.go(Goal(1.0, 1.0, 0.0), 10.0, patience=0.0).words.startswith("move_base gave up (ABORTED): no way")


@pytest.mark.parametrize("presses", [["/page"], ["/page", ""]])
def test_a_goal_that_is_given_or_checked_during_an_emergency_stop_is_not_what_a_release_begins(monkeypatch, presses):
    move_base = NoWay()
    move_base.replace(monkeypatch)
    goto = goto_client.GoTo("map", lambda _words: None)
    monkeypatch.setattr(goto, "_refusal", lambda _goal: [
        move_base.hear("emergency_stop/pressed_by", String(who)) for who in presses] and None)
    assert "the emergency stop, pressed by /page" in goto.go(Goal(1.0, 1.0, 0.0), 1.0).words
    move_base.hear("emergency_stop/pressed_by", String(""))
    assert move_base.sent == 0
    monkeypatch.setattr(goto, "_refusal", lambda _goal: None)
    assert goto.check(Goal(1.0, 1.0, 0.0)) is None


@pytest.mark.parametrize("topic, message, sender, words", [
    ("move_base/cancel", GoalID(), "/page", "cancelled by /page, while it waited"),
    ("move_base/goal", MoveBaseActionGoal(), "/page", "replaced by a goal of /page, while it waited"),
    ("move_base/cancel", GoalID(id="of another goal"), "/page", ""),
    ("move_base/cancel", GoalID(), "/goto", ""),
    ("move_base/goal", MoveBaseActionGoal(), "/goto", ""),
])
def test_a_goal_that_waits_is_not_sent_again_once_somebody_has_cancelled_all_or_sent_another(
        monkeypatch, topic, message, sender, words):
    move_base = NoWay()
    move_base.replace(monkeypatch)
    monkeypatch.setattr(goto_client, "AGAIN", 0.3)
    shown, outcomes = [], []
    goto = goto_client.GoTo("map", shown.append)
    going = threading.Thread(target=lambda: outcomes.append(goto.go(Goal(1.0, 1.0, 0.0), 0.0)), daemon=True)
    monkeypatch.setattr(goto, "check", lambda goal: None)
    going.start()
    wait_for(lambda: any(line.startswith("waits") for line in shown), "the goal to wait")
    message._connection_header = {"callerid": sender}
    move_base.hear(topic, message)
    sent = move_base.sent
    if not words:
        wait_for(lambda: move_base.sent > sent, "the goal to be sent again")
        goto.leave()
    going.join(10.0)
    assert outcomes[0].status == REPLACED
    assert outcomes[0].words.startswith(words)
    assert not words or move_base.sent == sent
