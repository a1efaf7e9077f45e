"""cmd_vel_mux without ROS: who drives, who is slowed, and what is said of it. What needs its process: the rostest."""

import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest
import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from guarded_drive import WHEELS
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan, Range
from std_msgs.msg import Float32, Header, String
from std_srvs.srv import TriggerRequest
from tf2_msgs.msg import TFMessage

from robotont_driver.parameters.parameters import ParameterError
from robotont_driver.ros.diagnostics import OK, WARN
from robotont_teleop.mux import cmd_vel_mux, guard_sensors
from robotont_testing.bus import Bus
from robotont_testing.node_test import twist

HAND, NAVIGATION, STOP = (0.1, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.0)
AHEAD = (0.8, 0.0, 0.0)
SENSORS = [TransformStamped(Header(frame_id="base_link"), name, Transform(Vector3(*place), Quaternion(*turn)))
           for name, place, turn in (("laser", (0.0, 0.0, 0.2), (0.0, 1.0, 0.0, 0.0)),
                                     ("sonar", (0.0, 0.1, 0.1), (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))))]


class Mux(Bus):
    """The node, with a driver_node that hears it, a laser that hangs backwards, and a range sensor on the left.

    wheels: of the robot that runs; kept: who has to stop first.
    """

    def __init__(self, monkeypatch, blind_speed=0.3, wheels=WHEELS):
        super().__init__(monkeypatch, cmd_vel_mux, guard_sensors)
        self.wheels, self.kept = wheels, []
        self.connections["emergency_stop/pressed_by"] = 1
        monkeypatch.setattr(cmd_vel_mux, "KeptParameter", lambda _, value: SimpleNamespace(
            changed=lambda: self.kept.append(value())))
        monkeypatch.setattr(guard_sensors, "running_wheels", self._running_wheels)
        given = {one.name: one.default for one in cmd_vel_mux.PARAMETERS}
        self.node = cmd_vel_mux.CmdVelMux({**given, "blind_speed": blind_speed})

    def _running_wheels(self, _namespace):
        if not self.wheels:
            raise ParameterError(["no robot runs"])
        return self.wheels

    def look(self, seconds=0.02):
        """Time passes, as far as the node's threads look before anybody sends more."""
        for _ in range(round(seconds / 0.02)):
            self.now += 0.02
            for work in self.work:
                work()

    def drive(self, name, *command):
        """A command comes; the newest that goes out then."""
        self.look()
        self.hear(f"cmd_vel/{name}", twist(*command))
        return self.commands[-1] if self.commands else None

    @property
    def commands(self):
        return [(one.linear.x, one.linear.y, one.angular.z) for one in self.sent["cmd_vel"]]

    @property
    def drivers(self):
        return [one.data for one in self.sent["cmd_vel/driven_by"]]

    def says(self, subject):
        return self.reports[subject]()[:2]

    def see(self, behind=math.inf, left=math.inf, beside=3.0, frame="laser", age=0.0, odometry=True):
        """Everything around is free for 3 m, but for a wall ahead, behind the laser's back, and something beside.

        beside: [m] by the laser, whose left is the robot's left because it looks backwards and hangs.
        """
        self.hear("/tf_static", TFMessage(SENSORS))
        if odometry:
            self.hear("odom", Odometry())
        made, now = rospy.Time.from_sec(self.now - age), rospy.Time.now()
        angles = np.arange(360) - 180
        self.hear("scan", LaserScan(
            header=Header(stamp=made, frame_id=frame), angle_min=-math.pi, angle_increment=math.pi / 180,
            range_min=0.1, range_max=4.0,
            ranges=np.where(abs(angles) > 150, behind, np.where(abs(angles - 90) < 30, beside, 3.0))))
        self.hear("range", Range(header=Header(stamp=now, frame_id="sonar"), field_of_view=0.4, min_range=0.04,
                                 max_range=4.0, range=left))

    def ask(self, wanted, name="hand", **seen):
        """The newest command that goes out, with readings for 3 s, which is longer than any counts."""
        for _ in range(30):
            self.look(0.1)
            self.see(**seen)
            found = self.drive(name, *wanted)
        return found


@pytest.fixture
def mux(monkeypatch):
    return Mux(monkeypatch)


def test_the_hand_takes_over_from_navigation_and_gives_back_on_request(mux):
    assert mux.drive("navigation", *NAVIGATION) == NAVIGATION
    assert mux.drive("hand", *HAND) == HAND
    assert mux.drive("navigation", *NAVIGATION) == HAND
    answer = mux.services["~give_back"](TriggerRequest())
    assert (answer.success, answer.message) == (True, "navigation drives")
    assert mux.drive("navigation", *NAVIGATION) == NAVIGATION
    assert [command for command, _ in itertools.groupby(mux.commands)] == [NAVIGATION, STOP, HAND, STOP, NAVIGATION]
    assert mux.drivers == ["nobody", "navigation", "hand", "navigation"]


