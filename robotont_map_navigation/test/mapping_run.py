#!/usr/bin/env python3
"""Maps a world with slam.launch on the simulator, driven as docs/first-map.md says, and scores the map's walls.

mapping_run.py [launch arguments, e.g. imu:=imu scan_field_of_view:=6.2831853] prints the figures of `score` as JSON.
Needs gmapping; has a ROS master of its own.
"""

import json
import math
import sys
import time
from pathlib import Path

import numpy as np
import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid
from navigation_run import Simulated
from scipy.optimize import minimize
from scipy.spatial import cKDTree

from robotont_driver.kinematics.se2 import between, compose
from robotont_map_navigation.readings import Newest
from robotont_simulator.world import OCCUPIED, draw_map, read_world
from robotont_testing.harness import Master, wait_for
from robotont_testing.node_test import twist

WORLD = Path(__file__).parent / "data" / "mapping_ring.yaml"
PERIOD = 0.05        # [s] between two commands
SPEED = 0.2          # [m/s]
TURN = 0.5           # [rad/s]
ARRIVED = 0.05       # [m] from a place
FACING = 0.1         # [rad] from the way to a place; farther off it turns on the spot
REST = 4.0           # [s] of standing at the start and at each new place, in which a gyro's bias is learnt
SETTLED = 5.0        # [s] behind the drive, with no newer map
WALL = 100           # occupied, in an OccupancyGrid

FINE = 0.02          # [m] of the world's true faces
WITHIN = 0.10        # [m] up to which a wall counts as found
FAR = 0.3            # [m] from which an error does not pull at the alignment any more

# Places (x, y) [m] that the robot visits one after the other; it looks around at each new one.
ROUTE = ((0.8, 0.8), (2.4, 0.7), (3.4, 0.7), (3.45, 2.4), (4.6, 2.5), (4.3, 3.9), (3.3, 3.0), (2.5, 2.5), (3.45, 2.2),
         (3.45, 0.7), (5.6, 0.9), (6.4, 2.2), (6.4, 3.8), (6.2, 5.3), (4.6, 5.5), (2.8, 5.4), (1.0, 5.6), (0.9, 4.3),
         (1.0, 2.4), (0.8, 0.8), (2.4, 0.7), (3.4, 0.7))


class Run(Simulated):
    """slam.launch, its newest map, and who drives, by the truth."""

    def __init__(self, master, arguments):
        super().__init__(master, "slam.launch", f"world:={WORLD}", *arguments)
        self._command, self._map = rospy.Publisher("cmd_vel/hand", Twist, queue_size=1), Newest("map", OccupancyGrid)
        wait_for(lambda: self._map.message, "the first map", timeout=120)

    def follow_route(self):
        """Drive it, and wait for the last map."""
        for number, place in enumerate(ROUTE):
            self._go(place)
            if place not in ROUTE[:number]:
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
        for turn, seconds in (0.0, REST), (side * TURN, 2 * math.pi / TURN):
            for _ in range(round(seconds / PERIOD)):
                self._drive(0.0, turn)

    def walls(self):
        """n x 2 [m], the middles of the map's occupied cells."""
        found = self._map.message
        cells = np.argwhere(np.reshape(found.data, (found.info.height, found.info.width)) == WALL)[:, ::-1]
        return (cells + 0.5) * found.info.resolution + (found.info.origin.position.x, found.info.origin.position.y)


def score(points, start):
    """Figures of a map's occupied cells, n x 2 [m] of their middles in the map's frame, best laid on the true faces.

    Nine of ten cells lie within p90_m of a face that a robot sees which goes wherever it can; recall: share of such
    faces that are found. start: (x, y, yaw) of the map's frame in the world, about.
    """
    image, corner = draw_map(read_world(WORLD), FINE)
    faces = np.argwhere(image[::-1] == OCCUPIED)[:, ::-1] * FINE + corner + FINE / 2
    nearest = cKDTree(faces)

    def moved(pose):
        return np.transpose(compose(pose, (*points.T, 0.0))[:2])

    def distances(pose):
        return nearest.query(moved(pose))[0]
    around = start + np.vstack([np.zeros(3), np.diag([0.1, 0.1, 0.05])])
    pose = minimize(lambda placed: np.minimum(distances(placed), FAR).mean(), start, method="Nelder-Mead",
                    options={"initial_simplex": around, "xatol": 1e-3}).x
    found = cKDTree(moved(pose)).query(faces)[0] <= WITHIN
    return {"p90_m": round(float(np.percentile(distances(pose), 90)), 3), "recall": round(float(np.mean(found)), 2)}


def main():
    with Master() as master:
        run = Run(master, sys.argv[1:])
        start = run.pose()
        run.follow_route()
        print(json.dumps(score(run.walls(), start)))


if __name__ == "__main__":
    main()
