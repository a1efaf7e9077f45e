import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robotont_driver.command.limits import Limits, limit_acceleration, limit_speed

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


@given(twist=twists)
def test_zero_means_no_limit(twist):
    assert limit_speed(twist, twist, Limits()) == twist
    assert limit_acceleration((1, 1, 1), twist, 0.001, Limits()) == twist


def test_the_tightest_limit_decides():
    assert limit_speed((3.0, 4.0, 2.0), (6.0, 0.0, 0.0), Limits(2.5, 1.5, 1.2)) == pytest.approx((0.6, 0.8, 0.4))


@given(previous=twists, wanted=twists, elapsed=st.floats(0, 1), linear=bounds, angular=bounds)
def test_acceleration_limits_hold_on_the_straight_way(previous, wanted, elapsed, linear, angular):
    twist = limit_acceleration(previous, wanted, elapsed, Limits(0, 0, 0, linear, angular))
    change = [new - old for new, old in zip(twist, previous)]
    wish = [new - old for new, old in zip(wanted, previous)]
    assert not linear or math.hypot(change[0], change[1]) <= linear * elapsed + 1e-9
    assert not angular or abs(change[2]) <= angular * elapsed + 1e-9
    scale = max(map(abs, wish))
    if scale > 1e-6:
        factor = max(map(abs, change)) / scale
        assert factor <= 1 + 1e-9
        assert change == pytest.approx([factor * step for step in wish], abs=1e-9)
