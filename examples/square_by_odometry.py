#!/usr/bin/env python3
"""Drives a square of half a metre by odometry: each side and each turn ends when odom says so."""

import math
import time

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

SPEED, TURN = 0.25, 1.0  # [m/s], [rad/s]
SIDE = 0.5              # [m]
STOPPING = 0.6          # [s] at full speed before the end of a side or a turn, from where the robot slows down


class Square:
    """Keeps the newest pose of odom."""

    def __init__(self):
        self.pose = None  # x [m], y [m], yaw [rad]
        self.publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        rospy.on_shutdown(self.stop)
        rospy.Subscriber("odom", Odometry, self.on_odom, queue_size=1)

    def stop(self):
        """Zeros for a moment, also at Ctrl-C: a last one alone may be lost with the program."""
        for _ in range(10):
            self.publisher.publish(Twist())
            time.sleep(0.02)

    def on_odom(self, message):
        """Called by rospy for each message."""
        position, turn = message.pose.pose.position, message.pose.pose.orientation
        self.pose = position.x, position.y, 2 * math.atan2(turn.z, turn.w)

    def go(self, speed, turn, amount, gone):
        """Drive until gone(start, now) is the amount [m or rad], slower toward the end."""
        rate, start = rospy.Rate(20), self.pose
        while not rospy.is_shutdown():
            left = amount - gone(start, self.pose)
            if left < 0.002:
                break
            share = max(0.05, min(1.0, left / ((speed + turn) * STOPPING)))
            command = Twist()
            command.linear.x, command.angular.z = speed * share, turn * share
            self.publisher.publish(command)
            rate.sleep()
        self.publisher.publish(Twist())

    def drive(self):
        """Four sides, four quarter turns."""
        while self.pose is None and not rospy.is_shutdown():
            rospy.sleep(0.1)
        for _ in range(4):
            self.go(SPEED, 0.0, SIDE, way)
            self.go(0.0, TURN, math.pi / 2, angle)


def way(start, now):
    """[m] between two poses."""
    return math.hypot(now[0] - start[0], now[1] - start[1])


def angle(start, now):
    """[rad] from one pose to the other, counterclockwise, from -pi to pi."""
    return math.remainder(now[2] - start[2], 2 * math.pi)


rospy.init_node("square_by_odometry")
Square().drive()
