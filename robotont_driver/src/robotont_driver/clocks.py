"""The steady clock and ROS time, read as one."""

import time

import rospy

LONGEST_READING = 1_000_000  # [ns] that reading two clocks may take; longer, and something came between


def read_clocks():
    """(steady clock, ROS time) [ns] of one instant; simulated time is both."""
    if not rospy.rostime.is_wallclock():
        now = rospy.Time.now().to_nsec()
        return now, now
    while True:
        steady = time.monotonic_ns()
        now = time.time_ns()  # what rospy.Time.now() reads, too
        if time.monotonic_ns() - steady < LONGEST_READING:
            return steady, now
