"""A goal that waits, of which move_base knows nothing, beside others who cancel goals and send some; without ROS."""

import threading

import pytest
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus
from move_base_msgs.msg import MoveBaseActionGoal

from robotont_map_navigation import goto_client
from robotont_map_navigation.goal import REPLACED, Goal
from robotont_testing.harness import wait_for


class NoWay:
    """Stands in for actionlib's client: each goal is given up at once."""

    def __init__(self, *_):
        self.sent = 0

    def send_goal(self, _message, done_cb, **_):
        self.sent += 1
        threading.Thread(target=done_cb, args=(None, None), daemon=True).start()

    def get_state(self):
        return GoalStatus.ABORTED

    def get_goal_status_text(self):
        return "no way"


@pytest.mark.parametrize("topic, message, sender, words", [
    ("move_base/cancel", GoalID(), "/page", "cancelled by /page, while it waited"),
    ("move_base/goal", MoveBaseActionGoal(), "/page", "replaced by a goal of /page, while it waited"),
    ("move_base/cancel", GoalID(id="of another goal"), "/page", ""),
    ("move_base/cancel", GoalID(), "/goto", ""),
    ("move_base/goal", MoveBaseActionGoal(), "/goto", ""),
])
def test_a_goal_that_waits_is_not_sent_again_once_somebody_has_cancelled_all_or_sent_another(
        monkeypatch, topic, message, sender, words):
    hear = {}
    monkeypatch.setattr(goto_client.actionlib, "SimpleActionClient", NoWay)
    monkeypatch.setattr(rospy, "Subscriber", lambda name, _kind, callback, **_: hear.update({name: callback}))
    monkeypatch.setattr(rospy, "get_name", lambda: "/goto")
    monkeypatch.setattr(rospy.Time, "now", rospy.Time)
    monkeypatch.setattr(goto_client, "goal_id", lambda _client: "own")
    monkeypatch.setattr(goto_client, "AGAIN", 0.3)
    shown, outcomes = [], []
    goto = goto_client.GoTo("map", shown.append)
    going = threading.Thread(target=lambda: outcomes.append(goto.go(Goal(1.0, 1.0, 0.0), 0.0)), daemon=True)
    monkeypatch.setattr(goto, "check", lambda goal: None)
    going.start()
    wait_for(lambda: any(line.startswith("waits") for line in shown), "the goal to wait")
    message._connection_header = {"callerid": sender}
    hear.get(topic, lambda _: None)(message)
    sent = goto._client.sent
    if not words:
        wait_for(lambda: goto._client.sent > sent, "the goal to be sent again")
        goto.leave()
    going.join(10.0)
    assert outcomes[0].status == REPLACED
    assert outcomes[0].words.startswith(words)
    assert not words or goto._client.sent == sent
