#!/usr/bin/env python3
"""navigation_monitor: what it says of a scan, the room that it makes at walls, DWAPlannerROS' tolerance."""

import math
import time

import numpy as np
import rospy
import rostest
from actionlib_msgs.msg import GoalID
from dynamic_reconfigure.srv import Reconfigure, ReconfigureResponse
from geometry_msgs.msg import PoseStamped, Twist
from map_msgs.msg import OccupancyGridUpdate
from move_base_msgs.msg import MoveBaseActionFeedback
from nav_msgs.msg import OccupancyGrid
from navigation_messages import grid, latched, transform, walled
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from robotont_map_navigation.navigation_monitor import wide_enough
from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.node_test import ERROR, OK, WARN, NodeTest, twist

TASK = "navigation_monitor: localization"
ANGLES = np.linspace(-math.pi, math.pi, 90, endpoint=False)
COS, SIN = np.cos(ANGLES + 0.3), np.sin(ANGLES + 0.3)
ALL = np.minimum(np.where(COS > 0, 2.5, -3.5) / COS, np.where(SIN > 0, 1.0, -1.0) / SIN)  # [m] what the sensor sees
HALF = np.where(np.arange(90) < 50, ALL, 0.4)  # beside something that the map lacks
GONE = np.where(np.arange(90) < 66, ALL, ALL + 1.0)  # a wall of the map is gone: its rays end a metre behind it
FILLS = "something that the map lacks fills the view"


