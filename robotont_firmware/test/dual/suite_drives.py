"""Drives of drives.py, more of them where the interpreter is fast."""

from drives import PROFILES, broken, healthy, say
from dual_tools import FAST, Config, Robot
from sim_motor import COAST, MICRO
from suite_fuzz import Random

EVERYWHERE = 12
UNEVEN = {"60 % by chance": 3, "dirty disc": 1}  # [s] for such an encoder where the effort tells nothing
LOSSY = ("60 % lost", "60 % by chance", "dirty disc")


def limit(config, units, name, driving):
    """Return how fast a wheel with a broken encoder may turn [units]; what physics allows, see docs/firmware.md."""
    if config.DRIVER == "coast":
        return 125  # bounded by time alone: no effort turns a free wheel at a certain speed
    counted = 3 if name in ("hum 3", "noise 6") else 0
    lost = 0.4 if name in UNEVEN else 0.6 if name in LOSSY else 1
    creep = (config.MAX_LOAD / 18 + counted) / lost + 10  # a slope may help with 10 units
    # A robot that speeds up with 40 % of its edges looks like one that is 2.5 times as heavy.
    from_rest = not driving and (name in LOSSY or name == "noise 6")
    return max((2.5 if from_rest else 1.5) * abs(units), creep)


def time_for(config, units, name, driving):
    """Return the time [s] in which it has to be found, or None.

    60 % lost evenly, at little effort, may be a load; a disc that makes one turn a period counts evenly.
    """
    from_rest = 0 if driving else 0.1 + abs(units) / 500  # set-points take their time
    if name == "dirty disc" and config.DRIVER == "coast" and abs(abs(units) - 26) <= 3:
        return None
    if name in LOSSY and (config.DRIVER == "coast" or abs(units) <= 18):
        return UNEVEN[name] + from_rest if name in UNEVEN else None
    return 0.6 + from_rest


def fault_of(name, seconds, fastest, units, wrong, config, driving):
    """Return what is wrong with what `broken` returned, or ""."""
    allowed = time_for(config, units, name, driving)
    late = allowed is not None and (seconds is None or seconds > allowed)
    if wrong or fastest > limit(config, units, name, driving) or late:
        return str((name, seconds, fastest, units, wrong, config.PROFILE, driving))
    return ""


def test_broken_encoders_are_found_in_time_and_run_not_away():
    random = Random(20181102)
    found = []
    for number in range(100 if FAST else EVERYWHERE):
        drive = broken(random)
        assert not fault_of(*drive), fault_of(*drive)
        if number < EVERYWHERE:
            found.append(str(drive[1]))
    return " ".join(found)


def test_healthy_wheels_are_not_blamed():
    random = Random(20181103)
    for _ in range(10 if FAST else 1):
        blamed, _, why = healthy(random, 60 if FAST else 10)
        assert not blamed, why


def test_each_profile_drives_at_the_commanded_speed():
    worst = 0
    for config, motor, reach in PROFILES:
        for units in (5, 12, 33, reach):
            made = Robot(settings=config, **motor)
            assert say(made, (units, -units, units / 2), 100) is None, (config.PROFILE, units)
            before = [wheel.turned for wheel in made.board.motors]
            assert say(made, (units, -units, units / 2), 150) is None, (config.PROFILE, units)
            for index, part in ((0, 1), (1, -1), (2, 0.5)):
                mean = (made.board.motors[index].turned - before[index]) / 150
                assert abs(mean - part * units) <= max(0.02 * abs(units * part), 0.05), (config.PROFILE, units, mean)
                worst = max(worst, abs(mean / part / units - 1))
    return f"within {100 * worst:.1f} %"


def test_what_the_bounds_refuse_cannot_work():
    """Drivers that coast: at 10 kHz a quarter of the battery gives no current to speak of, at 100 Hz it does."""
    currents = []
    for frequency in (100, 10000):
        wheel = Robot(driver=COAST, frequency=frequency, battery=140).board.motors[0]
        wheel.blocked = True
        wheel.drive(1000)
        wheel.run(100)
        currents.append(wheel.current() * 5 / 4000)
    assert currents[0] > 1, currents
    assert currents[1] < 0.1, currents
    return "stall current {:.2f} A and {:.2f} A".format(*currents)


def test_a_wheel_that_needs_more_than_the_profile_allows_is_named_and_a_larger_number_lets_it_drive():
    for load, fault in ((400, True), (900, False)):
        made = Robot(settings=Config(MAX_LOAD=load, BLOCKED_INTEGRAL=900), friction=9, breakaway=45)  # 1.1 A
        found = say(made, (10, 10, 10), 150)
        assert (found is not None) == fault, load
        if not fault:
            assert made.board.motors[0].speed > 8 * MICRO
