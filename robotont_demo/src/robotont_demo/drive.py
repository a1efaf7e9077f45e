"""The drive itself: follows a plan by cmd_vel, and waits until all of it has come back as odometry."""

import time

import rospy
from geometry_msgs.msg import Twist

from robotont_demo.scenario import PERIOD

REST = 0.2  # [s] of standing that the odometry has to show


def drive(steps, recorder, wait_for):
    """Follow the Steps, then stop. wait_for: that of the `stack`, whose StackError names the missing event."""
    command = rospy.Publisher("cmd_vel", Twist, queue_size=1)
    wait_for(lambda: recorder.odometry and recorder.truth and recorder.drives and command.get_num_connections(),
             "a robot that obeys")
    follow(steps, command)
    wait_for(lambda: command.publish(Twist()) or recorder.stands_since, "the robot to stop")
    wait_for(lambda: recorder.stands_since and recorder.odometry[-1][0] > recorder.stands_since + REST,
             "the last counts")
    before = recorder.link
    wait_for(lambda: recorder.link is not before, "the newest diagnostics")


def follow(steps, command):
    """Publish one Step per period, and print each leg that is done."""
    due = time.monotonic()
    for number, step in enumerate(steps, 1):
        message = Twist()
        message.linear.x, message.linear.y, message.angular.z = step.twist
        command.publish(message)
        if number == len(steps) or steps[number].leg != step.leg:
            print(f"  {100 * number / len(steps):3.0f} %  {step.leg}", flush=True)
        due += PERIOD
        time.sleep(max(0.0, due - time.monotonic()))
