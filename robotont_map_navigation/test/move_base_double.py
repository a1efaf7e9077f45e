#!/usr/bin/env python3
"""Stands in for move_base: an action server that sends recorded commands of DWAPlannerROS on cmd_vel.

What tests need of it: ten commands per second while a goal is active, feedback with the pose of odom, one zero Twist at
the end and at a cancellation, and its words. A goal beyond x = 100 is given up as one without a way.
"""

from pathlib import Path

import actionlib
import rospy
from geometry_msgs.msg import PoseStamped, Twist
from move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback, MoveBaseResult
from nav_msgs.msg import Odometry

from robotont_driver.rospy_repairs.rospy_process import init_node

RECORD = Path(__file__).resolve().parent / "data" / "dwa_commands.csv"
NO_WAY = "Failed to find a valid plan. Even after executing recovery behaviors."


def read_record():
    """[(seconds since the start, (v_x, v_y, omega))]."""
    lines = [line for line in RECORD.read_text().splitlines() if not line.startswith("#")]
    rows = [[float(number) for number in line.split(",")] for line in lines]
    return [(row[0], tuple(row[1:])) for row in rows]


class MoveBaseDouble:
    """The action server `move_base`. `~repeat`: true goes on with the record for ever. `~hurry`: times as fast.

    `~barred`: so many goals find no way.
    `~deaf`: [s] that it goes on after a cancellation, as move_base does in its recovery.
    """

    def __init__(self):
        self._record = read_record()
        self._repeat = rospy.get_param("~repeat", False)
        self._hurry = rospy.get_param("~hurry", 1.0)
        self._deaf = rospy.get_param("~deaf", 0.0)
        self._barred = rospy.get_param("~barred", 0)
        self._pose = PoseStamped()
        self._pose.pose.orientation.w = 1.0
        self._command = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        rospy.Subscriber("odom", Odometry, self._on_odometry, queue_size=1)
        self._server = actionlib.SimpleActionServer("move_base", MoveBaseAction, self._drive, auto_start=False)
        self._server.start()

    def _on_odometry(self, message):
        self._pose.header, self._pose.pose = message.header, message.pose.pose

    def _send(self, x=0.0, y=0.0, turn=0.0):
        message = Twist()
        message.linear.x, message.linear.y, message.angular.z = x, y, turn
        self._command.publish(message)

    def _go_on(self):
        """Deaf for so long, but not to the end of this process."""
        end = rospy.Time.now() + rospy.Duration(self._deaf)
        while rospy.Time.now() < end and not rospy.is_shutdown():
            rospy.sleep(0.1)

    def _drive(self, goal):
        """Called with each goal, in a thread of its own."""
        self._barred -= 1
        if goal.target_pose.pose.position.x > 100 or self._barred >= 0:
            self._server.set_aborted(MoveBaseResult(), NO_WAY)
            return
        start = rospy.Time.now()
        rows = list(self._record)
        while rows and not rospy.is_shutdown():
            due, command = rows.pop(0)
            rospy.sleep(max(0.0, due / self._hurry - (rospy.Time.now() - start).to_sec()))
            if self._server.is_preempt_requested():
                self._go_on()
                if not self._server.is_new_goal_available():
                    self._send()
                self._server.set_preempted(MoveBaseResult(), "")
                return
            self._send(*command)
            self._server.publish_feedback(MoveBaseFeedback(base_position=self._pose))
            if self._repeat and not rows:
                start, rows = rospy.Time.now(), list(self._record)
        self._send()
        self._server.publish_feedback(MoveBaseFeedback(base_position=goal.target_pose))  # it has arrived
        rospy.sleep(0.2)  # the result comes on a connection of its own: move_base's, too, some periods later
        self._server.set_succeeded(MoveBaseResult(), "Goal reached.")


if __name__ == "__main__":
    init_node("move_base")
    MoveBaseDouble()
    rospy.spin()
