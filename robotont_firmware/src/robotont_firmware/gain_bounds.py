"""What the numbers of a configuration may be, so that no product outgrows the board's small integers.

MicroPython's small integers on the board are 31 bits, sign included; one more bit and it allocates a big
integer, which the locked heap refuses with a MemoryError: in mid-drive, not at start-up. So everything is
checked before the motors are given free. The tests run the loop at these limits and look at every result.
"""

from robotont_firmware.receiver import MAX_UNITS

LARGEST = 0x3FFFFFFF  # the largest small integer
MOTOR_VOLTAGE = 12000  # [mV] at which the gains of config.py hold
MAX_COUNTS = 400  # [edges/period] twice the motor's reach; a larger difference is no speed
NO_ARC = 1 << 28  # [edges] an arc that bends nothing
MAX_PERIODS = 16  # [periods] the most missed ticks that a step makes up for; the watchdog comes before

_RANGES = (  # name, least, most; what depends on other numbers is added in `check`
    ("WHEELS", 3, 8),
    ("RATE", 1, 1000),
    ("TIMEOUT", 1, 1000),
    ("BRAKING", 0, 1000),
    ("FAULT_HOLD", 1, 1000),
    ("ANSWER_INTERVAL", 1, 1000),
    ("BATTERY", 6000, 30000),
    ("BATTERY_LOW", 0, 30000),
    ("MAX_SPEED", 1, LARGEST // ((MAX_UNITS + 1) * 256) // 16),  # 262: a command is scaled down
    ("FULL_EFFORT", 1, 10000),
    ("FOLLOW", 1, 256),  # more would swing around the set-point
    ("TURN_DRAG", 0, 256),
    ("STIFFNESS", 1024, 65536),
    ("BLIND_TIME", 1, 1000),
    ("BLIND_SHARE", 0, 256),
    ("CHANGING_SHARE", 0, 256),
    ("BESIDE_SHARE", 0, 256),
    ("UNEVEN_SHARE", 0, 256),
    ("UNEVEN_EDGES", 1, 2000),
    ("WRONG_EDGES", 1, 2000),
    ("OVERLOAD_TIME", 1, 200),
    ("TEST_TIME", 1, 100),
    ("TEST_SPEED", 1, 100),
)


def line_bytes(config):
    """Return the bytes that the serial line brings in one period, and an eighth more for a late reader."""
    return config.BAUDRATE // 10 // config.RATE * 9 // 8


def check(config):
    """Raise ValueError, with what was found and what is allowed, for the first number that is out of range."""
    for name, least, most in _RANGES:
        check_number(config, name, least, most)
    full, speed, battery = config.FULL_EFFORT, config.MAX_SPEED * 256, config.BATTERY
    error = MAX_COUNTS * 256 + speed
    for name in ("MAX_ACCELERATION", "MAX_BRAKING"):
        check_number(config, name, 1, LARGEST // (2 * speed * 256))  # all set-points move by one fraction
    for name in ("STATIC", "MAX_EFFORT", "MAX_TORQUE", "CONTINUOUS_TORQUE", "MAX_LOAD"):
        check_number(config, name, 0, full)
    check_number(config, "TEST_EFFORT", 0, full // 4)
    for name, factor in (
        ("SPEED_GAIN", MAX_COUNTS * 256),
        ("P_GAIN", error // 2),
        ("D_GAIN", 2 * MAX_COUNTS * 256),
        ("BRAKE_GAIN", MAX_COUNTS * 256),
    ):
        check_number(config, name, 0, _unscaled(LARGEST // factor, battery))
    check_number(config, "ARC", 2 * config.MAX_SPEED, NO_ARC)  # then a way bends by MAX_SPEED a period at most
    for name in ("LEAD", "TURN_LEAD"):
        check_number(config, name, 0, LARGEST // (7 * speed + config.TURN_DRAG))  # five speeds straight, two of turning
    for name in ("MAX_INTEGRAL", "BLOCKED_INTEGRAL"):
        check_number(config, name, 0, _unscaled(LARGEST >> 16, battery))
    largest = at_battery(max(config.MAX_INTEGRAL, config.BLOCKED_INTEGRAL), battery)
    gain = config.I_GAIN
    if gain != 0:
        room = LARGEST - error * MAX_PERIODS  # one more error is added before the integral is cut
        least = _unscaled((largest << 16) // room + 1, battery) + 1
        check_number(config, "I_GAIN", least, _unscaled(LARGEST // error, battery))


def at_battery(value, battery):
    """Return a gain or an effort of config.py for a battery of `battery` mV: more volts, less duty."""
    return value * MOTOR_VOLTAGE // battery


def reach(config):
    """Return the most edges that a motor makes in a period on a full battery, and an eighth more."""
    free = (config.FULL_EFFORT << 8) // max(1, config.SPEED_GAIN)
    return min(free * config.BATTERY // MOTOR_VOLTAGE * 9 // 8, MAX_COUNTS - 1)


def acceleration(config, most):
    """Return how much a set-point may change [1/256 unit/period]: `most` units, or what MAX_TORQUE gives that LEAD."""
    needed = max(config.LEAD, config.TURN_LEAD) * config.SPEED_GAIN  # for a unit/period: [1/4096 effort]
    return max(1, min(most * 256, config.MAX_TORQUE * 4096 * 256 // needed)) if needed else most * 256


def integral_for(effort, gain):
    """Return the sum of errors [1/256 unit * period] whose integral part is `effort`."""
    return 0 if gain == 0 else (effort << 16) // gain


def _unscaled(value, battery):
    """Return the largest value that `at_battery` brings to at most `value`."""
    return value * battery // MOTOR_VOLTAGE


def check_number(config, name, least, most, what=""):
    """Raise ValueError unless that number of the configuration is whole and in range."""
    value = getattr(config, name, None)
    if type(value) is not int or not least <= value <= most:
        raise ValueError(f"config.{name}: found {value!r}, allowed: a whole number from {least} to {most}{what}")
