"""Why a goal ends, beside others who stop or cancel goals and send some; without ROS."""

import threading
from collections import defaultdict

import pytest
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped
from move_base_msgs.msg import MoveBaseActionResult
from navigation_messages import grid, walled
from std_msgs.msg import String

from robotont_map_navigation import goto_client
from robotont_map_navigation.goal import Goal, Status
from robotont_testing.harness import wait_for

GOAL = Goal(1.0, 1.0, 0.0)
STOP = "the emergency stop, pressed by /page: release it, then send the goal again"
ILL = DiagnosticArray(status=[DiagnosticStatus(name="link", level=DiagnosticStatus.ERROR, message="unplugged"),
                              DiagnosticStatus(name="driver", level=DiagnosticStatus.WARN, message="slow")])


class MoveBase:
    """Stands in for the topics and move_base behind them, which ends each goal before its sender goes on."""

    def __init__(self, monkeypatch):
        self.listeners = defaultdict(list)
        self.sent, self.newest, self.shown, self.cancelled = 0, None, [], []
        self.after, self.status = 0.0, GoalStatus.ABORTED  # [s] until the result
        self.before = ()  # (topic, message) that come before it
        self.obeys = True  # a cancellation
        monkeypatch.setattr(rospy, "Subscriber",
                            lambda topic, _, callback, **__: self.listeners[topic].append(callback))
        monkeypatch.setattr(rospy, "Publisher", lambda *_, **__: self)
        monkeypatch.setattr(rospy, "get_namespace", lambda: "/")
        monkeypatch.setattr(rospy, "get_param", lambda name, default: 0.16 if "radius" in name else default)
        monkeypatch.setattr(rospy, "get_rostime", rospy.Time)
        monkeypatch.setattr(rospy.Time, "now", rospy.Time)
        monkeypatch.setattr(goto_client, "LOOK_UP", 0.0)
        self.goto = goto_client.GoTo(self.shown.append)

    def hear(self, topic, message):
        for callback in self.listeners[topic]:
            callback(message)

    def publish(self, message):
        if isinstance(message, GoalID):
            self.cancelled.append(message.id)
            if self.obeys:
                end = GoalStatus(message, GoalStatus.PREEMPTED, "")
                self.hear("move_base/result", MoveBaseActionResult(status=end))
            return
        self.sent, self.newest = self.sent + 1, message.goal_id.id
        result = MoveBaseActionResult(status=GoalStatus(message.goal_id, self.status, "no way"))

        def answer():
            for heard in self.before:
                self.hear(*heard)
            self.hear("move_base/result", result)
        timer = threading.Timer(self.after, answer)
        timer.daemon = True
        timer.start()
        if not self.after:
            timer.join()


@pytest.fixture
def move_base(monkeypatch):
    monkeypatch.setattr(goto_client, "AGAIN", 0.3)
    return MoveBase(monkeypatch)


@pytest.mark.parametrize("topic, message, end, status, words", [
    ("navigation/held", String("something holds the robot"), GoalStatus.PREEMPTED, Status.GAVE_UP,
     "something holds the robot; the goal is cancelled"),
    ("emergency_stop/pressed_by", String("/page"), GoalStatus.PREEMPTED, Status.REPLACED, "cancelled by " + STOP),
    ("/diagnostics", ILL, GoalStatus.ABORTED, Status.GAVE_UP, "move_base gave up (ABORTED): no way; link: unplugged"),
    ("localization/trouble", String("a wrong pose"), GoalStatus.PREEMPTED, Status.LOST,
     "the robot does not know where it is, the goal is cancelled: a wrong pose; start relocalize, or set the pose by "
     "RViz' 2D Pose Estimate")])
@pytest.mark.parametrize("after", [0.0, 0.3])
def test_what_ends_a_goal_is_named(move_base, topic, message, end, status, words, after):
    move_base.after, move_base.status, move_base.before = after, end, [(topic, message)]
    assert move_base.goto.go(GOAL, 10.0, patience=0.0) == (status, words)
    if status == Status.LOST:
        assert move_base.goto.go(GOAL, 10.0).status == Status.LOST
        assert move_base.sent == 1


@pytest.mark.parametrize("obeys, words", [
    (True, "the goal is cancelled"),
    (False, "cancelled, but move_base has not confirmed it within 0.1 s: the robot may still move")])
def test_a_goal_ends_after_its_timeout_and_says_whether_move_base_confirms_it(move_base, monkeypatch, obeys, words):
    monkeypatch.setattr(goto_client, "CANCELLING", 0.1)
    move_base.after, move_base.obeys = 60.0, obeys
    assert move_base.goto.go(GOAL, 0.5) == (Status.TOO_LONG, "not there after 0.5 s; " + words)


