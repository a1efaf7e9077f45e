"""The four rules about a wheel, each at its edges."""

from robotont_firmware import config
from robotont_firmware.fault_watch import (
    NO_COUNTS,
    NO_FAULT,
    NOISE,
    TOO_MANY,
    WRONG_WAY,
    drive_fault,
    rest_fault,
    speed_fault,
)
from robotont_firmware.robot_numbers import Numbers
from robotont_firmware.wheel_speed import Pid

NUMBERS = Numbers(config)
EDGE = 1 << NUMBERS.shift
TIME = 20  # [periods] of 400 ms
WRONG_TIME = 22  # of 450 ms


def wheel():
    """Return the numbers of a wheel."""
    return Pid(config, NUMBERS).n


def fault(rule, *arguments):
    """Return (what is found, after how many periods) when a rule judges the same again and again."""
    numbers = wheel()
    for period in range(100):
        found = rule(numbers, *arguments)
        if found != NO_FAULT:
            return found, period + 1
    return NO_FAULT, 100


def test_asked_for_too_much_and_no_counts():
    for wished, counted, excess, expected in (
        (50, 0, 1, NO_COUNTS), (50, 12, 1, NO_COUNTS), (50, 13, 1, NO_FAULT), (50, 0, 0, NO_FAULT),
        (50, 0, -1, NO_FAULT), (4, 0, 1, NO_COUNTS), (1, 0, 1, NO_COUNTS), (0, 0, 1, NO_FAULT),
    ):
        for sign in (1, -1):
            found = fault(drive_fault, sign * wished * EDGE, sign * counted * EDGE, 0, sign * excess, 1)
            assert found == (expected, TIME + 1 if expected else 100), (wished, counted, excess, found)


def test_a_slow_wheel_is_judged_by_its_edges():
    assert fault(drive_fault, EDGE // 16, 0, 0, 1, 1) == (NO_COUNTS, 96), "six edges are missing"
    for every, expected in ((16, NO_FAULT), (60, NO_FAULT), (100, NO_COUNTS)):
        numbers, found = wheel(), NO_FAULT
        for period in range(1000):
            found = found or drive_fault(numbers, EDGE // 16, 0 if period % every else EDGE, 0, 1, 1)
        assert found == expected, every


def test_an_edge_back_is_no_way_that_is_missing():
    for wished, back, expected in (
        (EDGE // 5, (1, 9), 31), (EDGE, (1, 9), TIME + 1), (20 * EDGE, (1, 9), TIME + 1), (EDGE // 5, range(200), 31),
    ):
        numbers = wheel()
        found = [drive_fault(numbers, wished, -EDGE if period in back else 0, 0, 1, 1) for period in range(200)]
        assert found.index(NO_COUNTS) + 1 == expected, (wished, back, found.index(NO_COUNTS))


def test_gravity_holds_a_wheel_for_ever_while_less_than_max_load_is_asked_for():
    """A blocked wheel asks for more and more: it is found when that is MAX_LOAD, not when it is driven with much."""
    load = NUMBERS.load - (NUMBERS.load >> 3)
    for units in (1, 5, 20):
        pid, found, periods = Pid(config, NUMBERS), NO_FAULT, 0
        while found == NO_FAULT:
            effort = pid.step(units * EDGE, 0, 1, 0)
            found, periods = pid.fault, periods + (effort - NUMBERS.static - (NUMBERS.gain * units * EDGE >> 16) > load)
        assert found == NO_COUNTS
        assert TIME <= periods <= TIME + 2, (units, periods)


def test_counts_the_wrong_way():
    for wished, counted, push, expected in (
        (50, -5, 0, WRONG_WAY), (50, -3, 0, NO_FAULT), (50, -5, -1, NO_FAULT), (0, -5, 100, NO_FAULT),
    ):
        for sign in (1, -1):
            found = fault(drive_fault, sign * wished * EDGE, sign * counted * EDGE, sign * push, 0, 1)
            assert found == (expected, WRONG_TIME + 1 if expected else 100), (wished, counted, push, found)


def test_more_counts_than_the_motor_can_make():
    for speed, periods, expected in (
        (NUMBERS.reach + 1, 1, (TOO_MANY, 3)), (-NUMBERS.reach - 1, 1, (TOO_MANY, 3)),
        (NUMBERS.reach + 1, 3, (TOO_MANY, 1)), (NUMBERS.reach, 1, (NO_FAULT, 100)),
    ):
        assert fault(speed_fault, speed, periods) == expected, speed
    numbers = wheel()
    for _ in range(20):
        assert speed_fault(numbers, NUMBERS.reach + 1, 2) == speed_fault(numbers, 0, 1) == NO_FAULT, "not in a row"


def test_noise_at_rest():
    for size, gap, expected in ((2, 0, NOISE), (1, 0, NO_FAULT), (2, 12, NO_FAULT), (2, 5, NOISE)):
        numbers, found = wheel(), NO_FAULT
        for number in range(100):
            found = found or rest_fault(numbers, (size if number % 2 else -size) * EDGE, 1)
            for _ in range(gap):
                found = found or rest_fault(numbers, (size if number % 2 else -size) * EDGE, 1)
        assert found == expected, (size, gap)


def test_missed_ticks_count_and_a_reset_forgets():
    pid = Pid(config, NUMBERS)
    assert drive_fault(pid.n, 50 * EDGE, 0, 0, 1, TIME) == NO_FAULT
    pid.reset(1)
    assert drive_fault(pid.n, 50 * EDGE, 0, 0, 1, TIME) == NO_FAULT
    assert drive_fault(pid.n, 50 * EDGE, 0, 0, 1, 1) == NO_COUNTS
