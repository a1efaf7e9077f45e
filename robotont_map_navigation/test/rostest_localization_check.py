#!/usr/bin/env python3
"""navigation_monitor: what its diagnostics say of a scan that fits the map, and of one that does not."""

import math
import time

import numpy as np
import rospy
import rostest
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped, Twist
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from robotont_testing.harness import wait_for
from robotont_testing.node_test import ERROR, OK, WARN, NodeTest, twist

TASK = "navigation_monitor: localization"
ANGLES = np.linspace(-math.pi, math.pi, 90, endpoint=False)


def latched(topic, message):
    """A publisher that has sent a message to whoever listens now or later."""
    publisher = rospy.Publisher(topic, type(message), queue_size=1, latch=True)
    publisher.publish(message)
    return publisher


def place(x, yaw, y=0.0, odometry=0.0):
    """The transforms of a robot at (x, y) [m], yaw [rad] on the map, of which the odometry has begun at x [m]."""
    start = TransformStamped()
    start.header.frame_id, start.child_frame_id = "map", "odom"
    start.transform.translation.x, start.transform.rotation.w = odometry, 1.0
    transform = TransformStamped()
    transform.header.frame_id, transform.child_frame_id = "map", "laser"
    transform.transform.translation.x, transform.transform.translation.y = x, y
    transform.transform.rotation.z, transform.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    return TFMessage([start, transform])


