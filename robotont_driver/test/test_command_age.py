import math
import random

import pytest

from robotont_driver.command.command_age import BURST, OLDEST, PAUSE, UNSEEN, Arrivals, Link


def streamed(until, period=0.05):
    """A link to another machine over which a message came every `period` [s] since 0."""
    link = Link(0.0)
    for step in range(1, round(until / period) + 1):
        assert link.age(step * period) < period + BURST + 1e-6
    return link


@pytest.mark.parametrize("rate", [5.0, 10.0, 20.0, 50.0])
def test_a_stream_over_a_network_that_delays_by_up_to_a_burst_drives_without_a_gap(rate):
    link, chance, last, until = Link(0.0), random.Random(1), 0.0, 1.0
    for count in range(1, 5000):
        last = max(last + 1e-6, count / rate + chance.uniform(0.0, 0.99 * BURST))
        assert last < until
        until = last + OLDEST - link.age(last)


@pytest.mark.parametrize("last_look", [None, 10.0, 11.9])
def test_what_comes_after_a_gap_between_looks_never_drives(last_look):
    link = streamed(10.0)
    if last_look:
        link.reached(last_look)
    for now in (last_look or 10.0) + 1.01 * UNSEEN, 20.0, 20.05:
        assert link.age(now) == math.inf
    assert link.lost


@pytest.mark.parametrize("pause, age", [(0.95 * PAUSE, 0.95 * PAUSE), (1.05 * PAUSE, 0.1), (10.2, 0.2)])
def test_what_comes_after_a_long_pause_is_no_older_than_the_last_look(pause, age):
    link = streamed(10.0)
    for look in range(1, int(pause / 0.25) + 1):
        link.reached(10.0 + look * 0.25)
    assert link.age(10.0 + pause) == pytest.approx(age)


def test_a_look_after_a_gap_proves_nothing():
    link = streamed(10.0)
    link.reached(10.5)
    link.reached(10.6 + UNSEEN)
    assert link.lost
    assert link.age(10.7 + UNSEEN) == math.inf


def test_the_first_message_of_a_publisher_that_latches_is_of_any_age():
    link = Link(0.0)
    link.local = True
    assert link.age(0.1, latching=True) == math.inf
    assert link.age(0.2, latching=True) == 0.0
    assert link.age(100.0) == 0.0, "a machine is within reach of itself"


def test_a_command_waits_for_its_process_and_on_its_way():
    arrivals = Arrivals(0.25, 0.0)
    assert arrivals.spent({}, 0.1, 0.5) == math.inf  # of no known connection
    link = Link(0.0)
    arrivals.link = lambda header: link
    for step in range(1, 10):
        arrivals.stalls.tick(step * 0.05)
        assert arrivals.spent({}, step * 0.05, 0.3) == 0.0, "a short time-out is for silence"
    assert arrivals.spent({}, 0.8, 0.3) == pytest.approx(0.35)
