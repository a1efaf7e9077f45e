#!/usr/bin/env python3
"""The launch files with all three nodes, on boards behind pseudo-terminals."""

import math
import os
import signal
import socket
import struct
import xmlrpc.client

import numpy as np
import rospy
import rostest
import yaml
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.se2 import pose_of
from robotont_driver.kinematics.wheels import read_wheels
from robotont_driver.odometry.odometry import Pose
from robotont_testing.harness import START, suspended, wait_for
from robotont_testing.node_test import ERROR, OK, NodeTest, twist
from robotont_testing.robots import WHEEL_PARAMS, robot_folder
from robotont_testing.stand_in_board import Board

SHIPPED = yaml.safe_load(WHEEL_PARAMS.read_text())
MORE_THAN_A_SOCKET_HOLDS = 8000  # [messages] of odom, 700 bytes each; Linux holds 4 MB at most
UNEVEN = {
    4: {**SHIPPED, "wheelAmount": 4, "wheelRads": [0.1, 1.4, 3.3, 5.0]},
    5: {**SHIPPED, "wheelAmount": 5, "wheelRads": [0.3, 1.2, 2.9, 3.6, 5.5], "positiveRotation": "counterclockwise"},
}


class Robot:
    """A board, the stack in a namespace, and the truth about both. `described`: with the robot's model."""

    def __init__(self, test, namespace="", parameters=SHIPPED, arguments=(), described=False, nodes=None, **board):
        self.test = test
        self.name = namespace or "robot"
        self.kinematics = Kinematics(read_wheels(parameters))
        self.board = Board(str(test.processes.folder / self.name), self.kinematics.wheels.amount, **board)
        self.board.on_period = self._on_period
        self._turned = np.zeros(self.kinematics.wheels.amount)
        self.truth = Pose()
        self.board.plug()
        test.addCleanup(self.board.__exit__)
        folder = robot_folder(test.processes.folder / (self.name + "_robot"), parameters, **(nodes or {}))
        self.log = test.processes.folder / (self.name + ".log")
        prefix = namespace + "/" if namespace else ""
        self.launch = test.processes.launch(
            "robot.launch", f"port:={self.board.link}", f"robot:={folder}", f"namespace:=/{namespace}",
            f"composed:={str(test.composed).lower()}", f"description:={str(described).lower()}", *arguments,
            log=self.log)
        self.odom = test.listen(f"/{prefix}odom", Odometry)
        self.joints = test.listen(f"/{prefix}joint_states", JointState)
        self.command = test.publisher(f"/{prefix}cmd_vel", Twist)
        wait_for(lambda: self.odom, "odometry", START)

    def _on_period(self, turned):
        turned = np.array(turned)
        edges = self.kinematics.wheels.metres_per_edge
        step = self.kinematics.inverse @ ((turned - self._turned) * edges)
        self.truth.move(step.tolist())
        self._turned = turned

    def pose(self):
        """(x, y, yaw) of the newest odometry."""
        pose = self.odom[-1].pose.pose
        return pose_of(pose)

    def drive(self, speeds, until, what):
        """Command at 50 Hz until a condition holds."""
        wait_for(lambda: self.command.publish(twist(*speeds)) or until(), what, period=0.02)

    def stop(self):
        """Stop, and wait until odometry has every count."""
        self.drive((0, 0, 0), lambda: not any(self.board.speeds), "the stop")
        per_edge = 2 * math.pi / self.kinematics.wheels.edges_per_turn
        wait_for(lambda: np.allclose(self.joints[-1].position, np.array(self.board.motors.counted) * per_edge),
                 "the last counts")
        seen = len(self.odom)
        wait_for(lambda: len(self.odom) > seen, "odometry")

    def assert_truthful(self):
        """Odometry is where the wheels have really gone, within 1 mm and 0.1 degree."""
        error = np.subtract(self.pose(), (self.truth.x, self.truth.y, self.truth.yaw))
        assert np.all(np.abs(error) < (1e-3, 1e-3, math.radians(0.1))), (self.pose(), error)


