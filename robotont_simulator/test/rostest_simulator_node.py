#!/usr/bin/env python3
"""Worlds and ports of the simulator, those that there are and others."""

import math
import re
import time

import numpy as np
import rosparam
import rospy
import rostest
import yaml
from nav_msgs.msg import OccupancyGrid, Odometry
from PIL import Image
from simulation_test import SimulationTest
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

from robotont_driver.kinematics.se2 import between, compose, yaw_of
from robotont_simulator.simulated_board import LONGEST_STALL
from robotont_testing import places
from robotont_testing.harness import START, suspended, wait_for
from robotont_testing.node_test import WARN
from robotont_testing.robots import WHEEL_PARAMS

MAZE = "world:=maze", "world_map:=true", "description:=false"


def place_of(transform):
    """(x, y, yaw) of a geometry_msgs/Transform."""
    return transform.translation.x, transform.translation.y, yaw_of(transform.rotation)


class SimulatorNodeTest(SimulationTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.transforms = []  # latched: a later subscriber of this process would not get what has come
        rospy.Subscriber("tf_static", TFMessage, cls.transforms.append)

    def setUp(self):
        super().setUp()
        rosparam.upload_params("/", yaml.safe_load(WHEEL_PARAMS.read_text()))

    def test_a_maze_has_its_map_and_the_start_on_it_and_the_laser_sees_its_walls(self):
        """By its name the first one: the robot stands at the start."""
        maps = self.listen("map", OccupancyGrid)
        self.start(*MAZE)
        wait_for(lambda: maps and self.transforms, "the map, and where odom starts on it")
        with Image.open(str(places.config("maps/maze.pgm"))) as picture:
            drawn = np.array(picture)[::-1]
        seen = np.array(maps[0].data).reshape(drawn.shape)
        for grey, cell in ((0, 100), (205, -1), (254, 0)):
            self.assertTrue(((drawn == grey) == (seen == cell)).all())
        shipped = yaml.safe_load(places.config("maps/maze.yaml").read_text())
        place = maps[0].info.origin.position
        self.assertEqual((round(place.x, 4), round(place.y, 4)), tuple(shipped["origin"][:2]))
        start = next(one for message in self.transforms for one in message.transforms if one.child_frame_id == "odom")
        self.assertEqual((start.header.frame_id, start.transform.translation.x), ("map", 0.5))
        self.assertAlmostEqual(start.transform.rotation.z, 0.5 ** 0.5, delta=1e-6)
        wait_for(lambda: len(self.scan) > 3, "scans")
        scan = self.scan[-1]
        self.assertEqual(scan.header.frame_id, "laser")
        self.assertEqual(len(scan.ranges), 128)
        self.assertEqual(scan.ranges[64], math.inf)  # the corridor is longer than the laser sees
        np.testing.assert_allclose((scan.ranges[0], scan.ranges[-1]), 0.45 / math.sin(1.03 / 2), atol=0.02)
        self.assertAlmostEqual(scan.angle_max, 1.03 / 2, delta=1e-3)
        self.assertAlmostEqual(scan.scan_time, 0.1, delta=1e-6)  # at the scan_rate of config/simulator.yaml

    def test_a_reset_of_the_odometry_moves_nothing_on_the_map(self):
        self.start(*MAZE)

        def starts():
            return [place_of(one.transform) for message in self.transforms for one in message.transforms
                    if one.child_frame_id == "odom"]

        def off_the_truth():  # [m, rad] of the place on the map
            return np.abs(between(compose(starts()[-1], self.poses()[0]), self.poses()[1])).max()
        wait_for(starts, "where odom starts")
        for number in (1, 2):
            self.drive((0.2, 0.0, 0.6), lambda: np.abs(self.poses()[0]).max() > 0.3, "a way")
            if number == 1:
                self.rest()  # the second reset is on the way
            rospy.ServiceProxy("reset_odometry", Trigger)()
            self.rest()
            wait_for(lambda number=number: len(set(starts())) > number, "where odom starts now")
            self.assertLess(max(map(abs, self.poses()[0][:2])), 0.3)
            wait_for(lambda: off_the_truth() < 0.03, "the place on the map")

    def test_a_simulator_that_was_stopped_reports_the_time_that_it_skipped(self):
        self.start(*MAZE)
        with suspended(self.processes.pid("/simulator_node")):
            end = time.monotonic() + 2 * LONGEST_STALL
            wait_for(lambda: time.monotonic() > end, "a stall")
        self.wait_for_status("simulator_node: real time", WARN, "time was skipped")

    def test_ctrl_c_ends_the_board_at_once_and_then_its_port(self):
        self.stop_simulation()  # its topics have the same names
        port, log = self.processes.folder / "board", self.processes.folder / "simulator.log"
        process = self.processes.start(places.program("robotont_simulator", "simulator_node"), f"_port:={port}",
                                       "__name:=ending", log=log)
        periods = self.listen("ground_truth/odom", Odometry)
        wait_for(lambda: periods, "the ground truth", START)
        before = len(periods)
        self.assertEqual(self.processes.stop(process), 0)
        self.assertLess(len(periods) - before, 40)  # in 1 s, for which it once waited, there are 50
        self.assertEqual([file.name for file in self.processes.folder.glob("board*")], [])
        self.assertNotIn("Traceback", log.read_text())

    def test_a_world_that_is_not_there(self):
        self.stop_simulation()  # its nodes have the same names
        log = self.processes.folder / "log"
        port = self.processes.folder / "board"
        launch = self.processes.launch("simulation.launch", "world:=moon", f"port:={port}", log=log)
        wait_for(lambda: re.search(r"moon\.yaml, allowed: .*\broom\b", log.read_text()), "words about the world", START)
        wait_for(lambda: launch.poll() is not None, "the end: there is no robot without a simulator")
        self.assertNotIn("Traceback", log.read_text())


if __name__ == "__main__":
    rostest.rosrun("robotont_simulator", "simulator_node_test", SimulatorNodeTest)
