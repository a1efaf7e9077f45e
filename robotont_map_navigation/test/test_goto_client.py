"""Why a goal ends, beside others who stop or cancel goals and send some; without ROS and its time."""

import math
from unittest.mock import Mock

import pytest
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from move_base_msgs.msg import MoveBaseActionResult
from navigation_messages import TimedBus, grid, walled
from std_msgs.msg import String

from robotont_map_navigation.goal import Goal, Status
from robotont_map_navigation.goto_client import LOOK, TURN, GoTo

GOAL = Goal(1.0, 1.0, 0.0)
STOP = "the emergency stop, pressed by /page: release it, then send the goal again"
ILL = DiagnosticArray(status=[DiagnosticStatus(name="link", level=DiagnosticStatus.ERROR, message="unplugged"),
                              DiagnosticStatus(name="driver", level=DiagnosticStatus.WARN, message="slow")])


class MoveBase(TimedBus):
    """Stands in for move_base, too, which ends each goal before its sender goes on, or later."""

    def __init__(self, monkeypatch):
        super().__init__(monkeypatch)
        self.shown, self.cancelled = [], []
        self.after, self.status = 0.0, GoalStatus.ABORTED  # [s] until the result
        self.others = []  # goals of other clients that it pursues
        self.before = ()  # (topic, message) that come before it
        self.obeys = self.lives = True  # a cancellation; and says so
        self.goto = GoTo(self.shown.append)
        self.hear("emergency_stop/pressed_by", String(""))

    @property
    def goals(self):
        """Ids of the goals that were sent."""
        return [message.goal_id.id for message in self.sent["move_base/goal"]]

    def sleep(self, seconds):
        super().sleep(seconds)
        if self.lives:
            self.hear("move_base/status", GoalStatusArray(status_list=self.others))

    def publish(self, topic, message):
        super().publish(topic, message)
        if topic == "move_base/goal":
            self.later(self.after, self.end, message.goal_id, self.status, self.before)
            super().sleep(0.0)
        elif topic == "move_base/cancel":
            self.cancelled.append(message.id)
            if self.obeys:
                self.end(message, GoalStatus.PREEMPTED)

    def end(self, goal, status, before=()):
        for heard in before:
            self.hear(*heard)
        self.hear("move_base/result", MoveBaseActionResult(status=GoalStatus(goal, status, "no way")))


@pytest.fixture
def move_base(monkeypatch):
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
    assert move_base.goto.go(GOAL, patience=0.0) == (status, words)
    if status == Status.LOST:
        assert move_base.goto.go(GOAL).status == Status.LOST
        assert len(move_base.goals) == 1


@pytest.mark.parametrize("lives, obeys, status, words", [
    (True, True, Status.GAVE_UP,
     "got nowhere for 2 s: does something stand in the way, or on the goal? the goal is cancelled; link: unplugged"),
    (True, False, Status.GAVE_UP, "got nowhere for 2 s: does something stand in the way, or on the goal? "
     "cancelled, but move_base has not confirmed it within 5 s: the robot may still move"),
    (False, False, Status.NOT_THERE, "move_base has not been heard for 3 s: has it died?")])
def test_a_goal_ends_where_the_robot_gets_nowhere_or_move_base_is_not_heard(move_base, lives, obeys, status, words):
    move_base.after, move_base.lives, move_base.obeys = 60.0, lives, obeys
    move_base.hear("/diagnostics", ILL)
    assert move_base.goto.go(GOAL, patience=2.0 if lives else 60.0) == (status, words)
    assert move_base.cancelled == ["", *move_base.goals]


def test_a_goal_where_the_map_has_no_room_is_never_sent(move_base):
    """In a room, (0, 0) to (4, 2) [m]."""
    move_base.hear("map", grid(walled(40, 80)))
    words = "refused: (1.00, 0.10) is 0.08 m from a wall of the map, and the robot needs 0.16 m"
    assert move_base.goto.go(Goal(1.0, 0.1, 0.0)) == (Status.REFUSED, words)
    assert move_base.goals == []
    assert move_base.goto.check(Goal(1.5, 1.0, 0.0)) is None


def test_a_goal_is_given_up_after_its_patience(move_base):
    assert move_base.goto.go(GOAL, patience=1.0) == (Status.GAVE_UP, "move_base gave up (ABORTED): no way")
    assert len(move_base.goals) > 2


@pytest.mark.parametrize("seconds, status", [(3.0, Status.REPLACED), (60.0, Status.GAVE_UP)])
def test_a_robot_that_waits_turns_around_now_and_then_to_see_whether_its_way_is_free(move_base, seconds, status):
    """Until an emergency stop is pressed, so long after the turn has begun, or once around."""
    sent = []

    def press_later(words):
        if words == "looks around":
            sent.append(len(move_base.goals))
            move_base.later(seconds, move_base.hear, "emergency_stop/pressed_by", String("/page"))
    move_base.goto._show = press_later
    assert move_base.goto.go(GOAL, patience=LOOK + 2.0).status == status
    turns = [message.angular.z for message in move_base.sent["cmd_vel/navigation"]]
    assert 0.1 * sum(turns) == pytest.approx(min(TURN * seconds, 2 * math.pi), abs=0.2)
    assert turns.index(0.0) == len(turns) - 1
    assert move_base.now < 103.0 + 2 * LOOK + 2 * math.pi / TURN
    assert (len(move_base.goals) > sent[0] > 10) == (status == Status.GAVE_UP), "what it has seen is tried"


