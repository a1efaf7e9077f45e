#!/usr/bin/env python3
"""odom_node, fed by the test."""

import math
import time

import numpy as np
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.se2 import pose_of
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.protocol.protocol import Packet, format_packet
from robotont_testing.harness import wait_for
from robotont_testing.node_test import OK, WARN, NodeTest

TASK = "odom_node: wheel feedback"


class OdomNodeTest(NodeTest):
    def setUp(self):
        super().setUp()
        self.odom = self.listen("odom", Odometry)
        self.transforms = self.listen("/tf", TFMessage)
        self.joints = self.listen("joint_states", JointState)
        self.read = self.publisher("serial_read", String)
        rospy.wait_for_service("reset_odometry", 20)
        rospy.ServiceProxy("reset_odometry", Trigger)()
        # until every one of the connections is there
        wait_for(lambda: self.send([(0, 0, 0)], wait=False) or (self.odom and self.transforms and self.joints),
                 "odometry", period=0.05)
        self.settle()

    def settle(self):
        """Until nothing is under way, then forget what came."""
        number = -1
        while number != len(self.odom):
            number = len(self.odom)
            rospy.sleep(0.1)
        for messages in (self.odom, self.transforms, self.joints):
            messages.clear()

    def send(self, packets, wait=True):
        before = len(self.odom)
        for packet in packets:
            self.read.publish(format_packet(packet))
        if wait:
            wait_for(lambda: len(self.odom) >= before + len(packets), "an odometry message per packet")

    def pose(self):
        return pose_of(self.odom[-1].pose.pose)

    def test_frames_stamps_and_covariances(self):
        self.send([(-10, 0, 10)] * 50)
        wait_for(lambda: len(self.transforms) == len(self.joints) == 50, "transforms and joint states")
        self.assertGreater(np.diff([message.header.stamp.to_nsec() for message in self.odom]).min(), 0)
        for odom, tf, joints in zip(self.odom, self.transforms, self.joints):
            (transform,) = tf.transforms
            for message in (odom, transform):
                self.assertEqual((message.header.frame_id, message.child_frame_id), ("odom", "base_link"))
            self.assertEqual({transform.header.stamp, joints.header.stamp}, {odom.header.stamp})
            self.assertEqual(transform.transform.translation.x, odom.pose.pose.position.x)
            self.assertEqual(transform.transform.rotation, odom.pose.pose.orientation)
            for covariance in (odom.pose.covariance, odom.twist.covariance):
                matrix = np.reshape(covariance, (6, 6))
                self.assertLess(np.diag(matrix).max(), 1e3)
                np.testing.assert_allclose(matrix, matrix.T, rtol=1e-9, atol=1e-18)
                self.assertGreater(np.linalg.eigvalsh(matrix).min(), 0)
        self.assertEqual(self.joints[-1].name, ["wheel_0_joint", "wheel_1_joint", "wheel_2_joint"])
        self.assertGreater(self.odom[-1].pose.covariance[0], self.odom[0].pose.covariance[0])
        self.assertGreater(self.pose()[0], 0.09)
        units = Kinematics(read_wheels(rospy.get_param("/"))).units_of_twist((0.8, 0.4, 2.0))
        self.send([[round(unit) for unit in units]])
        speeds = self.odom[-1].twist.twist
        np.testing.assert_allclose((speeds.linear.x, speeds.linear.y, speeds.angular.z), (0.8, 0.4, 2.0), atol=0.02)
        self.assertTrue(rospy.ServiceProxy("reset_odometry", Trigger)().success)
        self.send([(0, 0, 0)])
        self.assertEqual(self.pose(), (0.0, 0.0, 0.0))

    def test_a_board_of_another_rate_is_told(self):
        start, sent = time.monotonic(), 0

        def told():
            nonlocal sent
            due = int((time.monotonic() - start) / 0.018) - sent
            self.send([(0, 0, 0)] * due, wait=False)
            sent += due
            status = self.status.get("odom_node: stamps")
            return status and status.level == WARN and "pidControlFrequency" in status.message
        wait_for(told, "the warning")

    def keep_on_until(self, level, words, topic, counts, units):
        """The task's values, once it has this level and these words while packets of `counts` come."""
        task = topic.lstrip("/") + TASK
        read, command = self.publisher(topic + "serial_read", String), Packet(units, format_packet(units, 2))

        def told():
            read.publish(Packet(counts, commanded=command).told())
            status = self.status.get(task)
            return status and status.level == level and words in status.message
        wait_for(told, f"{words!r} in {task}", period=0.01)
        return self.values(task)

    def test_a_slipping_wheel_of_four_is_left_out_named_and_taken_back(self):
        """In a namespace with frames of its own, and without TF."""
        odom, joints = self.listen("/four/odom", Odometry, publishers=1), self.listen("/four/joint_states", JointState)
        units = Kinematics(read_wheels(rospy.get_param("/four"))).units_of_twist((0.4, 0.0, 0.0))
        right = [round(unit) for unit in units]
        wrong = [round(1.4 * unit) if wheel == 2 else unit for wheel, unit in enumerate(right)]
        wait_for(lambda: float(self.keep_on_until(OK, "packets/s", "/four/", right, units)[
            "noise of the wheels, learnt"].split()[0]) <= 0.6, "the wheels' noise", period=0.01)
        values = self.keep_on_until(WARN, "wheel 2 disagrees", "/four/", wrong, units)
        told = len(odom)
        self.keep_on_until(WARN, "wheel 2 disagrees", "/four/", wrong, units)  # the next packets are without it
        wait_for(lambda: len(odom) > told, "odometry of the next packet")
        self.assertAlmostEqual(odom[-1].twist.twist.linear.x, 0.4, delta=0.01)
        self.assertAlmostEqual(odom[-1].twist.twist.angular.z, 0.0, delta=0.03)
        self.assertEqual(values["wheels excluded"], "wheel 2")
        self.keep_on_until(OK, "packets/s", "/four/", right, units)
        self.assertEqual((odom[-1].header.frame_id, odom[-1].child_frame_id), ("four/odom", "four/base_footprint"))
        wait_for(lambda: joints, "joint states")
        self.assertEqual(joints[-1].name[0], "four/wheel_0_joint")
        self.assertEqual(self.transforms, [])

    def test_a_gyro_on_its_side_takes_part_once_tf_has_its_frame(self):
        odom, read = self.listen("/gyro/odom", Odometry, publishers=1), self.publisher("/gyro/serial_read", String)
        imu, broadcaster = self.publisher("/gyro/imu", Imu), tf2_ros.StaticTransformBroadcaster()

        def turn_by_hand(rate, until, what):
            message = Imu()
            message.header.frame_id, message.angular_velocity.y = "camera", 0.01 - rate  # its y axis points down

            def done():
                message.header.stamp = rospy.Time.now()
                imu.publish(message)
                read.publish(format_packet((0, 0, 0)))
                return until()
            wait_for(done, what, period=0.02)

        def says(level, words):
            status = self.status.get("gyro/odom_node: gyro")
            return status and status.level == level and words in status.message
        turn_by_hand(0.0, lambda: says(WARN, "no transform from 'camera'"), "word of the missing transform")
        mounted = TransformStamped(child_frame_id="camera")
        mounted.header.frame_id = "base_link"
        mounted.transform.rotation.x, mounted.transform.rotation.w = -math.sqrt(0.5), math.sqrt(0.5)
        broadcaster.sendTransform(mounted)
        turn_by_hand(0.0, lambda: says(OK, "takes part"), "the bias")
        self.assertAlmostEqual(pose_of(odom[-1].pose.pose)[2], 0.0, delta=0.02)
        turn_by_hand(1.0, lambda: 0.3 < pose_of(odom[-1].pose.pose)[2] < 2.0, "a turn to the left")
        self.wait_for_status("gyro/odom_node: gyro", WARN, "no samples on imu")


if __name__ == "__main__":
    rostest.rosrun("robotont_driver", "odom_node_test", OdomNodeTest)
