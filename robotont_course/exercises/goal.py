#!/usr/bin/env python3
"""Finds a way on the map to the goal, and drives it."""

import rospy
import tf2_ros
from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid

from robotont_driver.kinematics.se2 import yaw_of

GOAL = 3.5, 2.5  # [m] on the map


# ---- your code ----
def drive(command, free, x, y, yaw):
    """Called 20 times a second. free(x, y): whether a place of the map is free; x, y, yaw: where you are on it."""
    command.linear.x = 0.0
# ---- end of your code ----


def free_on_the_map(x, y):
    """Whether nothing stands at a place [m]."""
    info = grid.info
    column = int((x - info.origin.position.x) / info.resolution)
    row = int((y - info.origin.position.y) / info.resolution)
    return 0 <= column < info.width and 0 <= row < info.height and grid.data[row * info.width + column] == 0


rospy.init_node("goal")
publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)
frames = tf2_ros.Buffer()
listener = tf2_ros.TransformListener(frames)
grid = rospy.wait_for_message("map", OccupancyGrid)
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    try:
        found = frames.lookup_transform("map", "base_link", rospy.Time(0)).transform
    except tf2_ros.TransformException:
        continue
    twist = Twist()
    drive(twist, free_on_the_map, found.translation.x, found.translation.y, yaw_of(found.rotation))
    publisher.publish(twist)
    rate.sleep()
