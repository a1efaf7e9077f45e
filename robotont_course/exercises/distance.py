#!/usr/bin/env python3
"""Keeps 0.6 m from the wall ahead."""

import math

import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan


# ---- your code ----
def drive(command, ahead):
    """Called for each scan. ahead [m] is the distance of what is ahead, infinite when nothing is; fill in command."""
    command.linear.x = 0.0
# ---- end of your code ----


def on_scan(scan):
    """The scan goes from right to left; its middle third is ahead."""
    third = len(scan.ranges) // 3
    twist = Twist()
    drive(twist, min((found for found in scan.ranges[third:-third] if not math.isnan(found)), default=math.inf))
    publisher.publish(twist)


rospy.init_node("distance")
publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)
rospy.Subscriber("scan", LaserScan, on_scan, queue_size=1)
rospy.spin()
