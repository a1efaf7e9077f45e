import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robotont_driver.command.limits import Limits, limit_acceleration, limit_bend, limit_speed

speeds = st.floats(-5, 5)
twists = st.tuples(speeds, speeds, speeds)
bounds = st.one_of(st.just(0.0), st.floats(0.01, 3))


@given(twist=twists, linear=bounds, angular=bounds, wheel=bounds)
def test_speed_limits_hold_and_keep_the_direction(twist, linear, angular, wheel):
    wheel_speeds = (twist[0] + 0.1 * twist[2], twist[1], -twist[2])
    limited = limit_speed(twist, wheel_speeds, Limits(linear, angular, wheel))
    factors = [new / old for new, old in zip(limited, twist) if abs(old) > 1e-6]
    assert all(factor == pytest.approx(factors[0], rel=1e-9) for factor in factors)
    assert all(0 < factor <= 1 for factor in factors)
    slack = 1 + 1e-9
    assert not linear or math.hypot(limited[0], limited[1]) <= linear * slack
    assert not angular or abs(limited[2]) <= angular * slack
    if factors:
        assert not wheel or factors[0] * max(map(abs, wheel_speeds)) <= wheel * slack


@pytest.mark.parametrize("limits, factor", [
    (Limits(2.5, 1.5, 1.2), 0.2), (Limits(2.5, 1.5), 0.5), (Limits(4.0, 1.5), 0.75), (Limits(), 1.0)], ids=str)
def test_the_tightest_limit_decides_and_zero_means_none(limits, factor):
    assert limit_speed((3.0, 4.0, 2.0), (6.0, 0.0, 0.0), limits) == pytest.approx((3 * factor, 4 * factor, 2 * factor))
    assert limit_acceleration((1, 1, 1), (3.0, 4.0, 2.0), 0.001, limits) == (3.0, 4.0, 2.0)


@given(previous=twists, wanted=twists, elapsed=st.floats(0.001, 0.05), linear=bounds, angular=bounds,
       slower=bounds)
def test_acceleration_limits_hold_over_ground_or_as_the_robot_sees_it(
        previous, wanted, elapsed, linear, angular, slower):
    twist = limit_acceleration(previous, wanted, elapsed, Limits(0, 0, 0, linear, angular, slower))
    seen = [math.hypot(twist[0] - x, twist[1] - y) for x, y in (previous[:2], turned(previous, previous[2] * elapsed))]
    assert not linear or min(seen) <= max(linear, slower) * elapsed + 1e-9
    assert not angular or abs(twist[2] - previous[2]) <= angular * elapsed + 1e-9


@given(wanted=twists, steps=st.integers(1, 30))
def test_a_start_keeps_the_direction_and_the_curve(wanted, steps):
    twist = (0.0, 0.0, 0.0)
    for _ in range(steps):
        twist = limit_acceleration(twist, wanted, 0.02, Limits(0, 0, 0, 1.5, 8.0))
    part = max(map(abs, twist)) / max(*map(abs, wanted), 1e-12)
    # of two starts that are equally far but for rounding either may be taken: a turn by the root of a float's precision
    assert twist == pytest.approx([part * speed for speed in wanted], abs=1e-6)


def test_a_robot_that_turns_beneath_a_straight_way_is_not_limited_and_one_on_an_arc_is():
    limits = Limits(0, 0, 0, 1.5, 8.0)
    previous = (1.0, 0.0, 3.0)
    x, y = turned(previous, 3.0 * 0.02)
    wanted = (x, y, 3.0)
    assert limit_bend(wanted, previous, 0.02, limits) == wanted
    assert limit_acceleration(previous, wanted, 0.02, limits) == pytest.approx(wanted)
    x, y, turn = limit_bend(previous, previous, 0.02, limits)
    assert abs(turn) * math.hypot(x, y) == pytest.approx(1.5)
    assert (y, turn / x) == (0.0, pytest.approx(3.0))


def test_a_corner_costs_the_way_that_the_acceleration_demands():
    twist, lost, steps = (0.8, 0.0, 0.0), 0.0, 0
    while twist != (0.0, 0.8, 0.0):
        twist = limit_acceleration(twist, (0.0, 0.8, 0.0), 0.001, Limits(0, 0, 0, 1.5, 8.0, 2.25))
        lost, steps = lost + 0.001 * (0.8 - twist[1]), steps + 1
    most = 0.8 ** 2 / (math.sqrt(2) * 1.5)
    assert most / 1.5 <= lost <= most, "the first half brakes"
    assert steps * 0.001 <= math.sqrt(2) * 0.8 / 1.5


def test_slowing_down_has_a_limit_of_its_own():
    for linear, slower, faster, braked in ((1.0, 2.0, 0.1, 0.2), (1.0, 0.0, 0.1, 0.1), (0.0, 2.0, math.inf, 0.2)):
        limits = Limits(linear_acceleration=linear, linear_deceleration=slower)
        speeds = [limit_acceleration((0.5, 0.0, 0.0), (wanted, 0.0, 0.0), 0.1, limits)[0] for wanted in (5.0, 0.1)]
        assert speeds == pytest.approx([min(0.5 + faster, 5.0), 0.5 - braked])


def turned(twist, angle):
    return (math.cos(angle) * twist[0] + math.sin(angle) * twist[1],
            math.cos(angle) * twist[1] - math.sin(angle) * twist[0])
