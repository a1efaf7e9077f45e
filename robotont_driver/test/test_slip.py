"""The search for wheels that slip: false alarms, finds, whom it excludes; foreign noise, behind the motors' lag."""

import copy

import numpy as np
import pytest
from scipy.stats import chi2

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.nodes.odom_node import PARAMETERS, fault_of_wheels
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_driver.odometry.slip import SlipSearch
from robotont_testing import physics
from robotont_testing.simulated_wheels import matrix_of

LIMIT = next(parameter.default for parameter in PARAMETERS if parameter.name == "slip_limit")
STATED, SMOOTH = 0.012, 0.005  # [m per root m] by default, and on a smooth floor
PERIOD = 0.02  # [s]


def kinematics(base):
    return Kinematics(read_wheels(base.thesis_keys()))


def search(base):
    return SlipSearch(kinematics(base), PERIOD, STATED, LIMIT)


def units(base, twists):
    return twists @ base.matrix.T / base.edge * PERIOD


def driven(rng, base, drives, seconds, noise, law="gaussian", lag=None, share=0.0, **given):
    """(counts, units commanded, [(drive, begin, wheel) that slips]) of drives behind a lag [s], None: up to 0.12."""
    wished = physics.commands(rng, drives, seconds, **given)
    lag = rng.uniform(0.0, 0.12, drives) if lag is None else lag
    dead = lag * rng.random(drives)
    twists = physics.behind(wished, dead, lag - dead)
    slip, began = physics.slips(rng, base, twists, share, every=15.0) if share else (None, [])
    return physics.encoders(rng, base, twists, noise, law, slip), units(base, wished), began


def told(finder, packets, commanded):
    """(slipping, alike) by packet of one drive, K x n."""
    states = []
    for packet, command in zip(packets.tolist(), commanded.tolist()):
        finder.update(packet, command)
        states.append((finder.slipping, finder.alike))
    return states


def learnt(rng, base, noise, amount=1):
    """So many `SlipSearch` that have learnt a floor's noise."""
    finders, (packets, commanded, _) = [search(base) for _ in range(amount)], driven(rng, base, amount, 200.0, noise)
    for finder, *each in zip(finders, packets, commanded):
        told(finder, *each)
    return finders


LAWS = {"Gaussian": ("gaussian", 1), "Gaussian, twice": ("gaussian", 2), "in common": ("common", 1),
        "Student 3": ("student3", 1)}
RATES = {"Gaussian": 0.5, "Gaussian, twice": 0.5, "in common": 1.0, "Student 3": 1.0}  # [1/h], docs/odometry.md


@pytest.mark.parametrize("wheels, law, hours", [
    (4, "in common", 0.05), (8, "Student 3", 0.05),
    *(pytest.param(wheels, law, 6.25, marks=pytest.mark.long) for law in LAWS for wheels in (4, 5, 6, 8))])
def test_false_alarms_on_clean_counts(wheels, law, hours):
    """Each quarter of an hour on another floor, whose noise is learnt in it; the lower bound of 95 %."""
    rng, base, (name, times) = np.random.default_rng([wheels, list(LAWS).index(law)]), physics.Base(wheels), LAWS[law]
    packets, commanded, _ = driven(rng, base, max(1, round(4 * hours)), min(900.0, 3600 * hours), times * STATED, name)
    states = [list(map(any, told(search(base), *each))) for each in zip(packets, commanded)]
    alarms = sum(now and not before for each in states for before, now in zip([False, *each], each))
    low, high = chi2.ppf(0.025, 2 * alarms) / 2 / hours if alarms else 0.0, chi2.ppf(0.975, 2 * alarms + 2) / 2 / hours
    print(f"{wheels} wheels, {law}: {alarms} in {hours} h, {low:.2f} to {high:.2f} per hour")
    assert low <= RATES[law]


@pytest.mark.parametrize("wheels, lag, drives", [
    (4, 0.12, 12), *(pytest.param(wheels, lag, 300, marks=pytest.mark.long) for lag in (0.0, 0.06, 0.12)
                     for wheels in (4, 5, 6, 8))])
