"""A robot that has looked all around is found, and a place that looks like another one is told."""

import math
import random

import numpy as np
import pytest

from robotont_driver.kinematics.se2 import between, compose
from robotont_map_navigation.floor_map import FloorMap
from robotont_map_navigation.scan_fit import APART, search

SIZE = 5.0, 4.0  # [m] of the room, inside its walls of a cell each
CELL = 0.05
ANGLES = np.linspace(-math.pi, math.pi, 180, endpoint=False)
CLEARANCE = 0.1
SEES = 6.0       # [m] the whole room: with less, places in the open look alike


def room(*walls):
    """A FloorMap of a room, turned by 0.4 rad; walls: (first row, last row, column), all in cells, inside it."""
    columns, rows = (round(side / CELL) for side in SIZE)
    cells = np.zeros((rows + 2, columns + 2), np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = 100
    for first, last, column in walls:
        cells[first:last, column] = 100
    return FloorMap(cells, CELL, (-1.0, 2.0, 0.4))


def look(floor_map, pose):
    """(ends 2 x N, free 2 x M) of a scanner all around at a pose, by small steps along each ray."""
    steps = np.arange(0.0, SEES, 0.01)
    x, y, _ = compose((pose[0], pose[1], 0.0), (np.cos(ANGLES + pose[2])[:, None] * steps,
                                                np.sin(ANGLES + pose[2])[:, None] * steps, 0.0))
    row, column = (np.floor(index).astype(int) for index in floor_map.indices(x, y))
    walls = floor_map.cells[np.clip(row, 0, floor_map.cells.shape[0] - 1),
                            np.clip(column, 0, floor_map.cells.shape[1] - 1)] > 0
    ends = walls.any(axis=1)
    lengths = np.where(ends, steps[walls.argmax(axis=1)], SEES)
    rays = np.array([lengths * np.cos(ANGLES), lengths * np.sin(ANGLES)])
    return rays[:, ends], rays[:, ~ends]


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(1, 20))])
def test_a_robot_in_a_room_with_a_wall_in_it_is_found_whatever_wrong_pose_is_believed(seed):
    floor_map = room((0, 30, 35))
    draw = random.Random(seed)
    while True:
        inside = draw.uniform(0.3, SIZE[0] - 0.3), draw.uniform(0.3, SIZE[1] - 0.3), draw.uniform(-math.pi, math.pi)
        pose = compose(floor_map.origin, inside)
        if floor_map.clearance(pose[:2]) > 0.3:
            break
    seen = look(floor_map, pose)
    for believed in (None, compose(pose, (1.0, 0.5, 2.0))):
        first, *others = search(floor_map, seen, CLEARANCE, believed)
        x, y, yaw = between(pose, first.pose)
        assert math.hypot(x, y) < 0.1
        assert abs(math.remainder(yaw, 2 * math.pi)) < 0.05
        assert first.share > 0.9
        assert all(first.share - other.share > 0.05 for other in others)


def test_an_empty_room_looks_alike_from_both_its_ends():
    floor_map = room()
    pose = compose(floor_map.origin, (1.0, 1.2, 0.3))
    other = compose(floor_map.origin, (SIZE[0] + 2 * CELL - 1.0, SIZE[1] + 2 * CELL - 1.2, 0.3 + math.pi))
    first, second, *_ = search(floor_map, look(floor_map, pose), CLEARANCE)
    assert first.share - second.share < 0.05
    for expected in (pose, other):
        assert min(math.dist(expected[:2], found.pose[:2]) for found in (first, second)) < 0.1
    assert math.dist(first.pose[:2], second.pose[:2]) > APART[0]


def test_a_right_pose_is_not_given_up_for_a_cupboard_that_has_moved():
    """To the opposite corner, where the map fits better with the robot at the opposite place."""
    floor_map, truth = room((1, 10, 35)), room((72, 81, 66))
    pose = compose(floor_map.origin, (1.6, 1.5, 0.3))
    seen = look(truth, pose)
    moved, *_ = search(floor_map, seen, CLEARANCE)
    assert math.dist(pose[:2], moved.pose[:2]) > 1.0
    first, *_ = search(floor_map, seen, CLEARANCE, believed=compose(pose, (0.1, 0.0, 0.1)))
    x, y, yaw = between(pose, first.pose)
    assert math.hypot(x, y) < 0.12
    assert abs(math.remainder(yaw, 2 * math.pi)) < 0.06
