import pytest
from navigation_messages import walled

from robotont_driver.kinematics.se2 import compose
from robotont_map_navigation.floor_map import FloorMap

RADIUS = 0.16


def room(origin):
    """FloorMap of 4 m x 2 m with a wall around it, and one across it at x = 2 m whose door begins at the upper wall."""
    cells = walled(40, 80)
    cells[:32, 40] = 100
    cells[1:-1, 60] = -1  # unknown cells are free
    return FloorMap(cells, 0.05, origin)


@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.0), (10.0, -5.0, 0.5), (10.0, -5.0, -2.0)])
@pytest.mark.parametrize("goal, words", [
    ((1.0, 1.0), ""), ((3.0, 1.0), ""), ((1.0, 0.215), ""), ((2.02, 1.79), ""),
    ((4.5, 1.0), "off the map, which is 4.0 m x 2.0 m large"),
    ((-0.01, 1.0), "off the map, which is 4.0 m x 2.0 m large"),
    ((2.02, 0.5), "in a wall of the map"),
    ((1.01, 0.125), "0.10 m from a wall of the map, and the robot needs 0.16 m")])
def test_a_goal_is_refused_where_the_map_has_no_room(origin, goal, words):
    x, y, _ = compose(origin, (*goal, 0.0))
    assert room(origin).refusal((x, y), RADIUS) == (words and f"({x:.2f}, {y:.2f}) is {words}")
