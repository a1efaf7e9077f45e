#!/usr/bin/env python3
"""navigation_monitor as a process: what it hears and tells, a robot that something holds, something that comes."""

import time

import numpy as np
import rospy
import rostest
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseStamped, Twist
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid, Odometry
from navigation_messages import grid, latched, ranges_in_box, scan_of, transform, walled
from sensor_msgs import point_cloud2
from sensor_msgs.msg import LaserScan, PointCloud2
from std_msgs.msg import Float32, String
from tf2_msgs.msg import TFMessage

from robotont_testing.harness import wait_for
from robotont_testing.node_test import ERROR, OK, WARN, NodeTest, twist

TASK, MOTION = "navigation_monitor: localization", "navigation_monitor: motion"


class NavigationMonitorTest(NodeTest):
    """In a room of 6 m x 2 m around the origin."""

    def setUp(self):
        super().setUp()
        self.cancelled = self.listen("move_base/cancel", GoalID)
        self.stands = self.listen("navigation/stand", Float32)
        self.felt = self.listen("navigation/felt", PointCloud2)
        self.told = self.listen("navigation/held", String)
        self.odom = self.publisher("odom", Odometry)
        self.command = self.publisher("cmd_vel/limited", Twist)
        self.driver = latched("cmd_vel/driven_by", String("navigation"))

    def test_scans_and_maps(self):
        troubles, updates = self.listen("localization/trouble", String), self.listen("map_for_planning_updates",
                                                                                     OccupancyGridUpdate)
        self.map, scans = latched("map", grid(walled(42, 122), -3.05, -1.05)), self.publisher("scan", LaserScan)
        transforms = rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True)

        def stand(x, y, yaw):
            transforms.publish(TFMessage([transform("odom", 0.0, 0.0), transform("laser", x, y, yaw)]))
        ranges = ranges_in_box((0.5, 0.0, 0.3), -3.0, 3.0, -1.0, 1.0)
        timer = rospy.Timer(rospy.Duration(0.1), lambda _: scans.publish(scan_of(ranges, stamp=rospy.Time.now())))
        self.addCleanup(timer.shutdown)
        self.wait_for_status(TASK, WARN, "the scan cannot be laid on the map")
        stand(0.5, 0.0, 0.3)
        self.wait_for_status(TASK, OK, "the map explains 100% of the scan's rays")
        for who, corner in ("amcl", (-3.025, -1.025)), ("planning", (-3.05, -1.05)):  # amcl takes middles for corners
            maps = self.listen(f"map_for_{who}", OccupancyGrid)
            wait_for(lambda maps=maps: maps, f"the map for {who}")
            origin = maps[0].info.origin.position
            np.testing.assert_allclose((origin.x, origin.y), corner)
            self.assertEqual((maps[0].header.frame_id, maps[0].info.width), ("map", 122))
        stand(-2.99, 0.0, 0.3)
        self.wait_for_status(TASK, ERROR, "a map of another place, or a wrong pose")
        wait_for(lambda: "a map of another place" in troubles[-1].data, "words for goto")
        wait_for(lambda: updates and 0 in updates[-1].data, "room in the wall")

    def drive(self, until, what):
        """Command 0.2 m/s while the wheels stand."""
        odometry = Odometry()

        def step():
            self.command.publish(twist(0.2))
            odometry.header.stamp = rospy.Time.now()
            self.odom.publish(odometry)
            return until()
        wait_for(step, what, period=0.02)

    def test_a_robot_that_is_held_loses_navigations_goals_and_a_new_one_tries_again(self):
        self.driver.publish(String("hand"))
        wait_for(lambda: self.values(MOTION)["driven by"] == "hand", "navigation_monitor to hear who drives")
        begin = time.monotonic()
        self.drive(lambda: time.monotonic() - begin > 1.0, "a second by hand")
        self.assertEqual([*self.cancelled, *self.stands], [])
        self.driver.publish(String("navigation"))
        self.drive(lambda: self.stands, "a stand")
        self.assertEqual(self.cancelled, [])
        felt = wait_for(lambda: [cloud for cloud in self.felt if cloud.width], "what it has felt")
        xs, _, _ = zip(*point_cloud2.read_points(felt[0]))
        self.assertGreaterEqual(min(xs), 0.0)
        self.assertGreater(max(xs), 0.05)
        wait_for(lambda: not self.felt[-1].width, "a cloud of nothing: else costmaps would never forget the one before")
        self.drive(lambda: self.cancelled and self.told[-1].data.startswith("something holds the robot"), "the end")
        self.wait_for_status(MOTION, ERROR, "something holds the robot")
        self.publisher("move_base/current_goal", PoseStamped).publish(PoseStamped())
        wait_for(lambda: not self.told[-1].data, "a new try")

    def test_navigation_stands_while_something_comes(self):
        """Of two scanners on one topic, of which the lower one sees something that stands."""
        transforms = rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True)
        frames = [transform(child, 0.0, 0.0) for child in ("base_link", "laser", "low_laser")]
        for frame, parent in zip(frames, ("odom", "base_link", "base_link")):
            frame.header.frame_id = parent
        transforms.publish(TFMessage(frames))
        scans, commands = self.publisher("scan", LaserScan), self.publisher("cmd_vel", Twist)

        def show(distance, until, what):
            def step():
                commands.publish(twist(0.2))
                for frame, seen in (("laser", distance(time.monotonic() - begin)), ("low_laser", 0.8)):
                    scan = scan_of(np.full(101, seen), stamp=rospy.Time.now())
                    scan.header.frame_id = frame
                    scans.publish(scan)
                return until()
            wait_for(step, what, period=0.05)
        begin = time.monotonic()
        show(lambda _: 3.0, lambda: time.monotonic() - begin > 1.5, "a second with a wall far away")
        self.assertEqual(self.stands, [])
        show(lambda now: 3.0 if now % 1.2 < 0.6 else 0.7, lambda: self.stands, "a stand")  # comes and goes
        self.assertTrue(0.0 < self.stands[0].data <= 2.0, "what cmd_vel_mux takes")


if __name__ == "__main__":
    rostest.rosrun("robotont_map_navigation", "navigation_monitor", NavigationMonitorTest)
