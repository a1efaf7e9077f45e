"""Stamps against the times at which packets were made: jitter, bursts, repairs, drift, losses, clocks that are set."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robotont_driver.timing.odometry_stamps import SECOND, TICK, OdometryStamps
from robotont_testing import other_noise

PERIOD = 0.02  # [s]
EPOCH = 1_700_000_000 * SECOND

# [s] Delay from the end of a period to the callback of a node on a desktop, quantiles in per cent: measured
# with the simulator on two cores, at work on little else, and beside two programs that took both.
PERCENT = (0, 10, 25, 50, 75, 90, 95, 98, 99, 99.5, 99.9, 100)
QUIET = np.array((0.57, 0.91, 1.41, 2.05, 3.34, 4.58, 5.83, 6.99, 8.04, 10.38, 13.88, 15.18)) / 1000
BUSY = np.array((0.08, 1.68, 3.49, 6.6, 9.67, 13.51, 16.03, 17.71, 18.47, 19.89, 49.18, 57.67)) / 1000


def made(amount, drift=0.0):
    """[s] when each of so many packets was made; drift: by which part the board's clock is slow."""
    return 5.0 + PERIOD * (1 + drift) * np.arange(amount)


def delayed(times, quantiles, seed=1):
    """[s] arrivals of packets made at `times`, in order, with delays drawn from a distribution."""
    delays = np.interp(np.random.default_rng(seed).uniform(0, 100, len(times)), PERCENT, quantiles)
    return np.maximum.accumulate(times + delays)


def stamps(arrivals, walls=0, clock=None):
    """[s] stamps of packets that come at `arrivals` [s] of the steady clock; walls: [ns] how far the other is ahead."""
    clock = clock or OdometryStamps(PERIOD)
    given = [round(arrival * SECOND) for arrival in arrivals]
    walls = np.broadcast_to(walls, len(given)).tolist()
    return np.array([clock.stamp(at, at + wall) for at, wall in zip(given, walls)]) / SECOND


def test_bursts_whose_packets_wait_for_each_other():
    """The board hands over 17 at once, with the last of them; each waits for those before it, on a busy machine."""
    times, size = made(6000), 17
    burst, place = np.divmod(np.arange(6000), size)
    waits = np.random.default_rng(5).exponential(0.0015, 6000)
    waits[::size] = 0.0
    since = np.cumsum(waits)
    arrivals = delayed(times[[*range(size - 1, 6000, size), -1]], BUSY)[burst] + since - since[burst * size]
    p50, p99 = np.percentile(1000 * np.abs(stamps(arrivals + 5e-5 * place) - times)[500:], (50, 99))
    assert p50 <= 1.5
    assert p99 <= 4.0


@pytest.mark.parametrize("stall", [0.029, 0.05, 0.12, 0.5])
@pytest.mark.parametrize("after", [0.0, 0.005, 0.009, 0.011, 0.019])
def test_what_was_taken_for_lost_and_came_late_leaves_no_trace(stall, after):
    """Where packets have been lost, the first one after a stall looks as if more were; its queue shows that none is."""
    times = np.delete(made(3000), 1000)
    arrivals = times + 0.001
    queue = arrivals[2000] + stall + after + 0.0006 * np.arange(999)
    arrivals[2000] += stall
    arrivals[2001:] = np.maximum(arrivals[2001:], queue[:len(arrivals) - 2001])
    late = (stamps(arrivals) - times - 0.001)[2000 + math.ceil((stall + after) / PERIOD) + 1:]
    assert np.abs(late).max() < 0.003


@pytest.mark.parametrize("lost", [1, 2, 7, 40])
def test_packets_lost_unnoticed_shift_the_line_within_half_a_second(lost):
    """Plain packets have no counter: those behind a lost one are one period later than their number says."""
    times = np.delete(made(3000), slice(1000, 1000 + lost))
    clock = OdometryStamps(PERIOD)
    found = stamps(delayed(times, QUIET), clock=clock)
    wrong = np.flatnonzero(np.abs(found - times) > 5e-3)
    assert set(wrong) <= set(range(1000, 1025))
    assert clock.shifts == 1


