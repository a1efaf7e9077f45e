"""The drive itself: follows a plan by cmd_vel, and waits until all of it has come back as odometry."""

import time

import rospy
from geometry_msgs.msg import Twist

from robotont_demo.scenario import PERIOD

REST = 0.2  # [s] of standing that the odometry has to show


def wait_for(condition, what, timeout=20.0, period=0.005):
    """Until `condition()` is true; AssertionError that names `what` after `timeout` [s]."""
    end = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"waited {timeout} s in vain for {what}")
        time.sleep(period)


def drive(steps, recorder):
    """Follow the Steps, then stop; AssertionError that names the missing event."""
    command = rospy.Publisher("cmd_vel", Twist, queue_size=1)
    wait_for(lambda: recorder.odometry and recorder.truth and recorder.drives and command.get_num_connections(),
             "the stack", timeout=60.0)
    follow(steps, command)
    wait_for(lambda: command.publish(Twist()) or recorder.stands_since, "the robot to stop", period=PERIOD)
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
