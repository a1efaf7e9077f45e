"""Beside move_base: whether the map fits, room where the robot stands, staying at a goal, an end to pushing."""

import copy

import rospy
import tf2_ros
from nav_msgs.msg import OccupancyGrid

from robotont_driver.ros.lifecycle import run_without_wheels
from robotont_map_navigation import arrival, localization_check
from robotont_map_navigation.arrival import Arrival
from robotont_map_navigation.footprint_clearing import FootprintClearing
from robotont_map_navigation.held import Held
from robotont_map_navigation.localization_check import LocalizationCheck

PARAMETERS = (*localization_check.PARAMETERS, *arrival.PARAMETERS)


class NavigationMonitor:
    """The four in one process, for which /tf, 100 messages per second, is read once."""

    def __init__(self, parameters):
        transforms = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(transforms)
        self._parts = (LocalizationCheck(parameters, transforms), FootprintClearing(transforms), Arrival(parameters),
                       Held())
        self._map = rospy.Publisher("map_for_amcl", OccupancyGrid, queue_size=1, latch=True)
        rospy.Subscriber("map", OccupancyGrid, self._on_map, queue_size=1)

    def _on_map(self, message):
        """Half a cell farther, for amcl takes the middle of a cell for its corner."""
        shifted = OccupancyGrid(message.header, copy.deepcopy(message.info), message.data)
        place, half = shifted.info.origin.position, shifted.info.resolution / 2
        place.x, place.y = place.x + half, place.y + half
        self._map.publish(shifted)


def main():
    """Run navigation_monitor."""
    run_without_wheels("navigation_monitor", NavigationMonitor, PARAMETERS)
