"""Every number of the loop from what config tells of robot and motors: integers, alike on every interpreter.

Speeds are counted in *fine* units per period: an edge is 2^shift of them, with the shift that brings the no-load
speed to 32768 .. 65535. So gains and limits are shares of the no-load speed, whatever encoder, gear and rate, and no
product outgrows the board's small integers of 31 bits: the loop allocates nothing. The tests look at every result.
"""

FULL_EFFORT = 4000  # of the whole battery voltage
LARGEST = 0x3FFFFFFF  # the largest small integer
MOTOR_VOLTAGE = 12000  # [mV] at which efforts hold
MAX_PERIODS = 16  # [periods] that the watchdog lets pass: a step makes up for the ticks that were missed
NO_ARC = 1 << 28  # an arc that bends nothing
TURN = 628319  # [1/100000 rad]
LAG = 6000  # [us] between counts and effort
LEAST_EDGES, MOST_EDGES = 8, 16000  # [edges] in a period, without load
MOST_LOAD_TIME = 1500  # [ms] in which shorted motors, the brake of each stop, slow the robot down to 37 %
_SINES = (866, 1000, 951, 866, 782, 707)  # [1/1000] of the angle between 3 .. 8 wheels

_RANGES = (  # name, least, most
    ("WHEELS", 3, 8),
    ("RATE", 2, 1000),
    ("GEAR", 10, 100000),
    ("RADIUS", 1000, 1000000),
    ("DISTANCE", 1000, 10000000),
    ("MASS", 1, 1000000),
    ("INERTIA", 1, 10000000000),
    ("EVEN", 0, 1),
    ("NO_LOAD_SPEED", 10, 50000),
    ("STALL_TORQUE", 100, 1000000000),
    ("TIME_CONSTANT", 5, 1000),
    ("BATTERY", 9000, 30000),
    ("BAUDRATE", 9600, 1000000),
    ("STATIC", 0, FULL_EFFORT // 4),
    ("MAX_EFFORT", 1, FULL_EFFORT),
    ("MAX_TORQUE", 1, FULL_EFFORT),
    ("CONTINUOUS_TORQUE", 1, FULL_EFFORT),
    ("MAX_LOAD", 1, FULL_EFFORT // 2),
    ("TEST_EFFORT", 0, FULL_EFFORT // 4),
    ("MAX_SPEED", 10, 1000),
    ("MAX_ACCELERATION", 10, 1000),
    ("MAX_BRAKING", 10, 1000),
    ("OVERLOAD_TIME", 20, 4000),
    ("RUBBING", 0, 1000),
    ("TIMEOUT", 20, 500),
    ("BRAKING", 0, 2000),
    ("FAULT_HOLD", 20, 20000),
    ("TEST_TIME", 20, 1000),
    ("TEST_SPEED", 10, 500),
)


def line_bytes(config):
    """Return the bytes that the serial line brings in one period, and an eighth more for a late reader."""
    return max(1, config.BAUDRATE // 10 // config.RATE * 9 // 8)


def in_periods(config, *milliseconds):
    """Return times in periods, one at least."""
    return [max(1, time * config.RATE // 1000) for time in milliseconds]


def check(config):
    """Raise ValueError, with what was found and what is allowed, for the first number that does not fit."""
    for name, least, most in _RANGES:
        check_number(config, name, least, most)
    turns, time = config.NO_LOAD_SPEED * 100000, 10 * TURN * config.RATE  # of a motor without load, in a period
    check_number(config, "EDGES", -(-LEAST_EDGES * time // turns), ((MOST_EDGES + 1) * time - 1) // turns,
                 " with this NO_LOAD_SPEED and RATE")
    slow = max(load_times(config)) // 1000
    require("GEAR", config.GEAR, slow <= MOST_LOAD_TIME,
            f"hundredths with which shorted motors slow the robot to 37 % in {MOST_LOAD_TIME} ms at most, not {slow}: "
            "or less MASS, INERTIA or RADIUS, or more STALL_TORQUE")


def load_times(config):
    """Return what mass and what inertia add to the motors' time constant [us]."""
    shaft = config.RADIUS ** 2 * config.NO_LOAD_SPEED
    torque = config.WHEELS * config.STALL_TORQUE * config.GEAR ** 2
    return (config.MASS * shaft * 2 // torque,
            config.INERTIA * shaft * 100000000 // (torque * config.DISTANCE ** 2))


def free_speed(config, shift):
    """Return the no-load speed: edges * 2^shift in a period."""
    return (config.NO_LOAD_SPEED * config.EDGES * 100000 << shift) // (10 * TURN * config.RATE)


class Numbers:
    """What the loop needs: speeds in fine units, gains in 1/65536 effort per fine unit, times in periods.

    Raises ValueError for a configuration that does not fit.
    """

    def __init__(self, config):
        check(config)
        battery, full, wheels = config.BATTERY, FULL_EFFORT, config.WHEELS
        period = 1000000 // config.RATE  # [us]
        self.shift = 0
        while free_speed(config, self.shift) < 32768:
            self.shift += 1
        self.free = free = free_speed(config, self.shift)
        self.max_speed = free * config.MAX_SPEED // 1000
        edge = 1 << self.shift
        self.follows = max(free // 50, edge * 3 // 2)
        self.creeps = max(free // 20, 2 * edge)
        self.reach = min(free * battery // MOTOR_VOLTAGE * 9 // 8, 2 * free - 1)

        gain = ((full - config.STATIC) << 16) // free
        self.static, self.gain, self.load, most, continuous = (value * MOTOR_VOLTAGE // battery for value in (
            config.STATIC, gain, config.MAX_LOAD, config.MAX_TORQUE, config.CONTINUOUS_TORQUE))  # more volts, less duty
        self.forward = 0 if config.DRIVER == "coast" else self.gain
        self.p = self.gain * min(1667, 740000 * config.TIME_CONSTANT // period) // 1000
        self.i = max(1, self.p * period // max(122000, period * 61 // 10))
        self.follow = 256 * period // (period + 20000)
        self.max_torque = min(full, most)
        self.continuous = min(continuous, self.max_torque)
        # Full torque for OVERLOAD_TIME brings a cold motor to the limit.
        self.max_heat = max(1, config.OVERLOAD_TIME * 1000 // period) * (
            (self.max_torque >> 4) ** 2 - (self.continuous >> 4) ** 2)

        mass, turn = load_times(config)
        own = max(0, 1000 * config.TIME_CONSTANT + LAG - period // 2)
        self.lead = max(1, (own + mass) * 16 // period)  # [1/16 period]
        self.turn_lead = max(1, (own + turn) * 16 // period)
        # A wheel in the air bears so much; a robot is to stop with a time constant of 150 ms, whatever its mass.
        brake = max(min(3125, 1400000 * config.TIME_CONSTANT // period), (own + mass) // 150 - 1000)
        self.brake = self.gain * min(brake, 20000) // 1000
        torque_change = self.max_torque * (16 << 16) * battery // (
            MOTOR_VOLTAGE * gain * max(self.lead, self.turn_lead))
        self.change, self.braking = (
            max(1, min(torque_change * part // 8, free * percent // 100 * period // 1000000))
            for part, percent in ((8, config.MAX_ACCELERATION), (7, config.MAX_BRAKING)))
        force = wheels * config.GEAR * config.STALL_TORQUE  # of all motors, over radius
        rubs = config.RUBBING * config.MASS * 981 * config.RADIUS * full // (force * 10000000)
        self.drag = min(rubs * (16 << 16) // (self.turn_lead * gain), self.change)
        self.arc = NO_ARC
        if config.EVEN:
            edges = 2 * _SINES[wheels - 3] * config.DISTANCE * config.GEAR * config.EDGES << self.shift
            self.arc = max(2 * self.max_speed >> 8, min(NO_ARC, (
                edges * (own + mass) // (config.RADIUS * TURN * 256 * max(1, mass)))))
        stiff = min(15, 450000 // period) ** 2  # [1/s^2] of the whole robot
        self.stiffness = max(1, (stiff * config.MASS * 2 * config.RADIUS ** 2 * full * TURN << 16) // (
            force * config.GEAR * config.EDGES * 10000000000 << self.shift))


def check_number(config, name, least, most, what=""):
    """Raise ValueError unless that number of the configuration is whole and in range."""
    value = getattr(config, name, None)
    fits = type(value) is int and least <= value <= most
    require(name, value, fits, f"a whole number from {least} to {most}{what}")


def require(name, value, fits, allowed):
    """Raise ValueError unless that value of the configuration fits."""
    if not fits:
        raise ValueError(f"config.{name}: found {value!r}, allowed: {allowed}")
