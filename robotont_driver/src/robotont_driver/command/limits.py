"""Limits that keep the way: a twist is scaled as a whole, or moves straight towards another; never axis by axis."""

import math
from typing import NamedTuple


class Limits(NamedTuple):
    """Bounds on the motion of the robot; 0 = no bound."""

    linear_speed: float = 0.0          # [m/s]
    angular_speed: float = 0.0         # [rad/s]
    wheel_speed: float = 0.0           # [m/s]
    linear_acceleration: float = 0.0   # [m/s^2] of the velocity over ground
    angular_acceleration: float = 0.0  # [rad/s^2]
    linear_deceleration: float = 0.0   # [m/s^2] likewise, while it slows down; 0: linear_acceleration


def limit_speed(twist, wheel_speeds, limits):
    """`twist` (v_x, v_y, omega) with its `wheel_speeds` [m/s], scaled by one factor so that every limit is kept."""
    x, y, turn = twist
    factor = 1.0
    for value, limit in ((math.hypot(x, y), limits.linear_speed), (abs(turn), limits.angular_speed),
                         (max(map(abs, wheel_speeds)), limits.wheel_speed)):
        if limit and value > limit:
            factor = min(factor, limit / value)
    return (x * factor, y * factor, turn * factor)


def limit_bend(twist, before, since, limits):
    """`twist`, scaled so that the bend of its path keeps the linear acceleration; `before`: the one `since` [s] ago."""
    # a robot that turns beneath a straight way, command by command, does not bend it
    limit = limits.linear_acceleration
    bend = abs(twist[2]) * math.hypot(twist[0], twist[1])
    if not limit or bend <= limit:
        return tuple(twist)
    if tuple(twist) != tuple(before) and since > 0.0:
        x, y = _turned(before, twist[2] * since)
        bend = min(bend, math.hypot(twist[0] - x, twist[1] - y) / since)
    factor = math.sqrt(min(1.0, limit / bend)) if bend else 1.0
    return tuple([part * factor for part in twist])


def limit_acceleration(previous, wanted, elapsed, limits):
    """The twist between `previous` and `wanted` that the acceleration limits allow after `elapsed` [s].

    It lies on the straight line from one to the other, which begins at what needs less: the same motion as the robot
    sees it, or the same over ground. Both accelerations share the wheels' torque: their parts' squares add up.
    """
    if previous == wanted or not any(limits[3:]):
        return tuple(wanted)
    ground = _turned(previous, previous[2] * elapsed)
    x, y = min(previous[:2], ground, key=lambda start: math.hypot(wanted[0] - start[0], wanted[1] - start[1]))
    change = (wanted[0] - x, wanted[1] - y, wanted[2] - previous[2])
    slower = change[0] * x + change[1] * y < 0.0
    linear = (slower and limits.linear_deceleration) or limits.linear_acceleration
    share = math.hypot(_share(math.hypot(change[0], change[1]), linear, elapsed),
                       _share(abs(change[2]), limits.angular_acceleration, elapsed))  # fmt: skip
    if share <= 1.0:
        return tuple(wanted)
    return tuple(old + step / share for old, step in zip((x, y, previous[2]), change))


def _turned(twist, angle):
    """(v_x, v_y) of a velocity over ground after the robot below it has turned by `angle` [rad]."""
    cos, sin = math.cos(angle), math.sin(angle)
    return cos * twist[0] + sin * twist[1], cos * twist[1] - sin * twist[0]


def _share(value, limit, elapsed):
    """How many times `limit` times `elapsed` a value is; 0 where the limit is off (0)."""
    if limit == 0.0:
        return 0.0
    return value / (limit * elapsed) if elapsed > 0.0 else math.inf if value else 0.0
