"""Beside move_base: whether the map fits, room where the robot stands, staying at a goal, not pushing, giving way."""

import copy

import numpy as np
import rospy
from nav_msgs.msg import OccupancyGrid

from robotont_driver.ros.repeating_thread import RepeatingThread
from robotont_map_navigation.arrival import Arrival
from robotont_map_navigation.felt import Felt
from robotont_map_navigation.giving_way import GivesWay
from robotont_map_navigation.held import Held
from robotont_map_navigation.localization_check import LocalizationCheck
from robotont_map_navigation.map_clearing import FootprintClearing
from robotont_map_navigation.readings import Frames, floor_map_of

PARAMETERS = ()
PERIOD = 0.1  # [s] between two looks at where the robot is


class NavigationMonitor:
    """The five in one process, for which /tf, dozens of messages a second, and the map are read once."""

    def __init__(self, _parameters):
        self._frames = frames = Frames()
        self._check, self._clearing, self._arrival = LocalizationCheck(frames), FootprintClearing(), Arrival()
        felt = Felt(frames)
        self._others = Held(frames, felt), GivesWay(frames, felt)
        self._for_amcl, self._for_planning = (rospy.Publisher(f"map_for_{who}", OccupancyGrid, queue_size=1, latch=True)
                                              for who in ("amcl", "planning"))
        rospy.Subscriber("map", OccupancyGrid, self._on_map, queue_size=1)
        RepeatingThread(self._look)

    def _on_map(self, message):
        shifted = OccupancyGrid(message.header, copy.deepcopy(message.info), message.data)
        place, half = shifted.info.origin.position, shifted.info.resolution / 2
        place.x, place.y = place.x + half, place.y + half  # amcl takes the middle of a cell for its corner
        self._for_amcl.publish(shifted)
        self._for_planning.publish(wide_enough(message))
        self._check.floor_map = floor_map_of(message)
        self._clearing.take_map(self._check.floor_map)

    def _look(self):
        """Where the robot is on the map; the time to rest."""
        place = self._frames.robot_in(self._frames.map)
        if place:
            self._clearing.look(place)
            self._arrival.look(place)
        return PERIOD


def wide_enough(message):
    """The map for navfn, whose ways are never longer than twice its width: one that is higher than wide gets wider."""
    info = copy.deepcopy(message.info)
    if info.height <= info.width:
        return message
    cells = np.reshape(message.data, (info.height, info.width))
    # unknown ones, behind the last column: no cell moves
    cells = np.pad(cells, ((0, 0), (0, info.height)), constant_values=-1)
    info.width += info.height
    return OccupancyGrid(message.header, info, cells.ravel().tolist())
