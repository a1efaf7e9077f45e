"""What a robot tells the fleet of itself, and how it takes a goal; without ROS."""

import json
import math
from unittest.mock import Mock

import pytest
from fleet_rig import STATE

from robotont_driver.kinematics.se2 import pose_of
from robotont_fleet import robot_telemetry
from robotont_fleet.messages import read_state
from robotont_teleop.web import page_setup


@pytest.fixture
def telemetry():
    """A RobotTelemetry without its topics."""
    robot = robot_telemetry.RobotTelemetry.__new__(robot_telemetry.RobotTelemetry)
    robot._pose, robot.newest_charge = lambda: ("map", (0.0, 0.0, math.pi)), 0.75
    robot.emergency_stop = Mock(pressed=False)
    robot._goals = Mock(get_num_connections=lambda: 1)
    return robot


def test_a_state_stays_short_enough_to_be_read_however_many_press_the_stop(telemetry, monkeypatch):
    """As by rostopic pub -1, each time under another name."""
    summary = {key: STATE[key] for key in ("speed", "driven", "driven_by", "battery", "worst")}
    monkeypatch.setattr(robot_telemetry.RobotTelemetry, "summary", summary)
    telemetry.emergency_stop = Mock(pressed_by=", ".join(map("/rostopic_1_{}".format, range(2000))), has_driver=True)
    telemetry._page = ""
    assert read_state(json.dumps({**STATE, **telemetry.state()}).encode())["stopped"].startswith("/rostopic_1_0, ")


def test_where_the_robots_page_is_stays_known_while_the_master_is_away(telemetry, monkeypatch):
    monkeypatch.setattr(robot_telemetry.rospy, "get_param", Mock(side_effect=[
        {}, {"address": "127.0.0.1", "port": 8123}, {"address": "10.0.0.1"}, {"address": "fd00::1"},
        {"address": "", "certificate": "here"}, {"address": "0.0.0.0", "port": 8123}, ConnectionRefusedError]))
    monkeypatch.setattr(page_setup, "own_address", lambda: "r1")
    found = [(telemetry._look_for_page(), telemetry._page) for _ in range(7)]
    assert found == [(robot_telemetry.NEXT_PAGE, page) for page in (
        "", "", "http://10.0.0.1:8100/", "http://[fd00::1]:8100/", "https://r1:8100/", *2 * ["http://r1:8123/"])]


@pytest.mark.parametrize("changed, words", [
    ({}, ""), ({"_pose": lambda: ("odom", (0.0, 0.0, 0.0))}, "does not know its place"), ({"newest_charge": None}, ""),
    ({"emergency_stop": Mock(pressed=True)}, "the emergency stop is pressed"),
    ({"newest_charge": 0.04}, "the battery is empty"),
    ({"_goals": Mock(get_num_connections=lambda: 0)}, "no navigation runs")])
def test_a_goal_goes_out_only_where_the_robot_may_follow_it(telemetry, monkeypatch, changed, words):
    monkeypatch.setattr(robot_telemetry.rospy.Time, "now", robot_telemetry.rospy.Time)
    vars(telemetry).update(changed)
    refusal = telemetry.goal(1.0, 2.0)
    assert words in refusal
    assert bool(refusal) == bool(words)
    sent = [call[0][0] for call in telemetry._goals.publish.call_args_list]
    assert [(goal.header.frame_id, *pose_of(goal.pose)) for goal in sent] == [("map", 1.0, 2.0, math.pi)] * (not words)
