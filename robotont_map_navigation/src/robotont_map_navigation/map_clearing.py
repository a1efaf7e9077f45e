"""Room for the robot where it stands: the map's walls give way to its footprint, and close again behind it.

A robot beside a wall may stand in it by the error of its pose, and planners refuse every way that begins in an
obstacle. So within the radius that the robot needs nothing is an obstacle. Where that cuts through a wall, the cells
beyond, which the robot cannot see past the wall, become the wall: it bulges, but never has a hole for a plan to take.
"""

import math
import time
from collections import deque

import numpy as np
import rospy
from map_msgs.msg import OccupancyGridUpdate

from robotont_driver.kinematics.se2 import compose
from robotont_map_navigation.readings import needed_radius

SETTLING = 2.0  # [s] without updates after a map of another size: costmaps must have got it before, they check nothing
FREE, WALL = 0, 100  # [%] as of nav_msgs/OccupancyGrid
RING = 1.5           # cells: width of the bulge, so that it is closed on diagonals too
REMEMBERED = 5.0     # [s] that a costmap may take to draw a change; until then the next one has its place too
# [s], at least, and [s] a cell between two updates of the whole map: after clear_costmaps a costmap draws the newest
# update, and no more
WHOLE = 5.0, 1e-5


class FootprintClearing:
    """Sends the cells of the map that give way to the robot, and takes them back when it has moved on."""

    def __init__(self):
        self._size = self._clearing = None
        self._settled = 0.0  # [s] time.monotonic() from which on updates are sent
        self._publisher = rospy.Publisher("map_for_planning_updates", OccupancyGridUpdate, queue_size=10)

    def take_map(self, floor_map):
        """Start anew with a FloorMap: the costmaps have forgotten all updates."""
        size = *floor_map.cells.shape, floor_map.resolution, *floor_map.origin
        if size != self._size:
            self._settled = time.monotonic() + SETTLING
        # a cell more than the robot needs: a costmap rounds its place to whole cells
        self._size, self._clearing = size, MapClearing(floor_map, needed_radius() + floor_map.resolution)

    def look(self, place):
        """Tell what has changed since the last look, with the robot at (x [m], y [m], yaw) on the map."""
        clearing, now = self._clearing, time.monotonic()
        update = clearing and now >= self._settled and clearing.move(place[:2], now)
        if update:
            update.header.frame_id, update.header.stamp = clearing.floor_map.frame, rospy.Time.now()
            self._publisher.publish(update)


class MapClearing:
    """Updates for costmaps that have a map, as a robot moves on it; without a master."""

    def __init__(self, floor_map, radius):
        """radius: [m] around the robot that is to be free."""
        self.floor_map, self._radius, self._reach = floor_map, radius, radius + RING * floor_map.resolution
        self._places = deque()  # (time [s], row, column) at walls
        self._whole, self._whole_at = True, -math.inf  # whether the newest one was of the whole map; [s] of the last

    def move(self, place, now):
        """The OccupancyGridUpdate for a robot at (x, y) [m] at the time `now` [s]; None where nothing has changed."""
        at_wall = self.floor_map.are_near_walls(place, self._reach)
        if at_wall:
            self._places.append((now, *self.floor_map.indices(*place)))
        while self._places and now - self._places[0][0] > REMEMBERED:
            self._places.popleft()
        if not self._places and self._whole:
            return None
        self._whole = not self._places or now - self._whole_at > max(WHOLE[0], WHOLE[1] * self.floor_map.cells.size)
        if self._whole:
            self._whole_at, top, left, (bottom, right) = now, 0, 0, self.floor_map.cells.shape
        else:
            around, reach = np.array(self._places)[:, 1:], self._reach / self.floor_map.resolution
            top, left = np.maximum(np.floor(around.min(axis=0) - reach), 0).astype(int)
            bottom, right = np.ceil(around.max(axis=0) + reach).astype(int)
        cells = self.floor_map.cells[top:bottom, left:right].copy()
        height, width = cells.shape
        if at_wall:
            rows, columns = np.indices(cells.shape) + 0.5
            x, y, _ = compose(self.floor_map.origin, ((columns + left) * self.floor_map.resolution,
                                                      (rows + top) * self.floor_map.resolution, 0.0))
            distance = np.hypot(x - place[0], y - place[1])
            ring = (distance >= self._radius) & (distance < self._reach)
            hidden = self.floor_map.are_behind_walls(place, (x[ring], y[ring]), 0.0)
            cells[distance < self._radius] = FREE
            cells[ring] = np.where(hidden, WALL, cells[ring])
        return OccupancyGridUpdate(x=left, y=top, height=height, width=width, data=cells.ravel().tolist())
