import math
import time

import numpy as np
import pytest

from robotont_map_navigation.floor_map import FloorMap
from robotont_map_navigation.goal import refusal

RADIUS = 0.16
# 4 m x 2 m with a wall around it, and one across it at x = 2 m whose door begins at the upper wall
CELLS = np.zeros((40, 80), np.int8)
CELLS[[0, -1]] = CELLS[:, [0, -1]] = 100


def room(door, origin=(0.0, 0.0, 0.0)):
    """FloorMap of the two rooms with a door of so many cells."""
    cells = CELLS.copy()
    cells[:39 - door, 40] = 100
    return FloorMap(cells, 0.05, origin)


NO_WAY = ("no way from the robot at (0.50, 0.50) to (3.00, 1.00): walls of the map, or gaps narrower than 0.32 m, lie "
          "between them")


@pytest.mark.parametrize("door, start, goal, words", [
    (12, (0.5, 0.5), (1.0, 1.0), ""), (12, (0.5, 0.5), (3.0, 1.0), ""), (12, (0.5, 0.5), (1.0, 0.2), ""),
    (12, (0.5, 0.5), (4.5, 1.0), "(4.50, 1.00) is off the map, which is 4.0 m x 2.0 m large"),
    (12, (0.5, 0.5), (-0.01, 1.0), "(-0.01, 1.00) is off the map, which is 4.0 m x 2.0 m large"),
    (12, (0.5, 0.5), (2.02, 0.5), "(2.02, 0.50) is in a wall of the map"),
    (12, (0.5, 0.5), (1.0, 0.125), "(1.00, 0.12) is 0.10 m from a wall of the map, and the robot needs 0.16 m"),
    (6, (0.5, 0.5), (3.0, 1.0), NO_WAY), (7, (0.5, 0.5), (3.0, 1.0), ""), (6, None, (3.0, 1.0), ""),
])
def test_a_goal_is_refused_for_what_the_map_shows(door, start, goal, words):
    assert refusal(room(door), goal, start, RADIUS) == words


def test_a_robot_that_stands_at_a_wall_has_a_way_out_but_not_through_the_wall():
    for x in (1.92, 1.97, 2.0):
        assert room(door=0).is_connected((x, 1.0), (1.0, 1.0), RADIUS)
    assert not room(door=0).is_connected((1.90, 1.0), (3.0, 1.0), RADIUS)


def test_unknown_cells_are_free():
    cells = CELLS.copy()
    cells[1:-1, 40] = -1
    assert refusal(FloorMap(cells, 0.05, (0.0, 0.0, 0.0)), (3.0, 1.0), (0.5, 0.5), RADIUS) == ""


@pytest.mark.parametrize("yaw", [0.0, 0.5, -2.0])
def test_the_map_lies_where_its_origin_says(yaw):
    turned = room(door=7, origin=(10.0, -5.0, yaw))

    def place(x, y):
        return 10 + math.cos(yaw) * x - math.sin(yaw) * y, -5 + math.sin(yaw) * x + math.cos(yaw) * y

    assert turned.bars(place(2.02, 0.5)) == "in a wall of the map"
    assert turned.bars(place(4.5, 1.0)).startswith("off the map")
    assert not turned.bars(place(2.02, 1.8))
    assert not turned.bars(place(3.9, 1.9))
    assert turned.clearance(place(2.225, 0.525)) == pytest.approx(0.2)
    assert turned.is_connected(place(0.5, 0.5), place(3.0, 1.0), RADIUS)


def test_places_at_walls():
    floor_map = room(door=7)
    x = np.array([0.1, 2.0, 1.0, 9.0])
    assert floor_map.are_near_walls((x, np.full(4, 1.0)), 0.15).tolist() == [True, True, False, False]


def test_a_large_map_is_searched_within_the_time_that_a_goal_has():
    cells = np.full((2000, 2000), -1, np.int8)  # 100 m x 100 m
    cells[:, 1000] = 100
    start = time.process_time()
    assert "no way" in refusal(FloorMap(cells, 0.05, (0.0, 0.0, 0.0)), (90.0, 90.0), (1.0, 1.0), RADIUS)
    assert time.process_time() - start < 1.0  # [s] of the processor; 0.4 s as measured
