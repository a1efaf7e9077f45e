#!/usr/bin/env python3
"""navigation_monitor: what a costmap that follows its updates shows, as the robot moves and maps come."""

import time

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import TransformStamped
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid
from tf2_msgs.msg import TFMessage

from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest

SPACE = "/robot2"
BASE = "robot2/base_link"
MONITOR = places.program("robotont_map_navigation", "navigation_monitor")


def room(rows, columns):
    """Cells of an empty room with walls around it."""
    cells = np.zeros((rows, columns), np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = 100
    return cells


class FootprintClearingTest(NodeTest):
    """A robot of 0.2 m in a namespace, in a room whose first cell is at (-1, -1)."""

    def setUp(self):
        super().setUp()
        for name, value in (("robot_base_frame", BASE), ("robot_radius", 0.15), ("footprint_padding", 0.05)):
            rospy.set_param(f"{SPACE}/move_base/global_costmap/{name}", value)
        self.maps = rospy.Publisher(SPACE + "/map", OccupancyGrid, queue_size=1, latch=True)
        self.transforms = rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True)
        self.updates = self.listen(SPACE + "/map_updates", OccupancyGridUpdate)
        self.taken = 0

    def send_map(self, cells):
        """A map for everybody."""
        self.map = cells
        self.costmap = cells.copy()
        self.taken = len(self.updates)
        message = OccupancyGrid(data=cells.ravel().tolist())
        message.header.frame_id = "map"
        message.info.resolution, message.info.height, message.info.width = 0.05, *cells.shape
        message.info.origin.position.x = message.info.origin.position.y = -1.0
        message.info.origin.orientation.w = 1.0
        self.maps.publish(message)

    def place(self, x, y):
        """Put the robot to (x, y) [m] on the map."""
        transform = TransformStamped()
        transform.header.frame_id, transform.child_frame_id = "map", BASE
        transform.transform.translation.x, transform.transform.translation.y = x, y
        transform.transform.rotation.w = 1.0
        self.transforms.publish(TFMessage([transform]))

    def drawn(self):
        """The map with all updates, as costmap_2d's StaticLayer takes them, cell by cell, with no look at bounds."""
        while self.taken < len(self.updates):
            update = self.updates[self.taken]
            self.assertEqual((update.header.frame_id, len(update.data)), ("map", update.width * update.height))
            for number, value in enumerate(update.data):
                self.costmap[update.y + number // update.width, update.x + number % update.width] = value
            self.taken += 1
        return self.costmap

    def test_as_the_robot_moves_and_maps_come(self):
        self.place(-0.88, 0.5)  # 0.095 m right of the middle of the left wall
        self.send_map(room(60, 80))
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
        self.send_map(room(50, 70))
        wait_for(lambda: self.drawn()[0, 30] == 0, "room in the new map")
        self.assertGreater(time.monotonic() - sent, 1.9)  # only when everybody has the map of another size
        sent = time.monotonic()
        self.send_map(room(50, 70))
        wait_for(lambda: self.drawn()[0, 30] == 0, "room in the same map, sent again")
        self.assertLess(time.monotonic() - sent, 1.5)
        self.assertIsNone(node.poll())
        self.assertNotIn("Traceback", log.read_text())


if __name__ == "__main__":
    rostest.rosrun("robotont_map_navigation", "footprint_clearing", FootprintClearingTest)
