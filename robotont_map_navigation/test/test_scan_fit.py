import math

import numpy as np
import pytest

from robotont_map_navigation.floor_map import FloorMap
from robotont_map_navigation.scan_fit import deviations, fit

CELLS = np.zeros((40, 80), np.int8)  # 4 m x 2 m with a wall around it
CELLS[[0, -1]] = CELLS[:, [0, -1]] = 100
MAP = FloorMap(CELLS, 0.05, (-1.0, -1.0, 0.0))
ANGLES = np.linspace(-math.pi, math.pi, 90, endpoint=False)
BOUNDS = (0.05, 5.0)


def ranges(x, y, yaw):
    """What a sensor at a pose sees of the walls' inner faces, at -0.95 and 2.95, -0.95 and 0.95 m."""
    cos, sin = np.cos(ANGLES + yaw), np.sin(ANGLES + yaw)
    with np.errstate(divide="ignore"):
        return np.minimum(np.where(cos > 0, 2.95 - x, -0.95 - x) / cos, np.where(sin > 0, 0.95 - y, -0.95 - y) / sin)


POSE = (0.3, 0.2, 0.7)
SEEN = ranges(*POSE)


def but(rays, ranges):
    """What is seen, but for some rays."""
    seen = SEEN.copy()
    seen[rays] = ranges
    return seen


@pytest.mark.parametrize("seen, bounds, expected", [
    (SEEN, BOUNDS, (1.0, 0.0)),
    (np.minimum(SEEN, 0.4), BOUNDS, (0.0, 0.0)),
    (but(slice(39), np.tile([math.nan, 0.01, 5.0], 13)), BOUNDS, (1.0, 0.0)),
    (but(slice(9, None), math.nan), BOUNDS, None),
    (but(slice(None, None, 3), math.inf), BOUNDS, (2 / 3, 1 / 3)),
    (np.full(90, math.inf), (0.05, 0.5), (1.0, 0.0)),
], ids=["the walls", "an obstacle that fills the view", "rays that show nothing", "too few rays",
        "nothing where the map has a wall", "nothing as far as the sensor sees"])
def test_shares_at_the_true_pose(seen, bounds, expected):
    assert fit(MAP, POSE, seen, ANGLES, bounds, 0.1) == (expected and pytest.approx(expected))


@pytest.mark.parametrize("wrong", [(0.9, 0.2, 0.7), (0.3, -0.3, 0.7), (0.3, 0.2, 1.2)])
def test_few_rays_fit_at_another_pose(wrong):
    explained, through_walls = fit(MAP, wrong, SEEN, ANGLES, BOUNDS, 0.1)
    assert explained < 0.7
    assert through_walls > 0.1


@pytest.mark.parametrize("off", [(0.1, 0.05, 0.1), (-0.08, -0.1, -0.08)])
def test_a_pose_that_is_nearly_right_explains_what_is_seen_from_a_place_at_a_wall(off):
    """From there few rays end at a wall: along the wall a small angle is a long way."""
    pose = (2.75, -0.75, -1.2)
    explained, through_walls = fit(MAP, np.add(pose, off), ranges(*pose), ANGLES, BOUNDS, 0.2)
    assert explained > 0.9
    assert through_walls < 0.1


def test_deviations_are_those_of_the_least_certain_direction():
    covariance = np.zeros((6, 6))
    covariance[:2, :2] = [[0.05, 0.04], [0.04, 0.05]]  # 0.09 m^2 along the diagonal, 0.01 across
    covariance[5, 5] = 0.04
    assert deviations(covariance.ravel()) == pytest.approx((0.3, 0.2))