class NavigationMonitorTest(NodeTest):
    """A room of 6 m x 2 m around the origin; the sensor really is at (0.5, 0), turned by 0.3 rad."""

    frame = "laser"  # of the scans
    ranges = ALL     # None: no scan comes

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.map = latched("map", grid(walled(42, 122), -3.05, -1.05))
        cls.scans = rospy.Publisher("scan", LaserScan, queue_size=1)
        cls.timer = rospy.Timer(rospy.Duration(0.1), cls.scan)

    @classmethod
    def tearDownClass(cls):
        cls.timer.shutdown()

    @classmethod
    def scan(cls, _event):
        if cls.ranges is not None:
            message = LaserScan(angle_min=-math.pi, angle_increment=2 * math.pi / 90, range_min=0.1, range_max=8.0,
                                ranges=cls.ranges)
            message.header.frame_id, message.header.stamp = cls.frame, rospy.Time.now()
            cls.scans.publish(message)

    def setUp(self):
        super().setUp()
        self.troubles = self.listen("localization/trouble", String)
        self.transforms = rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True)

    def see(self, ranges):
        type(self).ranges = ranges

    def stand(self, x, yaw, y=0.0, odometry=0.0):
        """At (x, y) [m], yaw [rad] by the localization; the odometry has begun at x = `odometry` [m]."""
        self.transforms.publish(TFMessage([transform("odom", odometry, 0.0), transform("laser", x, y, yaw)]))

    def expect(self, level, words):
        """What the diagnostics say; goto hears of it when it is an error, and that it may go on when it is none."""
        def is_told():
            newest = self.troubles[-1].data if self.troubles else ""
            return words in newest if level == ERROR else not newest
        self.wait_for_status(TASK, level, words)
        wait_for(is_told, "words for goto")

    def explained(self):
        """[%] of the scan's rays."""
        return int(self.values(TASK)["rays that the map explains"].rstrip("%"))

    def drive_about(self, x, yaw):
        """2.1 m, more than proves a wrong pose, around a place."""
        for number in range(8):
            self.stand(x + (0.15 if number % 2 else -0.15), yaw)
            rospy.sleep(0.6)

    def all_is_well_again(self):
        self.stand(0.5, 0.3)
        self.see(ALL)
        self.expect(OK, "of the scan's rays")

    def test_amcl_gets_the_map_half_a_cell_farther(self):
        """It takes a cell's middle for its corner."""
        shifted = self.listen("map_for_amcl", OccupancyGrid)
        wait_for(lambda: shifted, "the map for amcl")
        origin = shifted[0].info.origin.position
        np.testing.assert_allclose((origin.x, origin.y), (-3.025, -1.025))
        self.assertEqual((shifted[0].header.frame_id, shifted[0].info.width), ("map", 122))

    def test_a_map_that_is_higher_than_wide_is_wide_enough_for_navfn(self):
        """Its ways have 4 points per column, half a cell apart."""
        corridor = walled(360, 30)
        wide = wide_enough(grid(corridor, -1.0, 2.0))
        self.assertGreater(2 * wide.info.width, 2 * (360 + 30) - 1)
        cells = np.reshape(wide.data, (360, wide.info.width))
        np.testing.assert_array_equal(cells[:, :30], corridor)
        self.assertTrue((cells[:, 30:] == -1).all())
        planned = self.listen("map_for_planning", OccupancyGrid)
        wait_for(lambda: planned, "the map for the planner")
        self.assertEqual(planned[0].info.width, 122)

    def test_1_before_anybody_has_said_where_the_laser_is_and_after_it(self):
        self.expect(WARN, "the scan cannot be laid on the map")
        self.stand(0.5, 0.3)
        self.expect(OK, "the map explains 100% of the scan's rays")

    def test_places_where_the_robot_cannot_be(self):
        self.all_is_well_again()
        self.stand(-1.5, 1.2)
        wait_for(lambda: self.explained() < 60, "a share that tells it")
        self.expect(ERROR, "a map of another place, or a wrong pose")
        cancelled = self.listen("move_base/cancel", GoalID)
        command = self.publisher("cmd_vel", Twist)
        wait_for(lambda: command.publish(twist(0.2)) or cancelled, "the end of the goal that drives", period=0.2)
        rospy.sleep(0.5)  # of all that was on its way
        cancelled.clear()
        command.publish(Twist())
        self.all_is_well_again()
        self.assertEqual(cancelled, [])
        self.stand(0.5, 3.0, y=-1.02)
        self.expect(ERROR, "is in a wall of the map")
        self.stand(50.0, 0.0)
        self.wait_for_status(TASK, ERROR, "is off the map")
        self.all_is_well_again()

    def test_a_pose_that_slides_away_is_wrong_even_when_it_fits_then(self):
        self.all_is_well_again()
        self.see(HALF)
        self.expect(WARN, FILLS)
        self.stand(1.6, 0.3, odometry=1.1)
        self.expect(ERROR, "the localization has moved the pose by 1.1 m")
        self.see(ALL)
        wait_for(lambda: self.explained() > 75, "a view that fits")
        self.expect(ERROR, "the localization has moved the pose by 1.1 m")
        self.all_is_well_again()

    def test_what_the_map_lacks_is_no_fault_until_the_robot_has_driven_with_it_for_long(self):
        self.see(HALF)
        self.expect(WARN, FILLS)
        self.see(GONE)
        self.expect(WARN, "the room has changed")
        self.drive_about(0.5, 0.3)
        self.expect(WARN, "the room has changed")
        self.stand(0.5, 0.3)
        self.see(np.minimum(ALL, 0.4))
        self.expect(WARN, "the map explains 0% of the scan's rays, the others end before its walls")
        self.stand(-1.2, 0.3)
        self.expect(ERROR, "m of driving: a map of another place")
        self.all_is_well_again()

    def test_transforms_that_are_late_for_a_moment_are_no_fault(self):
        self.all_is_well_again()
        type(self).frame = "elsewhere"
        begun = time.monotonic()
        self.expect(WARN, "the scan cannot be laid on the map")
        self.assertGreater(time.monotonic() - begun, 2.0)
        type(self).frame = "laser"
        self.all_is_well_again()

    def test_a_scan_that_shows_nothing(self):
        self.see(np.full(90, math.nan))
        self.expect(OK, "nothing to compare")
        self.all_is_well_again()

    def test_when_no_scan_comes(self):
        self.see(None)
        self.expect(WARN, "does its sensor run?")
        self.all_is_well_again()

    def test_a_costmap_that_follows_the_updates_has_room_for_the_robot(self):
        """Of 0.2 m, in a namespace, in rooms whose first cells are at (-1, -1)."""
        rospy.set_param("/robot2/move_base/global_costmap",
                        {"robot_base_frame": "robot2/base_link", "robot_radius": 0.15, "footprint_padding": 0.05})
        maps = rospy.Publisher("/robot2/map", OccupancyGrid, queue_size=1, latch=True)
        updates = self.listen("/robot2/map_for_planning_updates", OccupancyGridUpdate)
        costmap = np.zeros(0)

        def send(cells):
            nonlocal costmap
            costmap = cells
            updates.clear()
            maps.publish(grid(cells, -1.0, -1.0))
            return time.monotonic()

        def drawn():
            """With all updates, each of which lies within the map: costmap_2d's StaticLayer does not look."""
            while updates:
                update = updates.pop(0)
                self.assertEqual(update.header.frame_id, "map")
                rows, columns = slice(update.y, update.y + update.height), slice(update.x, update.x + update.width)
                costmap[rows, columns] = np.reshape(update.data, (update.height, update.width))
            return costmap

        def place(x, y):
            self.transforms.publish(TFMessage([transform("robot2/base_link", x, y)]))
        place(-0.88, 0.5)  # 0.095 m right of the middle of the left wall
        send(walled(60, 80))
        node = self.processes.start(places.program("robotont_map_navigation", "navigation_monitor"), "__ns:=/robot2")
        wait_for(lambda: drawn()[30, 0] == 0, "room in the wall")
        expected = walled(60, 80)
        expected[25:35, 0] = 0
        np.testing.assert_array_equal(drawn(), expected)
        place(0.5, 0.5)
        wait_for(lambda: (drawn() == walled(60, 80)).all(), "the map as it was")
        place(0.5, -0.88)
        wait_for(lambda: drawn()[0, 30] == 0, "room in the lower wall")
        sent = send(walled(50, 70))
        wait_for(lambda: drawn()[0, 30] == 0, "room in the new map")
        self.assertGreater(time.monotonic() - sent, 1.9)  # only when everybody has the map of another size
        sent = send(walled(50, 70))
        wait_for(lambda: drawn()[0, 30] == 0, "room in the same map, sent again")
        self.assertLess(time.monotonic() - sent, 1.5)
        self.assertIsNone(node.poll())

    def test_the_goals_tolerance_is_wide_from_the_arrival_to_the_next_goal(self):
        heard = []

        def reconfigure(request):
            heard.extend((each.name, each.value) for each in request.config.doubles)
            return ReconfigureResponse()
        service = rospy.Service("move_base/DWAPlannerROS/set_parameters", Reconfigure, reconfigure)
        self.addCleanup(service.shutdown)
        goal = self.publisher("move_base/current_goal", PoseStamped)
        feedback = self.publisher("move_base/feedback", MoveBaseActionFeedback)
        narrow, wide = ("xy_goal_tolerance", 0.02), ("xy_goal_tolerance", 0.06)
        message, now = PoseStamped(), MoveBaseActionFeedback()
        message.pose.position.x = 2.0
        goal.publish(message)
        for x in (1.0, 1.97, 1.99, 1.97):
            now.feedback.base_position.pose.position.x = x
            feedback.publish(now)
            rospy.sleep(0.1)
        wait_for(lambda: heard[-1:] == [wide], "the arrival")
        goal.publish(message)
        wait_for(lambda: heard[-1] == narrow, "the next goal")
        self.assertEqual(heard.count(wide), 1)


if __name__ == "__main__":
    rostest.rosrun("robotont_map_navigation", "navigation_monitor", NavigationMonitorTest)
