#!/usr/bin/env python3
"""navigation_monitor: what a costmap that follows its updates shows, as the robot moves and maps come."""

import time

import numpy as np
import rospy
import rostest
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid
from navigation_messages import grid, transform, walled
from tf2_msgs.msg import TFMessage

from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest

SPACE = "/robot2"
BASE = "robot2/base_link"
MONITOR = places.program("robotont_map_navigation", "navigation_monitor")


class FootprintClearingTest(NodeTest):
    """A robot of 0.2 m in a namespace, in a room whose first cell is at (-1, -1)."""

    def setUp(self):
        super().setUp()
        rospy.set_param(SPACE + "/move_base/global_costmap",
                        {"robot_base_frame": BASE, "robot_radius": 0.15, "footprint_padding": 0.05})
        self.maps = rospy.Publisher(SPACE + "/map", OccupancyGrid, queue_size=1, latch=True)
        self.transforms = rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True)
        self.updates = self.listen(SPACE + "/map_updates", OccupancyGridUpdate)
        self.taken = 0

    def send_map(self, cells):
        self.map = cells
        self.costmap = cells.copy()
        self.taken = len(self.updates)
        self.maps.publish(grid(cells, -1.0, -1.0))

    def place(self, x, y):
        """Put the robot to (x, y) [m] on the map."""
        self.transforms.publish(TFMessage([transform(BASE, x, y)]))

    def drawn(self):
        """The map with all updates, each of which lies within it: costmap_2d's StaticLayer does not look."""
        new = self.updates[self.taken:]
        self.taken += len(new)
        for update in new:
            self.assertEqual(update.header.frame_id, "map")
            cells = np.reshape(update.data, (update.height, update.width))
            self.costmap[update.y:update.y + update.height, update.x:update.x + update.width] = cells
        return self.costmap

    def test_as_the_robot_moves_and_maps_come(self):
        self.place(-0.88, 0.5)  # 0.095 m right of the middle of the left wall
        self.send_map(walled(60, 80))
        log = self.processes.folder / "log"
        node = self.processes.start(MONITOR, f"__ns:={SPACE}", log=log)
        wait_for(lambda: self.drawn()[30, 0] == 0, "room in the wall")
        self.assertEqual(self.drawn()[:, 0].tolist(), [100] * 25 + [0] * 10 + [100] * 25)
        self.assertEqual({update.x for update in self.updates}, {0})
        self.place(0.5, 0.5)
        wait_for(lambda: (self.drawn() == self.map).all(), "the map as it was")
        self.place(0.5, -0.88)
        wait_for(lambda: self.drawn()[0, 30] == 0, "room in the lower wall")
        sent = time.monotonic()
        self.send_map(walled(50, 70))
        wait_for(lambda: self.drawn()[0, 30] == 0, "room in the new map")
        self.assertGreater(time.monotonic() - sent, 1.9)  # only when everybody has the map of another size
        sent = time.monotonic()
        self.send_map(walled(50, 70))
        wait_for(lambda: self.drawn()[0, 30] == 0, "room in the same map, sent again")
        self.assertLess(time.monotonic() - sent, 1.5)
        self.assertIsNone(node.poll())
        self.assertNotIn("Traceback", log.read_text())


if __name__ == "__main__":
    rostest.rosrun("robotont_map_navigation", "footprint_clearing", FootprintClearingTest)
