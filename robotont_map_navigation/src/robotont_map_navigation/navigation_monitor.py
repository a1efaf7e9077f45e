"""Beside move_base: whether the map fits, room where the robot stands, zeros for a board that a wall has blocked."""

import tf2_ros

from robotont_driver.ros.lifecycle import run_without_wheels
from robotont_map_navigation.footprint_clearing import FootprintClearing
from robotont_map_navigation.localization_check import PARAMETERS, LocalizationCheck
from robotont_map_navigation.unblock import Unblock


class NavigationMonitor:
    """The three in one process, for which /tf, 100 messages per second, is read once."""

    def __init__(self, parameters):
        transforms = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(transforms)
        self._parts = LocalizationCheck(parameters, transforms), FootprintClearing(transforms), Unblock()


def main():
    """Run navigation_monitor."""
    run_without_wheels("navigation_monitor", NavigationMonitor, PARAMETERS)
