import numpy as np
import pytest
from scipy import ndimage

from robotont_map_navigation.floor_map import FloorMap
from robotont_map_navigation.map_clearing import REMEMBERED, WHOLE, MapClearing

CELL = 0.05     # [m]
RADIUS = 0.24   # [m]
WALL = 40       # column of a wall from bottom to top, 2.025 m from the left edge, which ends at row 60
ORIGIN = (-1.0, -2.0, 0.0)
CELLS = np.zeros((80, 80), np.int8)
CELLS[:60, WALL:WALL + 3] = 100, -1, 100
THIN = np.where(np.arange(80) == WALL, CELLS, 0).astype(np.int8)


def beside(distance, along=1.0):
    """(x, y) [m] of a place `distance` left of the middle of the wall's face, `along` from its lower end."""
    return ORIGIN[0] + (WALL + 0.5) * CELL - distance, ORIGIN[1] + along


def clearing(cells=CELLS):
    return MapClearing(FloorMap(cells, CELL, ORIGIN), RADIUS)


def changed(place, cells=CELLS):
    """The map as it is with the room that is made."""
    drawn = cells.copy()
    apply(drawn, clearing(cells).move(place, 0.0))
    return drawn


def apply(cells, update):
    if update is not None:
        cells[update.y:update.y + update.height, update.x:update.x + update.width] = np.reshape(
            update.data, (update.height, update.width))


@pytest.mark.parametrize("cells", [CELLS, THIN], ids=["thick", "thin"])
@pytest.mark.parametrize("distance", [0.2, 0.12, 0.05, 0.03, -0.08])
@pytest.mark.parametrize("along", [0.0, 1.0, 1.02])
def test_a_wall_that_gives_way_has_no_hole(cells, distance, along):
    """Not even for a robot as narrow as a cell. The map's edge and a row of wall close the ends."""
    if distance < 0 and cells is CELLS:
        distance -= 0.1  # beyond both faces
    drawn = changed(beside(distance, along), cells)
    drawn[60, :] = 100
    rooms, _ = ndimage.label(drawn <= 0)
    assert rooms[30, 0] != rooms[30, -1]


def test_the_end_of_a_wall_stays_where_it_is():
    """What the robot sees past the end is free, also where the wall gives way."""
    assert (changed(beside(0.15, 3.0))[60:] == 0).all()


def test_a_costmap_that_takes_every_update_has_the_map_but_for_the_place_of_now():
    own, costmap = clearing(), CELLS.copy()
    generator = np.random.default_rng(5)
    y, x = (np.indices(CELLS.shape) + 0.5) * CELL
    for step in range(200):
        place = beside(generator.uniform(-0.3, 0.4), generator.uniform(0.0, 3.5))  # amcl's pose may jump
        apply(costmap, own.move(place, 0.1 * step))
        distance = np.hypot(x + ORIGIN[0] - place[0], y + ORIGIN[1] - place[1])
        assert (costmap[distance < RADIUS] <= 0).all()
        far = distance > RADIUS + 2 * CELL
        assert (costmap[far] == CELLS[far]).all()
    apply(costmap, own.move(beside(1.0), 20.0))
    assert (costmap == CELLS).all()


def test_an_update_covers_what_was_changed_of_late():
    """A costmap draws the newest update only, when more than one came between two of its cycles."""
    own = clearing()
    own.move(beside(0.15, 1.0), -0.1)
    own.move(beside(0.15, 0.5), 0.0)
    own.move(beside(0.15, 2.0), 1.0)
    update = own.move(beside(1.0), WHOLE[0] - 0.2)
    assert update.y <= 10
    assert 40 <= update.y + update.height < 80


def test_the_whole_map_comes_again_and_again_and_last():
    """A costmap that is cleared draws of the map what the newest update had, and plans lead through walls."""
    own = clearing()
    times = np.arange(0.0, 30.0, 0.1)
    sent = {now: own.move(beside(0.15 if now < 20.0 else 1.0), now) for now in times}
    whole = [now for now, update in sent.items() if update and (update.height, update.width) == CELLS.shape]
    assert whole[0] == 0.0
    assert np.diff(whole).max() < WHOLE[0] + 0.3
    told = [now for now, update in sent.items() if update]
    assert whole[-1] == told[-1]
    assert abs(told[-1] - 20.0 - REMEMBERED) < 0.3, "then nothing"


@pytest.mark.parametrize("place", [(-0.99, -1.99), (2.99, 1.99), (3.1, 2.1), (50.0, 50.0), (-50.0, 0.0)])
def test_at_the_edge_of_the_map_and_off_it(place):
    drawn = changed(place, np.full((80, 80), 100, np.int8))  # of an update that is not all on the map numpy complains
    assert 0 in drawn or max(place) > 3 or min(place) < -2
