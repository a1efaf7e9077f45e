#!/usr/bin/env python3
"""Finds the red thing, and stops half a metre before it."""

from robotont_course.robot import run


# ---- your code ----
def drive(command, robot):
    """Called 20 times a second; every command begins as zeros."""
    command.angular.z = 0.0  # you know robot.picture and robot.ahead
# ---- end of your code ----


run(drive)
