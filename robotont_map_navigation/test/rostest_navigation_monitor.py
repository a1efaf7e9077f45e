#!/usr/bin/env python3
"""navigation_monitor as a process: what it hears of a master and of tf, and tells."""

import rospy
import rostest
from nav_msgs.msg import OccupancyGrid
from navigation_messages import grid, ranges_in_box, scan_of, transform, walled
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from robotont_testing.harness import wait_for
from robotont_testing.node_test import OK, WARN, NodeTest

TASK = "navigation_monitor: localization"
PLACE = 0.5, 0.0, 0.3  # of the sensor [m], [rad]


class NavigationMonitorTest(NodeTest):
    """In a room of 6 m x 2 m around the origin."""

    def test_scans_and_maps(self):
        transforms, maps = (rospy.Publisher(topic, kind, queue_size=1, latch=True)
                            for topic, kind in (("/tf_static", TFMessage), ("map", OccupancyGrid)))
        maps.publish(grid(walled(42, 122), -3.05, -1.05))
        scans = self.publisher("scan", LaserScan)
        ranges = ranges_in_box(PLACE, -3.0, 3.0, -1.0, 1.0)
        timer = rospy.Timer(rospy.Duration(0.1), lambda _: scans.publish(scan_of(ranges, stamp=rospy.Time.now())))
        self.addCleanup(timer.shutdown)
        self.wait_for_status(TASK, WARN, "the scan cannot be laid on the map")
        transforms.publish(TFMessage([transform("odom", 0.0, 0.0), transform("laser", *PLACE)]))
        self.wait_for_status(TASK, OK, "the map explains 100% of the scan's rays")
        self.wait_for_status("navigation_monitor: motion", OK, "as commanded")
        late = [self.listen(topic, kind) for topic, kind in (
            ("map_for_amcl", OccupancyGrid), ("map_for_planning", OccupancyGrid), ("navigation/held", String),
            ("localization/trouble", String))]
        wait_for(lambda: all(late), "what is told to those who come late")


if __name__ == "__main__":
    rostest.rosrun("robotont_map_navigation", "navigation_monitor", NavigationMonitorTest)
