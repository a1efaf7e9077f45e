import pytest

from robotont_driver.command.command_age import LONGEST, StallWatch

GAP = 0.25


def ticked(until, start=0.0, period=0.05):
    watch = StallWatch(GAP, start)
    for tick in range(1, round((until - start) / period) + 1):
        watch.tick(start + tick * period)
    return watch


@pytest.mark.parametrize("gap, settling", [(0.26, 0.26), (0.7, 0.7), (3600.0, LONGEST)])
def test_messages_are_old_for_as_long_as_the_gap_lasted_and_a_second_at_most(gap, settling):
    watch = ticked(10.0)
    end = 10.0 + gap
    for tick in range(1000):
        now = end + tick * 0.01
        assert watch.earliest_arrival(now) == (10.0 if now < end + settling else now)


def test_a_gap_before_the_queues_are_empty_continues_the_one_before():
    watch = ticked(10.0)
    watch.tick(15.0)
    assert watch.earliest_arrival(15.0 + 1.1 * GAP) == 10.0
    assert watch.stalls == 2
