"""Messages as this package's own types."""

import numpy as np

from robotont_driver.kinematics.se2 import pose_of
from robotont_map_navigation.floor_map import FloorMap


def floor_map_of(message):
    """FloorMap of a nav_msgs/OccupancyGrid."""
    cells = np.array(message.data, np.int8).reshape(message.info.height, message.info.width)
    return FloorMap(cells, message.info.resolution, pose_of(message.info.origin))
