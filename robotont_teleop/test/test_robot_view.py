"""The robot as its page sees it, and what becomes of a page's goal; without ROS."""

import math
from unittest.mock import Mock

import pytest
from actionlib_msgs.msg import GoalID
from guarded_drive import WHEELS
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import Range
from std_msgs.msg import Header, String
from tf2_msgs.msg import TFMessage
from web_client import room

from robotont_description.geometry import body
from robotont_map_navigation.goal import Goal, Outcome, Status
from robotont_teleop.hand import emergency_stop_publisher, robot_reports
from robotont_teleop.web import camera, newest_goal, page_messages, robot_view
from robotont_testing.bus import Bus, transform
from robotont_testing.node_test import twist


class View(Bus):
    """On a robot that stands on a map."""

    def __init__(self, monkeypatch):
        super().__init__(monkeypatch, robot_view, robot_reports, camera, newest_goal, emergency_stop_publisher)
        self.goto = Mock(answers=True, **{"check.return_value": None, "follow.return_value": Outcome(Status.DONE, "x")})
        monkeypatch.setattr(robot_view, "GoTo", lambda _: self.goto)
        monkeypatch.setattr(robot_view, "running_wheels", lambda _: WHEELS)
        self.view = robot_view.RobotView("camera")
        self.hear("/tf_static", TFMessage([transform("base_link", "sonar", 0.1, 0.0)]))
        self.hear("odom", Odometry(child_frame_id="base_link"))
        self.hear("/tf", TFMessage([transform("map", "odom", 1.0, 2.0),
                                    transform("odom", "base_link", 0.5, -0.25, 0.6)]))
        self.pursue = next(work for work in self.work if work.__name__ == "_pursue")


@pytest.fixture
def bus(monkeypatch):
    return View(monkeypatch)


def test_a_goal_is_a_place_on_the_map_where_the_robot_looks_as_it_looks_now_and_cancelling_takes_back_all(bus):
    assert bus.view.state()["pose"] == pytest.approx((1.5, 1.75, 0.6))
    bus.view.goal(2.0, 1.0)
    bus.pursue()
    bus.goto.send.assert_called_once_with(Goal(2.0, 1.0, pytest.approx(0.6)))
    assert bus.view.status()["note"]["words"] == "x"
    bus.view.cancel()
    bus.goto.leave.assert_called_with(cancel=True)
    assert bus.sent["move_base/cancel"] == [GoalID()], "whoever has sent them"


def test_a_goal_that_the_master_has_held_up_is_not_driven_when_it_comes_back(bus):
    bus.goto.check.side_effect = lambda _: setattr(bus, "now", bus.now + 15.0)
    bus.view.goal(1.0, 0.0)
    bus.pursue()
    assert not bus.goto.send.called
    assert "too late" in bus.view.status()["note"]["words"]


def test_of_many_goals_the_newest_is_pursued_and_one_that_was_taken_back_is_not_sent(bus):
    meanwhile = iter((lambda: bus.view.goal(1.0, 0.0), lambda: None, bus.view.cancel))
    bus.goto.check.side_effect = lambda _: next(meanwhile)()
    bus.goto.follow.side_effect = lambda _: bus.view.goal(2.0, 0.0) or Outcome(Status.DONE, "there")
    bus.view.goal(0.0, 0.0)
    bus.pursue()
    assert not bus.goto.send.called, "replaced while it was checked"
    for _ in range(2):
        bus.pursue()
    bus.goto.send.assert_called_once_with(Goal(1.0, 0.0, pytest.approx(0.6)))
    assert bus.view.status()["goal"] is None
    assert not bus.view.status()["note"]["words"], "a newer one has taken its place, or nobody wants it"


def test_a_page_is_told_who_moves_it_what_is_near_and_where_its_map_lies(bus):
    bus.hear("cmd_vel", twist(0.1), "/square")
    bus.hear("cmd_vel/hand", twist(), "/keys")
    assert [bus.view.state()[key] for key in ("mover", "driven_by")] == [("program", "square"), ""], "\"\": no mux"
    assert bus.view.status()["near"] == []
    bus.hear("cmd_vel", twist(math.nan), "/square")
    assert bus.view.state()["mover"] == ("nobody", ""), "the driver refuses it"
    next(work for work in bus.work if work.__name__ == "_look_for_wheels")()
    bus.hear("range", Range(header=Header(frame_id="sonar"), field_of_view=0.4, min_range=0.04, max_range=4.0,
                            range=0.5))
    status, radius = bus.view.status(), body(WHEELS)[0]
    assert (status["frame"], status["radius"]) == ("map", radius)
    assert status["near"][0] == pytest.approx(0.6 - radius, abs=0.01)
    bus.now += 2.0
    assert set(bus.view.status()["near"]) == {None}, "a sensor that has fallen silent sees nothing"
    bus.hear("map", room(x=1.0))
    bus.hear("map", OccupancyGrid())  # none: the one before stays
    assert bus.view.status()["map"]["origin"] == (1.0, 0.0, 0.0)
    assert bus.view.map_picture.startswith(b"\x89PNG")


def test_each_order_of_a_page_is_one_of_the_robots(bus):
    assert {*page_messages.FIELDS} - {"drive", "take", "stop", "release"} <= {*dir(bus.view)}


def test_a_page_is_told_whether_its_stop_has_arrived(bus):
    """It sends it again (modules.test.mjs) until it is `pressed_here`."""
    def told():
        return tuple(bus.view.state()[key] for key in ("stopped", "stop_waits", "pressed_here", "stopped_by_class"))
    bus.hear("emergency_stop/pressed_by", String("/robot1/fleet_node"))
    assert told() == (True, False, False, True)
    bus.view.emergency_stop.press()
    assert told() == (True, True, False, True)
    bus.hear("emergency_stop/pressed_by", String("/robot1/fleet_node, /node"))
    assert told() == (True, False, True, True)
    bus.hear("emergency_stop/pressed_by", String(""))
    assert told()[0], "another's release, before anybody could see this press, does not end it"
    bus.now += emergency_stop_publisher.HELD
    for names in ("/node", ""):
        bus.hear("emergency_stop/pressed_by", String(names))
    assert told() == (False, False, False, False)
