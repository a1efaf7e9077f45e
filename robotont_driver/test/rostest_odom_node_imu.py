#!/usr/bin/env python3
"""odom_node with a gyro on ~imu (timed_odom_node.test): its frame by TF, unplugged and plugged in again."""

import math

import numpy as np
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu
from std_msgs.msg import String

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.se2 import pose_of, wrap
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.protocol.packet import format_packet
from robotont_testing.harness import wait_for
from robotont_testing.node_test import OK, WARN, NodeTest

GYRO = "gyro/odom_node: gyro"
PERIOD = 0.02   # [s]
SAMPLES = 5     # of the gyro per period
BURST = 10      # packets, and more than wait here
STANDING = 100  # packets, 2 s: the bias is learnt
TWIST = (0.2, 0.0, 0.2)  # [m/s], [m/s], [rad/s]


class OdomNodeImuTest(NodeTest):
    """Packets in real time, from a board whose clock goes on between the tests."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.begin = rospy.get_time()

    def setUp(self):
        super().setUp()
        self.odom = self.listen("/gyro/odom", Odometry, publishers=1)
        self.read = self.publisher("/gyro/serial_read", String)
        self.imu = self.publisher("/gyro/imu", Imu)
        wheels = read_wheels(rospy.get_param("/gyro"))
        self.kinematics = Kinematics(wheels)
        self.paths = np.zeros(wheels.amount)   # [edges] that the wheels have turned
        self.counted = np.zeros(wheels.amount, int)
        self.periods = math.ceil((rospy.get_time() - self.begin) / PERIOD)
        self.broadcaster = tf2_ros.StaticTransformBroadcaster()

    def mount(self, frame, roll):
        """Publish the orientation of the gyro's frame."""
        transform = TransformStamped(child_frame_id=frame)
        transform.header.frame_id = "base_link"
        transform.transform.rotation.x, transform.transform.rotation.w = math.sin(roll / 2), math.cos(roll / 2)
        self.broadcaster.sendTransform(transform)

    def drive(self, twist, packets, plugged=True, frame="camera"):
        """So many periods of a `twist`. Yields odometry."""
        units = np.array(self.kinematics.units_of_twist(twist))
        for _ in range(packets):
            self.periods += 1
            end = self.begin + self.periods * PERIOD
            rospy.sleep(max(0.0, end - rospy.get_time()))
            if plugged:
                self.publish_imu(end, twist[2], frame)
            self.paths += units
            counts = self.paths.round().astype(int) - self.counted
            self.counted += counts
            before = len(self.odom)
            self.read.publish(format_packet(counts.tolist()))
            wait_for(lambda before=before: len(self.odom) > before, "odometry of the packet")
            yield self.odom[-1]

    def publish_imu(self, end, rate, frame):
        """A period's samples of a gyro whose y axis points down."""
        for sample in range(1, SAMPLES + 1):
            message = Imu()
            message.header.frame_id = frame
            message.header.stamp = rospy.Time.from_sec(end - PERIOD + sample * PERIOD / SAMPLES)
            message.angular_velocity.y = 0.01 - rate
            self.imu.publish(message)

    def learn(self):
        """Mounted on its side, standing until the bias is learnt."""
        self.mount("camera", -math.pi / 2)
        for _ in range(10):
            list(self.drive((0.0, 0.0, 0.0), STANDING // 2))
            status = self.status.get(GYRO)
            if status and status.level == OK and "takes part" in status.message:
                return
        self.fail(f"no gyro that takes part: {self.status.get(GYRO)}")

    def test_unplugged_and_plugged_in_again_it_does_not_jump(self):
        self.learn()
        driven = [self.odom[-1]]
        for plugged in (True, False, True):
            driven += self.drive(TWIST, 75, plugged)
        poses = [np.array(pose_of(odom.pose.pose)) for odom in driven]
        steps = np.diff(np.array(poses), axis=0)
        expected = np.array(TWIST) * PERIOD
        # Packets of this test that waited come at once. Until the gyro's samples have, the wheels' turns stand for more
        # time than has passed, by as much as the latest of them waited; it is taken back with the samples.
        ends = self.begin + PERIOD * np.arange(self.periods - len(driven) + 1, self.periods + 1)
        late = np.array([odom.header.stamp.to_sec() for odom in driven]) - ends
        slack = TWIST[2] * np.array([late[max(0, packet - BURST):packet + 1].max() for packet in range(1, len(late))])
        turns = np.abs(wrap(steps[:, 2]) - expected[2])
        jumps = (np.abs(np.hypot(steps[:, 0], steps[:, 1]) - expected[0]).max(), np.degrees((turns - slack).max()))
        told = f"{jumps[1]:.3f} deg at {(turns - slack).argmax()}, late by {late.round(3).tolist()} s"
        self.assertLess(jumps[0], 0.001)
        self.assertLess(jumps[1], 0.1, told)
        turned = wrap(poses[-1][2] - poses[0][2])
        self.assertLess(abs(math.degrees(wrap(turned - 225 * expected[2]))), 1.0)
        self.wait_for_status(GYRO, OK)
        self.wait_for_status(GYRO, WARN, "no samples on imu")  # it is unplugged for good

    def test_a_frame_that_tf_does_not_have_is_reported_and_the_wheels_go_on(self):
        def unknown():
            list(self.drive(TWIST, 10, frame="somewhere"))
            status = self.status.get(GYRO)
            return status and status.level == WARN and "somewhere" in status.message
        wait_for(unknown, "the missing transform in the diagnostics")
        before = pose_of(self.odom[-1].pose.pose)
        list(self.drive(TWIST, 50, frame="somewhere"))
        after = pose_of(self.odom[-1].pose.pose)
        self.assertAlmostEqual(wrap(after[2] - before[2]), 0.2, delta=0.01)
        self.mount("somewhere", -math.pi / 2)
        wait_for(lambda: list(self.drive((0.0, 0.0, 0.0), 20, frame="somewhere")) and (
            self.status[GYRO].level == OK), "the transform")


if __name__ == "__main__":
    rostest.rosrun("robotont_driver", "odom_node_imu_test", OdomNodeImuTest)
