#!/usr/bin/env python3
"""Drives a square of 1 m."""

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

from robotont_driver.kinematics.se2 import pose_of


# ---- your code ----
def drive(command, x, y, yaw):
    """Called 20 times a second. x, y [m] and yaw [rad] are the odometry; fill in command.linear and command.angular."""
    command.linear.x = 0.0
# ---- end of your code ----


def on_odometry(message):
    """The newest place."""
    pose[:] = pose_of(message.pose.pose)


pose = []
rospy.init_node("square")
publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)
rospy.Subscriber("odom", Odometry, on_odometry, queue_size=1)
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    if pose:
        twist = Twist()
        drive(twist, *pose)
        publisher.publish(twist)
    rate.sleep()
