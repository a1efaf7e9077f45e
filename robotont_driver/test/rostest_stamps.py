#!/usr/bin/env python3
"""Stamps of odom_node against boards with an even clock, on a machine that computes on all its cores."""

import subprocess
import sys
import time

import numpy as np
import rospy
import rostest
from sensor_msgs.msg import JointState

from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_testing.even_board import PERIOD, numbers_of
from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest
from robotont_testing.robots import SHIPPED

PACKETS = 400
SETTLED = 500  # packets, 10 s
HELD = {"single": 0}  # by robot: packets that its board keeps for the next one; no delivered board keeps any
MEDIAN, MOST = 1.0, 3.0  # [ms] 50 and 99 of 100
BUSY = 2  # processes that compute without end: as many as this machine has cores


class Robot:
    """A robot on an even board, and its stamps: those of the joint states, which are those of the odometry."""

    def __init__(self, test, name, held):
        self._log, port = test.processes.folder / f"{name}.txt", test.processes.folder / name
        self._board = subprocess.Popen(
            [sys.executable, "-m", "robotont_testing.even_board", str(port), str(self._log), str(held)],
            stdin=subprocess.PIPE)
        test.addCleanup(self.end)
        self.stamped = test.listen(f"/{name}/joint_states", JointState)
        rospy.set_param(f"/{name}", {**SHIPPED, "serial_com_node": {"port": str(port)},
                                     "odom_node": {"publish_tf": False}})
        test.processes.node("robotont_node", f"__ns:=/{name}")

    def end(self):
        """The board's end."""
        self._board.stdin.close()
        self._board.wait()

    def errors(self):
        """[ms] between stamps and the ends of the packets' periods, once settled."""
        self.end()
        sent, stamped = np.loadtxt(str(self._log)), list(self.stamped)
        per_edge = 2 * np.pi / read_wheels(SHIPPED).edges_per_turn / PERIOD
        counts = np.array([message.velocity for message in stamped]) / per_edge
        numbers = numbers_of(counts.round().astype(int), sent[:, 1:].astype(int))
        steady = np.array([message.header.stamp.to_sec() for message in stamped]) - (time.time() - time.monotonic())
        return 1000 * np.abs(steady - sent[numbers, 0])[SETTLED:]


class StampsTest(NodeTest):
    def test_stamps_on_a_busy_machine(self):
        robots = {name: Robot(self, name, held) for name, held in HELD.items()}

        def wait_for_packets(amount):
            wait_for(lambda: min(len(robot.stamped) for robot in robots.values()) >= amount, f"{amount} packets",
                     timeout=60 + 4 * PACKETS * PERIOD)
        wait_for_packets(SETTLED)
        for _ in range(BUSY):
            self.processes.start(sys.executable, "-c", "while True: pass")
        wait_for_packets(max(len(robot.stamped) for robot in robots.values()) + PACKETS)
        for name, robot in robots.items():
            with self.subTest(name):
                median, most = np.percentile(robot.errors(), (50, 99))
                self.assertLess(median, MEDIAN)
                self.assertLess(most, MOST)


if __name__ == "__main__":
    rostest.rosrun("robotont_driver", "stamps_test", StampsTest)
