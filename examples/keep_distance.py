#!/usr/bin/env python3
"""Keeps half a metre from whatever is ahead, by the laser scan: too far, it drives on; too near, it backs."""

import math
import time

import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan

DISTANCE = 0.5  # [m]
GAIN = 1.0      # [m/s] for each metre too much
FASTEST = 0.2   # [m/s]
AHEAD = 0.2     # [rad] to both sides

rospy.init_node("keep_distance")
publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)


def stop():
    """Zeros for a moment, also at Ctrl-C: a last one alone may be lost with the program."""
    for _ in range(10):
        publisher.publish(Twist())
        time.sleep(0.02)


rospy.on_shutdown(stop)


def on_scan(scan):
    """Each scan gives one command. Without scans there are no commands, and the robot stops by itself."""
    if rospy.core.is_shutdown_requested():
        return  # scans still come while stop() sends its zeros
    angles = [scan.angle_min + i * scan.angle_increment for i in range(len(scan.ranges))]
    ahead = [distance for angle, distance in zip(angles, scan.ranges) if math.cos(angle) > math.cos(AHEAD)]
    seen = [distance for distance in ahead if scan.range_min <= distance <= scan.range_max]  # no NaN, no infinity
    command = Twist()
    if -math.inf in ahead:
        command.linear.x = -FASTEST  # nearer than the sensor measures
    elif seen:
        command.linear.x = max(-FASTEST, min(FASTEST, GAIN * (min(seen) - DISTANCE)))
    elif math.inf in ahead:
        command.linear.x = FASTEST  # nothing within the sensor's range
    publisher.publish(command)


rospy.Subscriber("scan", LaserScan, on_scan, queue_size=1)
rospy.spin()
