#!/usr/bin/env python3
"""Maps a world with slam.launch on the simulator, driven as docs/first-map.md says, and scores the map.

mapping_run.py WORLD [launch arguments, e.g. imu:=imu scan_field_of_view:=6.2831853] prints the figures of map_score as
JSON. WORLD: a file with one of ROUTES' names. Needs gmapping; has a ROS master of its own.
"""

import argparse
import json
import math
import time
from pathlib import Path

import numpy as np
import rospy
from geometry_msgs.msg import Twist
from map_score import score
from nav_msgs.msg import OccupancyGrid
from navigation_run import Simulated

from robotont_driver.kinematics.se2 import between
from robotont_map_navigation.readings import Newest
from robotont_simulator.world import read_world
from robotont_testing.harness import Master, wait_for
from robotont_testing.node_test import twist

PERIOD = 0.05        # [s] between two commands
SPEED = 0.2          # [m/s]
TURN = 0.5           # [rad/s]
ARRIVED = 0.05       # [m] from a place
FACING = 0.1         # [rad] from the way to a place; farther off it turns on the spot
REST = 4.0           # [s] of standing at the start and at each new place, in which a gyro's bias is learnt
SETTLED = 5.0        # [s] behind the drive, with no newer map
WALL = 100           # occupied, in an OccupancyGrid

# Places (x, y) [m] that the robot visits one after the other; it looks around at each new one.
ROUTES = {
    "mapping_flat": ((0.8, 0.8), (2.4, 0.7), (2.4, 1.9), (3.8, 1.9), (3.7, 3.0), (3.6, 5.2), (1.8, 5.2), (0.8, 4.0),
                     (2.2, 3.2), (3.7, 2.65), (5.1, 2.65), (5.1, 0.7), (5.1, 3.9), (5.2, 5.3), (6.4, 5.0), (7.0, 3.2),
                     (6.8, 0.9), (6.6, 3.0), (6.3, 5.1), (5.1, 5.2), (5.1, 2.65), (3.7, 2.65), (2.3, 2.9), (0.8, 2.6),
                     (0.8, 0.8)),
    "mapping_ring": ((0.8, 0.8), (2.4, 0.7), (3.4, 0.7), (3.45, 2.4), (4.6, 2.5), (4.3, 3.9), (3.3, 3.0), (2.5, 2.5),
                     (3.45, 2.2), (3.45, 0.7), (5.6, 0.9), (6.4, 2.2), (6.4, 3.8), (6.2, 5.3), (4.6, 5.5), (2.8, 5.4),
                     (1.0, 5.6), (0.9, 4.3), (1.0, 2.4), (0.8, 0.8), (2.4, 0.7), (3.4, 0.7)),
}


class Run(Simulated):
    """slam.launch, its newest map, and who drives, by the truth."""

    def __init__(self, master, world, arguments):
        super().__init__(master, "slam.launch", f"world:={world}", *arguments)
        self._command, self._map = rospy.Publisher("cmd_vel/hand", Twist, queue_size=1), Newest("map", OccupancyGrid)
        wait_for(lambda: self._map.message, "the first map", timeout=120)

    def follow(self, places):
        """Drive there, one after the other, and wait for the last map."""
        for number, place in enumerate(places):
            self._go(place)
            if place not in places[:number]:
                self._look_around(-1.0 if number % 2 else 1.0)
        self._drive(0.0, 0.0)
        wait_for(lambda: time.monotonic() > self._map.came + SETTLED, "the last map", timeout=60)

    def _drive(self, speed, turn):
        self._command.publish(twist(speed, 0.0, max(-TURN, min(TURN, turn))))
        time.sleep(PERIOD)

    def _go(self, place):
        while math.dist(self.pose()[:2], place) > ARRIVED:
            ahead, aside, _ = between(self.pose(), (*place, 0.0))
            off = math.atan2(aside, ahead)
            self._drive(min(SPEED, 0.05 + ahead) if abs(off) < FACING else 0.0, 1.5 * off)

    def _look_around(self, side):
        """Stand for a while, then turn all the way round, to the left where side is 1."""
        for _ in range(round(REST / PERIOD)):
            self._drive(0.0, 0.0)
        yaw, turned = self.pose()[2], 0.0
        while turned < 2 * math.pi:
            self._drive(0.0, side * (0.1 + 2 * math.pi - turned))
            step = math.remainder(self.pose()[2] - yaw, 2 * math.pi)
            yaw, turned = yaw + step, turned + side * step

    def walls(self):
        """n x 2 [m], the middles of the map's occupied cells."""
        found = self._map.message
        cells = np.argwhere(np.reshape(found.data, (found.info.height, found.info.width)) == WALL)[:, ::-1]
        return (cells + 0.5) * found.info.resolution + (found.info.origin.position.x, found.info.origin.position.y)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("world", type=Path)
    options, arguments = parser.parse_known_args()
    with Master() as master:
        run = Run(master, options.world.resolve(), arguments)
        start = run.pose()
        run.follow(ROUTES[options.world.stem])
        print(json.dumps(score(run.walls(), read_world(options.world), start)))


if __name__ == "__main__":
    main()
