"""Every number of the firmware with its unit: timing, limits and gains here, the wiring profile in pin_profile.py.

One *unit* is one encoder edge per control period. Three Pololu 19:1 37D motors at 12 V are assumed:
gear 18.75, 64 edges per motor turn (1200 per wheel turn), 500 rpm without load (200 units), 5 A in stall.
An *effort* of FULL_EFFORT is the whole battery voltage. Efforts and gains are for 12 V; Pid scales them to
BATTERY. A profile may replace any number here by one of its own with the same name.
"""

# Timing. A period is 1 / RATE seconds.
WHEELS = 3
RATE = 50  # [Hz] control periods per second, the driver's pidControlFrequency
TIMEOUT = 24  # [periods] without a valid packet stop the motors: 0.48 to 0.5 s after the packet came
BRAKING = 15  # [periods] after the time-out the wheels are braked for this long, then released
ANSWER_INTERVAL = 10  # [periods] at most one answer to a request for the identity in this time
FAULT_HOLD = 25  # [periods] a fault stands for at least this long, and the fault pins must be quiet for it

# Limits.
MAX_SPEED = 180  # [units] faster commands are scaled down, all wheels by one factor
MAX_ACCELERATION = 10  # [units/period] of the wheel whose set-point changes most (500 units/s, 4.6 m/s^2)
MAX_BRAKING = 6  # [units/period] likewise, to a stop: 2.7 m/s^2. Both are less where MAX_TORQUE does not
#                  give that to a robot of this LEAD (gain_bounds.acceleration)
FULL_EFFORT = 4000  # [effort] 100 % PWM
MAX_EFFORT = 4000  # [effort] of the whole voltage
MAX_TORQUE = 2000  # [effort] above the back-EMF: half of the stall current, 2.5 A
CONTINUOUS_TORQUE = 800  # [effort] above the back-EMF: 1 A, that the motor stands for ever (rated 1.25 A)
OVERLOAD_TIME = 75  # [periods] of MAX_TORQUE bring a cold motor to where only CONTINUOUS_TORQUE is left
MAX_INTEGRAL = 1200  # [effort] the most that the integral part may add
BLOCKED_INTEGRAL = 400  # [effort] the most that it may reach while FaultWatch bounds the effort

# Broken encoders and wheels: see fault_watch.py.
MAX_LOAD = 400  # [effort] of 0.5 A that a healthy wheel may need above a free one. The price of more: before it is
#                 found, a wheel without an encoder turns at MAX_LOAD / 19.2 = 21 units, or 1.15 times the command
BLIND_TIME = 14  # [periods] at that bound make a fault of a wheel; 24 while the robot changes its motion
BLIND_SHARE = 197  # [1/256 of its speed] a wheel that counts less is slow,
CHANGING_SHARE = 128 # [1/256 of its speed] or less than this while the robot changes its motion
BESIDE_SHARE = 64  # [1/256] or at this part of the fastest wheel's set-point
UNEVEN_SHARE = 24  # [1/256 of its speed] and 2.5 edges a healthy wheel's counts may bend from period to period;
UNEVEN_EDGES = 42  # [edges] of more, summed, make a fault: knocks and walls bring a healthy wheel to 32
WRONG_EDGES = 16  # [edges] backward are no tremor; the least that a wheel has to owe for a fault

# Speed controller. STATIC in effort, the gains in 1/256 effort per unit (I: per unit and period).
STATIC = 160  # [effort] overcomes friction: 0.2 A without load, of 5 A
SPEED_GAIN = 4915  # 19.2 effort per unit: (FULL_EFFORT - STATIC) / 200 units
P_GAIN = 8192  # 32 effort per unit
I_GAIN = 1344  # 5.25 effort per unit and period
BRAKE_GAIN = 60  # [effort per unit] against the wheel's motion, after the time-out
D_GAIN = 0  # on the measured speed; encoder counts are too coarse at 50 Hz to need it
FOLLOW = 128  # [1/256 of the way per period] the reference nears the set-point: time constant 29 ms
LEAD = 240  # [1/16 period] time constant of motors that drive the robot straight on, on the floor: 0.3 s at 3 kg,
TURN_LEAD = 112  # [1/16 period] of motors that turn it on the spot,
TURN_DRAG = 40  # [1/256 unit/period] by which a turn on the spot slows down by itself, besides friction: rollers rub
FREE_LEAD = 64  # [1/16 period] and, for tests, of motors that turn free wheels
ARC = 1350  # [edges] 2 * sin(120 deg) * wheel distance / way of an edge * 240 / 210: how turning bends the way of three
#             even wheels, whose LEAD has so much from the mass, which alone is bent
STIFFNESS = 5888  # [1/256 effort per edge] by which a wheel that should stand resists: 23 effort per edge

# One wheel driven on its own while no commands come, by the order `!test` (./robotont wheels --bring-up).
TEST_EFFORT = 400  # [effort] 10 %; a quarter of FULL_EFFORT at most
TEST_SPEED = 60  # [units] 0.55 m/s: the board ends a drive that is faster
TEST_TIME = 25  # [periods] 0.5 s, whatever the PC does

# Serial line to the PC: USART2, the ST-Link's virtual port, shared with the REPL.
UART = 2
BAUDRATE = 115200
WATCHDOG = 300  # [ms] without a finished period: the board resets

from robotont_firmware.pin_profile import *  # noqa: E402, F403 (the profile: pins and electronics)
