"""Which commands may have waited."""

import random
from unittest.mock import MagicMock, patch

import pytest

from robotont_driver.command.command_age import MOST_KNOWN, SETTLING, SILENCE, Arrivals, Gaps
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.nodes import driver_node
from robotont_testing.robots import SHIPPED

LONGEST = 0.5  # [s]
FAR, NEAR = {"from": "another machine"}, {"from": "this one"}


@pytest.fixture
def arrivals():
    """Of a process that has been alive for 10 s, on whose connections nothing has come."""
    made = Arrivals(LONGEST, 0.0, lambda header: header["from"] == "this one")
    for step in range(200):
        made.gaps.tick(step * 0.05)
    return made


def new_for(arrivals, header, begin, seconds, rate=50):
    """[whether each command of some seconds is new]; the process is alive meanwhile."""
    return [arrivals.are_new(header, begin + step / rate) for step in range(round(seconds * rate))]


@pytest.mark.parametrize("rate", [5.0, 10.0, 20.0, 50.0])
def test_a_stream_over_a_network_that_delays_by_up_to_a_fifth_of_a_second_drives_without_a_gap(arrivals, rate):
    new_for(arrivals, FAR, 10.0, 1.0, rate)
    chance = random.Random(1)
    for count in range(5000):
        assert arrivals.are_new(FAR, 11.0 + count / rate + chance.uniform(0.0, 0.19))


@pytest.mark.parametrize("silence", [0.45, 0.55, 10.0])
def test_behind_a_silence_of_another_machine_nothing_drives_at_first(arrivals, silence):
    drives = new_for(arrivals, FAR, 10.0, 1.0)
    settling = round(SETTLING * 50)
    assert (any(drives[:settling - 1]), all(drives[settling + 1:])) == (False, True), "it may have waited since long"
    for step in range(round(silence / 0.05)):
        arrivals.gaps.tick(11.0 + step * 0.05)
    drives = new_for(arrivals, FAR, 10.98 + silence, 1.0)
    assert any(drives[:settling - 1]) == all(drives[:settling - 1]) == (silence < SILENCE)
    assert all(drives[settling + 1:])


def test_within_a_machine_only_the_first_of_a_publisher_that_latches_is_of_any_age(arrivals):
    assert arrivals.are_new(NEAR, 10.0)
    latching = {**NEAR, "latching": "1"}
    assert [arrivals.are_new(latching, 10.0) for _ in range(3)] == [False, True, True]
    for header in [dict(NEAR) for _ in range(2 * MOST_KNOWN)]:
        assert arrivals.are_new(header, 10.1)
    assert len(arrivals._known) == MOST_KNOWN


@pytest.mark.parametrize("gap", [0.45, 0.55, 3600.0])
def test_behind_a_gap_of_this_process_nothing_drives_at_first_and_another_gap_begins_anew(arrivals, gap):
    arrivals.are_new(NEAR, 10.0)
    back = 10.0 + gap
    assert arrivals.are_new(NEAR, back) == (gap < LONGEST)
    if gap > LONGEST:
        assert arrivals.gaps.amount == 1
        assert not arrivals.are_new(NEAR, back + 0.9 * SETTLING)
        assert not arrivals.are_new(NEAR, back + 1.0)  # starved before its queues were empty
        assert arrivals.are_new(NEAR, back + 1.01 + SETTLING)


def test_a_clock_that_another_thread_read_before_a_gap_hides_none():
    gaps = Gaps(LONGEST, 0.0)
    gaps.tick(1.0)
    gaps.tick(0.2)
    assert not gaps.settled(1.1)
    assert gaps.amount == 1


@pytest.mark.parametrize("timeout, rate", [(0.05, 10.0), (0.05, 200.0), (0.5, 10.0)])
def test_driver_node_looks_for_gaps_more_often_than_they_are_long(timeout, rate):
    parameters = {**{parameter.name: parameter.default for parameter in driver_node.PARAMETERS},
                  "cmd_timeout": timeout, "publish_rate": rate}
    ros = dict.fromkeys(("rospy", "RepeatingThread", "Health", "Reconnector", "KeptParameter"), MagicMock())
    ros["kept_names"] = lambda _: []
    ros["rospy"].get_param.return_value = ()
    with patch.multiple(driver_node, **ros):
        node = driver_node.DriverNode("driver_node", read_wheels(SHIPPED), parameters, MagicMock())
        assert 0.0 <= node._repeat() <= timeout / 4
