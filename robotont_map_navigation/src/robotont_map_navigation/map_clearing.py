"""Room for the robot where it stands: the map's walls give way to its footprint, and close again behind it.

A robot beside a wall may stand in it by the error of its pose, and planners refuse every way that begins in an
obstacle. So within the radius that the robot needs nothing is an obstacle. Where that cuts through a wall, the cells
beyond, which the robot cannot see past the wall, become the wall: it bulges, but never has a hole for a plan to take.
Pure: no ROS.
"""

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from robotont_map_navigation.floor_map import OCCUPIED

FREE, WALL = 0, 100  # [%] as of nav_msgs/OccupancyGrid
RING = 1.5           # cells: width of the bulge, so that it is closed on diagonals too
HIT = 0.71           # cells between a line of sight and the middle of a wall's cell that it hits: half a diagonal
OFF_WALLS = 1.5      # cells between the robot and all walls from where it is clear on which side of them it is
FARTHEST_LOOKOUT = 0.5  # [m] between the robot and such a place, farther off it shows nothing
REMEMBERED = 5.0     # [s] that a costmap may take to draw a change; until then the next one has its place too
REPEATED = 1.0       # [s] between two equal updates, for costmaps that have started or got the map in the meantime


class Update(NamedTuple):
    """New values of a part of the map: H x W cells [%], the first of which is at (row, column)."""

    row: int
    column: int
    cells: np.ndarray


class MapClearing:
    """Updates for costmaps that have a map, as a robot moves on it."""

    def __init__(self, floor_map, radius, lookout=None):
        """radius: [m] around the robot that is to be free; lookout: that of the map before."""
        self._map = floor_map
        self._radius = radius
        self.lookout = lookout   # (x, y) [m] of the newest place from where the robot's side of all walls was clear
        self._changed = {}       # (row, column): value, as sent last
        self._sent = -math.inf   # [s] newest update
        self._places = deque()   # (time [s], first row, first column, last row, last column) of what was changed

    def move(self, place, now):
        """The Update for a robot at (x, y) [m] at the time `now` [s]; None when there is nothing new."""
        if not self._map.are_near_walls(np.transpose([place]), OFF_WALLS * self._map.resolution):
            self.lookout = place
        near = self.lookout and math.dist(self.lookout, place) <= FARTHEST_LOOKOUT
        changed = cleared_cells(self._map, place, self.lookout if near else None, self._radius)
        if changed == self._changed and not (changed and now - self._sent >= REPEATED):
            return None
        while self._places and now - self._places[0][0] > REMEMBERED:
            self._places.popleft()
        cells = [*self._changed, *changed]
        self._places.append((now, *np.min(cells, axis=0), *np.max(cells, axis=0)))
        self._changed, self._sent = changed, now
        _, *firsts, _, _ = np.min(self._places, axis=0).astype(int)
        *_, last_row, last_column = np.max(self._places, axis=0).astype(int)
        row, column = firsts
        cells = self._map.cells[row:last_row + 1, column:last_column + 1].copy()
        for (at_row, at_column), value in changed.items():
            cells[at_row - row, at_column - column] = value
        return Update(int(row), int(column), cells)


def cleared_cells(floor_map, place, lookout, radius):
    """{(row, column): value} of the cells of a FloorMap that change for a robot at `place`, (x, y) [m].

    radius: [m] around it that is to be free; lookout: (x, y) [m] near it, off all walls, which decides what lies
    behind walls; None: the walls are cut, and do not bulge.
    """
    row, column = floor_map.indices(*place)
    near = radius / floor_map.resolution
    top, left, cells = _part(floor_map, [(row, column)], near + RING)
    rows, columns = np.indices(cells.shape)
    distance = np.hypot(rows + top + 0.5 - row, columns + left + 0.5 - column)
    inside = distance < near
    if not (inside & (cells >= OCCUPIED)).any():
        return {}
    changed = {cell: FREE for cell in _places(inside & ((cells >= OCCUPIED) | (cells < 0)), top, left)}
    if lookout:
        ring = _places(~inside & (distance < near + RING) & (cells < OCCUPIED), top, left)
        changed.update({cell: WALL for cell in _hidden(floor_map, ring, floor_map.indices(*lookout), near + RING)})
    return changed


def _hidden(floor_map, cells, lookout, reach):
    """Those of the cells, (row, column), that are behind walls for one who stands at `lookout`, (row, column)."""
    top, left, around = _part(floor_map, [lookout, *cells], reach)
    walls = np.argwhere(around >= OCCUPIED) + [top, left] + 0.5
    ways = np.array(cells).reshape(-1, 1, 2) + 0.5 - lookout
    to_walls = walls - lookout
    share = np.clip((ways * to_walls).sum(axis=-1) / (ways ** 2).sum(axis=-1), 0.0, 1.0)  # of the way, beside a wall
    missed = np.linalg.norm(share[..., None] * ways - to_walls, axis=-1)
    return [cell for cell, hit in zip(cells, (missed < HIT).any(axis=1)) if hit]


def _part(floor_map, places, reach):
    """(first row, first column, cells) of the part of the map up to `reach` cells from places (row, column)."""
    low, high = np.min(places, axis=0) - reach, np.max(places, axis=0) + reach
    top, left = np.maximum(np.floor(low).astype(int), 0)
    bottom, right = np.maximum(np.ceil(high).astype(int), 0)
    return top, left, floor_map.cells[top:bottom, left:right]


def _places(mask, top, left):
    """[(row, column)] of a part's cells."""
    return [(int(row) + int(top), int(column) + int(left)) for row, column in np.argwhere(mask)]