def test_slip_is_found_and_no_healthy_wheel_is_excluded(wheels, lag, drives):
    """Within 2 s 5, 60, 90 % of slips by 10, 20, 50 % are found; 2 % of the excluded are healthy."""
    rng, base = np.random.default_rng([wheels, round(1000 * lag)]), physics.Base(wheels)
    finders, excluded, wrong = learnt(rng, base, SMOOTH, min(12, drives // 3)), 0, 0
    for share, least in ((0.1, 0.05), (0.2, 0.6), (0.5, 0.9)):
        states, slipping = slips_told(rng, base, finders, drives, lag, share)
        found = [any(map(any, each[150:250])) and not any(map(any, each[:150])) for each in states]
        out = [next((out[0] for out, _ in each[150:] if out), None) for each in states]
        excluded, wrong = excluded + len(out) - out.count(None), wrong + sum(
            one not in (None, wheel) for one, wheel in zip(out, slipping))
        print(f"{wheels} wheels, lag {lag} s, slip {share:.0%}: {np.mean(found):.0%} of {len(found)} found")
        assert np.mean(found) >= least - 2 * (least * (1 - least) / len(found)) ** 0.5
    print(f"{wrong} of {excluded} excluded are healthy")
    assert wrong <= 0.02 * excluded


def slips_told(rng, base, finders, drives, lag, share):
    """`told` of 3 s before each slip and 4 s from its begin on, and the wheels that slip."""
    packets, commanded, began = driven(rng, base, drives, 30.0, SMOOTH, lag=lag, share=share, rests=0.0)
    began = [each for each in began if each[1] + 200 <= packets.shape[1]]
    states = [told(copy.deepcopy(finders[drive % len(finders)]), packets[drive, begin - 150:begin + 200],
                   commanded[drive][begin - 150:begin + 200]) for drive, begin, _ in began]
    return states, [wheel for _, _, wheel in began]


def drive(base, packets, commanded=None, finder=None):
    """(odometry, search, wheels excluded or told by packet) of a drive."""
    odometry, finder = WheelOdometry(kinematics(base), PERIOD, STATED), finder or search(base)
    told = []
    for index, packet in enumerate(packets.tolist()):
        odometry.update(packet, PERIOD, slips=finder.slips)
        if finder.update(packet, None if commanded is None else commanded[index].tolist()):
            odometry.exclude(finder.slipping)
        told.append((finder.slipping, finder.alike))
    return odometry, finder, told


def straight(base, rng, twist, packets, wheel, slips):
    """(counts, units, true end) of a drive with one twist, of which a wheel slips by half in the packets `slips`."""
    twists, slip = np.tile(twist, (1, packets, 1)), np.ones((1, packets, base.wheels))
    slip[0, slips, wheel] = 1.5
    counts = physics.encoders(rng, base, twists, SMOOTH, slip=slip)[0]
    return counts, units(base, twists[0]), physics.true_poses(twists)[0, -1]


def off(odometry, end):
    return np.subtract((odometry.pose.x, odometry.pose.y, odometry.pose.yaw), end)


@pytest.mark.parametrize("wheels", [4, pytest.param(6, marks=pytest.mark.long)])
def test_a_slipping_wheel_is_left_out_and_taken_back(wheels):
    base, rng, twist = physics.Base(wheels), np.random.default_rng(wheels), (0.6, 0.2, 0.3)
    finder, wheel = learnt(rng, base, SMOOTH)[0], int(np.argmax(np.abs(base.matrix @ twist)))
    packets, commanded, end = straight(base, rng, twist, 500, wheel, slice(200, 300))
    odometry, finder, told = drive(base, packets, commanded, finder)
    first = told.index(((wheel,), ()))
    assert 200 < first <= 200 + round(0.5 / PERIOD)
    assert {slipping for slipping, _ in told[first:300]} == {(wheel,)}
    assert told.index(((), ()), first) <= 300 + round(2.0 / PERIOD)
    assert not fault_of_wheels(finder)
    alone = WheelOdometry(kinematics(base), PERIOD, STATED)
    for packet in packets.tolist():
        alone.update(packet, PERIOD)
    assert np.hypot(*off(odometry, end)[:2]) < 0.5 * np.hypot(*off(alone, end)[:2])


def test_without_commands_four_wheels_explain_it_alike_and_the_covariance_grows():
    base, rng = physics.Base(4), np.random.default_rng(1)
    packets, _, end = straight(base, rng, (0.6, 0.0, 0.0), 200, 2, slice(100, 200))
    odometry, finder, told = drive(base, packets, finder=learnt(rng, base, SMOOTH)[0])
    assert told[-1] == ((), (0, 1, 2, 3))
    assert "wheel 0 or 1 or 2 or 3 slips" in fault_of_wheels(finder)
    alone = WheelOdometry(kinematics(base), PERIOD, STATED)
    for packet in packets.tolist():
        alone.update(packet, PERIOD)
    squares = [off(one, end) @ np.linalg.solve(matrix_of(one.pose_covariance), off(one, end))
               for one in (odometry, alone)]
    assert squares[0] < chi2.ppf(0.99, 3) < squares[1]


def test_one_jump_is_no_slip():
    base = physics.Base(4)
    packets, commanded, _ = straight(base, np.random.default_rng(2), (0.4, 0.0, 0.0), 400, 0, [])
    packets[300, 0] += round(0.05 / base.edge)
    assert set(drive(base, packets, commanded)[2]) == {((), ())}


@pytest.mark.parametrize("lag", [0.0, 0.15])
def test_motors_that_lag_but_follow_are_no_fault(lag):
    base, rng = physics.Base(3), np.random.default_rng(1)
    finder, (packets, commanded, _) = search(base), driven(rng, base, 1, 120.0, STATED, lag=lag, slope=20.0)
    for packet, command in zip(packets[0].tolist(), commanded[0].tolist()):
        finder.update(packet, command)
        assert not finder.lagging


@pytest.mark.parametrize("wheel, share", [(0, 0.0), (1, 0.5), (2, 1.5), (0, -1.0)])
def test_a_wheel_that_does_not_do_as_commanded_is_named(wheel, share):
    base, twists, slip = physics.Base(3), np.tile((0.05, 0.05, 3.0), (1, 200, 1)), np.ones((1, 200, 3))
    slip[0, 100:, wheel] = share
    packets = physics.encoders(np.random.default_rng(1), base, twists, SMOOTH, slip=slip)[0]
    finder, named = search(base), []
    for packet, command in zip(packets.tolist(), units(base, twists[0]).tolist()):
        finder.update(packet, command)
        named.append(finder.lagging)
    assert not any(named[:100])
    first = next(index for index, wheels in enumerate(named) if wheels)
    assert set(named[first:]) == {(wheel,)}
    assert (first - 100) * PERIOD <= 1.3


@pytest.mark.parametrize("deceleration", [0.225, 0.3125, np.inf])
def test_a_robot_that_rolls_on_behind_a_stop_or_whose_board_stands_has_no_wheel_at_fault(deceleration):
    """Generation 2 rolls 0.1 m from 0.25 m/s; inf: the board stands, whatever is commanded."""
    base, rolls = physics.Base(3), np.isfinite(deceleration)
    speeds = np.maximum(0.0, 0.25 - (deceleration if rolls else 100.0) * PERIOD * np.maximum(0, np.arange(300) - 100))
    twists = speeds[:, None] * (1.0, 0.0, 0.0)
    packets = physics.encoders(np.random.default_rng(1), base, twists[None], SMOOTH, slip=np.ones((1, 300, 3)))[0]
    asked = np.where(np.arange(300) < 100, 0.25, 0.0 if rolls else 0.25)[:, None] * (1.0, 0.0, 0.0)
    finder = search(base)
    for packet, command in zip(packets.tolist(), units(base, asked).tolist()):
        finder.update(packet, command)
        assert not finder.lagging


def test_a_wheel_that_turns_while_all_are_to_stand_is_named():
    finder = search(physics.Base(3))
    named = set()
    for _ in range(200):
        finder.update([20, 0, 0], [0, 0, 0])
        named.add(finder.lagging)
    assert named == {(), (0,)}


@pytest.mark.parametrize("share", [0.3, 0.5, 0.8])
@pytest.mark.parametrize("twist", [(0.4, 0.0, 0.0), (0.0, 0.4, 0.0), (0.2, 0.1, 1.0)])
def test_where_all_wheels_are_too_slow_none_is_named(share, twist):
    """A weak battery, a carpet."""
    base, finder = physics.Base(3), search(physics.Base(3))
    twists = np.tile(twist, (1, 200, 1))
    packets = physics.encoders(np.random.default_rng(1), base, share * twists, SMOOTH, slip=np.ones((1, 200, 3)))[0]
    for packet, command in zip(packets.tolist(), units(base, twists[0]).tolist()):
        finder.update(packet, command)
        assert not finder.lagging
