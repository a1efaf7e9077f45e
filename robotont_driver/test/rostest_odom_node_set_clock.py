#!/usr/bin/env python3
"""Nodes while the clock is set, as by NTP, or jumps with a suspension: set_clock.c does it to a process alone."""

import mmap
import struct
import subprocess
import time
from pathlib import Path

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from robotont_driver.protocol.protocol import format_packet
from robotont_testing.harness import wait_for
from robotont_testing.node_test import WARN, NodeTest, twist

TASK = "odom_node: stamps"
PERIOD = 0.02  # [s]
MOST = 0.1     # [s] without odometry
ZEROS = "0.00:0.00:0.00;\n"


class SetClockTest(NodeTest):
    def start(self, node, *arguments):
        """Start a node with a clock that can be set."""
        source, library = Path(__file__).resolve().with_name("set_clock.c"), self.processes.folder / "set_clock.so"
        subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", str(library), str(source)], check=True)
        ahead = self.processes.folder / "ahead"
        ahead.write_bytes(struct.pack("d", 0.0))
        with ahead.open("r+b") as file:
            self.ahead = mmap.mmap(file.fileno(), 8)
        self.addCleanup(self.ahead.close)
        self.processes.node(node, *arguments, LD_PRELOAD=str(library), CLOCK_AHEAD=str(ahead))

    def set_clock(self, ahead):
        """Set the node's clock so many seconds ahead of the real time, in one go."""
        self.ahead[:] = struct.pack("d", ahead)

    def drive(self, packets):
        """Send so many packets, one per period; [s] the longest times without odometry, and without a packet."""
        arrived, sent = len(self.arrivals), []
        for number in range(packets):
            time.sleep(max(0.0, (sent[0] if sent else 0.0) + number * PERIOD - time.monotonic()))
            sent.append(time.monotonic())
            self.read.publish(format_packet((-10, 0, 10)))
        wait_for(lambda: len(self.arrivals) >= arrived + packets, "odometry of each packet")
        return np.diff(self.arrivals[arrived:]).max(), np.diff(sent).max()

    def test_a_command_from_before_a_suspension_does_not_drive_behind_it(self):
        written = self.listen("serial_write", String)
        self.start("driver_node", "_cmd_timeout:=2.0")
        command = self.publisher("cmd_vel", Twist)
        wait_for(lambda: command.publish(twist(0.2)) or (written and set(written[-1].data) & set("123456789")),
                 "a robot that drives", period=0.05)
        self.set_clock(3600.0)
        wait_for(lambda: written[-1].data == ZEROS, "the stop", timeout=1.0)

    def test_the_clock_is_set(self):
        self.arrivals, odom = [], self.listen("odom", Odometry)
        self.listen("odom", Odometry, lambda _: self.arrivals.append(time.monotonic()))
        self.start("odom_node")
        self.read = self.publisher("serial_read", String)
        wait_for(lambda: self.read.publish(format_packet((0, 0, 0))) or odom, "odometry", period=PERIOD)
        self.drive(50)
        ahead = 0.0
        for step in (3600.0, -3600.0, 0.2, -0.2):
            ahead += step
            self.set_clock(ahead)
            gap, own = self.drive(50)
            self.assertLess(gap - own + PERIOD, MOST)
            self.assertLess(abs(odom[-1].header.stamp.to_sec() - ahead - rospy.get_time()), 0.1)
            way = "back by" if step < 0 else "forward by"
            self.wait_for_status(TASK, WARN, f"the clock was set {way} {abs(step):g}"[:30])
        steps = np.diff([message.header.stamp.to_sec() for message in odom])
        self.assertEqual(np.sum(steps <= 0), 2, "only where the clock was set back")


if __name__ == "__main__":
    rostest.rosrun("robotont_driver", "odom_node_set_clock_test", SetClockTest)
