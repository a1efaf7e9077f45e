#!/usr/bin/env python3
"""robot.launch with all its nodes, on a board behind a pseudo-terminal that one launch drives for all tests."""

import math
import os
import signal
import socket
import sys
import xmlrpc.client
from typing import ClassVar

import numpy as np
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rosgraph.network import write_ros_handshake_header
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.se2 import between, pose_of
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.odometry.odometry import Pose
from robotont_testing.harness import START, Processes, suspended, wait_for
from robotont_testing.node_test import ERROR, OK, NodeTest, twist
from robotont_testing.robots import SHIPPED, robot_folder
from robotont_testing.stand_in_board import Board

MORE_THAN_A_SOCKET_HOLDS = 8000  # [messages] of odom, 700 bytes each; Linux holds 4 MB at most
KINEMATICS = Kinematics(read_wheels(SHIPPED))


class Stack(NodeTest):
    shared: ClassVar = Processes()
    truth: ClassVar = Pose()
    turned: ClassVar = np.zeros(3)

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.addClassCleanup(cls.shared.close)
        cls.board = Board(str(cls.shared.folder / "board"), start_totals=0x7000)  # their sum overflows
        cls.board.on_period = cls.on_period
        cls.board.plug()
        cls.addClassCleanup(cls.board.close)
        robot = robot_folder(cls.shared.folder / "robot", SHIPPED)
        cls.log = cls.shared.folder / "log"
        cls.launch = cls.shared.launch(
            "robot.launch", f"port:={cls.board.link}", f"robot:={robot}", "description:=false", log=cls.log)

    @classmethod
    def on_period(cls, turned):
        edges = np.subtract(turned, cls.turned) * KINEMATICS.wheels.metres_per_edge
        cls.truth.move((KINEMATICS.inverse @ edges).tolist())
        cls.turned = np.array(turned)

    def setUp(self):
        super().setUp()
        self.odom = self.listen("/odom", Odometry)
        self.joints = self.listen("/joint_states", JointState)
        wait_for(lambda: self.odom and self.joints, "odometry", START)
        self.command = self.publisher("/cmd_vel", Twist)
        self.stop()
        self.start = self.pose()

    def pose(self):
        return pose_of(self.odom[-1].pose.pose)

    def true_pose(self):
        return self.truth.x, self.truth.y, self.truth.yaw

    def moved(self):
        """(x, y, yaw) by odometry since the test began, seen from there."""
        return between(self.start, self.pose())

    def drive(self, speeds, until, what):
        wait_for(lambda: self.command.publish(twist(*speeds)) or until(), what, period=0.02)

    def stop(self):
        """Stop, and wait until odometry has come to rest, too."""
        self.drive((0, 0, 0), lambda: not any(self.board.speeds), "the stop")
        standing = self.board.motors.counted
        seen = len(self.joints)
        wait_for(lambda: len(self.joints) > seen + 2 and self.joints[-1].position == self.joints[-2].position
                 and standing == self.board.motors.counted
                 and self.odom[-1].header.stamp >= self.joints[-1].header.stamp, "the last counts")


class StackTest(Stack):
    def test_odometry_is_truthful(self):
        """That forward is forward, and left is left, the simulator's drive shows."""
        start = self.true_pose()
        self.drive((0.3, -0.2, 0.8), lambda: self.moved()[2] > 1.5, "a curve")
        self.stop()
        error = np.subtract(self.moved(), between(start, self.true_pose()))
        assert np.all(np.abs(error) < (1e-3, 1e-3, math.radians(0.1))), error

    def test_restarted_and_unplugged_in_mid_drive_it_goes_on_by_itself_and_odometry_does_not_jump(self):
        self.drive((0.4, 0, 0), lambda: self.moved()[0] > 0.1, "motion")
        self.board.restart()
        self.drive((0.4, 0, 0), lambda: self.moved()[0] > 0.3, "motion after a reset of the board")
        self.board.unplug()
        seen, before = len(self.odom), self.moved()[0]
        self.wait_for_status("serial_com_node: link", ERROR)
        self.board.restart()
        self.board.plug()
        wait_for(lambda: len(self.odom) > seen + 5, "odometry after replugging")
        self.drive((0.4, 0, 0), lambda: self.moved()[0] > before + 0.1, "motion after replugging")
        path = [(message.pose.pose.position.x, message.pose.pose.position.y) for message in self.odom]
        self.assertLess(np.linalg.norm(np.diff(path, axis=0), axis=1).max(), 0.4 * 0.02 * 1.5)
        self.wait_for_status("serial_com_node: link", OK)
        self.assertNotIn("Traceback", self.log.read_text())

    def test_each_node_that_dies_stops_the_robot_and_is_started_again(self):
        for node in ("/driver_node", "/serial_com_node"):
            self.drive((0.4, 0, 0), lambda: any(self.board.speeds), "motion")
            with suspended(self.launch.pid):  # roslaunch may have it back before the board stops by itself
                os.kill(self.shared.pid(node), signal.SIGKILL)
                self.drive((0.4, 0, 0), lambda: not any(self.board.speeds), f"the stop without {node}")
            self.drive((0.4, 0, 0), lambda: any(self.board.speeds), f"motion with a new {node}")


class NightlyStackTest(Stack):
    """Once a day."""

    def subscribe_without_reading(self, topic, message_type):
        """A socket that odom_node takes for a subscriber."""
        uri = self.shared.node_uri("/odom_node")
        _, _, (_, host, port) = xmlrpc.client.ServerProxy(uri).requestTopic("/hung", topic, [["TCPROS"]])
        hung = socket.socket()
        hung.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        hung.connect((host, port))
        write_ros_handshake_header(hung, {"callerid": "/hung", "topic": topic, "md5sum": message_type._md5sum,
                                          "type": message_type._type})
        return hung

    def subscribers(self, topic):
        """Number of open connections of odom_node for a topic."""
        info = xmlrpc.client.ServerProxy(self.shared.node_uri("/odom_node")).getBusInfo("/test")[2]
        return sum(line[4] == topic and line[2] == "o" for line in info)

    def test_a_subscriber_that_stops_reading_holds_up_nobody(self):
        others = 2
        wait_for(lambda: self.subscribers("/odom") == others, "this test and the mux' guard")
        hung = self.subscribe_without_reading("/odom", Odometry)
        self.addCleanup(hung.close)
        wait_for(lambda: self.subscribers("/odom") == others + 1, "another subscriber")
        read = self.publisher("serial_read", String)
        seen, sent = len(self.odom), 0
        while sent < MORE_THAN_A_SOCKET_HOLDS:
            for _ in range(100):
                read.publish("0:0:0;\n")
            sent += 100
            wait_for(lambda sent=sent: len(self.odom) >= seen + sent, "every message for the other subscriber")
        self.assertEqual(self.subscribers("/odom"), others + 1)  # it costs itself messages, not its connection
        self.drive((0.4, 0, 0), lambda: self.odom[-1].twist.twist.linear.x > 0.3, "motion")


if __name__ == "__main__":
    rostest.rosrun("robotont_bringup", "stack_test", NightlyStackTest if "nightly" in sys.argv else StackTest)
