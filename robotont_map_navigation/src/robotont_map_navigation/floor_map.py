"""A map of the floor in plain arrays, without ROS: what a goal and a scan are compared with."""

import math

import numpy as np

from robotont_driver.kinematics.se2 import between

OCCUPIED = 65  # [%] from here on a cell is a wall, as for the costmaps (config/navigation/costmap_common.yaml)


class FloorMap:
    """Cells of a nav_msgs/OccupancyGrid. Unknown cells are free, as they are for the planner.

    cells: H x W of int8, -1 unknown, else occupied in percent, row 0 at the origin; resolution: [m] per cell;
    origin: (x [m], y [m], yaw [rad]) of the corner of the first cell in the map's frame, whose name is `frame`.
    """

    def __init__(self, cells, resolution, origin, frame="map"):
        self.cells = np.asarray(cells)
        self._occupied = self.cells >= OCCUPIED
        self.resolution = resolution
        rows, columns = self.cells.shape
        self.size = columns * resolution, rows * resolution  # (length, width) [m] along the map's own axes
        self.origin = origin
        self.frame = frame
        self._near_walls = {}  # radius [m]: H x W of bool, cells whose middles are closer than that to one of a wall

    def refusal(self, place, radius=0.0):
        """Why a round robot of `radius` [m] cannot stand at (x, y) [m], in words; empty where it can."""
        clearance, words = self.clearance(place) if radius else math.inf, ""
        if not self._at(np.ones_like(self._occupied), *place):
            words = "off the map, which is {:.1f} m x {:.1f} m large".format(*self.size)
        elif self._at(self._occupied, *place):
            words = "in a wall of the map"
        elif clearance < radius:
            words = f"{clearance:.2f} m from a wall of the map, and the robot needs {radius:.2f} m"
        return words and f"({place[0]:.2f}, {place[1]:.2f}) is {words}"

    def clearance(self, place):
        """[m] from (x, y) [m] to the centre of the nearest occupied cell; inf where there is none."""
        cells = np.argwhere(self._occupied) + 0.5
        return self.resolution * float(np.hypot(*(cells - self.indices(*place)).T).min(initial=math.inf))

    def are_near_walls(self, places, tolerance):
        """Which places (x, y), arrays of one shape [m], are at most `tolerance` [m] away from an occupied cell."""
        if tolerance not in self._near_walls:
            reach = int(tolerance / self.resolution)
            near = np.zeros(np.add(self._occupied.shape, 2 * reach), bool)
            rows, columns = np.nonzero(self._occupied)
            disk = self.resolution * np.hypot(*(np.indices((2 * reach + 1, 2 * reach + 1)) - reach)) < tolerance
            for down, right in np.argwhere(disk):
                near[rows + down, columns + right] = True
            self._near_walls[tolerance] = near[reach:near.shape[0] - reach, reach:near.shape[1] - reach]
        return self._at(self._near_walls[tolerance], *places)

    def are_behind_walls(self, start, places, tolerance):
        """N of bool: which of N >= 1 rays from `start` (x, y) to places (2 x N, [m]) cross a wall before they end.

        One that ends at most `tolerance` [m] behind the wall ends at it.
        """
        way = np.subtract(places, np.reshape(start, (2, 1)))
        lengths = np.maximum(np.hypot(*way), 1e-9)
        steps = np.arange(0.0, lengths.max(), self.resolution)[:, None]  # [m] along each ray
        walls = self._at(self._occupied, *(np.reshape(start, (2, 1, 1)) + (way / lengths)[:, None] * steps))
        return (walls & (steps < lengths - tolerance)).any(axis=0)

    def are_unknown(self, places):
        """Which places (x, y), arrays of one shape [m], lie in cells of which the map knows nothing, or off it."""
        return ~self._at(self.cells >= 0, *places)

    def indices(self, x, y):
        """(row, column), not rounded, of places in the map's frame [m]."""
        along, across, _ = between(self.origin, (x, y, 0.0))
        return across / self.resolution, along / self.resolution

    def _at(self, cells, x, y):
        """What cells (H x W of bool) are at places in the map's frame [m]; off the map: not."""
        row, column = (np.floor(index).astype(int) for index in self.indices(x, y))
        inside = (row >= 0) & (row < cells.shape[0]) & (column >= 0) & (column < cells.shape[1])
        return inside & cells[row * inside, column * inside]
