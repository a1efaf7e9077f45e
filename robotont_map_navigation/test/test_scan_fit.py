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


def test_all_rays_fit_at_the_true_pose():
    pose = (0.3, 0.2, 0.7)
    assert fit(MAP, pose, ranges(*pose), ANGLES, BOUNDS, 0.1) == (1.0, 0.0)


@pytest.mark.parametrize("wrong", [(0.9, 0.2, 0.7), (0.3, -0.3, 0.7), (0.3, 0.2, 1.2)])
def test_few_rays_fit_at_another_pose(wrong):
    explained, through_walls = fit(MAP, wrong, ranges(0.3, 0.2, 0.7), ANGLES, BOUNDS, 0.1)
    assert explained < 0.7
    assert through_walls > 0.1


def test_an_obstacle_that_fills_the_view_goes_through_no_wall():
    pose = (0.3, 0.2, 0.7)
    assert fit(MAP, pose, np.minimum(ranges(*pose), 0.4), ANGLES, BOUNDS, 0.1) == (0.0, 0.0)


def test_rays_that_show_nothing_do_not_count():
    pose = (0.3, 0.2, 0.7)
    seen = ranges(*pose)
    seen[:39] = np.tile([math.nan, 0.01, 5.0], 13)
    assert fit(MAP, pose, seen, ANGLES, BOUNDS, 0.1) == (1.0, 0.0)
    seen[9:] = math.nan
    assert fit(MAP, pose, seen, ANGLES, BOUNDS, 0.1) is None


def test_a_ray_that_sees_nothing_where_the_map_has_a_wall_goes_through_it():
    pose = (0.3, 0.2, 0.7)
    seen = ranges(*pose)
    seen[::3] = math.inf
    explained, through_walls = fit(MAP, pose, seen, ANGLES, BOUNDS, 0.1)
    assert explained == pytest.approx(2 / 3)
    assert through_walls == pytest.approx(1 / 3)
    assert fit(MAP, pose, np.full(90, math.inf), ANGLES, (0.05, 0.5), 0.1) == (1.0, 0.0)  # a sensor that sees no wall


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