def test_lost_packets_at_the_start_do_not_make_the_line_too_fast_for_ever():
    """A line that is too fast falls behind by and by; that is no packet lost, which would make it faster still."""
    wrong = []
    for seed in range(60, 170):
        generator = np.random.default_rng(seed)
        kept = np.ones(2000, dtype=bool)
        start = generator.integers(30, 300)
        kept[:start] = generator.uniform(size=start) < 0.93
        times = made(2000)
        delays = np.where(np.arange(2000) < start, generator.exponential(generator.choice((3, 12), 2000)), 0.5) / 1000
        clock = OdometryStamps(PERIOD)
        found = stamps(np.maximum.accumulate(times + delays)[kept], clock=clock) - times[kept]
        if np.abs(found[-200:]).max() > 0.003:
            wrong.append((seed, clock.drift))
    assert not wrong


def test_after_a_pause_it_begins_anew_and_the_drift_is_reported():
    times = made(3000, 3e-4)
    times[1500:] += 60.0
    clock = OdometryStamps(PERIOD)
    assert np.abs(stamps(times, clock=clock) - times)[100:].max() < 1e-3
    assert (clock.restarts, clock.event) == (1, None)
    assert clock.drift == pytest.approx(3e-4, abs=5e-5)


@pytest.mark.parametrize("step, words", [
    (3600.0, "forward by 3600 s"), (-0.2, "back by 0.200 s"), (0.03, "forward by 0.030 s")])
def test_the_wall_clock_is_set(step, words):
    """Beside a steady clock the stamps follow with the very next packet, and keep their distances."""
    times = made(2000)
    ahead = np.where(np.arange(2000) < 1000, 0.0, step)
    clock = OdometryStamps(PERIOD)
    walls = [EPOCH + round(by * SECOND) for by in ahead]
    found = stamps(delayed(times, QUIET), walls, clock) - EPOCH / SECOND
    assert np.abs(found - times - ahead)[100:].max() < 3e-3
    assert (clock.steps, clock.restarts, clock.shifts) == (1, 0, 0)
    assert clock.event == "the clock was set " + words


@pytest.mark.parametrize("step, packets", [(3600.0, 0), (-3600.0, 0), (-80.0, 0), (0.2, 25), (-0.2, 0)], ids=str)
def test_the_only_clock_is_set(step, packets):
    """Simulated time, or a steady clock that is none: the stamps follow within so many packets."""
    times = made(2000) + 4000.0
    times[1000:] += step
    clock = OdometryStamps(PERIOD)
    found = stamps([*delayed(times[:1000], QUIET), *delayed(times[1000:], QUIET)], clock=clock)
    wrong = np.flatnonzero(np.abs(found - times) > 10e-3)
    assert set(wrong) <= set(range(1000, 1000 + packets))
    assert (clock.event is not None) == (step < 0)


@given(st.lists(st.tuples(st.integers(-3 * SECOND, 3 * SECOND), st.integers(-3 * SECOND, 3 * SECOND)), max_size=300))
def test_never_newer_than_now_and_never_older_than_the_last(moves):
    clock = OdometryStamps(PERIOD)
    arrival, wall, before = 0, EPOCH, None
    for gap, step in moves:
        arrival, wall = arrival + abs(gap), wall + (step if step % 5 == 0 else 0)
        steps = clock.steps
        stamp = clock.stamp(arrival, arrival + wall)
        assert isinstance(stamp, int)
        if clock.steps == steps and before is not None:
            assert stamp >= before + TICK  # tf2 holds stamps that differ by less for the same
            assert stamp <= max(arrival + wall, before + TICK)
        before = stamp


@pytest.mark.parametrize("given", [
    {}, {"drift": 0.01}, {"drift": -0.01}, {"drift": 0.02}, {"drift": -0.02}, {"lost": 0.01},
    {"lost": 0.002, "burst": 5}, {"lost": 0.01, "burst": 5}, {"lost": 0.01, "drift": 0.01}, {"late": 0.1},
    {"jitter": 0.005}], ids=str)
def test_ten_minutes_of_the_other_generator(given):
    """From the first packet on; the least delay is 2 ms. Lost packets have no counter."""
    ends, at, come = other_noise.arrivals(30000, np.random.default_rng(1), **given)
    clock = OdometryStamps(PERIOD)
    p50, p99 = np.percentile(1000 * np.abs(stamps(1.0 + at[come], clock=clock) - 1.002 - ends[come]), (50, 99))
    print(f"{given}: stamps p50 {p50:.2f}, p99 {p99:.2f} ms")
    assert p50 <= 0.1
    assert p99 <= 5.0
    assert clock.drift == pytest.approx(given.get("drift", 0.0), abs=1e-4)
    assert clock.restarts == 0
