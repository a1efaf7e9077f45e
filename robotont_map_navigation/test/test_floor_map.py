import math

import numpy as np
import pytest
from navigation_messages import walled

from robotont_map_navigation.floor_map import FloorMap

RADIUS = 0.16


def room(origin=(0.0, 0.0, 0.0)):
    """FloorMap of 4 m x 2 m with a wall around it, and one across it at x = 2 m whose door begins at the upper wall."""
    cells = walled(40, 80)
    cells[:32, 40] = 100
    cells[1:-1, 60] = -1  # unknown cells are free
    return FloorMap(cells, 0.05, origin)


@pytest.mark.parametrize("goal, words", [
    ((1.0, 1.0), ""), ((3.0, 1.0), ""), ((1.0, 0.2), ""),
    ((4.5, 1.0), "(4.50, 1.00) is off the map, which is 4.0 m x 2.0 m large"),
    ((-0.01, 1.0), "(-0.01, 1.00) is off the map, which is 4.0 m x 2.0 m large"),
    ((2.02, 0.5), "(2.02, 0.50) is in a wall of the map"),
    ((1.0, 0.125), "(1.00, 0.12) is 0.10 m from a wall of the map, and the robot needs 0.16 m")])
def test_a_goal_is_refused_where_the_map_has_no_room(goal, words):
    assert room().refusal(goal, RADIUS) == words


@pytest.mark.parametrize("yaw", [0.0, 0.5, -2.0])
def test_the_map_lies_where_its_origin_says(yaw):
    turned = room((10.0, -5.0, yaw))

    def place(x, y):
        return 10 + math.cos(yaw) * x - math.sin(yaw) * y, -5 + math.sin(yaw) * x + math.cos(yaw) * y

    assert turned.refusal(place(2.02, 0.5)).endswith(" is in a wall of the map")
    assert " is off the map" in turned.refusal(place(4.5, 1.0))
    assert not turned.refusal(place(2.02, 1.8))
    assert not turned.refusal(place(3.9, 1.9))
    assert turned.clearance(place(2.225, 0.525)) == pytest.approx(0.2)


def test_places_at_walls():
    floor_map = room()
    x = np.array([0.1, 2.0, 1.0, 9.0])
    assert floor_map.are_near_walls((x, np.full(4, 1.0)), 0.15).tolist() == [True, True, False, False]