def test_a_move_base_that_is_not_heard_any_more_ends_the_goal(move_base, monkeypatch):
    monkeypatch.setattr(goto_client, "SILENCE", 0.3)
    move_base.after = 60.0
    assert move_base.goto.go(GOAL, 10.0) == (Status.NOT_THERE, "move_base has not been heard for 0.3 s: has it died?")
    assert move_base.cancelled == [move_base.newest]


@pytest.mark.parametrize("x, y, words", [
    (1.0, 0.1, "refused: (1.00, 0.10) is 0.08 m from a wall of the map, and the robot needs 0.16 m"),
    (3.0, 1.0, "refused: no way from the robot at (1.00, 1.00) to (3.00, 1.00): walls of the map, or gaps narrower "
     "than 0.32 m, lie between them")])
def test_a_goal_that_the_map_shows_to_be_out_of_reach_is_never_sent(move_base, x, y, words):
    """Two rooms, (0, 0) to (4, 2) [m], without a door."""
    rooms, pose = walled(40, 80), PoseWithCovarianceStamped()
    rooms[:, 40] = 100
    pose.pose.pose.position.x = pose.pose.pose.position.y = 1.0
    move_base.hear("map", grid(rooms))
    move_base.hear("amcl_pose", pose)
    assert move_base.goto.go(Goal(x, y, 0.0), 10.0) == (Status.REFUSED, words)
    assert move_base.sent == 0
    assert move_base.goto.check(Goal(1.5, 1.0, 0.0)) is None


def test_a_goal_is_given_up_after_its_patience(move_base):
    found = move_base.goto.go(GOAL, 10.0, patience=1.0)
    assert found == (Status.GAVE_UP, "move_base gave up (ABORTED): no way")
    assert move_base.sent > 2


@pytest.mark.parametrize("presses", [["/page"], ["/page", ""]])
def test_a_goal_that_is_given_or_checked_during_an_emergency_stop_is_not_what_a_release_begins(
        move_base, monkeypatch, presses):
    monkeypatch.setattr(move_base.goto, "_refusal", lambda _goal: [
        move_base.hear("emergency_stop/pressed_by", String(who)) for who in presses] and None)
    found = move_base.goto.go(GOAL, 1.0)
    assert found.status == Status.REFUSED
    assert found.words.endswith(STOP)
    move_base.hear("emergency_stop/pressed_by", String(""))
    assert move_base.sent == 0
    monkeypatch.undo()
    assert move_base.goto.check(GOAL) is None


def waiting(move_base):
    """(thread, outcomes) of a goal that waits."""
    outcomes = []
    going = threading.Thread(target=lambda: outcomes.append(move_base.goto.go(GOAL, 0.0)), daemon=True)
    going.start()
    wait_for(lambda: any(line.startswith("waits") for line in move_base.shown), "the goal to wait")
    return going, outcomes


@pytest.mark.parametrize("presses", [["/page"], ["/page", ""]])
def test_a_stop_ends_a_goal_that_waits_also_where_it_has_just_been_sent_again(move_base, presses):
    going, outcomes = waiting(move_base)
    move_base.after = 5.0  # [s] move_base has not ended the newest one, nor heard of the stop
    wait_for(lambda: move_base.sent > 2, "the next try")
    for who in presses:
        move_base.hear("emergency_stop/pressed_by", String(who))
    going.join(4.0)
    assert outcomes == [(Status.REPLACED, "cancelled by " + STOP)]
    assert move_base.newest in move_base.cancelled


def test_a_goal_that_waits_is_not_sent_again_once_it_is_left(move_base):
    going, _ = waiting(move_base)
    move_base.goto.leave()
    sent = move_base.sent
    going.join(4.0)
    assert (going.is_alive(), move_base.sent) == (False, sent)


def test_a_goal_on_its_way_is_not_waited_for_once_it_is_left(move_base):
    move_base.after = 60.0
    going = threading.Thread(target=lambda: move_base.goto.go(GOAL, 0.0), daemon=True)
    going.start()
    wait_for(lambda: move_base.sent, "the goal")
    move_base.goto.leave()
    going.join(2.0)  # [s] less than SILENCE, which would end it too
    assert not going.is_alive()


def test_whatever_ends_the_client_takes_its_goal_back(move_base, monkeypatch):
    move_base.after = 1.0

    def show(_words):
        raise BrokenPipeError
    monkeypatch.setattr(move_base.goto, "_show", show)
    with pytest.raises(BrokenPipeError):
        move_base.goto.go(GOAL, 10.0)
    assert move_base.cancelled == [move_base.newest]


def test_what_ails_another_robot_of_the_same_master_is_no_cause(move_base):
    move_base.hear("/diagnostics", DiagnosticArray(status=[
        DiagnosticStatus(name="robot2/serial_com_node: link", hardware_id="robot2", level=DiagnosticStatus.ERROR)]))
    assert move_base.goto.go(GOAL, 10.0, patience=0.0).words == "move_base gave up (ABORTED): no way"
