#!/usr/bin/env python3
"""Drives along a list of points without turning, as only an omnidirectional robot can."""

import math
import time

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

POINTS = [(0.6, 0.0), (0.9, 0.3), (0.6, 0.6), (0.0, 0.6), (0.0, 0.0)]  # [m] from where the robot starts
SPEED = 0.25  # [m/s]
GAIN = 2.0    # [1/s] speed for each metre that is left, and turn for each radian of error
NEAR = 0.05   # [m] from a point, the next one is aimed at
HERE = 0.01   # [m] from the last point, the robot has arrived


class Follower:
    """Answers each message of odom with a command."""

    def __init__(self):
        self.start = None
        self.points = list(POINTS)
        self.publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        rospy.on_shutdown(self.stop)
        rospy.Subscriber("odom", Odometry, self.on_odom, queue_size=1)

    def stop(self):
        """Zeros for a moment, also at Ctrl-C: a last one alone may be lost with the program."""
        for _ in range(10):
            self.publisher.publish(Twist())
            time.sleep(0.02)

    def on_odom(self, message):
        """Aim at the next point."""
        if rospy.core.is_shutdown_requested():
            return  # odom still comes while stop() sends its zeros
        position, turn = message.pose.pose.position, message.pose.pose.orientation
        yaw = 2 * math.atan2(turn.z, turn.w)
        if self.start is None:
            self.start = position.x, position.y, yaw
        x, y, heading = self.since_start(position.x, position.y, yaw)
        to_x, to_y = self.points[0][0] - x, self.points[0][1] - y
        left = math.hypot(to_x, to_y)
        if left < (NEAR if len(self.points) > 1 else HERE):
            self.points.pop(0)
            if not self.points:
                rospy.signal_shutdown("arrived")
                return
        speed = SPEED if len(self.points) > 1 else min(SPEED, GAIN * left)
        command = Twist()
        if left > 0.0:
            vx, vy = speed * to_x / left, speed * to_y / left
            command.linear.x = math.cos(heading) * vx + math.sin(heading) * vy
            command.linear.y = -math.sin(heading) * vx + math.cos(heading) * vy
        command.angular.z = -GAIN * heading
        self.publisher.publish(command)

    def since_start(self, x, y, yaw):
        """The pose seen from where the robot started."""
        x0, y0, yaw0 = self.start
        dx, dy = x - x0, y - y0
        return (math.cos(yaw0) * dx + math.sin(yaw0) * dy, -math.sin(yaw0) * dx + math.cos(yaw0) * dy,
                math.remainder(yaw - yaw0, 2 * math.pi))


rospy.init_node("follow_path")
follower = Follower()
rospy.spin()
