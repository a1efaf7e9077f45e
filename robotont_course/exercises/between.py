#!/usr/bin/env python3
"""Drives between two posts, and stops behind them."""

import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan


# ---- your code ----
def drive(command, points):
    """Called for each scan. points: (angle [rad], distance [m]) of all that it sees, from the right to the left."""
    command.linear.x = 0.0
# ---- end of your code ----


def on_scan(scan):
    """What lies within the scan's range, by its angle: left is positive."""
    twist = Twist()
    drive(twist, [(scan.angle_min + number * scan.angle_increment, found)
                  for number, found in enumerate(scan.ranges) if scan.range_min <= found <= scan.range_max])
    publisher.publish(twist)


rospy.init_node("between")
publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)
rospy.Subscriber("scan", LaserScan, on_scan, queue_size=1)
rospy.spin()
