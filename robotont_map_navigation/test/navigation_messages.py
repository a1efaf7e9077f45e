"""What tests of this folder share: a walled room as a map, transforms, and a stand-in for rospy's topics."""

import math
from collections import defaultdict
from types import SimpleNamespace

import numpy as np
import rospy
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import LaserScan

CELL = 0.05  # [m]


def walled(rows, columns):
    """Cells of an empty room with walls around it."""
    cells = np.zeros((rows, columns), np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = 100
    return cells


def grid(cells, x=0.0, y=0.0):
    """A map of cells, the corner of the first at (x, y) [m]."""
    message = OccupancyGrid(data=cells.ravel().tolist())
    message.header.frame_id = "map"
    message.info.resolution, message.info.height, message.info.width = CELL, *cells.shape
    message.info.origin.position.x, message.info.origin.position.y = x, y
    message.info.origin.orientation.w = 1.0
    return message


ANGLES = np.linspace(-math.pi, math.pi, 90, endpoint=False)  # [rad] of a scanner all around


def ranges_in_box(pose, left, right, low, high):
    """[m] that a scanner at a pose (x, y, yaw) sees at ANGLES, in a room from x = left to right, y = low to high."""
    x, y, yaw = pose
    cos, sin = np.cos(ANGLES + yaw), np.sin(ANGLES + yaw)
    return np.minimum(np.where(cos > 0, right - x, left - x) / cos, np.where(sin > 0, high - y, low - y) / sin)


def scan_of(ranges, sees=8.0, stamp=None):
    """The LaserScan of the frame `laser`."""
    message = LaserScan(angle_min=-math.pi, angle_increment=2 * math.pi / 90, range_min=0.05, range_max=sees,
                        ranges=ranges)
    message.header.frame_id, message.header.stamp = "laser", stamp or rospy.Time()
    return message


def transform(child, x, y, yaw=0.0):
    """The transform of a frame at (x, y) [m], yaw [rad] on the map."""
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = "map"
    message.transform.translation.x, message.transform.translation.y = x, y
    message.transform.rotation.z, message.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    return message


def latched(topic, message):
    """A publisher that has sent a message to whoever listens now or later."""
    publisher = rospy.Publisher(topic, type(message), queue_size=1, latch=True)
    publisher.publish(message)
    return publisher


class Bus:
    """Stands in for rospy's topics, parameters and clock, without a master: what is published, and who listens."""

    def __init__(self, monkeypatch):
        self.listeners, self.sent = defaultdict(list), defaultdict(list)
        for name, stand_in in (("Subscriber", lambda topic, _, callback, **__: self.listeners[topic].append(callback)),
                               ("Publisher", lambda topic, *_, **__: SimpleNamespace(
                                   publish=lambda message: self.publish(topic, message))),
                               ("get_namespace", lambda: "/"), ("get_rostime", rospy.Time),
                               ("get_param", lambda name, default: 0.16 if "radius" in name else default)):
            monkeypatch.setattr(rospy, name, stand_in)
        monkeypatch.setattr(rospy.Time, "now", rospy.Time)

    def publish(self, topic, message):
        """Called for what is published."""
        self.sent[topic].append(message)

    def hear(self, topic, message):
        """What comes on a topic."""
        for callback in self.listeners[topic]:
            callback(message)
