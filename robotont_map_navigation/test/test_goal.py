import math

import pytest
import rospy
from geometry_msgs.msg import PoseStamped
from navigation_messages import TimedBus

from robotont_map_navigation.arrival import ARRIVED, STAYS, Arrival
from robotont_map_navigation.goal import Goal, Status, outcome
from robotont_map_navigation.goto import parse_arguments

GOAL = Goal(8.0, 8.0, 1.57)


def test_arguments_are_read_and_negative_numbers_are_no_options():
    options = parse_arguments(["1000", "-1e-3", "-6.2831853", "--patience", "0"])
    assert (options.x, options.y, options.yaw, options.patience) == (1000.0, -0.001, -6.2831853, 0.0)


@pytest.mark.parametrize("words, fault", [
    (["eight", "2", "0"], "argument x: found 'eight', allowed: a number from -1000 to 1000 [m]"),
    (["2", "nan", "0"], "argument y: found 'nan'"), (["1001", "2", "0"], "argument x: found '1001'"),
    (["2", "2", "90"], "argument yaw: found '90', allowed: a number from -6.28 to 6.28 [rad], not degrees"),
    (["2", "2", "0", "--patience", "-1"], "argument --patience: found '-1', allowed: a number from 0 to 1000000 [s]"),
])
def test_wrong_arguments_end_with_status_2_and_what_is_allowed(capsys, words, fault):
    with pytest.raises(SystemExit) as raised:
        parse_arguments(words)
    assert raised.value.code == 2
    assert fault in capsys.readouterr().err


@pytest.mark.parametrize("state, text, pose, status, words", [
    ("SUCCEEDED", "Goal reached.", (8.03, 8.04, 1.5), Status.DONE,
     "reached (8.00, 8.00, 1.57) after 31.2 s, within 0.05 m and 0.07 rad"),
    ("SUCCEEDED", "Goal reached.", (8.18, 8.0, 1.57), Status.NEAR,
     "as near as possible to (8.00, 8.00, 1.57) after 31.2 s: 0.18 m and 0.00 rad away"),
    ("SUCCEEDED", "Goal reached.", (8.0, 8.0, 1.87 - 4 * math.pi), Status.NEAR,
     "as near as possible to (8.00, 8.00, 1.57) after 31.2 s: 0.00 m and 0.30 rad away"),
    ("SUCCEEDED", "", None, Status.DONE, "reached (8.00, 8.00, 1.57) after 31.2 s"),
    ("ABORTED", "Failed to find a valid plan.", (5.0, 4.0, 1.57), Status.GAVE_UP,
     "move_base gave up (ABORTED): Failed to find a valid plan; 5.00 m and 0.00 rad were left"),
    ("REJECTED", "", None, Status.GAVE_UP, "move_base gave up (REJECTED): no reason given"),
    ("LOST", "", None, Status.NOT_THERE, "move_base died after 31.2 s and was started again: send the goal again"),
    ("PREEMPTED", "", None, Status.REPLACED,
     "cancelled by another client, or another goal took its place, after 31.2 s")])
def test_every_end_has_a_status_and_words(state, text, pose, status, words):
    assert outcome(state, text, GOAL, pose, 31.2) == (status, words)


def test_the_planners_tolerance_is_wide_from_the_arrival_to_the_next_goal(monkeypatch):
    bus, heard = TimedBus(monkeypatch), []

    def service(name, _kind):
        assert name == "move_base/DWAPlannerROS/set_parameters"
        return lambda config: heard.extend((each.name, each.value) for each in config.doubles)
    monkeypatch.setattr(rospy, "ServiceProxy", service)
    arrival = Arrival()
    for places in (1.0, 1.985, 1.995, 1.97), (1.97,):
        goal = PoseStamped()
        goal.pose.position.x = 2.0
        bus.hear("move_base/current_goal", goal)
        for x in places:
            arrival.look((x, 0.0, 0.0))
    assert heard == [("xy_goal_tolerance", value) for value in (ARRIVED, STAYS, ARRIVED)]
