#!/usr/bin/env python3
"""Finds the red thing, and stops half a metre before it."""

import numpy as np
import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import Image, LaserScan


# ---- your code ----
def drive(command, picture, ahead):
    """Called for each picture: height x width x 3 of red, green, blue, 0 to 255, and the distance ahead [m]."""
    command.angular.z = 0.0
# ---- end of your code ----


def on_scan(scan):
    """What is straight ahead; infinite when nothing is."""
    middle = len(scan.ranges) // 2
    nearest[0] = min(scan.ranges[middle - 8:middle + 8])


def on_image(image):
    """The picture as numbers."""
    twist = Twist()
    drive(twist, np.frombuffer(image.data, np.uint8).reshape(image.height, image.width, 3).astype(int), nearest[0])
    publisher.publish(twist)


nearest = [float("inf")]
rospy.init_node("colors")
publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)
rospy.Subscriber("scan", LaserScan, on_scan, queue_size=1)
rospy.Subscriber("camera/color/image_raw", Image, on_image, queue_size=1, buff_size=2 ** 24)
rospy.spin()
