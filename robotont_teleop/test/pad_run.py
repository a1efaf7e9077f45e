#!/usr/bin/env python3
"""gamepad_teleop on a recorded pad: buttons that a line of stdin names are pressed, then let go (BTN_EAST)."""

import sys

import rospy
from evdev import ecodes
from rostest_gamepad_teleop import RecordedPad
from std_msgs.msg import String

from robotont_driver.parameters.parameters import read_parameters
from robotont_teleop.hand.gamepad_teleop import PARAMETERS, GamepadTeleop

if __name__ == "__main__":
    rospy.init_node("gamepad_teleop")
    pad = RecordedPad()
    teleop = GamepadTeleop(read_parameters(PARAMETERS, {}), pad)
    pad.plug()
    rospy.wait_for_message("emergency_stop/pressed_by", String)
    print("ready", flush=True)
    for line in sys.stdin:
        buttons = [ecodes.ecodes[name] for name in line.split()]
        for button in buttons:
            pad.frame((ecodes.EV_KEY, button, 1))
        for button in buttons:
            pad.frame((ecodes.EV_KEY, button, 0))
