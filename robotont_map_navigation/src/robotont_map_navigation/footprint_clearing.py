"""Keeps the place where the robot stands free of the map's walls, for the costmaps: sends map_for_planning_updates."""

import time

import rospy
from map_msgs.msg import OccupancyGridUpdate

from robotont_driver.ros.worker import Worker
from robotont_map_navigation.map_clearing import MapClearing
from robotont_map_navigation.readings import base_frame, look_up, needed_radius, place_of

PERIOD = 0.1   # [s] between two looks at where the robot is
SETTLING = 2.0  # [s] without updates after a map of another size: costmaps must have got it before, they check nothing


class FootprintClearing:
    """Sends the cells of the map that give way to the robot, and takes them back when it has moved on."""

    def __init__(self, transforms):
        self._transforms, self._base = transforms, base_frame()
        self._frame = self._size = self._clearing = None
        self._settled = 0.0  # [s] time.monotonic() from which on updates are sent
        self._publisher = rospy.Publisher("map_for_planning_updates", OccupancyGridUpdate, queue_size=10)
        Worker(self._look)

    def take_map(self, message, floor_map):
        """Start anew with a map, nav_msgs/OccupancyGrid and FloorMap: the costmaps have forgotten all updates."""
        size = *floor_map.cells.shape, floor_map.resolution, *floor_map.origin
        if size != self._size:
            self._settled = time.monotonic() + SETTLING
        self._size, self._frame = size, message.header.frame_id
        # a cell more than the robot needs: a costmap rounds its place to whole cells
        self._clearing = MapClearing(floor_map, needed_radius() + floor_map.resolution)

    def _look(self):
        """Tell what has changed since the last look; returns the time to rest."""
        clearing = self._clearing
        place = clearing and place_of(look_up(self._transforms, self._frame, self._base))
        update = place and time.monotonic() >= self._settled and clearing.move(place[:2], time.monotonic())
        if update:
            message = OccupancyGridUpdate(x=update.column, y=update.row)
            message.header.frame_id, message.header.stamp = self._frame, rospy.Time.now()
            message.height, message.width = update.cells.shape
            message.data = update.cells.ravel().tolist()
            self._publisher.publish(message)
        return PERIOD
