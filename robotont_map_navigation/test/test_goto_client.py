"""Why a goal ends, beside others who stop or cancel goals and send some; without ROS."""

import threading
from collections import defaultdict

import pytest
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from move_base_msgs.msg import MoveBaseActionGoal, MoveBaseActionResult
from std_msgs.msg import String

from robotont_map_navigation import goto_client
from robotont_map_navigation.goal import GAVE_UP, LOST, REFUSED, REPLACED, Goal
from robotont_testing.harness import wait_for

GOAL = Goal(1.0, 1.0, 0.0)
STOP = "the emergency stop, pressed by /page: release it, then send the goal again"
ILL = DiagnosticArray(status=[DiagnosticStatus(name="link", level=DiagnosticStatus.ERROR, message="unplugged"),
                              DiagnosticStatus(name="driver", level=DiagnosticStatus.WARN, message="slow")])


class MoveBase:
    """Stands in for the topics and move_base behind them, which ends each goal before its sender goes on."""

    def __init__(self, monkeypatch):
        self.listeners = defaultdict(list)
        self.sent, self.shown = 0, []
        self.after, self.status = 0.0, GoalStatus.ABORTED  # [s] until the result
        self.before = ()  # (topic, message, sender) that come before it
        monkeypatch.setattr(rospy, "Subscriber",
                            lambda topic, _, callback, **__: self.listeners[topic].append(callback))
        monkeypatch.setattr(rospy, "Publisher", lambda *_, **__: self)
        monkeypatch.setattr(rospy, "get_name", lambda: "/goto")
        monkeypatch.setattr(rospy, "get_namespace", lambda: "/")
        monkeypatch.setattr(rospy, "get_param", lambda _name, default: default)
        monkeypatch.setattr(rospy, "get_rostime", rospy.Time)
        monkeypatch.setattr(rospy.Time, "now", rospy.Time)
        monkeypatch.setattr(goto_client, "LOOK_UP", 0.0)
        self.goto = goto_client.GoTo(self.shown.append)

    def hear(self, topic, message, sender="/page"):
        message._connection_header = {"callerid": sender}
        for callback in self.listeners[topic]:
            callback(message)

    def publish(self, message):
        if isinstance(message, GoalID):  # a cancellation
            return
        self.sent += 1
        result = MoveBaseActionResult(status=GoalStatus(message.goal_id, self.status, "no way"))

        def answer():
            for heard in self.before:
                self.hear(*heard)
            self.hear("move_base/result", result)
        timer = threading.Timer(self.after, answer)
        timer.start()
        if not self.after:
            timer.join()


@pytest.fixture
def move_base(monkeypatch):
    monkeypatch.setattr(goto_client, "AGAIN", 0.3)
    return MoveBase(monkeypatch)


@pytest.mark.parametrize("topic, message, end, status, words", [
    ("navigation/held", String("something holds the robot"), GoalStatus.PREEMPTED, GAVE_UP,
     "something holds the robot; the goal is cancelled"),
    ("emergency_stop/pressed_by", String("/page"), GoalStatus.PREEMPTED, REPLACED, "cancelled by " + STOP),
    ("move_base/goal", MoveBaseActionGoal(), GoalStatus.PREEMPTED, REPLACED, "replaced by a goal of /page"),
    ("/diagnostics", ILL, GoalStatus.ABORTED, GAVE_UP, "move_base gave up (ABORTED): no way; link: unplugged"),
    ("localization/trouble", String("a wrong pose"), GoalStatus.PREEMPTED, LOST,
     "the robot does not know where it is, the goal is cancelled: a wrong pose; start relocalize, or set the pose by "
     "RViz' 2D Pose Estimate")])
@pytest.mark.parametrize("after", [0.0, 0.3])
def test_what_ends_a_goal_is_named(move_base, topic, message, end, status, words, after):
    move_base.after, move_base.status, move_base.before = after, end, [(topic, message)]
    assert move_base.goto.go(GOAL, 10.0, patience=0.0) == (status, words)
    if status == LOST:
        assert move_base.goto.go(GOAL, 10.0).status == LOST
        assert move_base.sent == 1


def test_a_goal_is_given_up_after_its_patience(move_base):
    found = move_base.goto.go(GOAL, 10.0, patience=1.0)
    assert found == (GAVE_UP, "move_base gave up (ABORTED): no way")
    assert move_base.sent > 2


@pytest.mark.parametrize("presses", [["/page"], ["/page", ""]])
def test_a_goal_that_is_given_or_checked_during_an_emergency_stop_is_not_what_a_release_begins(
        move_base, monkeypatch, presses):
    monkeypatch.setattr(move_base.goto, "_refusal", lambda _goal: [
        move_base.hear("emergency_stop/pressed_by", String(who)) for who in presses] and None)
    found = move_base.goto.go(GOAL, 1.0)
    assert found.status == REFUSED
    assert found.words.endswith(STOP)
    move_base.hear("emergency_stop/pressed_by", String(""))
    assert move_base.sent == 0
    monkeypatch.undo()
    assert move_base.goto.check(GOAL) is None


@pytest.mark.parametrize("topic, message, sender, words", [
    ("move_base/cancel", GoalID(), "/page", "cancelled by /page"),
    ("move_base/goal", MoveBaseActionGoal(), "/page", "replaced by a goal of /page"),
    ("emergency_stop/pressed_by", String("/page"), "/driver_node", "cancelled by " + STOP),
    ("move_base/cancel", GoalID(id="of another goal"), "/page", ""),
    ("move_base/cancel", GoalID(), "/goto", ""),
    ("move_base/goal", MoveBaseActionGoal(), "/goto", ""),
])
def test_a_goal_that_waits_is_not_sent_again_once_somebody_has_stopped_or_cancelled_all_or_sent_another(
        move_base, topic, message, sender, words):
    outcomes = []
    going = threading.Thread(target=lambda: outcomes.append(move_base.goto.go(GOAL, 0.0)), daemon=True)
    going.start()
    wait_for(lambda: any(line.startswith("waits") for line in move_base.shown), "the goal to wait")
    move_base.hear(topic, message, sender)
    sent = move_base.sent
    if not words:
        wait_for(lambda: move_base.sent > sent, "the goal to be sent again")
        move_base.goto.leave()
    going.join(10.0)
    assert outcomes[0] == (REPLACED, words or "cancelled")
    assert not words or move_base.sent == sent


def test_whatever_ends_the_client_takes_its_goal_back(move_base, monkeypatch):
    cancelled = []
    move_base.after = 1.0

    def show(_words):
        raise BrokenPipeError
    goto = goto_client.GoTo(show)
    monkeypatch.setattr(goto._client.pub_cancel, "publish", cancelled.append, raising=False)
    with pytest.raises(BrokenPipeError):
        goto.go(GOAL, 10.0)
    assert len(cancelled) == 1


def test_what_ails_another_robot_of_the_same_master_is_no_cause(move_base):
    move_base.hear("/diagnostics", DiagnosticArray(status=[
        DiagnosticStatus(name="robot2/serial_com_node: link", hardware_id="robot2", level=DiagnosticStatus.ERROR)]))
    assert move_base.goto.go(GOAL, 10.0, patience=0.0).words == "move_base gave up (ABORTED): no way"
