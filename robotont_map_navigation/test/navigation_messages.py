"""What the rostests of this folder share: a walled room as a map, and transforms."""

import math

import numpy as np
import rospy
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import OccupancyGrid

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
