"""Room for the robot where it stands: the map's walls give way to its footprint, and close again behind it.

A robot beside a wall may stand in it by the error of its pose, and planners refuse every way that begins in an
obstacle. So within the radius that the robot needs nothing is an obstacle. Where that cuts through a wall, the cells
beyond, which the robot cannot see past the wall, become the wall: it bulges, but never has a hole for a plan to take.
Pure: no ROS.
"""

from collections import deque
from typing import NamedTuple

import numpy as np

from robotont_driver.kinematics.se2 import compose

FREE, WALL = 0, 100  # [%] as of nav_msgs/OccupancyGrid
RING = 1.5           # cells: width of the bulge, so that it is closed on diagonals too
REMEMBERED = 5.0     # [s] that a costmap may take to draw a change; until then the next one has its place too


class Update(NamedTuple):
    """New values of a part of the map: H x W cells [%], the first of which is at (row, column)."""

    row: int
    column: int
    cells: np.ndarray


class MapClearing:
    """Updates for costmaps that have a map, as a robot moves on it."""

    def __init__(self, floor_map, radius):
        """radius: [m] around the robot that is to be free."""
        self._map, self._radius, self._reach = floor_map, radius, radius + RING * floor_map.resolution
        self._places = deque()  # (time [s], row, column) at walls

    def move(self, place, now):
        """The Update for a robot at (x, y) [m] at the time `now` [s]; None far from walls."""
        at_wall = self._map.are_near_walls(np.transpose([place]), self._reach)[0]
        if at_wall:
            self._places.append((now, *self._map.indices(*place)))
        while self._places and now - self._places[0][0] > REMEMBERED:
            self._places.popleft()
        if not self._places:
            return None
        around, reach = np.array(self._places)[:, 1:], self._reach / self._map.resolution
        top, left = np.maximum(np.floor(around.min(axis=0) - reach), 0).astype(int)
        bottom, right = np.ceil(around.max(axis=0) + reach).astype(int)
        cells = self._map.cells[top:bottom, left:right].copy()
        if at_wall:
            self._make_room(cells, top, left, place)
        return Update(int(top), int(left), cells)

    def _make_room(self, cells, top, left, place):
        """Around a place, in cells of the map from (top, left) on."""
        rows, columns = np.indices(cells.shape) + 0.5
        x, y, _ = compose(self._map.origin, ((columns + left) * self._map.resolution,
                                             (rows + top) * self._map.resolution, 0.0))
        distance = np.hypot(x - place[0], y - place[1])
        ring = (distance >= self._radius) & (distance < self._reach)
        hidden = self._map.are_behind_walls(place, (x[ring], y[ring]), 0.0)
        cells[distance < self._radius] = FREE
        cells[ring] = np.where(hidden, WALL, cells[ring])
