"""The demo's drive: a square without turning, then a circle with one turn the other way. Free of ROS."""

import math
from typing import NamedTuple, Tuple

import numpy as np

from robotont_driver.kinematics import se2

PERIOD = 0.02             # [s] between commands
SIDE, RADIUS = 1.0, 0.5   # [m] of the square, of the circle
SIDES = (("forward", 1, 0), ("left", 0, 1), ("back", -1, 0), ("right", 0, -1))


class Step(NamedTuple):
    """One period of the drive."""

    leg: str                            # name of the part that it belongs to
    twist: Tuple[float, float, float]   # v_x, v_y [m/s], omega [rad/s]


def plan(speed):
    """List of the Steps from start to end, at a speed [m/s]."""
    periods = round(SIDE / speed / PERIOD)
    square = [Step(f"square, {name}", (x * speed, y * speed, 0.0)) for name, x, y in SIDES for _ in range(periods)]
    periods = round(2 * math.pi * RADIUS / speed / PERIOD)
    turn = 2 * math.pi / periods  # [rad] in one period
    # seen from the robot the direction goes round twice, because the robot turns once the other way
    circle = [Step("circle, turning", (speed * math.cos(2 * turn * step), speed * math.sin(2 * turn * step),
                                       -turn / PERIOD)) for step in range(periods)]
    return square + circle


def commanded_path(steps):
    """K+1 x 2 places [m] of a robot that follows K Steps exactly, from the origin."""
    poses = se2.path([[speed * PERIOD for speed in step.twist] for step in steps])
    return np.vstack([np.zeros(2), poses[:, :2]])
