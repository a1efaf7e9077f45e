"""The drive itself: follows a plan by cmd_vel, and waits until all of it has come back as odometry."""

import sys
import time

import rospy
from geometry_msgs.msg import Twist

from robotont_demo.recording import Standstill
from robotont_demo.scenario import PERIOD
from robotont_demo.waiting import wait_for


class Commander:
    """Publishes twists."""

    def __init__(self):
        self._publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)

    def connected(self):
        """Whether the driver listens."""
        return self._publisher.get_num_connections() > 0

    def command(self, twist):
        """Publish v_x, v_y [m/s], omega [rad/s]."""
        message = Twist()
        message.linear.x, message.linear.y, message.angular.z = twist
        self._publisher.publish(message)

    def stop(self):
        """Publish a stop."""
        self.command((0.0, 0.0, 0.0))


def drive(steps, commander, robot, recorder):
    """Follow the Steps, then stop; AssertionError that names the missing event."""
    wait_for(lambda: len(recorder.odometry) and len(robot.truth) and commander.connected(), "the stack", timeout=60.0)
    follow(steps, commander)
    wait_for(lambda: commander.stop() or robot.stands(), "the robot to stop", period=PERIOD)
    wait_for(Standstill(recorder).reached, "the last counts", period=0.1)
    before = recorder.link
    wait_for(lambda: recorder.link is not before, "the newest diagnostics")


def follow(steps, commander):
    """Publish one Step per period, and show how far it is."""
    due = time.monotonic()
    for number, step in enumerate(steps, 1):
        commander.command(step.twist)
        if number == len(steps) or steps[number].leg != step.leg or (number % 10 == 0 and sys.stdout.isatty()):
            show_progress(number / len(steps), step.leg)
        due += PERIOD
        time.sleep(max(0.0, due - time.monotonic()))


def show_progress(part, leg):
    """One line that grows, on a terminal; a line for each leg elsewhere."""
    bar = "#" * round(30 * part)
    line = f"  [{bar:<30}] {100 * part:3.0f} %  {leg:<20}"
    if sys.stdout.isatty():
        print("\r" + line, end="\n" if part >= 1 else "", flush=True)
    else:
        print(line, flush=True)
