"""Wiring profile "four": as ours, with a fourth motor: the robot of config/robots/four_wheels.

Another robot with four wheels: a copy with its own numbers. TIM8's fourth channel takes the pin of motor 0's fault.
"""

from robotont_firmware.pin_profile import *  # noqa: F403 (on the PC that is "ours")
from robotont_firmware.pin_profile import BACKWARD_ENCODERS, DIRECTIONS, ENCODERS, FAULTS, PWM

PROFILE = "four"
DESCRIPTION = "four motors, wired by hand as in docs/firmware.md"

WHEELS = 4
EDGES = 48  # [edges] of both channels of an encoder per turn of the motor
GEAR = 3000  # [1/100] turns of the motor per turn of a wheel
RADIUS = 50000  # [um] of a wheel
DISTANCE = 200000  # [um] of the wheels from the middle
MASS = 3768  # [g] with wheels
INERTIA = 1104000  # [g cm^2] about the vertical through the middle
TIME_CONSTANT = 43  # [ms] of a motor that turns a wheel in the air

ENCODERS += (("PA8", "PA9", 1, 1),)  # A pin, B pin, timer (channels 1 and 2), alternate function
BACKWARD_ENCODERS += (False,)
PWM += (("PC9", 8, 4, 3),)  # pin, timer, channel, alternate function
DIRECTIONS += (("PB1", "PB2"),)  # high while forward, high while backward
FAULTS = ("PC12",) + FAULTS[1:] + ("PD2",)  # (MicroPython knows no star in it)
