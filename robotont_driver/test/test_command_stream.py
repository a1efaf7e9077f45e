import math

import pytest

from robotont_driver.command.command_stream import STOP, CommandStream
from robotont_driver.command.limits import Limits
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_testing.robots import SHIPPED

FLAT = (0.0, 0.0, 0.0)


@pytest.fixture
def stream(request):
    limits = Limits(**getattr(request, "param", {}))
    return CommandStream(Kinematics(read_wheels(SHIPPED)), limits, timeout=0.5, period=0.05)


def drive(stream, now, x=0.3, y=0.0, turn=0.0):
    return stream.command((x, y, 0.0), (0.0, 0.0, turn), now)


def test_follows_the_newest_stops_when_commands_stop_and_recovers_by_itself(stream):
    drive(stream, 0.9, 0.1)
    drive(stream, 1.0, 0.3, 0.2, -0.5)
    assert stream.twist(1.0) == stream.twist(1.4) == (0.3, 0.2, -0.5)
    assert stream.time_left(1.2) == pytest.approx(0.3)
    assert stream.twist(1.5) == STOP
    assert "is their sender alive?" in stream.complaint(2.0)
    assert stream.timeouts == 1
    drive(stream, 9.0)
    assert stream.twist(9.0) == (0.3, 0.0, 0.0)
    assert stream.complaint(9.0) == ""
    drive(stream, 10.0, 0.0)
    assert stream.twist(11.0) == STOP
    assert stream.complaint(11.0) == "", "the end of commands at rest is no complaint"
    assert stream.timeouts == 2


@pytest.mark.parametrize("linear, angular, named", [
    ((math.nan, 0, 0), FLAT, "linear.x is nan"),
    ((0, math.inf, 0), FLAT, "linear.y is inf"),
    ((0, 0, -math.inf), FLAT, "linear.z is -inf"),
    (FLAT, (0, 0, math.nan), "angular.z is nan"),
    (FLAT, (math.nan, 0, 0), "angular.x is nan"),
    ((1e300, 0, 0), FLAT, "linear.x is 1e+300"),
    ((0.1, 0, 0.2), FLAT, "linear.z is 0.2"),
    ((0.1, 0, 0), (0.5, 0, 0), "angular.x is 0.5"),
    ((0.1, 0, 0), (0, -0.5, 0), "angular.y is -0.5"),
])
def test_a_motion_that_the_base_cannot_do_stops_it(stream, linear, angular, named):
    drive(stream, 1.0)
    assert named in stream.command(linear, angular, 1.1)
    assert stream.twist(1.1) == STOP
    assert named in stream.complaint(2.0)
    assert named in stream.command(linear, angular, 1.15)
    assert stream.refused == 2
    drive(stream, 1.2)
    assert stream.twist(1.2) == (0.3, 0.0, 0.0)


def test_an_emergency_stop_holds_and_its_release_moves_nothing(stream):
    drive(stream, 1.0)
    stream.emergency_stop(True, 1.0)
    assert stream.twist(1.0) == STOP
    drive(stream, 1.1)
    assert stream.twist(1.1) == STOP
    assert "emergency stop" in stream.complaint(1.1)
    stream.emergency_stop(False, 1.2)
    assert stream.twist(1.2) == STOP
    drive(stream, 1.3)
    assert stream.twist(1.3) == STOP
    assert "must stop once" in stream.complaint(1.3)
    drive(stream, 1.4, 0.0)
    drive(stream, 1.5)
    assert stream.twist(1.5) == (0.3, 0.0, 0.0)
    assert stream.complaint(1.5) == ""


@pytest.mark.parametrize("stream", [{"wheel_speed": 0.2}], indirect=True, ids=str)
def test_the_wheel_limit_scales_all_wheels(stream):
    drive(stream, 1.0, 0.3, 0.1, 0.4)
    twist = stream.twist(1.0)
    assert max(map(abs, stream.kinematics.wheel_speeds(twist))) == pytest.approx(0.2)
    assert twist[1] / twist[0] == pytest.approx(1 / 3)
    assert twist[2] / twist[0] == pytest.approx(4 / 3)
    assert stream.limited


@pytest.mark.parametrize("stream", [{"linear_acceleration": 1.0}], indirect=True, ids=str)
def test_acceleration_rises_step_by_step_but_stops_do_not_wait(stream):
    stream.twist(1.0)
    drive(stream, 1.02)
    assert stream.twist(1.02) == pytest.approx((0.02, 0, 0))
    assert stream.twist(1.07) == pytest.approx((0.07, 0, 0))
    assert stream.twist(1.40) == pytest.approx((0.12, 0, 0))  # one step counts one period at most
    assert stream.ramping
    assert stream.twist(1.53) == STOP
    drive(stream, 1.6)
    stream.twist(1.6)
    drive(stream, 1.61, 0.0)
    assert stream.twist(1.61) == STOP, "a commanded stop"
    assert not stream.ramping


@pytest.mark.parametrize("stream, fastest, speed", [
    ({}, 0.3, 0.3), ({"wheel_speed": 0.2}, 0.3, 0.2), ({"wheel_speed": 0.5}, 0.3, 0.3), ({}, math.nan, 0.6),
], indirect=["stream"])
def test_what_the_board_can_do_keeps_the_direction_of_travel(stream, fastest, speed):
    """As a limit of its own; another board lifts it."""
    stream.limit_wheels(fastest)
    drive(stream, 1.0, 0.0, 0.6)  # its fastest wheel turns as fast as the robot moves
    assert stream.twist(1.0) == pytest.approx((0.0, speed, 0.0))
    stream.limit_wheels(0.0)
    drive(stream, 1.1, 0.0, 0.6)
    assert stream.twist(1.1) == pytest.approx((0.0, stream.limits.wheel_speed or 0.6, 0.0))
