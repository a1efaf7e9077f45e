"""Stamps against the times at which packets were made: jitter, stalls, losses, drift, restarts, clocks that are set."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robotont_driver.odometry.odometry_stamps import SECOND, OdometryStamps
from robotont_testing import other_noise, rough_noise

PERIOD = 0.02  # [s]
EPOCH = 1_700_000_000 * SECOND


def stamps(arrivals, numbers=None, walls=0, clock=None):
    """[s] stamps of packets that come at `arrivals` [s] of the steady clock; walls: [ns] how far the other is ahead."""
    clock = clock or OdometryStamps(PERIOD)
    given = [round(arrival * SECOND) for arrival in arrivals]
    walls = np.broadcast_to(walls, len(given)).tolist()
    numbers = [None] * len(given) if numbers is None else numbers.tolist()
    made = []
    for at, wall, number in zip(given, walls, numbers):
        made.append(clock.stamp(at, at + wall, number))
        assert made[-1] <= at + wall, "ahead of the time at which it is made"
    return np.array(made) / SECOND


def stalls(seconds, rng):
    """(begin, length) of stalls of 0.2 to 2.5 s, one in 30 s."""
    begins = np.arange(40.0, seconds - 15.0, 30.0)
    return np.column_stack([begins + rng.uniform(0, 5, len(begins)), rng.uniform(0.2, 2.5, len(begins))])


STALLS = "stalls"
PATTERNS = {
    "even": {}, "1 ms polls": {"timer": 0.001}, "jitter of 5 ms": {"jitter": 0.005}, "a tenth late": {"late": 0.1},
    "2 % fast": {"drift": -0.02}, "2 % slow": {"drift": 0.02}, "1 % slow": {"drift": 0.01},
    "1 % lost": {"lost": 0.01}, "5 % lost": {"lost": 0.05}, "five in a row lost": {"lost": 0.002, "burst": 5},
    "1 % lost and slow": {"lost": 0.01, "drift": 0.01},
    "stalls": {STALLS: True}, "stalls, slow": {STALLS: True, "drift": 0.005},
    "restarts": {"restarts": 10}, "FTDI": {"timer": 0.016}, "FTDI, stalls": {"timer": 0.016, STALLS: True},
}


@pytest.mark.parametrize("numbered", [True, False], ids=["numbered", "without numbers"])
@pytest.mark.parametrize("pattern", PATTERNS)
def test_twenty_minutes_of_rough_arrivals(pattern, numbered):
    """From the first packet on; ten seconds behind each stall are as good as all others; never ahead, never back."""
    minutes = 20
    rng, given = np.random.default_rng(3), dict(PATTERNS[pattern])
    pauses = given.pop(STALLS, False) and stalls(minutes * 60, rng)
    ends, at, numbers, come = rough_noise.arrivals(
        round(minutes * 60 / PERIOD), rng, stalls=() if pauses is False else pauses, **given)
    clock = OdometryStamps(PERIOD)
    found = stamps(at[come], numbers[come] if numbered else None, EPOCH, clock) - EPOCH / SECOND
    errors = 1000 * np.abs(found - ends[come] - rough_noise.FIRST)
    p50, p99 = np.percentile(errors, (50, 99))
    print(f"{pattern}, {'numbered' if numbered else 'without numbers'}: p50 {p50:.2f}, p99 {p99:.2f} ms")
    most = 5.0 if given.get("timer") == 0.016 else 2.0
    assert p99 <= most
    for begin, length in () if pauses is False else pauses:
        behind = (at[come] > begin + length + 0.05) & (at[come] < begin + length + 10)
        assert np.percentile(errors[behind], 99) <= most
    assert np.diff(found).min() > 0
    assert clock.drift == pytest.approx(given.get("drift", 0.0), abs=1e-4)


@pytest.mark.parametrize("given", [
    {}, {"drift": 0.01}, {"drift": -0.01}, {"drift": 0.02}, {"drift": -0.02}, {"lost": 0.01},
    {"lost": 0.002, "burst": 5}, {"lost": 0.01, "burst": 5}, {"lost": 0.01, "drift": 0.01}, {"late": 0.1},
    {"jitter": 0.005}], ids=str)
def test_ten_minutes_of_the_other_generator_without_numbers(given):
    """From the first packet on; the least delay is 2 ms."""
    ends, at, come = other_noise.arrivals(30000, np.random.default_rng(1), **given)
    clock = OdometryStamps(PERIOD)
    p50, p99 = np.percentile(1000 * np.abs(stamps(1.0 + at[come], clock=clock) - 1.002 - ends[come]), (50, 99))
    print(f"{given}: p50 {p50:.2f}, p99 {p99:.2f} ms")
    assert p50 <= 0.1
    assert p99 <= 5.0
    assert clock.drift == pytest.approx(given.get("drift", 0.0), abs=1e-4)


def made(amount):
    return 5.0 + PERIOD * np.arange(amount)


def delayed(times):
    """[s] arrivals, in order, a few ms late."""
    return np.maximum.accumulate(times + np.random.default_rng(1).exponential(0.002, len(times)))


@pytest.mark.parametrize("step, words", [
    (3600.0, "forward by 3600 s"), (-0.2, "back by 0.2 s"), (0.03, "forward by 0.03 s")])
def test_the_wall_clock_is_set(step, words):
    """Beside a steady clock the stamps follow with the very next packet, and keep their distances."""
    times, ahead = made(2000), np.where(np.arange(2000) < 1000, 0.0, step)
    clock = OdometryStamps(PERIOD)
    walls = [EPOCH + round(by * SECOND) for by in ahead]
    found = stamps(delayed(times), None, walls, clock) - EPOCH / SECOND
    assert np.abs(found - times - ahead)[100:].max() < 3e-3
    assert (clock.restarts, clock.event) == (0, "the clock was set " + words)


@pytest.mark.parametrize("numbered", [True, False])
@pytest.mark.parametrize("step, packets", [(3600.0, 0), (-3600.0, 0), (-80.0, 0), (0.2, 4), (-0.2, 0)], ids=str)
def test_the_only_clock_is_set(step, packets, numbered):
    """Simulated time, or a steady clock that is none: the stamps follow within so many packets."""
    times = made(2000) + 4000.0
    times[1000:] += step
    clock = OdometryStamps(PERIOD)
    at = [*delayed(times[:1000]), *delayed(times[1000:])]
    wrong = np.flatnonzero(np.abs(stamps(at, np.arange(2000) if numbered else None, clock=clock) - times) > 10e-3)
    assert set(wrong) <= set(range(1000, 1000 + packets))
    assert (clock.event is not None) == (step < 0)


@given(st.lists(st.tuples(st.integers(-3 * SECOND, 3 * SECOND), st.integers(-3 * SECOND, 3 * SECOND),
                          st.none() | st.integers(-2, 400)), max_size=300))
def test_never_ahead_of_now_and_never_behind_the_last(moves):
    clock = OdometryStamps(PERIOD)
    arrival, wall, number, before = 0, EPOCH, 0, None
    for gap, step, more in moves:
        arrival, wall = arrival + abs(gap) + 1, wall + (step if step % 5 == 0 else 0)
        number, event = number + (more or 0), clock.event_at
        stamp = clock.stamp(arrival, arrival + wall, None if more is None else number)
        assert isinstance(stamp, int)
        if clock.event_at == event and before is not None:
            assert before <= stamp <= max(arrival + wall, before)
        before = stamp


def test_packets_of_no_period_are_stamped_by_arrival():
    clock = OdometryStamps(0.0)
    at = made(100) + 0.3 * np.random.default_rng(1).random(100).cumsum()
    assert stamps(at, clock=clock) == pytest.approx(at, abs=1e-8)
    assert (clock.drift, clock.restarts) == (0.0, 0)
