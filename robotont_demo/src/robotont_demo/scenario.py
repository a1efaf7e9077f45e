"""The demo's drive: a square without turning, then a circle with one turn the other way. Free of ROS."""

import math
from typing import NamedTuple, Tuple

import numpy as np

from robotont_driver.kinematics import se2

PERIOD = 0.02             # [s] between commands
SIDE, RADIUS = 1.0, 0.5   # [m] of the square, of the circle
ACCELERATION = 1.0        # [m/s^2] within the driver's limit, so that the robot does just as commanded
SIDES = (("forward", 1, 0), ("left", 0, 1), ("back", -1, 0), ("right", 0, -1))


class Step(NamedTuple):
    """One period of the drive."""

    leg: str                            # name of the part that it belongs to
    twist: Tuple[float, float, float]   # v_x, v_y [m/s], omega [rad/s]


def plan(speed):
    """List of the Steps from start to end, at a speed [m/s]; each leg begins and ends with ACCELERATION."""
    square = [Step(f"square, {name}", (x * now, y * now, 0.0))
              for name, x, y in SIDES for now in trapezium(SIDE, speed)]
    speeds = trapezium(2 * math.pi * RADIUS, speed)
    angles = (np.cumsum(speeds) - speeds / 2) * PERIOD / RADIUS  # in the middle of each period
    # seen from the robot the direction goes round twice, because the robot turns once the other way
    circle = [Step("circle, turning", (now * math.cos(2 * angle), now * math.sin(2 * angle), -now / RADIUS))
              for now, angle in zip(speeds.tolist(), angles.tolist())]
    return square + circle


def trapezium(length, speed):
    """Speeds [m/s] per period, up with ACCELERATION and down again, that cover exactly `length` [m]."""
    ramp = np.arange(PERIOD / 2, speed / ACCELERATION, PERIOD) * ACCELERATION
    hold = round((length - speed ** 2 / ACCELERATION) / speed / PERIOD)
    speeds = np.concatenate([ramp, np.full(hold, speed), ramp[::-1]])
    return speeds * (length / (speeds.sum() * PERIOD))


def commanded_path(steps):
    """K+1 x 2 places [m] of a robot that follows K Steps exactly, from the origin."""
    poses = se2.path([[speed * PERIOD for speed in step.twist] for step in steps])
    return np.vstack([np.zeros(2), poses[:, :2]])
