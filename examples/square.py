#!/usr/bin/env python3
"""Drives a square of half a metre by time alone: four sides, four quarter turns. It never looks where the robot is."""

import math
import time

import rospy
from geometry_msgs.msg import Twist

SPEED, TURN = 0.25, 1.0  # [m/s], [rad/s]
SIDE = 0.5              # [m]

rospy.init_node("square")
publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)


def stop():
    """Zeros for a moment, also at Ctrl-C: a last one alone may be lost with the program."""
    for _ in range(10):
        publisher.publish(Twist())
        time.sleep(0.02)


rospy.on_shutdown(stop)


def drive(forward, turn, seconds):
    """Send the same command ten times a second: after half a second without one the robot stops."""
    command = Twist()
    command.linear.x, command.angular.z = forward, turn
    end = rospy.Time.now() + rospy.Duration(seconds)
    rate = rospy.Rate(10)
    while rospy.Time.now() < end and not rospy.is_shutdown():
        publisher.publish(command)
        rate.sleep()


while publisher.get_num_connections() == 0 and not rospy.is_shutdown():
    rospy.sleep(0.1)  # the driver has not heard of this node yet
for _ in range(4):
    drive(SPEED, 0.0, SIDE / SPEED)
    drive(0.0, TURN, math.pi / 2 / TURN)
