"""Drives over drivers, loads, slopes, encoders and speeds: who is found, how fast, and who is blamed wrongly.

Under MicroPython or CPython: `drives.py SRC broken|healthy COUNT SEED`; imported, `broken` and `healthy` do it.
"""

import sys

if __name__ == "__main__":
    sys.path.insert(0, sys.argv[1])
    sys.path.insert(0, __file__.rsplit("/", 1)[0])
    import lifted  # noqa: F401

from dual_tools import Config, Robot, profile
from sim_motor import BRAKE, CHANCE, COAST, DIODE, DIRTY, FLOATING, HALF, HUM, MICRO, PARTIAL, REVERSED, UNPLUGGED, WILD
from suite_fuzz import Random

from robotont_firmware import pin_profile_robotont21, pin_profile_vnh
from robotont_firmware.fault_watch import NO_FAULT

NAMES = {UNPLUGGED: "unplugged", REVERSED: "reversed", HALF: "half dead", PARTIAL: "60 % lost", FLOATING: "noise 2",
         WILD: "noise 6", HUM: "hum 3", CHANCE: "60 % by chance", DIRTY: "dirty disc"}  # fmt: skip


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
    room = config.MAX_LOAD * part // 100 * 208 // 4000  # [units]
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
            if robot.controller._status.fault_of(wheel) != NO_FAULT:
                return wheel
    return None


def broken(random):
    """Break an encoder; return (name, [s] until off or None, its fastest speed, the command [units], ..., driving)."""
    made, config, reach = robot(random, 80)
    kinds = sorted(NAMES)
    kind, wheel, driving = kinds[random.below(len(kinds))], random.below(3), random.below(2)
    units = between(random, 5, reach) * (1 - 2 * random.below(2))
    speeds = [between(random, -abs(units), abs(units)) for _ in range(3)]
    speeds[wheel] = units
    if driving and say(made, speeds, 60) is not None:
        return NAMES[kind], None, 0, units, True, config, driving
    motor = made.board.motors[wheel]
    motor.encoder = kind
    before = abs(motor.speed) / MICRO  # downhill it may be faster than it should
    fastest = 0
    for period in range(150):
        found = say(made, speeds, 1, period)
        speed = abs(motor.speed) / MICRO
        fastest = max(fastest, speed if speed > before + 1 else 0)
        if found is not None:
            return NAMES[kind], (period + 1) / config.RATE, fastest, units, found != wheel, config, driving
    return NAMES[kind], None, fastest, units, False, config, driving


def healthy(random, seconds):
    """Drive as people do; return (wheels blamed, periods driven)."""
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
            return 1, driven, (speeds, blamed, config.PROFILE)
    return 0, driven, None


if __name__ == "__main__":
    what, count, random = sys.argv[2], int(sys.argv[3]), Random(int(sys.argv[4]))
    if what == "broken":
        for _ in range(count):
            name, seconds, fastest, units, wrong, config, driving = broken(random)
            print(f"{name.replace(' ', '_')};{seconds};{fastest:.1f};{units};{wrong};{config.PROFILE};{driving}")
    else:
        blamed = driven = 0
        for _ in range(count):
            found, periods, why = healthy(random, 60)
            blamed += found
            driven += periods
            if why:
                print("blamed", why)
        print(f"hours {driven / 50 / 3600:.2f} blamed {blamed}")
