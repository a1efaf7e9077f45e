#!/usr/bin/env python3
"""cmd_vel_mux with driver_node behind it: what is on the wire at its end, and what outlives a restart."""

import itertools
import signal
import time

import rospy
import rostest
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool, String

from robotont_driver.ros.worker import Worker
from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.node_test import WARN, NodeTest, twist

STOPPED = "0.00:0.00:0.00;\n"


class CmdVelMuxTest(NodeTest):
    def start(self):
        """A mux, which all hear and are heard by."""
        self.drivers = self.listen("cmd_vel/driven_by", String)
        mux = self.processes.start(places.program("robotont_teleop", "cmd_vel_mux"))
        wait_for(lambda: self.drivers and self.hand.get_num_connections() and self.packets, "cmd_vel_mux")
        return mux

    def command(self):
        self.hand.publish(twist(next(self.speeds)))
        return 0.02

    def moving(self):
        wait_for(lambda: self.packets[-1][1] != STOPPED, "motion")

    def stays(self, seconds):
        """Nobody moves it."""
        seen = len(self.commands)
        time.sleep(seconds)
        self.assertFalse([command for command in self.commands[seen:] if command.linear.x])
        self.assertEqual(self.packets[-1][1], STOPPED)

    def test_its_end_is_a_zero_and_an_emergency_stop_outlives_it(self):
        self.packets = []  # (time [s], packet)
        self.listen("serial_write", String, lambda message: self.packets.append((time.monotonic(), message.data)))
        self.commands = self.listen("cmd_vel", Twist)
        button = self.publisher("emergency_stop", Bool)
        self.hand = self.publisher("cmd_vel/hand", Twist, subscribers=0)
        self.speeds = itertools.repeat(0.1)  # who holds the stick
        Worker(self.command)
        mux = self.start()
        self.moving()
        self.processes.stop(mux, signal.SIGTERM)  # amid commands
        wait_for(lambda: self.commands[-1] == Twist(), "the zero")
        mux = self.start()
        self.moving()
        pressed = time.monotonic()
        button.publish(True)
        stopped = wait_for(lambda: next(
            (at for at, packet in self.packets if at > pressed and packet == STOPPED), None), "the stop")
        self.assertLess(stopped - pressed, 0.05)
        wait_for(lambda: self.drivers[-1].data == "emergency stop", "the mux")
        self.processes.stop(mux)
        self.status.clear()
        mux = self.start()
        self.wait_for_status("cmd_vel_mux: who drives", WARN, "emergency stop")
        self.stays(0.3)
        button.publish(False)
        wait_for(lambda: rospy.get_param("cmd_vel_mux_held", []) == [rospy.get_name()], "who has to stop first")
        self.processes.stop(mux, signal.SIGKILL)
        self.start()
        self.stays(1.0)  # it has not let go yet
        self.speeds = itertools.chain.from_iterable(itertools.repeat(5 * (0.0,) + 5 * (0.1,)))  # lets go, and drives
        self.moving()


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "cmd_vel_mux_test", CmdVelMuxTest)
