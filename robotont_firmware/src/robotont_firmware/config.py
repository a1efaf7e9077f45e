"""What the firmware is told: the robot, its motors, limits and times; the wiring profile comes from pin_profile.py.

`robot_numbers` makes the loop's gains, limits and times from these; the simulator fills robot and motors in from
the robot's folder. A profile may replace any number here but BAUDRATE by one of its own with the same name. The motor
is Pololu's 37D at 12 V. An *effort* of 4000 is the whole battery voltage, 100 % PWM. Efforts are for 12 V, and BATTERY
scales all but MAX_EFFORT and TEST_EFFORT.
"""

# The robot.
WHEELS = 3
RATE = 50  # [Hz] packets per second, the driver's pidControlFrequency
EDGES = 64  # [edges] of both channels of an encoder per turn of the motor
GEAR = 1875  # [1/100] turns of the motor per turn of a wheel
RADIUS = 35000  # [um] of a wheel
DISTANCE = 125000  # [um] of the wheels from the middle: the mean lever
MASS = 3576  # [g] with wheels
INERTIA = 429000  # [g cm^2] about the vertical through the middle
EVEN = 1  # whether the wheels follow each other at even angles, the way round that they turn the robot

# Its motors, at their own shafts and at 12 V.
NO_LOAD_SPEED = 9817  # [0.1 rad/s] 500 rpm behind the gear
STALL_TORQUE = 31500  # [uN m] at 5 A
TIME_CONSTANT = 44  # [ms] of a motor that turns a wheel in the air
STATIC = 160  # [effort] overcomes friction: 0.2 A without load, of 5 A

# Limits.
MAX_SPEED = 900  # [1/1000 of the no-load speed] faster commands are scaled down, all wheels by one factor
MAX_ACCELERATION = 250  # [% of the no-load speed per s] of the wheel whose set-point changes most,
MAX_BRAKING = 150  # [%/s] likewise, to a stop. Both are less where MAX_TORQUE gives less
MAX_EFFORT = 4000  # [effort] of the whole voltage
MAX_TORQUE = 2000  # [effort] above the back-EMF: half of the stall current, 2.5 A
CONTINUOUS_TORQUE = 800  # [effort] above the back-EMF: 1 A, that the motor stands for ever (rated 1.25 A)
OVERLOAD_TIME = 1500  # [ms] of MAX_TORQUE bring a cold motor to where only CONTINUOUS_TORQUE is left
MAX_LOAD = 800  # [effort] that a wheel may get above what turns a free one, for a slope, a carpet, a threshold
RUBBING = 76  # [1/10000 of the weight] by which rollers rub while the robot turns on the spot

# Times.
TIMEOUT = 480  # [ms] without a valid packet stop the motors
BRAKING = 2000  # [ms] after the time-out or a fault wheels are braked for so long at most, then released
FAULT_HOLD = 500  # [ms] a fault stands for at least this long, and the fault pins must be quiet for it
WATCHDOG = 300  # [ms] without a finished period: the board resets

# One wheel driven on its own while no commands come, by the order `!test` (./robotont wheels --bring-up).
TEST_EFFORT = 400  # [effort] 10 %; 1000 at most
TEST_SPEED = 300  # [1/1000 of the no-load speed] the board ends a drive that is faster
TEST_TIME = 500  # [ms] from the newest order to test a wheel

BAUDRATE = 115200  # to the PC: USART2, the ST-Link's virtual port, shared with the REPL

from robotont_firmware.pin_profile import *  # noqa: E402, F403 (the profile: pins and electronics)
