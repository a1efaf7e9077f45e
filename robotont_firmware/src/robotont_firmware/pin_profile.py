"""Wiring profile "ours": a NUCLEO-L476RG wired as in docs/firmware.md. This is NOT how Robotont is wired.

`./robotont flash --profile NAME` puts pin_profile_NAME.py on the board as pin_profile.mpy. Here is how the board
is wired, motor by motor, in the order of the packets' fields; drivers other than these change config.py's numbers, too.
"""

PROFILE = "ours"
DESCRIPTION = "wired by hand as in docs/firmware.md; not a Robotont as it was built"

BATTERY = 12000  # [mV] of a full battery: scales feed-forward, gains of driving and torque limits
BATTERY_PIN = None  # analogue input behind a divider, or None: not measured
BATTERY_DIVIDER = 0  # [mV] of battery at which that input stands at its full scale (3.3 V)
BATTERY_LOW = 10500  # [mV] below this for a second the battery is low

ENCODERS = (  # A pin, B pin, timer (channels 1 and 2), alternate function
    ("PB6", "PB7", 4, 2),
    ("PA6", "PA7", 3, 2),
    ("PA0", "PA1", 2, 1),
)
BACKWARD_ENCODERS = (False, False, False)  # counts down while the motor drives forward
ENCODER_PULL_UPS = False  # inside the chip; only for encoders fed 3.3 V: a pulled pin does not stand 5 V
DRIVER = "brake"  # what the motor drivers do in the off phase of the PWM, brake or coast: see docs/firmware.md
PWM_FREQUENCY = 20000  # [Hz]
PWM = (("PC6", 8, 1, 3), ("PC7", 8, 2, 3), ("PC8", 8, 3, 3))  # pin, timer, channel, alternate function
DIRECTIONS = (("PB8", "PB9"), ("PB12", "PB13"), ("PB14", "PB15"))  # high while forward, high while backward
FAULTS = ("PC9", "PC10", "PC11")  # low: fault (open drain, pulled up inside the chip); () where none is connected
TICK_TIMER = 6
SAFE_BUTTON = "PC13"  # USER, low while pressed
LIGHT = "PA5"  # LD2: idle, driven, fault
