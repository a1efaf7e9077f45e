#!/usr/bin/env python3
"""scan_to_distance with the official package robotont_msgs; skipped without it (conftest.py)."""

import unittest

import rostest
from sensor_msgs.msg import LaserScan

from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest

try:
    from robotont_msgs.msg import LaserScanSplit
except ImportError:
    LaserScanSplit = None


@unittest.skipIf(LaserScanSplit is None, "needs the official package robotont_msgs")
class RobotontMsgsTest(NodeTest):
    def test_scan_to_distance(self):
        split = self.listen("scan_to_distance", LaserScanSplit)
        self.processes.start(places.program("robotont_course", "scan_to_distance"))
        scan = self.publisher("scan", LaserScan)
        ranges = [3.0] * 30 + [2.0] * 30 + [1.0] * 29 + [0.5]
        message = LaserScan(angle_min=-1.5, angle_max=1.5, angle_increment=3 / 89, range_min=0.1, range_max=10.0,
                            ranges=ranges)
        wait_for(lambda: scan.publish(message) or split, "the distances", period=0.1)
        self.assertEqual((split[0].rightMin, split[0].centerMin, split[0].leftMin), (3.0, 2.0, 0.5))
        self.assertAlmostEqual(split[0].leftMean, (29 + 0.5) / 30)


if __name__ == "__main__":
    rostest.rosrun("robotont_course", "robotont_msgs_test", RobotontMsgsTest)