@pytest.mark.parametrize("when", ["waits, 3 of 60 s: move_base gave up (ABORTED): no way", "looks around"])
@pytest.mark.parametrize("cancelled", [False, True])
def test_a_goal_that_waits_neither_turns_the_robot_nor_comes_back_once_somebody_cancels_it_or_sends_one(
        move_base, when, cancelled):
    def another(words):
        if words == when and cancelled:
            move_base.hear("move_base/cancel", GoalID(id="another's"))
            move_base.later(1.0, move_base.hear, "move_base/cancel", GoalID())
        elif words == when:
            move_base.later(1.0, move_base.others.append, GoalStatus(GoalID(id="another"), GoalStatus.ACTIVE, ""))
    move_base.goto._show = another
    assert move_base.goto.go(GOAL).status == Status.REPLACED
    assert move_base.now < 112.0
    assert len(move_base.sent["cmd_vel/navigation"]) < 15
    assert move_base.cancelled == []


@pytest.mark.parametrize("presses", [["/page"], ["/page", ""]])
@pytest.mark.parametrize("given", [0.95, 1.05])
def test_a_goal_that_is_given_or_checked_during_an_emergency_stop_is_not_what_a_release_begins(
        move_base, presses, given):
    for number, who in enumerate(presses):
        move_base.later(1.0 + 0.1 * number, move_base.hear, "emergency_stop/pressed_by", String(who))
    move_base.sleep(given)
    assert move_base.goto.go(GOAL) == (Status.REFUSED, "refused: " + STOP)
    move_base.hear("emergency_stop/pressed_by", String(""))
    assert move_base.goals == []
    assert move_base.goto.check(GOAL) is None


def test_a_goto_that_has_just_started_hears_first_who_presses_the_emergency_stop(move_base):
    move_base.goto._pressed_by = None
    move_base.later(0.8, move_base.hear, "emergency_stop/pressed_by", String("/page"))
    assert move_base.goto.go(GOAL) == (Status.REFUSED, "refused: " + STOP)


@pytest.mark.parametrize("presses", [["/page"], ["/page", ""]])
def test_a_stop_ends_a_goal_that_waits_also_where_it_has_just_been_sent_again(move_base, presses):
    """move_base has not ended the newest one, nor heard of the stop."""
    move_base.after = 0.4
    for who in presses:
        move_base.later(2.6, move_base.hear, "emergency_stop/pressed_by", String(who))
    assert move_base.goto.go(GOAL) == (Status.REPLACED, "cancelled by " + STOP)
    assert move_base.shown[-1].startswith("waits")
    assert move_base.cancelled == ["", move_base.goals[-1]]


def test_a_goal_that_waits_says_why_and_goes_on_by_itself(move_base):
    move_base.hear("/diagnostics", ILL)
    move_base.later(2.0, setattr, move_base, "status", GoalStatus.SUCCEEDED)
    assert move_base.goto.go(GOAL).status == Status.DONE
    assert "waits, 0 of 60 s: link: unplugged" in move_base.shown


@pytest.mark.parametrize("after", [0.0, 60.0])
@pytest.mark.parametrize("cancel", [False, True])
def test_a_goal_is_not_sent_again_nor_waited_for_once_it_is_left(move_base, after, cancel):
    def leave():
        move_base.goto.leave(cancel)
        move_base.later(0.0, sent.extend, move_base.goals)
    move_base.after, sent = after, []
    move_base.later(2.2, leave)
    move_base.goto.go(GOAL)
    assert move_base.goals == sent
    assert move_base.now < 103.0
    assert bool(move_base.cancelled) == cancel


def test_whatever_ends_the_client_takes_its_goal_back(move_base):
    move_base.after, move_base.goto._show = 1.0, Mock(side_effect=BrokenPipeError)
    with pytest.raises(BrokenPipeError):
        move_base.goto.go(GOAL)
    assert move_base.cancelled == ["", *move_base.goals]


@pytest.mark.parametrize("name, robot", [("robot2/serial_com_node: link", "robot2"), ("fleet_node: fleet", "robotont"),
                                         ("recorder_node: black box", "robotont")])
def test_what_ails_another_robot_or_what_navigation_does_not_need_is_no_cause(move_base, name, robot):
    move_base.hear("/diagnostics", DiagnosticArray(status=[
        DiagnosticStatus(name=name, hardware_id=robot, level=DiagnosticStatus.ERROR)]))
    assert move_base.goto.go(GOAL, patience=0.0).words == "move_base gave up (ABORTED): no way"
