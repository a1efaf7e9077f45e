#!/usr/bin/env python3
"""Maps a world with slam.launch on the simulator, driven as docs/first-map.md says, and scores the map.

mapping_run.py WORLD [launch arguments, e.g. imu:=imu scan_field_of_view:=6.2831853] prints the
figures of map_score as JSON. WORLD: a file with one of mapping_route.ROUTES' names. Needs gmapping; has a ROS master of
its own.
"""

import argparse
import contextlib
import json
import time
from pathlib import Path

import numpy as np
import rospy
from geometry_msgs.msg import Twist
from map_score import score
from mapping_route import ROUTES, drive
from nav_msgs.msg import OccupancyGrid, Odometry
from navigation_run import Simulated

from robotont_driver.kinematics.se2 import between, compose, pose_of
from robotont_simulator.world import read_world
from robotont_testing.harness import Master, wait_for
from robotont_testing.node_test import twist

RATE = 20.0          # [Hz] of the commands
SETTLED = 5.0        # [s] behind the drive, with no newer map
WALL = 100           # occupied, in an OccupancyGrid


class Run(Simulated):
    """slam.launch, its odometry and its newest map."""

    def __init__(self, master, world, arguments):
        super().__init__(master, "slam.launch", f"world:={world}", *arguments)
        self.odom = self.map = None
        self.start, self._map_at = self.pose(), 0.0
        self._publisher = rospy.Publisher("cmd_vel/hand", Twist, queue_size=1)
        rospy.Subscriber("odom", Odometry, self._on_odom, tcp_nodelay=True)
        rospy.Subscriber("map", OccupancyGrid, self._on_map)
        wait_for(lambda: self.map and self.odom, "the first map", timeout=120)

    def _on_odom(self, message):
        self.odom = pose_of(message.pose.pose)

    def _on_map(self, message):
        self.map, self._map_at = message, time.monotonic()

    def follow(self, places):
        """Drive there, one after the other, and wait for the last map."""
        rate, commands = rospy.Rate(RATE), drive(places, RATE)
        speeds = next(commands)
        with contextlib.suppress(StopIteration):
            while True:
                self._publisher.publish(twist(*speeds))
                rate.sleep()
                speeds = commands.send(self.pose())
        wait_for(lambda: time.monotonic() > self._map_at + SETTLED, "the last map", timeout=60)

    def walls(self):
        """n x 2 [m], the middles of the map's occupied cells."""
        info = self.map.info
        cells = np.argwhere(np.reshape(self.map.data, (info.height, info.width)) == WALL)[:, ::-1]
        return (cells + 0.5) * info.resolution + (info.origin.position.x, info.origin.position.y)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("world", type=Path)
    options, arguments = parser.parse_known_args()
    with Master() as master:
        run = Run(master, options.world.resolve(), arguments)
        run.follow(ROUTES[options.world.stem])
        off = between(compose(run.start, run.odom), run.pose())
        print(json.dumps({**score(run.walls(), read_world(options.world), run.start),
                          "odometry_off": [round(float(each), 3) for each in off]}))


if __name__ == "__main__":
    main()
