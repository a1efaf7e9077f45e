"""Keeps the place where the robot stands free of the map's walls, for the costmaps: sends map_for_planning_updates.

It takes the robot's radius and frame from the parameters of move_base/global_costmap.
"""

import time

import rospy
import tf2_ros
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid

from robotont_driver.ros.worker import Worker
from robotont_map_navigation.footprint import base_frame, needed_radius
from robotont_map_navigation.map_clearing import MapClearing
from robotont_map_navigation.messages import floor_map_of

PERIOD = 0.1   # [s] between two looks at where the robot is
SETTLING = 2.0  # [s] without updates after a map of another size: costmaps must have got it before, they check nothing


class FootprintClearing:
    """Sends the cells of the map that give way to the robot, and takes them back when it has moved on."""

    def __init__(self, transforms):
        self._map = None  # nav_msgs/OccupancyGrid that came last and has not been looked at
        self._frame = self._base = self._size = self._clearing = None
        self._settled = 0.0  # [s] time.monotonic() from which on updates are sent
        self._transforms = transforms
        self._publisher = rospy.Publisher("map_for_planning_updates", OccupancyGridUpdate, queue_size=10)
        rospy.Subscriber("map", OccupancyGrid, self._on_map, queue_size=1)
        Worker(self._look)

    def _on_map(self, message):
        self._map = message

    def _look(self):
        """Tell what has changed since the last look; returns the time to rest."""
        message, self._map = self._map, None
        if message is not None:
            self._take(message)
        if self._clearing is not None and time.monotonic() >= self._settled:
            try:
                found = self._transforms.lookup_transform(self._frame, self._base, rospy.Time()).transform
            except tf2_ros.TransformException:
                return PERIOD
            update = self._clearing.move((found.translation.x, found.translation.y), time.monotonic())
            if update is not None:
                self._publish(update)
        return PERIOD

    def _take(self, message):
        """Start anew with a map, of which the costmaps have forgotten all updates."""
        info = message.info
        size = info.width, info.height, info.resolution, info.origin.position.x, info.origin.position.y
        if size != self._size:
            self._settled = time.monotonic() + SETTLING
        lookout = self._clearing.lookout if self._clearing is not None else None
        self._frame, self._base, self._size = message.header.frame_id, base_frame(), size
        # a cell more than the robot needs: a costmap rounds its place to whole cells
        self._clearing = MapClearing(floor_map_of(message), needed_radius() + info.resolution, lookout)

    def _publish(self, update):
        message = OccupancyGridUpdate(x=update.column, y=update.row)
        message.header.frame_id, message.header.stamp = self._frame, rospy.Time.now()
        message.height, message.width = update.cells.shape
        message.data = update.cells.ravel().tolist()
        self._publisher.publish(message)