class StackTest(NodeTest):
    def setUp(self):
        super().setUp()
        # rospy's master keeps what a former test has set
        for name in ("serial_com_node", "driver_node", "odom_node", "robotont_node"):
            if rospy.has_param("/" + name):
                rospy.delete_param("/" + name)

    def test_directions_are_those_of_rep_103(self):
        robot = Robot(self)
        for speeds, place in (((0.4, 0, 0), 0), ((0, 0.4, 0), 1), ((0, 0, 1.0), 2)):
            before = np.array(robot.pose())
            robot.drive(speeds, lambda place=place, before=before: robot.pose()[place] - before[place] > 0.3, "motion")
            robot.stop()
            moved = robot.pose() - before
            moved[place] = 0.0
            self.assertLess(np.max(np.abs(moved[:2])), 0.01, (speeds, moved))
            robot.assert_truthful()
        robot.drive((0.3, -0.2, 0.8), lambda: robot.pose()[0] < 0.2, "a curve")
        robot.stop()
        robot.assert_truthful()

    def test_four_and_five_wheels_on_a_bad_line(self):
        for amount, parameters in UNEVEN.items():
            robot = Robot(self, f"wheels{amount}", parameters)
            robot.board.line.corrupt = 0.003
            robot.drive((0.2, -0.3, 0.5), lambda robot=robot: abs(robot.pose()[2]) > 0.7, "a curve")
            robot.stop()
            robot.assert_truthful()
            self.wait_for_status(f"wheels{amount}/odom_node: wheel feedback", OK)
            self.processes.stop(robot.launch)

    def test_unplugged_in_mid_drive_it_goes_on_by_itself_and_odometry_does_not_jump(self):
        robot = Robot(self)
        robot.drive((0.4, 0, 0), lambda: robot.pose()[0] > 0.1, "motion")
        robot.board.unplug()
        seen, before = len(robot.odom), robot.pose()
        self.wait_for_status("serial_com_node: link", ERROR)
        robot.board.restart()
        robot._turned = np.zeros(3)
        robot.board.plug()
        wait_for(lambda: len(robot.odom) > seen + 5, "odometry after replugging")
        robot.drive((0.4, 0, 0), lambda: robot.pose()[0] > before[0] + 0.1, "motion after replugging")
        path = [message.pose.pose.position.x for message in robot.odom]
        self.assertLess(max(np.diff(path)), 0.4 * 0.02 * 1.5)
        self.wait_for_status("serial_com_node: link", OK)
        self.assertNotIn("Traceback", robot.log.read_text())

    def test_a_board_that_restarts_in_mid_drive(self):
        robot = Robot(self, start_totals=0x7000)
        robot.drive((0.4, 0, 0), lambda: robot.pose()[0] > 0.1, "motion")
        robot.board.restart()
        robot._turned = np.zeros(3)
        robot.drive((0.4, 0, 0), lambda: robot.pose()[0] > 0.3, "motion afterwards")
        path = [message.pose.pose.position.x for message in robot.odom]
        self.assertLess(max(np.diff(path)), 0.4 * 0.02 * 1.5)

    def test_each_node_that_dies_stops_the_robot_and_is_started_again(self):
        for node in ("/robotont_node",) if self.composed else ("/driver_node", "/serial_com_node"):
            robot = Robot(self)
            robot.drive((0.4, 0, 0), lambda robot=robot: any(robot.board.speeds), "motion")
            with suspended(robot.launch.pid):  # roslaunch may have it back before the board stops by itself
                os.kill(self.processes.pid(node), signal.SIGKILL)
                wait_for(lambda robot=robot: robot.command.publish(twist(0.4)) or not any(robot.board.speeds),
                         f"the stop without {node}", period=0.02)
            robot.drive((0.4, 0, 0), lambda robot=robot: any(robot.board.speeds), f"motion with a new {node}")
            self.processes.stop(robot.launch)
            robot.board.unplug()

    def test_a_subscriber_that_stops_reading_holds_up_nobody(self):
        if self.composed:
            return  # it takes no packets of others, and publishes in the same way
        robot = Robot(self)
        hung = self.subscribe_without_reading("/odom", Odometry)
        wait_for(lambda: self.subscribers("/odom") == 2, "the second subscriber")
        read = self.publisher("serial_read", String)
        seen, sent = len(robot.odom), 0
        while sent < MORE_THAN_A_SOCKET_HOLDS:
            for _ in range(100):
                read.publish("0:0:0;\n")
            sent += 100
            wait_for(lambda sent=sent: len(robot.odom) >= seen + sent, "every message for the other subscriber")
        self.assertEqual(self.subscribers("/odom"), 2)  # it costs itself messages, not its connection
        robot.drive((0.4, 0, 0), lambda: robot.odom[-1].twist.twist.linear.x > 0.3, "motion")
        hung.close()

    def subscribe_without_reading(self, topic, message_type):
        """A socket that odom_node takes for a subscriber."""
        uri = self.processes.node_uri("/odom_node")
        _, _, (_, host, port) = xmlrpc.client.ServerProxy(uri).requestTopic("/hung", topic, [["TCPROS"]])
        hung = socket.socket()
        hung.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        hung.connect((host, port))
        fields = ["callerid=/hung", f"topic={topic}", f"md5sum={message_type._md5sum}", f"type={message_type._type}"]
        header = b"".join(struct.pack("<I", len(field)) + field.encode() for field in fields)
        hung.sendall(struct.pack("<I", len(header)) + header)
        return hung

    def subscribers(self, topic):
        """Number of open connections of odom_node for a topic."""
        uri = self.processes.node_uri("/odom_node")
        info = xmlrpc.client.ServerProxy(uri).getBusInfo("/test")[2]
        return sum(line[4] == topic and line[2] == "o" for line in info)

    def test_two_robots_in_namespaces_do_not_affect_each_other(self):
        one, two = (Robot(self, name, described=True) for name in ("robot1", "robot2"))
        transforms = self.listen("/tf", TFMessage)
        one.drive((0.4, 0, 0), lambda: one.pose()[0] > 0.2, "motion of one")
        one.stop()
        self.assertEqual(two.pose(), (0.0, 0.0, 0.0))
        self.assertEqual((one.odom[-1].header.frame_id, one.odom[-1].child_frame_id),
                         ("robot1/odom", "robot1/base_link"))
        self.assertEqual(one.joints[-1].name[0], "robot1/wheel_0_joint")
        frames = {transform.child_frame_id for message in transforms for transform in message.transforms}
        self.assertLessEqual({"robot1/base_link", "robot2/base_link"}, frames)
        self.assertTrue(all(frame.startswith(("robot1/", "robot2/")) for frame in frames), frames)
        for robot in (one, two):
            for task, hardware in {"cmd_vel_mux: who drives": robot.name, "driver_node: command stream": robot.name,
                                   "odom_node: wheel feedback": robot.name, "serial_com_node: link": robot.board.link,
                                   }.items():
                self.values(f"{robot.name}/{task}")
                self.assertEqual(self.status[f"{robot.name}/{task}"].hardware_id, hardware)

    def test_driver_basic_launch(self):
        if not self.composed:
            return  # it has one way to start
        board = Board(str(self.processes.folder / "basic"))
        self.addCleanup(board.__exit__)
        board.plug()
        self.processes.launch("driver_basic.launch", f"port:={board.link}")
        odom = self.listen("/odom", Odometry)
        command = self.publisher("/cmd_vel", Twist)
        wait_for(lambda: odom, "odometry")
        wait_for(lambda: command.publish(twist(0, 0.3)) or odom[-1].pose.pose.position.y > 0.1, "motion", period=0.02)
        self.assertEqual(board.heard[-1][1].partition(";")[0], "-16.37:32.74:-16.37")

    def test_odometry_from_commands_launch(self):
        if not self.composed:
            return  # it has one way to start
        self.processes.launch("odometry_from_commands.launch")
        odom = self.listen("/odom", Odometry)
        command = self.publisher("/cmd_vel", Twist)
        wait_for(lambda: odom, "odometry")
        start = rospy.get_time()
        wait_for(lambda: command.publish(twist(0.2, 0.1)) or odom[-1].pose.pose.position.x > 0.2, "motion", period=0.02)
        elapsed = rospy.get_time() - start
        self.assertAlmostEqual(odom[-1].pose.pose.position.y, odom[-1].pose.pose.position.x / 2, delta=1e-3)
        self.assertLessEqual(odom[-1].pose.pose.position.x, 0.2 * elapsed + 0.01)
        self.assertAlmostEqual(odom[-1].twist.twist.linear.x, 0.2, delta=1e-4)


if __name__ == "__main__":
    rostest.rosrun("robotont_bringup", "stack_test", StackTest)
