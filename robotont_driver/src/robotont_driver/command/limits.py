"""Limits that keep the direction of travel: the twist is scaled as a whole, never axis by axis."""

import math
from typing import NamedTuple


class Limits(NamedTuple):
    """Bounds on the motion of the robot; 0 = no bound."""

    linear_speed: float = 0.0          # [m/s]
    angular_speed: float = 0.0         # [rad/s]
    wheel_speed: float = 0.0           # [m/s]
    linear_acceleration: float = 0.0   # [m/s^2]
    angular_acceleration: float = 0.0  # [rad/s^2]

    @property
    def of_speed(self):
        """Whether any speed is limited."""
        return bool(self.linear_speed or self.angular_speed or self.wheel_speed)

    @property
    def of_acceleration(self):
        """Whether any acceleration is limited."""
        return bool(self.linear_acceleration or self.angular_acceleration)


def limit_speed(twist, wheel_speeds, limits):
    """`twist` (v_x, v_y, omega), scaled by one factor so that every speed limit is kept.

    `wheel_speeds` [m/s] are those of the twist; they shrink by the same factor.
    """
    x, y, turn = twist
    fastest = max(abs(speed) for speed in wheel_speeds)
    factor = min(
        _factor(math.hypot(x, y), limits.linear_speed),
        _factor(abs(turn), limits.angular_speed),
        _factor(fastest, limits.wheel_speed),
    )
    return (x * factor, y * factor, turn * factor)


def limit_acceleration(previous, wanted, elapsed, limits):
    """The twist between `previous` and `wanted` that the acceleration limits allow after `elapsed` [s].

    It lies on the straight line from one to the other, so a start from rest keeps the direction.
    """
    change = [new - old for old, new in zip(previous, wanted)]
    factor = min(
        _factor(math.hypot(change[0], change[1]), limits.linear_acceleration, elapsed),
        _factor(abs(change[2]), limits.angular_acceleration, elapsed),
    )
    if factor == 1.0:
        return tuple(wanted)
    return tuple(old + factor * step for old, step in zip(previous, change))


def _factor(value, limit, elapsed=1.0):
    """By how much to multiply `value` so that it is at most `limit` times `elapsed`; 1 where the limit is off (0)."""
    bound = limit * elapsed
    return 1.0 if limit == 0.0 or value <= bound else bound / value
