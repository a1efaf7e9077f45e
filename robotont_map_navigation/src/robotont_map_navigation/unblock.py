"""Sends a command of zeros when move_base's commands move nothing: a board that found a wheel blocked waits for it."""

import math
import time

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from robotont_map_navigation.blockage import PATIENCE, TRIES, Blockage


class Unblock:
    """Listens to cmd_vel, on which it sends the zeros too: right after a command, before the next one comes.

    Whether the commands reach the board at all is known from cmd_vel_mux.
    """

    def __init__(self):
        self._blockage = Blockage()
        self._driver = "navigation"  # where there is no mux
        self._publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("cmd_vel", Twist, self._on_command, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("odom", Odometry, self._on_odometry, queue_size=1)
        rospy.Subscriber("cmd_vel/driven_by", String, self._on_driver, queue_size=1)

    def _on_command(self, message):
        drives = self._driver == "navigation"
        if self._blockage.is_zero_due(drives and message != Twist(), time.monotonic()):
            self._publisher.publish(Twist())
            rospy.logwarn("commanded for %g s, the robot stands: is a wheel blocked, at a wall? Sent zeros, "
                          "for which the board may wait (%d of %d)", PATIENCE, self._blockage.tries, TRIES)

    def _on_driver(self, message):
        self._driver = message.data

    def _on_odometry(self, message):
        place, twist = message.pose.pose.position, message.twist.twist
        self._blockage.measure((place.x, place.y), math.hypot(twist.linear.x, twist.linear.y), twist.angular.z)