class LocalizationCheckTest(NodeTest):
    """A room of 6 m x 2 m around the origin; the sensor really is at (0.5, 0), turned by 0.3 rad."""

    frame = "laser"  # of the scans
    silent = False   # no scan comes

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cells = np.zeros((42, 122), np.int8)
        cells[[0, -1]] = cells[:, [0, -1]] = 100
        room = OccupancyGrid(data=cells.ravel().tolist())
        room.header.frame_id = "map"
        room.info.resolution, room.info.height, room.info.width = 0.05, *cells.shape
        room.info.origin.position.x, room.info.origin.position.y = -3.05, -1.05
        room.info.origin.orientation.w = 1.0
        cls.map = latched("map", room)
        cos, sin = np.cos(ANGLES + 0.3), np.sin(ANGLES + 0.3)
        cls.ranges = np.minimum(np.where(cos > 0, 2.5, -3.5) / cos, np.where(sin > 0, 1.0, -1.0) / sin)
        cls.scans = rospy.Publisher("scan", LaserScan, queue_size=1)
        cls.timer = rospy.Timer(rospy.Duration(0.1), cls.scan)

    @classmethod
    def tearDownClass(cls):
        cls.timer.shutdown()

    @classmethod
    def scan(cls, _event):
        if cls.silent:
            return
        message = LaserScan(angle_min=-math.pi, angle_increment=2 * math.pi / 90, range_min=0.1, range_max=8.0,
                            ranges=cls.ranges)
        message.header.frame_id, message.header.stamp = cls.frame, rospy.Time.now()
        cls.scans.publish(message)

    def test_amcl_gets_the_map_half_a_cell_farther(self):
        """It takes a cell's middle for its corner."""
        shifted = self.listen("map_for_amcl", OccupancyGrid)
        wait_for(lambda: shifted, "the map for amcl")
        origin = shifted[0].info.origin.position
        self.assertAlmostEqual(origin.x, -3.025)
        self.assertAlmostEqual(origin.y, -1.025)
        self.assertEqual((shifted[0].header.frame_id, shifted[0].info.width), ("map", 122))

    def drive_past_what_the_map_lacks(self, transforms):
        """3 m, and the map explains half of the view."""
        type(self).ranges = np.where(np.arange(90) < 50, self.ranges, 0.4)
        self.wait_for_status(TASK, WARN, "something that the map lacks fills the view")
        doubts = self.listen("localization/doubt", String)
        wait_for(lambda: doubts and "fills the view" in doubts[-1].data, "words for goto")
        for number in range(10):
            transforms.publish(place(0.65 if number % 2 else 0.35, 0.3))
            rospy.sleep(0.6)
        self.wait_for_status(TASK, WARN, "something that the map lacks fills the view")

    def let_the_pose_slide(self, transforms, troubles):
        """By 1.1 m, while the map explains half of the view and the odometry stands still; returns the whole view."""
        far = type(self).ranges
        type(self).ranges = np.where(np.arange(90) < 50, far, 0.4)
        self.wait_for_status(TASK, WARN, "something that the map lacks fills the view")
        transforms.publish(place(1.6, 0.3, odometry=1.1))
        wait_for(lambda: "the localization has moved the pose by 1.1 m" in troubles[-1].data, "words for goto")
        type(self).ranges = far  # even when it fits
        rospy.sleep(2 * rospy.get_param("navigation_monitor/fit_time"))
        self.wait_for_status(TASK, ERROR, "the localization has moved the pose by 1.1 m")
        transforms.publish(place(0.5, 0.3))
        self.wait_for_status(TASK, OK, "of the scan's rays")
        wait_for(lambda: not troubles[-1].data, "goto may go on")
        return far

    def test_what_the_diagnostics_say(self):
        troubles = self.listen("localization/trouble", String)
        self.wait_for_status(TASK, WARN, "the scan cannot be laid on the map")  # nobody has said where the laser is
        transforms = latched("/tf_static", place(0.5, 0.3))
        self.wait_for_status(TASK, OK, "the map explains 100% of the scan's rays")
        transforms.publish(place(-1.5, 1.2))
        status = self.wait_for_status(TASK, ERROR, "a map of another place, or a wrong pose")
        wait_for(lambda: "wrong pose" in troubles[-1].data, "words for goto")
        self.assertRegex(self.values(TASK)["rays that the map explains"], r"^[1-5]?\d%$", status)
        transforms.publish(place(0.5, 0.3))
        self.wait_for_status(TASK, OK, "of the scan's rays")
        wait_for(lambda: not troubles[-1].data, "goto may go on")
        transforms.publish(place(0.5, 3.0, y=-1.02))
        self.wait_for_status(TASK, ERROR, "is in a wall of the map")
        transforms.publish(place(50.0, 0.0))
        self.wait_for_status(TASK, ERROR, "is off the map")
        transforms.publish(place(0.5, 0.3))
        self.wait_for_status(TASK, OK, "of the scan's rays")
        wait_for(lambda: not troubles[-1].data, "goto may go on")
        far = self.let_the_pose_slide(transforms, troubles)
        self.drive_past_what_the_map_lacks(transforms)
        self.assertEqual(troubles[-1].data, "")
        transforms.publish(place(0.5, 0.3))
        type(self).ranges = np.minimum(far, 0.4)
        self.wait_for_status(TASK, WARN, "the map explains 0% of the scan's rays, the others end before its walls")
        self.assertEqual(troubles[-1].data, "", "the pose may be right")  # the last ones' end was waited for
        transforms.publish(place(-1.2, 0.3))
        self.wait_for_status(TASK, ERROR, "m of driving: a map of another place")
        transforms.publish(place(0.5, 0.3))
        type(self).ranges = far
        self.wait_for_status(TASK, OK, "of the scan's rays")
        unsure = PoseWithCovarianceStamped()
        unsure.pose.covariance[0] = 1.0  # [m^2]
        pose = latched("amcl_pose", unsure)
        self.wait_for_status(TASK, ERROR, "amcl is unsure of the pose: 1.00 m, 0.00 rad")
        cancelled = self.listen("move_base/cancel", GoalID)
        command = self.publisher("cmd_vel", Twist)
        command.publish(Twist())
        command.publish(twist(0.2))
        wait_for(lambda: cancelled, "the end of whatever goal makes move_base drive")
        self.assertEqual(len(cancelled), 1)
        pose.publish(PoseWithCovarianceStamped())
        self.wait_for_status(TASK, OK)
        type(self).frame = "elsewhere"  # as when transforms are late: no fault until it has lasted for fit_time
        begun = time.monotonic()
        self.wait_for_status(TASK, WARN, "the scan cannot be laid on the map")
        self.assertGreater(time.monotonic() - begun, rospy.get_param("navigation_monitor/fit_time") / 2)
        type(self).frame = "laser"
        self.wait_for_status(TASK, OK, "of the scan's rays")
        type(self).ranges = np.full(90, math.nan)
        wait_for(lambda: self.status[TASK].message.startswith("nothing to compare"), "an empty scan")

    def test_when_no_scan_comes(self):
        transforms = latched("/tf_static", place(0.5, 0.3))
        wait_for(transforms.get_num_connections, "navigation_monitor")
        self.wait_for_status(TASK, OK)
        type(self).silent = True
        self.wait_for_status(TASK, WARN, "does its sensor run?")
        type(self).silent = False
        self.wait_for_status(TASK, OK)


if __name__ == "__main__":
    rostest.rosrun("robotont_map_navigation", "localization_check", LocalizationCheckTest)
