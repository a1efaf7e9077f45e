"""Steady clocks, and ROS time read together with one."""

import functools
import time

import rospy

LONGEST_READING = 1_000_000  # [ns] that reading two clocks may take; longer, and something came between


# boot_time(): [s] of a steady clock that goes on while the machine is suspended, as time.monotonic() does not
boot_time = functools.partial(time.clock_gettime, time.CLOCK_BOOTTIME)


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
