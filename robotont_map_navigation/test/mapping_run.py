#!/usr/bin/env python3
"""Maps a world with slam.launch on the simulator, driven as docs/navigation.md "Mapping" says, and scores the map.

mapping_run.py WORLD [--backwards] [launch arguments, e.g. imu:=imu scan_field_of_view:=6.2831853] prints the
figures of map_score as JSON. WORLD: a file with one of mapping_route.ROUTES' names. Needs gmapping; has a ROS master of
its own.
"""

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np
import rospy
from geometry_msgs.msg import Twist
from map_score import score
from mapping_route import ROUTES, drive
from nav_msgs.msg import OccupancyGrid, Odometry

from robotont_driver.kinematics.se2 import between, compose, pose_of
from robotont_simulator.world import read_world
from robotont_testing.harness import Master, wait_for

RATE = 20.0          # [Hz] of the commands
SETTLED = 5.0        # [s] behind the drive, with no newer map
WALL = 100           # occupied, in an OccupancyGrid


class Run:
    """slam.launch, the truth and the newest map."""

    def __init__(self, master, world, arguments):
        self.truth = self.odom = self.map = self.start = None
        self.map_at = 0.0
        self.log = master.folder / "log"
        self.launch = master.launch("slam.launch", "sim:=true", f"port:={master.folder / 'board'}", f"world:={world}",
                                    *arguments, log=self.log)
        rospy.init_node("mapping_run", disable_signals=True)
        self._publisher = rospy.Publisher("cmd_vel/hand", Twist, queue_size=1)
        rospy.Subscriber("ground_truth/odom", Odometry, self._on_truth, tcp_nodelay=True)
        rospy.Subscriber("odom", Odometry, self._on_odom, tcp_nodelay=True)
        rospy.Subscriber("map", OccupancyGrid, self._on_map)
        wait_for(lambda: (self.map and self.odom) or self.launch.poll() is not None, "the first map", timeout=120)
        assert self.launch.poll() is None, self.log.read_text()

    def _on_truth(self, message):
        self.truth = pose_of(message.pose.pose)
        self.start = self.start or self.truth

    def _on_odom(self, message):
        self.odom = pose_of(message.pose.pose)

    def _on_map(self, message):
        self.map, self.map_at = message, time.monotonic()

    def follow(self, places):
        """Drive along the places."""
        rate, twists = rospy.Rate(RATE), drive(places, RATE)
        twist = next(twists)
        while twist is not None:
            message = Twist()
            message.linear.x, message.linear.y, message.angular.z = twist
            self._publisher.publish(message)
            rate.sleep()
            assert self.launch.poll() is None, self.log.read_text()
            try:
                twist = twists.send(self.truth)
            except StopIteration:
                twist = None
        wait_for(lambda: time.monotonic() > self.map_at + SETTLED, "the last map", timeout=60)

    def walls(self):
        """n x 2 [m], the middles of the map's occupied cells."""
        info = self.map.info
        cells = np.argwhere(np.reshape(self.map.data, (info.height, info.width)) == WALL)[:, ::-1]
        return (cells + 0.5) * info.resolution + (info.origin.position.x, info.origin.position.y)


def main():
    """Drive, score, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("world", type=Path)
    parser.add_argument("--backwards", action="store_true", help="along the route from its end")
    options, arguments = parser.parse_known_args()
    places = ROUTES[options.world.stem]
    if options.backwards:
        places = (places[0], *reversed(places))
    with Master() as master:
        run = Run(master, options.world.resolve(), arguments)
        begin = time.monotonic()
        run.follow(places)
        seconds = time.monotonic() - begin
        off = between(compose(run.start, run.odom), run.truth)
        print(json.dumps({**score(run.walls(), read_world(options.world), run.start), "seconds": round(seconds),
                          "odometry_off": [round(float(each), 3) for each in off]}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
