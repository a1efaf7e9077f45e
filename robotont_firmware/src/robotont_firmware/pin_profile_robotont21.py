"""Wiring profile "robotont21": Robotont 2.0 and 2.1 (Nucleo shield 1.3) with four encoder wires moved.

Read from the shield's schematic and the official firmware, never tried on a robot. The shield leads some
encoder channels to pins that are no pair of one timer's inputs, so four wires must be moved as described
in docs/firmware.md; all other pins are the official ones. Order and signs are the official ones too: motors at
60, 180 and 300 degrees, positive counterclockwise (config/robots/robotont2). Should a sign be
wrong, the first command stops with the fault that the wheel counts against its direction.
"""

from robotont_firmware.pin_profile import *  # noqa: F403 (on the PC that is "ours")

PROFILE = "robotont21"
DESCRIPTION = "Robotont 2.0/2.1, shield 1.3, with FOUR ENCODER WIRES MOVED"

BATTERY = 16800  # [mV] 4S LiPo, full, on motors for 12 V: scales feed-forward, gains of driving and torque limits
BATTERY_LOW = 13200  # [mV] 3.3 V a cell

STATIC = 330  # [effort] pulses of less than 0.6 ms give little current
MAX_LOAD = 300  # [effort] no more: where the driver coasts, it turns a free wheel faster and faster
MAX_EFFORT = 1000  # [effort] 25 % duty, the official limit
MAX_SPEED = 165  # [1/1000 of the no-load speed] 0.3 m/s, the official limit
DISTANCE = 145000  # [um] of the wheels from the middle
INERTIA = 556000  # [g cm^2] about the vertical through the middle

ENCODERS = (  # A pin, B pin, timer (channels 1 and 2), alternate function
    ("PA0", "PA1", 2, 1),  # A moved from PC5, B from PA12
    ("PB4", "PB5", 3, 2),  # B moved from PB13
    ("PA8", "PA9", 1, 1),  # A moved from PC7
)
ENCODER_PULL_UPS = True  # they are fed 3.3 V: an unplugged one counts nothing, instead of noise
DRIVER = "coast"  # MC33887, switched by D2
PWM_FREQUENCY = 100  # [Hz] as in the official firmware; pulses much shorter than 1 ms give no torque
PWM = (("PC6", 8, 1, 3), ("PB14", 15, 1, 14), ("PB6", 4, 1, 2))  # pin, timer, channel, alternate function
DIRECTIONS = (("PC9", "PC8"), ("PB1", "PB15"), ("PA7", "PB12"))  # high while forward (DIR2), backward (DIR1)
FAULTS = ("PA6", "PB3", "PB2")  # low: fault
LIGHT = None  # whether the shield leads LD2's pin anywhere is not known
