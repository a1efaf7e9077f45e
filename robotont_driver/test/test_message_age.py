import math

import pytest

from robotont_driver.command.message_age import BURST, PAUSE, UNSEEN, Arrivals, Link


def streamed(until, period=0.05):
    """A link to another machine over which a message came every `period` [s] since 0."""
    link = Link(0.0)
    link.age(period)
    for step in range(2, round(until / period) + 1):
        assert link.age(step * period) == pytest.approx(0.0 if step > 2 or period < BURST else period)
    return link


@pytest.mark.parametrize("period", [0.05, 0.4])
def test_a_stream_is_new(period):
    assert not streamed(10.0, period).lost


def test_what_comes_after_a_short_silence_may_have_waited_all_the_time():
    link = streamed(10.0)
    assert link.age(10.4) == pytest.approx(0.4)
    assert link.age(10.41) == pytest.approx(0.41)
    assert link.age(10.4 + BURST) == 0.0


@pytest.mark.parametrize("last_look", [None, 10.0, 11.9])
def test_what_comes_after_a_gap_between_looks_never_drives(last_look):
    link = streamed(10.0)
    if last_look:
        link.reached(last_look)
    for now in (last_look or 10.0) + 1.01 * UNSEEN, 20.0, 20.05:
        assert link.age(now) == math.inf
    assert link.lost


@pytest.mark.parametrize("pause, age", [(0.95 * PAUSE, 0.95 * PAUSE), (1.05 * PAUSE, 0.0), (30.0, 0.0)])
def test_what_comes_after_a_long_pause_is_new_while_the_machine_was_within_reach(pause, age):
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


def test_a_message_waits_for_its_process_and_on_its_way():
    arrivals = Arrivals(0.25, 0.0)
    link = Link(0.0)
    assert Arrivals(0.25, 0.0).age({}, 0.1) == math.inf  # of no known connection
    arrivals.link = lambda header: link
    for step in range(1, 10):
        arrivals.stalls.tick(step * 0.05)
        assert arrivals.age({}, step * 0.05) == 0.0
    assert arrivals.age({}, 0.8) == pytest.approx(0.35)
