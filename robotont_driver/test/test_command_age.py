import math
import random

import pytest

from robotont_driver.command.command_age import BURST, OLDEST, SETTLING, UNKNOWN, UNSEEN, Arrivals, Link, Reach


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


@pytest.mark.parametrize("silence", [0.2, 0.45, 0.55, 10.0])
def test_what_waited_in_a_silence_is_as_old_as_it_and_the_stream_behind_it_drives(silence):
    link = streamed(10.0)
    back = 10.0 + silence
    for late in (0.0, 0.01, 0.09):
        assert link.age(back + late) >= silence - 1e-6
    assert (link.age(back + 0.2) < OLDEST) == (silence < OLDEST)
    settled = [link.age(back + SETTLING + step * 0.05) for step in range(1, 10)]
    assert max(settled) < OLDEST


def test_a_machine_that_answers_slowly_is_within_reach():
    reach = Reach(0.0)
    assert not reach.turns(UNSEEN + 1.9 * UNKNOWN), "nobody knows yet how slow it is"
    for second in range(1, 60):
        reach.answered(second, second + 2.0)
        assert not reach.turns(second + 2.9)
    for tenth in range(600, 700):
        reach.answered(tenth / 10, tenth / 10 + 0.01)
    assert not reach.turns(70.9)
    assert reach.turns(71.1)
    assert reach.lost
    for second in range(72, 142):
        reach.answered(second, second + 2.0)
    reach.turns(143.0)
    assert not reach.lost, "it has become slow again"
    assert not reach.turns(143.9)
    assert reach.turns(150.0)
    reach.heard(150.1)
    assert reach.turns(150.2)
    assert not reach.lost


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
