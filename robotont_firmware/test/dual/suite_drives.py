"""Drives of drives.py, more of them where the interpreter is fast."""

from drives import PROFILES, broken, healthy, say
from dual_tools import FAST, Robot
from suite_fuzz import Random

EVERYWHERE = 12

def test_broken_encoders_are_found_in_time_and_run_not_away():
    random = Random(20181102)
    found = []
    for number in range(100 if FAST else EVERYWHERE):
        drive = broken(random)
        assert not drive[-1], drive
        if number < EVERYWHERE:
            found.append(str(drive[2]))
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
