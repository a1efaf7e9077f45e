#!/usr/bin/env python3
"""Zero is the last command of whatever drives, and is heard although nothing of the process runs behind its end."""

import itertools
import signal
import sys

import rospy
import rostest
from geometry_msgs.msg import Twist

from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest, twist

DRIVE, STOP = (0.1, 0.0, 0.0), (0.0, 0.0, 0.0)
PROGRAM = """
import os, sys, time, rospy
rospy.init_node("driving")
{make}
rospy.on_shutdown(lambda: os._exit(0))  # behind the node's own: no thread sends any more
while not rospy.is_shutdown():
    {drive}
    time.sleep(0.02)
"""
PAGE = """
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_teleop.robot_view import RobotView
view = RobotView(read_wheels(rospy.get_param("/")), "camera")
"""
KEYS_AND_PAD = """
from robotont_teleop.hand_output import HandOutput
output = HandOutput()
rospy.on_shutdown(lambda: output.send((0.0, 0.0, 0.0)))
"""
MUX = """
from robotont_driver.ros.node_parameters import own_parameters
from robotont_teleop.cmd_vel_mux import PARAMETERS, CmdVelMux
CmdVelMux(own_parameters(PARAMETERS))
"""


class LastCommandTest(NodeTest):
    def heard_until_the_end(self, topic, make, drive):
        """Commands, each once however often it was repeated, until a process that drives has ended."""
        heard = self.listen(topic, Twist)
        process = self.processes.start(sys.executable, "-c", PROGRAM.format(make=make, drive=drive))
        wait_for(lambda: heard, "the commands")
        self.processes.stop(process, signal.SIGTERM)
        wait_for(lambda: heard[-1] == twist(), "the zero")
        return [command for command, _ in itertools.groupby((message.linear.x, message.linear.y, message.angular.z)
                                                            for message in heard)]

    def test_a_page(self):
        self.assertEqual(self.heard_until_the_end("cmd_vel/hand", PAGE, f"view.send({DRIVE})"), [DRIVE, STOP])

    def test_keys_and_gamepad(self):
        """Who listens to cmd_vel/hand is no mux: a recorder does, too."""
        self.listen("cmd_vel/hand", Twist)
        self.assertEqual(self.heard_until_the_end("cmd_vel", KEYS_AND_PAD, f"output.send({DRIVE})"), [DRIVE, STOP])

    def test_the_mux(self):
        stick = self.publisher("cmd_vel/hand", Twist, subscribers=0)
        timer = rospy.Timer(rospy.Duration(0.05), lambda _: stick.publish(twist(*DRIVE)))
        self.addCleanup(timer.shutdown)
        self.assertEqual(self.heard_until_the_end("cmd_vel", MUX, "pass"), [DRIVE, STOP])


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "last_command_test", LastCommandTest)
