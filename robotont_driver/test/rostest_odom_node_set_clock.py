#!/usr/bin/env python3
"""Nodes while the clock is set, as by NTP, or jumps with a suspension: set_clock.c does it to a process alone."""

import mmap
import struct
import subprocess
import time
from pathlib import Path

import rospy
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from robotont_driver.protocol.packet import format_packet
from robotont_testing.harness import wait_for
from robotont_testing.node_test import WARN, NodeTest, twist

TASK = "odom_node: stamps"
PERIOD = 0.02  # [s]
MOST = 0.1     # [s] without odometry
ZEROS = "0.00:0.00:0.00;\n"


class SetClockTest(NodeTest):
    def start(self, node, *arguments):
        library, ahead = self.processes.folder / "set_clock.so", self.processes.folder / "ahead"
        subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", str(library),
                        str(Path(__file__).resolve().with_name("set_clock.c"))], check=True)
        ahead.write_bytes(struct.pack("d", 0.0))
        with ahead.open("r+b") as file:
            self.ahead = mmap.mmap(file.fileno(), 8)
        self.addCleanup(self.ahead.close)
        process = self.processes.node(node, *arguments, LD_PRELOAD=str(library), CLOCK_AHEAD=str(ahead))
        self.addCleanup(self.processes.stop, process)

    def set_clock(self, ahead):
        """Set the node's clock so many seconds ahead of the real time, in one go."""
        self.ahead[:] = struct.pack("d", ahead)

    def start_odom_node(self):
        self.arrivals, self.sent = [], []
        self.odom = self.listen("odom", Odometry)
        self.listen("odom", Odometry, lambda _: self.arrivals.append(time.monotonic()))
        self.start("odom_node")
        self.read = self.publisher("serial_read", String)
        wait_for(lambda: self.read.publish(format_packet((0, 0, 0))) or self.odom, "odometry", period=PERIOD)

    def drive(self, packets):
        """Send so many packets, one per period; the odometry of each."""
        before = len(self.odom)
        begin = time.monotonic()
        for number in range(packets):
            time.sleep(max(0.0, begin + number * PERIOD - time.monotonic()))
            self.sent.append(time.monotonic())
            self.read.publish(format_packet((-10, 0, 10)))
        wait_for(lambda: len(self.odom) >= before + packets, "odometry of each packet")
        return self.odom[before:before + packets]

    def test_a_command_from_before_a_suspension_does_not_drive_behind_it(self):
        written = self.listen("serial_write", String)
        self.start("driver_node", "_cmd_timeout:=2.0")
        command = self.publisher("cmd_vel", Twist)
        wait_for(lambda: command.publish(twist(0.2)) or (written and set(written[-1].data) & set("123456789")),
                 "a robot that drives", period=0.05)
        self.set_clock(3600.0)
        wait_for(lambda: written[-1].data == ZEROS, "the stop", timeout=1.0)

    def test_the_clock_is_set(self):
        self.start_odom_node()
        self.drive(50)
        ahead = 0.0
        for step in (3600.0, -3600.0, 0.2, -0.2):
            ahead += step
            arrived, self.sent = len(self.arrivals), []
            self.set_clock(ahead)
            newest = self.drive(50)[-1].header.stamp.to_sec()
            gap, own = (max(new - old for old, new in zip(times, times[1:]))
                        for times in (self.arrivals[arrived:], self.sent))
            print(f"clock set by {step:+g} s: longest time without odometry {1000 * gap:.0f} ms, "
                  f"without a packet {1000 * own:.0f} ms")
            self.assertLess(gap - own + PERIOD, MOST)
            self.assertLess(abs(newest - ahead - rospy.get_time()), 0.1)
            way = "back by" if step < 0 else "forward by"
            self.wait_for_status(TASK, WARN, f"the clock was set {way} {abs(step):g}"[:30])
        stamps = [message.header.stamp.to_sec() for message in self.odom]
        back = [new - old for old, new in zip(stamps, stamps[1:]) if new <= old]
        self.assertEqual(len(back), 2, back)  # only where the clock was set back


if __name__ == "__main__":
    rostest.rosrun("robotont_driver", "odom_node_set_clock_test", SetClockTest)
