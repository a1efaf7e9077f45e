import math

import numpy as np
import pytest

from robotont_map_navigation.floor_map import FloorMap
from robotont_map_navigation.map_clearing import FARTHEST_LOOKOUT, REMEMBERED, REPEATED, MapClearing, cleared_cells

CELL = 0.05     # [m]
RADIUS = 0.24   # [m]
WALL = 40       # column of a wall from bottom to top, 2.025 m from the left edge, which ends at row 60
ORIGIN = (-1.0, -2.0, 0.0)
CELLS = np.zeros((80, 80), np.int8)
CELLS[:60, WALL] = 100
CELLS[:60, WALL + 1] = -1
CELLS[:60, WALL + 2] = 100


def floor_map(cells=CELLS):
    return FloorMap(cells, CELL, ORIGIN)


def beside(distance, along=1.0):
    """(x, y) [m] of a place `distance` left of the middle of the wall's face, `along` from its lower end."""
    return ORIGIN[0] + (WALL + 0.5) * CELL - distance, ORIGIN[1] + along


def changed(place, lookout):
    """The map as it is with the room that is made."""
    cells = CELLS.copy()
    for (row, column), value in cleared_cells(floor_map(), place, lookout, RADIUS).items():
        assert cells[row, column] != value
        cells[row, column] = value
    return cells


def distances(place):
    """[m] of all cells' middles from a place."""
    rows, columns = np.indices(CELLS.shape)
    return np.hypot((columns + 0.5) * CELL + ORIGIN[0] - place[0], (rows + 0.5) * CELL + ORIGIN[1] - place[1])


@pytest.mark.parametrize("distance", [0.2, 0.12, 0.05, 0.0, -0.08])
@pytest.mark.parametrize("along", [0.0, 1.0, 1.02])
def test_a_wall_that_gives_way_has_no_hole(distance, along):
    """Not even for a robot as narrow as a cell. The map's edge and a row of wall close the ends."""
    place = beside(distance, along)
    cells = changed(place, beside(0.2, along))
    cells[60, :] = 100
    assert not FloorMap(cells, CELL, ORIGIN).is_connected(beside(0.6, 0.5), beside(-0.6, 0.5), CELL)


def test_the_way_out_is_free_for_the_whole_robot():
    place = beside(0.05)
    free = FloorMap(changed(place, beside(0.2)), CELL, ORIGIN)
    for step in np.arange(0.0, 0.3, 0.01):
        assert free.clearance((place[0] - step, place[1])) >= RADIUS


def test_the_end_of_a_wall_stays_where_it_is():
    """What the robot sees past the end is free, also where the wall gives way."""
    place = beside(0.15, 3.0)
    cells = changed(place, place)
    assert (cells[60:] == 0).all()


def test_the_place_before_decides_the_side_of_a_wall():
    own = MapClearing(floor_map(), RADIUS)
    for step, distance in enumerate(np.arange(0.3, -0.1, -0.02)):  # the pose drifts into the wall
        own.move(beside(distance), 0.1 * step)
    assert own.lookout == pytest.approx(beside(0.08))
    far = cleared_cells(floor_map(), beside(-0.08), own.lookout, RADIUS)
    assert {value for (_, column), value in far.items() if column > WALL + 2} == {100}
    own.move((own.lookout[0] + FARTHEST_LOOKOUT + 0.05, beside(0, 2.0)[1]), 9.0)  # a pose that was reset
    assert own.lookout[0] > beside(-0.2)[0]


def test_without_a_lookout_nearby_the_wall_is_cut_only():
    assert set(cleared_cells(floor_map(), beside(0.0), None, RADIUS).values()) == {0}
    own = MapClearing(floor_map(), RADIUS, lookout=beside(0.2, 1.0))
    nearby, far = own.move(beside(0.0, 1.0), 0.0), own.move(beside(0.0, 2.0), REMEMBERED + 1.0)
    assert (nearby.cells[:, WALL + 3 - nearby.column:] == 100).any()
    assert (far.cells[25:, WALL + 3 - far.column:] == 0).all()


def apply(cells, update):
    if update is not None:
        height, width = update.cells.shape
        cells[update.row:update.row + height, update.column:update.column + width] = update.cells


def test_a_costmap_that_takes_every_update_has_the_map_but_for_the_place_of_now():
    own, costmap = MapClearing(floor_map(), RADIUS), CELLS.copy()
    generator = np.random.default_rng(5)
    for step in range(200):
        place = beside(generator.uniform(-0.3, 0.4), generator.uniform(-0.1, 3.5))  # amcl's pose may jump
        apply(costmap, own.move(place, 0.1 * step))
        near = distances(place) < RADIUS
        assert (costmap[near] == 0).all()
        far = distances(place) > RADIUS + 2 * CELL
        assert (costmap[far] == CELLS[far]).all()
    apply(costmap, own.move(beside(1.0), 30.0))
    assert (costmap == CELLS).all()


def test_an_update_covers_what_was_changed_of_late():
    """A costmap draws the newest update only, when more than one came between two of its cycles."""
    own = MapClearing(floor_map(), RADIUS)
    own.move(beside(0.15, 0.5), 0.0)
    own.move(beside(0.15, 2.0), 1.0)
    update = own.move(beside(1.0), REMEMBERED - 0.1)
    assert update.row <= 10
    assert update.row + update.cells.shape[0] >= 40
    assert (update.cells == CELLS[update.row:update.row + update.cells.shape[0],
                                  update.column:update.column + update.cells.shape[1]]).all()
    own.move(beside(0.15, 2.0), REMEMBERED + 0.9)
    late = own.move(beside(1.0), 2 * REMEMBERED + 1.0)
    assert late.row > 20


def test_what_does_not_change_is_sent_again_but_seldom():
    own = MapClearing(floor_map(), RADIUS)
    assert own.move(beside(0.15), 0.0) is not None
    assert own.move(beside(0.15), REPEATED / 2) is None
    assert own.move(beside(0.15), REPEATED) is not None
    assert own.move(beside(1.0), REPEATED + 0.1) is not None
    assert own.move(beside(1.0), 3 * REPEATED) is None


@pytest.mark.parametrize("place", [(-1.0, -2.0), (-1.1, -2.1), (3.1, 2.1), (50.0, 50.0), (-50.0, 0.0)])
def test_at_the_edge_of_the_map_and_off_it(place):
    cells = np.full((80, 80), 100, np.int8)
    own = MapClearing(FloorMap(cells, CELL, ORIGIN), RADIUS)
    update = own.move(place, 0.0)
    if math.dist(place, (1.0, 0.0)) < 10:
        assert update.row >= 0
        assert update.column >= 0
        assert update.row + update.cells.shape[0] <= 80
        assert update.column + update.cells.shape[1] <= 80
        assert (update.cells == 0).any()
    else:
        assert update is None
