"""From the position of sticks and keys to a twist, for every way of driving by hand; free of ROS.

Positions are fractions from -1 to 1, in the robot's axes: forward, left, counterclockwise (REP 103).
"""

import math
from typing import NamedTuple

STOP = (0.0, 0.0, 0.0)


class Speeds(NamedTuple):
    """Speeds of a fully deflected stick."""

    linear: float   # [m/s]
    angular: float  # [rad/s]

    def twist(self, forward, left, turn):
        """Twist (v_x, v_y, omega) of positions; a diagonal is no faster than straight ahead."""
        length = max(1.0, math.hypot(forward, left))
        turn = min(1.0, max(-1.0, turn))
        return (self.linear * forward / length, self.linear * left / length, self.angular * turn)

    def within(self, twist):
        """The twist with the speed over ground and the turning speed no larger than these; its direction stays."""
        v_x, v_y, omega = twist
        factor = min(1.0, self.linear / max(math.hypot(v_x, v_y), 1e-9), self.angular / max(abs(omega), 1e-9))
        return (v_x * factor, v_y * factor, omega * factor)

    def scaled(self, linear, angular, largest):
        """These speeds times factors, between 1 % and all of the `largest` Speeds."""
        return Speeds(min(largest.linear, max(0.01 * largest.linear, self.linear * linear)),
                      min(largest.angular, max(0.01 * largest.angular, self.angular * angular)))
