"""The unchanged driver on the simulator, through simulation.launch."""

import math
from typing import ClassVar

import numpy as np
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan

from robotont_driver.kinematics.se2 import between, pose_of, wrap
from robotont_testing import places
from robotont_testing.harness import Processes, wait_for
from robotont_testing.node_test import OK, NodeTest, twist

LINK = "serial_com_node: link"
BOARD = "serial_com_node: board"


def pose(message):
    """(x, y, yaw) of an Odometry."""
    return pose_of(message.pose.pose)


class Simulation(Processes):
    """simulation.launch with these arguments."""

    def __init__(self, *arguments):
        super().__init__()
        self.arguments = arguments
        self.log = self.folder / "log"
        self.launch("simulation.launch", f"port:={self.folder / 'board'}", *arguments, log=self.log)


class SimulationTest(NodeTest):
    """Tests with the same arguments share a simulation, one after the other: its start is most of a test's time."""

    _simulation: ClassVar = None

    @classmethod
    def stop_simulation(cls):
        if cls._simulation:
            cls._simulation.close()
            cls._simulation = None

    tearDownClass = stop_simulation

    def start(self, *arguments):
        """A simulation whose robot stands and has no fault."""
        if not self._simulation or self._simulation.arguments != arguments:
            self.stop_simulation()
            type(self)._simulation = Simulation(*arguments)
        self.log = self._simulation.log
        self.odom = self.listen("odom", Odometry)
        self.truth = self.listen("ground_truth/odom", Odometry)
        self.scan = self.listen("scan", LaserScan)
        wait_for(lambda: self.odom and self.truth, "odometry and ground truth", timeout=60)
        self.command = self.publisher("cmd_vel", Twist)
        self.rest()
        self.drive((0.0, 0.0, 0.0), lambda: self.says(OK, "no fault"), "a good start")
        self.wait_for_status(LINK, OK)

    def drive(self, speeds, until, what, timeout=20.0):
        try:
            wait_for(lambda: self.command.publish(twist(*speeds)) or until(), what, period=0.02, timeout=timeout)
        except AssertionError as error:
            seen = "".join(f"\n{name}: {status.level} {status.message}" for name, status in self.status.items())
            raise AssertionError(f"{error}; odometry {pose(self.odom[-1])}, truth {pose(self.truth[-1])}, wheels turn "
                                 f"{self.odom[-1].twist.twist.linear.x:.2f} m/s{seen}") from None

    def rest(self):
        self.drive((0.0, 0.0, 0.0), lambda: max(map(abs, (
            self.truth[-1].twist.twist.linear.x, self.truth[-1].twist.twist.linear.y,
            self.truth[-1].twist.twist.angular.z))) < 0.01, "rest")

    def poses(self):
        """Newest poses by the odometry and in truth."""
        return pose(self.odom[-1]), pose(self.truth[-1])

    def moved(self, start):
        return math.dist(pose(self.truth[-1])[:2], start[:2])

    def error_since(self, start):
        """What the odometry's displacement (x [m], y [m], yaw [rad]) since `start` differs from the true one."""
        odom, truth = (between(before, after) for before, after in zip(start, self.poses()))
        x, y, turn = np.subtract(odom, truth)
        return x, y, wrap(turn)

    def says(self, level, words):
        status = self.status.get(BOARD)
        return status is not None and status.level == level and words in status.message

    def simulator(self, port, *arguments):
        """A simulator_node without the driver; its process and log."""
        log = self.processes.folder / "simulator.log"
        return self.processes.start(places.program("robotont_simulator", "simulator_node"), f"_port:={port}",
                                    *arguments, log=log), log
