"""Drives over drivers, loads, slopes, encoders and speeds: who is found, how fast, and who is blamed wrongly.

Under MicroPython or CPython: `drives.py SRC broken|healthy COUNT SEED`; imported, `broken` and `healthy` do it.
`drives.py SRC starts THOUSANDTHS 1`: with drivers that coast, speeding up by so many of a unit each period.
"""

import sys

if __name__ == "__main__":
    sys.path.insert(0, sys.argv[1])
    sys.path.insert(0, __file__.rsplit("/", 1)[0])
    import lifted  # noqa: F401

from dual_tools import Config, Robot, profile
from sim_motor import BRAKE, COAST, DIODE, FLOATING, HALF, MICRO, REVERSED, UNPLUGGED
from suite_fuzz import Random

from robotont_firmware import pin_profile_robotont21, pin_profile_vnh
from robotont_firmware.fault_watch import NO_FAULT, OVERLOAD
from robotont_firmware.status import WHEELS

NAMES = {UNPLUGGED: "unplugged", REVERSED: "reversed", HALF: "half dead", FLOATING: "noise 2"}


PROFILES = (  # configuration, its motor driver, [units] that it reaches
    (Config(), {"driver": BRAKE}, 150),
    (profile(pin_profile_vnh), {"driver": DIODE}, 150),
    (profile(pin_profile_robotont21), {"driver": COAST, "frequency": 100, "battery": 140}, 33),
)


def between(random, least, most):
    return least + random.below(most - least + 1)


def robot(random, load_part):
    """Return (robot, configuration, its reach): each wheel with a load of its own."""
    config, motor, reach = PROFILES[random.below(len(PROFILES))]
    made = Robot(settings=config)
    part = 60 if motor["driver"] == COAST else load_part  # [%] of the load that the profile allows
    room = config.MAX_LOAD * part // 200 * 208 // 4000  # [units]
    mass = between(random, 60, 120)
    slope = between(random, -room, room) // 2
    for index in range(3):
        wheel = made.board.motors[index]
        wheel.__init__(tau=mass, friction=between(random, 6, 9), load=slope * (1, -1, 0)[index],
                       breakaway=8 + between(random, 0, room // 2), **motor)  # fmt: skip
        wheel._random = random.below(65536)
    return made, config, reach


def say(robot, speeds, periods, first=0):
    """Command these speeds [units] at 20 Hz for some periods; return the wheel at fault, or None."""
    line = ":".join([f"{speed:.2f}" for speed in speeds])
    for period in range(first, first + periods):
        if period % 3 == 0:
            robot.send(line)
        robot.board.sent = b""
        robot.tick(1)
        for wheel in range(3):
            if robot.controller._status.fields[WHEELS + wheel] not in (NO_FAULT, OVERLOAD):
                return wheel
    return None


def limit(config, units):
    """Return how fast a wheel with a broken encoder may turn [units] before it is found."""
    if config.DRIVER == "coast":
        return 140  # bounded by time alone: no effort turns a free wheel at a certain speed
    return abs(units) + (config.MAX_LOAD + config.STATIC) / 12 + 10  # a slope may help with 10 units


def time_for(units, driving):
    """Return the time [s] in which it has to be found: the rules' own, and that in which set-points and effort grow."""
    return 0.84 + (0 if driving else 0.1 + abs(units) / 500)


def broken(random):
    """Break an encoder; return (profile, name, [s] until off or None, fastest, command [units], driving, outside)."""
    made, config, reach = robot(random, 80)
    kinds = sorted(NAMES)
    kind, wheel, driving = kinds[random.below(len(kinds))], random.below(3), random.below(2)
    units = between(random, 5, reach) * (1 - 2 * random.below(2))
    speeds = [between(random, -abs(units), abs(units)) for _ in range(3)]
    speeds[wheel] = units
    wrong = driving and say(made, speeds, 60) is not None
    motor, name = made.board.motors[wheel], NAMES[kind]
    motor.encoder = kind
    before = abs(motor.speed) / MICRO  # downhill it may be faster than it should
    seconds, fastest = None, 0
    for period in range(0 if wrong else 150):
        found = say(made, speeds, 1, period)
        speed = abs(motor.speed) / MICRO
        fastest = max(fastest, speed if speed > before + 1 else 0)
        if found is not None:
            seconds, wrong = (period + 1) / config.RATE, found != wheel
            break
    allowed = time_for(units, driving)
    late = seconds is None or seconds > allowed
    outside = wrong or late or fastest > limit(config, units)
    return config.PROFILE, name, seconds, fastest, units, driving, bool(outside)


def healthy(random, seconds):
    """Drive as people do; return (wheels blamed, periods driven, what was driven then)."""
    made, config, reach = robot(random, 80)
    driven = 0
    while driven < seconds * config.RATE:
        top = (3, 10, 30, reach)[random.below(4)]
        speeds = [between(random, -top * 10, top * 10) / 10 for _ in range(3)]
        if random.below(8) == 0:
            speeds = [0, 0, 0]
        periods = between(random, 10, 100)
        blamed = say(made, speeds, periods)
        driven += periods
        if blamed is not None:
            return 1, driven, (speeds, blamed, config.PROFILE, made.controller._status.fields[WHEELS + blamed])
    return 0, driven, None


def starts(step):
    """Return the loads with which a healthy wheel is blamed, speeding up by `step` [units] each period."""
    blamed = []
    for tau in (120, 200, 300):  # the last one is the robot with all that it carries
        for friction, battery in ((8, 123), (8, 110), (9, 105)):
            for target in ((33, -16.5, -16.5), (28, -28, 0), (33, 33, 33)):
                config, motor, _ = PROFILES[2]
                made, part = Robot(settings=config), 0
                for wheel in made.board.motors:
                    wheel.__init__(**dict(motor, tau=tau, friction=friction, battery=battery))
                for period in range(150):
                    part = min(1, part + step / 33)
                    if say(made, [part * speed for speed in target], 1, period) is not None:
                        blamed.append((tau, friction, battery, target, period))
                        break
    return blamed


if __name__ == "__main__":
    what, count, random = sys.argv[2], int(sys.argv[3]), Random(int(sys.argv[4]))
    for _ in range(0 if what == "starts" else count):
        print(broken(random) if what == "broken" else healthy(random, 60))
    if what == "starts":
        print(starts(count / 1000))
