#!/usr/bin/env python3
"""Stands in for move_base: an action server that drives ahead on cmd_vel.

What tests need of it: ten commands per second while a goal is active, feedback with the pose of odom, one zero Twist at
the end and at a cancellation.
"""

import math

import actionlib
import rospy
from geometry_msgs.msg import PoseStamped, Twist
from move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback, MoveBaseResult
from nav_msgs.msg import Odometry

from robotont_driver.rospy_repairs.rospy_process import init_node


class MoveBaseDouble:
    """The action server `move_base`. `~seconds` until a goal is reached; never, by default."""

    def __init__(self):
        self._seconds = float(rospy.get_param("~seconds", math.inf))
        self._pose = PoseStamped()
        self._pose.pose.orientation.w = 1.0
        self._command = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        rospy.Subscriber("odom", Odometry, self._on_odometry, queue_size=1)
        self._server = actionlib.SimpleActionServer("move_base", MoveBaseAction, self._drive, auto_start=False)
        self._server.start()

    def _on_odometry(self, message):
        self._pose.header, self._pose.pose = message.header, message.pose.pose

    def _drive(self, goal):
        """Called with each goal, in a thread of its own."""
        ahead = Twist()
        ahead.linear.x = 0.2
        end = rospy.get_time() + self._seconds
        while rospy.get_time() < end and not rospy.is_shutdown():
            rospy.sleep(0.1)
            if self._server.is_preempt_requested():
                if not self._server.is_new_goal_available():
                    self._command.publish(Twist())
                self._server.set_preempted(MoveBaseResult(), "")
                return
            self._command.publish(ahead)
            self._server.publish_feedback(MoveBaseFeedback(base_position=self._pose))
        self._command.publish(Twist())
        self._server.publish_feedback(MoveBaseFeedback(base_position=goal.target_pose))  # it has arrived
        rospy.sleep(0.2)  # the result comes on a connection of its own: move_base's, too, some periods later
        self._server.set_succeeded(MoveBaseResult(), "Goal reached.")


if __name__ == "__main__":
    init_node("move_base")
    MoveBaseDouble()
    rospy.spin()
