"""Wiring profile "four": as ours, with a fourth motor: the robot of config/robots/four_wheels.

Another robot with four wheels: a copy with its own numbers. TIM8's fourth channel takes the pin of motor 0's fault.
"""

from robotont_firmware.pin_profile import *  # noqa: F403 (on the PC that is "ours")

PROFILE = "four"
DESCRIPTION = "four motors, wired by hand as in docs/firmware.md"

WHEELS = 4
EDGES = 48  # [edges] of an encoder per turn of the motor
GEAR = 3000  # [1/100] turns of the motor per turn of a wheel
RADIUS = 50000  # [um] of a wheel
DISTANCE = 200000  # [um] of the wheels from the middle
MASS = 3768  # [g] with wheels
INERTIA = 1104000  # [g cm^2] about the vertical through the middle
TIME_CONSTANT = 43  # [ms] of a motor that turns a wheel in the air

ENCODERS = (  # A pin, B pin, timer (channels 1 and 2), alternate function
    ("PB6", "PB7", 4, 2),
    ("PA6", "PA7", 3, 2),
    ("PA0", "PA1", 2, 1),
    ("PA8", "PA9", 1, 1),
)
BACKWARD_ENCODERS = (False, False, False, False)
PWM = (("PC6", 8, 1, 3), ("PC7", 8, 2, 3), ("PC8", 8, 3, 3), ("PC9", 8, 4, 3))  # pin, timer, channel, function
DIRECTIONS = (("PB8", "PB9"), ("PB12", "PB13"), ("PB14", "PB15"), ("PB1", "PB2"))  # high while forward, backward
FAULTS = ("PC12", "PC10", "PC11", "PD2")