def test_commands_that_waited_while_it_was_stopped_do_not_drive(mux):
    mux.drive("hand", *HAND)
    mux.now += 1.0
    mux.hear("cmd_vel/hand", twist(-0.1))
    assert mux.commands == [HAND]
    mux.look(0.4)
    assert mux.drive("hand", -0.1) == (-0.1, 0.0, 0.0)


def test_a_command_amid_which_it_was_stopped_is_a_zero(mux, monkeypatch):
    arbiter = mux.node._arbiter
    command = arbiter.command

    def stopped_meanwhile(*given):
        mux.now += 1.0
        return command(*given)
    monkeypatch.setattr(arbiter, "command", stopped_meanwhile)
    assert mux.drive("hand", *HAND) == STOP


def test_the_emergency_stop_is_a_zero_and_ends_all_goals_also_those_that_came_meanwhile(mux):
    mux.drive("hand", *HAND)
    mux.hear("emergency_stop/pressed_by", String("/somebody"))
    assert (mux.commands[-1], mux.drivers[-1]) == (STOP, "emergency stop")
    assert mux.says("who drives") == (WARN, "emergency stop, pressed by /somebody")
    assert mux.sent["move_base/cancel"] == [GoalID()]
    assert mux.drive("navigation", *NAVIGATION) == STOP
    assert len(mux.sent["move_base/cancel"]) == 2, "the end of a goal that drives in vain"
    mux.hear("emergency_stop/pressed_by", String(""))
    assert len(mux.sent["move_base/cancel"]) == 3, "the end of goals that came during the stop"
    assert mux.kept == [["/somebody"]] * 2
    mux.look(0.6)
    assert mux.says("who drives") == (OK, "drives: nobody")


def test_straight_publishers_are_a_warning_only_beside_somebody_else(mux):
    mux.publishers["/cmd_vel"] = ["/node", "/square"]
    mux.look()
    assert mux.says("who drives") == (OK, "drives: nobody by hand or goal; on cmd_vel: /square"), "it disturbs none"
    mux.publishers["/cmd_vel"] += ["/another"]
    mux.look()
    assert mux.says("who drives")[1].startswith("/another, /square also on cmd_vel")
    mux.publishers["/cmd_vel"].pop()
    mux.look()
    mux.drive("hand", *HAND)
    assert mux.says("who drives") == (WARN, "/square also on cmd_vel: commands may mix (cmd_vel:=cmd_vel/default)")
    mux.connections["emergency_stop/pressed_by"] = 0
    assert mux.says("who drives") == (WARN, "no driver_node of this project hears its commands")


@pytest.mark.parametrize("wrong", [math.nan, math.inf])
@pytest.mark.parametrize("axis", ["x", "z"])
def test_commands_that_no_robot_can_do_are_refused_and_stop(mux, wrong, axis):
    mux.drive("hand", *HAND)
    message = twist(0.1)
    setattr(message.linear, axis, wrong)
    mux.hear("cmd_vel/hand", message)
    assert mux.commands == [HAND, STOP]
    assert "command refused: cmd_vel/hand: " in mux.says("who drives")[1]


def test_navigation_stands_when_it_is_told_to_and_goes_on_by_itself(mux):
    mux.drive("navigation", *NAVIGATION)
    for senseless in (math.nan, -1.0, 1e9):
        mux.hear("navigation/stand", Float32(senseless))
    assert mux.drive("navigation", *NAVIGATION) == NAVIGATION
    mux.hear("navigation/stand", Float32(0.5))
    begin = mux.now
    while mux.drive("navigation", *NAVIGATION) == STOP:
        assert mux.drivers[-1] == "navigation"
    assert mux.now - begin == pytest.approx(0.5, abs=0.03)


def test_navigation_only_turns_while_it_would_lean_on_what_is_in_a_barred_way_but_it_may_try_straight_on(mux):
    for way in ((math.nan, 0.0), (10.0, 0.0)):  # senseless
        mux.hear("navigation/barred", Vector3(*way, 0.0))
        assert mux.drive("navigation", 0.1, 0.0, 1.0) == (0.1, 0.0, 1.0)
    mux.hear("navigation/barred", Vector3(0.0, 1.0, 0.0))
    for asked, sent in (((0.0, 0.1, -1.0), (0.0, 0.0, -1.0)), ((0.2, 0.1, 0.0), STOP), ((0.0, 0.2, 0.01), None),
                        ((0.1, -0.2, 0.5), None), ((0.3, 0.03, 0.2), None), ((0.0, 0.0, 1.0), None)):
        assert mux.drive("navigation", *asked) == (sent or asked)
    assert mux.drive("hand", 0.1, 0.1, 1.0) == (0.1, 0.1, 1.0)
    mux.look(3.0)
    assert mux.drive("navigation", 0.0, 0.1, -1.0) == (0.0, 0.1, -1.0)


