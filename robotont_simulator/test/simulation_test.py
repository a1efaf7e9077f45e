"""The unchanged driver on the simulator, through simulation.launch."""

from typing import ClassVar

import numpy as np
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan

from robotont_driver.kinematics.se2 import between, pose_of, wrap
from robotont_testing.harness import Processes, wait_for
from robotont_testing.node_test import OK, NodeTest, twist

LINK = "serial_com_node: link"
BOARD = "serial_com_node: board"


def pose(message):
    """(x, y, yaw) of an Odometry."""
    return pose_of(message.pose.pose)


class SimulationTest(NodeTest):
    """Tests with the same arguments share a simulation, one after the other: its start is most of a test's time."""

    _simulation: ClassVar = None  # Processes
    _arguments: ClassVar = ()

    @classmethod
    def stop_simulation(cls):
        if cls._simulation:
            cls._simulation.close()
            cls._simulation = None

    tearDownClass = stop_simulation

    def start(self, *arguments):
        """A simulation whose robot stands and has no fault."""
        if not self._simulation or self._arguments != arguments:
            self.stop_simulation()
            type(self)._simulation, type(self)._arguments = Processes(), arguments
            self._simulation.launch("simulation.launch", f"port:={self._simulation.folder / 'board'}", *arguments)
        self.odom = self.listen("odom", Odometry)
        self.truth = self.listen("ground_truth/odom", Odometry)
        self.scan = self.listen("scan", LaserScan)
        wait_for(lambda: self.odom and self.truth, "odometry and ground truth", timeout=60)
        self.command = self.publisher("cmd_vel", Twist)
        self.rest()
        self.drive((0.0, 0.0, 0.0), lambda: self.says(OK, "no fault"), "a good start")
        self.wait_for_status(LINK, OK)

    def drive(self, speeds, until, what):
        wait_for(lambda: self.command.publish(twist(*speeds)) or until(), what, period=0.02)

    def rest(self):
        """Stand, also by the odometry: its newest message may be some periods older than the truth's."""
        self.drive((0.0, 0.0, 0.0), lambda: all(max(map(abs, (each.linear.x, each.linear.y, each.angular.z))) < 0.01
                   for each in (self.truth[-1].twist.twist, self.odom[-1].twist.twist)), "rest")

    def poses(self):
        """Newest poses by the odometry and in truth."""
        return pose(self.odom[-1]), pose(self.truth[-1])

    def error_since(self, start):
        """What the odometry's displacement (x [m], y [m], yaw [rad]) since `start` differs from the true one."""
        odom, truth = (between(before, after) for before, after in zip(start, self.poses()))
        x, y, turn = np.subtract(odom, truth)
        return x, y, wrap(turn)

    def says(self, level, words):
        status = self.status.get(BOARD)
        return status is not None and status.level == level and words in status.message
