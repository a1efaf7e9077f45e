"""Stamps against the times at which packets were made: jitter, stalls, losses, drift, restarts, clocks that are set."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robotont_driver.odometry.odometry_stamps import SECOND, OdometryStamps
from robotont_testing import physics

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


TOLD_BY_NUMBERS_ALONE = {"loss 5 %, ftdi", "stalls, loss", "stalls that lose"}  # what was lost


@pytest.mark.parametrize("minutes", [3, pytest.param(20, marks=pytest.mark.long)])
@pytest.mark.parametrize("port, numbered", [
    *((port, True) for port in physics.PORTS),
    *((port, False) for port in physics.PORTS if port not in TOLD_BY_NUMBERS_ALONE)])
def test_stamps_of_a_port(port, minutes, numbered):
    """p99 from the first second on, and for ten seconds behind each stall; never ahead; the period is found."""
    given = physics.PORTS[port]
    numbers, ends, at, pauses = physics.arrivals(np.random.default_rng([3, len(port)]), given, 60.0 * minutes)
    clock = OdometryStamps(PERIOD)
    found = stamps(1.0 + at, numbers if numbered else None, EPOCH, clock) - EPOCH / SECOND
    errors = 1000 * np.abs(found - 1.004 - ends)
    p50, p99 = np.percentile(errors[50:], (50, 99))
    print(f"{port}, {'numbered' if numbered else 'without numbers'}: p50 {p50:.2f}, p99 {p99:.2f} ms")
    most = 5.0 if given.get("poll") == 0.016 else 2.0
    assert p99 <= most
    for _, end in pauses:
        assert np.percentile(errors[(at > end + 0.05) & (at < end + 10)], 99) <= most
    if "warm" not in given:
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


@pytest.mark.parametrize("stall", [0.14, 0.2, 0.3, 0.4])
def test_numbered_packets_that_wait_are_stamped_as_made_however_slowly_their_queue_is_read(stall):
    """One packet in 18 ms: that takes up to 4 s; the simulator makes up for a stall as slowly."""
    times = made(3000)
    at = np.maximum(times, times[2000] + stall + 0.018 * (np.arange(3000) - 2000))
    at = np.where(np.arange(3000) < 2000, times, at) + 1e-3
    clock = OdometryStamps(PERIOD)
    assert np.abs(stamps(at, np.arange(3000), clock=clock) - times)[100:].max() < 2e-3
    assert clock.restarts == 0


@pytest.mark.parametrize("step, numbered, packets", [
    *((step, numbered, 0) for step in (3600.0, -3600.0, -80.0, -0.2) for numbered in (True, False)),
    (0.2, False, 4), (0.2, True, 51)], ids=str)  # with numbers it may be a queue, for a second
def test_the_only_clock_is_set(step, numbered, packets):
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


def test_the_loops_of_generation_3_are_no_restarts():
    """Each tenth takes 25 ms, so all are up to 3 ms off an even line."""
    times = 5.0 + np.cumsum(np.where(np.arange(3000) % 10 == 9, 0.025, 0.02))
    clock = OdometryStamps(PERIOD)
    found = stamps(delayed(times), clock=clock)
    assert np.abs(found - times)[500:].max() < 5e-3
    assert (clock.drift, clock.restarts) == (pytest.approx(0.025, abs=1e-3), 0)


def test_packets_of_no_period_are_stamped_by_arrival():
    clock = OdometryStamps(0.0)
    at = made(100) + 0.3 * np.random.default_rng(1).random(100).cumsum()
    assert stamps(at, clock=clock) == pytest.approx(at, abs=1e-8)
    assert (clock.drift, clock.restarts) == (0.0, 0)