def test_who_has_to_stop_first_has_not_stopped_because_a_way_is_barred(mux):
    mux.drive("navigation", *NAVIGATION)
    for by in ("/somebody", ""):
        mux.hear("emergency_stop/pressed_by", String(by))
    mux.hear("navigation/barred", Vector3(1.0, 0.0, 0.0))
    for _ in range(3):
        assert mux.drive("navigation", 0.1, 0.1, 0.0) == STOP
        assert mux.drive("navigation", 0.0, 0.0, 1.0) == STOP
    assert mux.says("who drives")[1].startswith("a sender on cmd_vel/navigation must stop once")


def test_before_a_scanner_has_spoken_the_hand_is_slow(mux):
    assert mux.drive("hand", *AHEAD) == AHEAD
    assert mux.says("guard") == (OK, "no scan and no range: does not interfere")
    mux.connections["scan"] = 1
    assert mux.drive("hand", *AHEAD) == pytest.approx((0.3, 0.0, 0.0))
    assert mux.says("guard")[1].startswith("by hand at most 0.30 m/s where no sensor sees: ahead")


@pytest.mark.parametrize("x, y, seen, words", [
    (0.8, 0.0, {"behind": 0.2}, "ahead, 0.05 m"), (0.0, 0.8, {"left": 0.06}, "on the left, 0.01 m"),
    (0.0, 0.8, {"beside": 0.21}, "on the left, 0.06 m")])
def test_a_hand_stops_before_what_is_in_the_way_and_drives_on_beside_it(mux, x, y, seen, words):
    assert mux.ask((-x, -y, 0.5), **seen) == (-x, -y, 0.5)
    mux.published.clear()
    assert mux.ask((x, y, 0.5), **seen) == STOP
    assert mux.says("guard") == (WARN, f"in the way: something {words} from the robot")
    assert mux.published, "it is told at once"
    mux.look(3.0)
    assert mux.says("guard")[0] == OK


def test_what_comes_between_two_commands_slows_the_newest(mux):
    assert mux.ask(AHEAD) == AHEAD
    mux.see(behind=0.4)
    mux.look()
    assert 0.5 < mux.commands[-1][0] < 0.65


@pytest.mark.parametrize("seen, words", [
    ({"frame": "unknown"}, "/tf_static does not tell where it is in base_link"),
    ({"age": 5.0}, "no odometry within 2 s of its stamps"), ({"odometry": False}, "no odometry within 2 s")])
def test_a_scan_that_cannot_be_used_is_named_and_slows(mux, seen, words):
    assert mux.ask(AHEAD, frame="/laser") == AHEAD
    assert mux.ask(AHEAD, **seen) == pytest.approx((0.3, 0.0, 0.0))
    level, said = mux.says("guard")
    assert (level, words in said) == (WARN, True), said
    assert mux.ask(AHEAD, frame="/laser") == AHEAD
    assert mux.says("guard")[0] == OK


def test_others_and_a_mux_without_it_are_left_alone(mux, monkeypatch):
    for name in ("navigation", "default"):
        assert mux.ask(AHEAD, name, behind=0.2) == AHEAD
    off = Mux(monkeypatch, blind_speed=-1.0)
    assert off.ask(AHEAD, behind=0.2) == AHEAD
    assert not off.heard_by["scan"]


def test_the_guard_is_that_of_the_robot_that_runs_now(monkeypatch):
    late = Mux(monkeypatch, wheels=None)
    assert late.drive("hand", *AHEAD) == AHEAD
    assert late.says("guard") == (WARN, "cannot be used: no robot's wheels on the parameter server: does not interfere")
    speeds, larger = [], WHEELS._replace(distances=[0.25] * 3)
    for late.wheels, limit in ((WHEELS, 1.5), (larger, 1.5), (larger, 0.3), (larger._replace(pid_frequency=5.0), 1.5),
                               (WHEELS._replace(mass=100.0), 1.5)):
        late.parameters["driver_node/max_linear_acceleration"] = limit
        speeds.append(late.ask(AHEAD, behind=0.5)[0])
    shipped, large, *slower, heavy = speeds
    assert large < shipped - 0.05
    assert max(slower) < large - 0.1, "one that brakes softly; two periods of a board of 5 Hz"
    assert heavy < shipped - 0.1
