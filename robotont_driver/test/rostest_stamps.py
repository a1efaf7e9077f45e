#!/usr/bin/env python3
"""Stamps of odom_node against a board with an even clock: through a port, serial_com_node and two ROS connections."""

import subprocess
import sys
import time

import numpy as np
import rospy
import rostest
from sensor_msgs.msg import JointState

from robotont_driver.wheels import read_wheels
from robotont_testing.even_board import PERIOD, numbers_of
from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest

PACKETS = 800
SETTLED = 500  # packets, 10 s
MEDIAN, MOST = 1.0, 3.0  # [ms]
BURSTS = 2.0   # [ms] median of bursts; the aim is 1.0: 17 lines come at once, and each waits for those before it
BUSY = 2       # processes that compute without end: as many as this machine has cores


class StampsTest(NodeTest):
    def setUp(self):
        super().setUp()
        self.stamped = self.listen("joint_states", JointState)  # odom_node: joint states and odometry share a stamp
        self.arrived = self.listen("/arrivals/joint_states", JointState)

    def judge(self, name, *board, median=MEDIAN):
        """Print the errors of stamps; hold them to the aim."""
        log, port = self.processes.folder / "sent.txt", self.processes.folder / "port"
        with subprocess.Popen([sys.executable, "-m", "robotont_testing.even_board", str(port), str(log), *board],
                              stdin=subprocess.PIPE) as process:
            self.processes.node("serial_com_node", f"_port:={port}", "_retry_period:=0.1")
            wait_for(lambda: len(self.stamped) > SETTLED and len(self.arrived) > SETTLED, "the first packets")
            for _ in range(BUSY):
                self.processes.start(sys.executable, "-c", "while True: pass")
            before = len(self.stamped)
            wait_for(lambda: len(self.stamped) >= before + PACKETS, "packets", timeout=4 * PACKETS * PERIOD)
            process.stdin.close()
            process.wait()
        sent = np.loadtxt(str(log))
        wall = time.time() - time.monotonic()
        ours, theirs = (self.errors(messages, sent, wall) for messages in (list(self.stamped), list(self.arrived)))
        print("{}: stamps p50 {:.2f}, p99 {:.2f}, largest {:.1f} ms; ".format(name, *ours)
              + "by arrival p50 {:.2f}, p99 {:.2f}, largest {:.1f} ms".format(*theirs))
        self.assertLess(ours[0], median)
        self.assertLess(ours[1], MOST)

    @staticmethod
    def errors(messages, sent, wall):
        """(p50, p99, largest) [ms] between stamps and the ends of the packets' periods."""
        wheels = read_wheels(rospy.get_param("/"))
        per_edge = 2 * np.pi / wheels.edges_per_turn / PERIOD
        counts = np.array([message.velocity for message in messages]) / per_edge
        numbers = numbers_of(counts.round().astype(int), sent[:, 1:].astype(int))
        late = np.array([message.header.stamp.to_sec() for message in messages]) - wall - sent[numbers, 0]
        return np.percentile(1000 * np.abs(late[SETTLED:]), (50, 99, 100))

    def test_busy(self):
        self.judge("busy, 1 byte in 1000 spoilt", "--corrupt", "0.001")

    def test_busy_bursts(self):
        self.judge("busy, 1 byte in 1000 spoilt, bursts", "--corrupt", "0.001", "--hold", "16", median=BURSTS)


if __name__ == "__main__":
    rostest.rosrun("robotont_driver", "stamps_test", StampsTest)
