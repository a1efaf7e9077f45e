import math

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import chi2

from robotont_driver.kinematics import se2
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.odometry.chi_square import chi_square_limit, chi_square_tail
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_driver.odometry.slip_by_command import CommandWatch
from robotont_driver.odometry.slip_by_wheels import WINDOW, SlipDetector
from robotont_driver.odometry.wheel_noise import LearntNoise
from robotont_testing.simulated_wheels import PERIOD, counted, end_pose, even_wheels, rolled

NOISE = 0.005        # [m] after 1 m, as in driver.yaml
FALSE_ALARMS = 0.1   # [1/h]
RATE = 1 / PERIOD


def detector(wheels, noise=NOISE):
    return SlipDetector(Kinematics(wheels).matrix, wheels.metres_per_edge, noise, FALSE_ALARMS, RATE)


def drive(wheels, counts, twists, commanded=None, detect=True):
    """(error [m], [rad] of the end pose; the detector; per packet the wheels excluded)."""
    odometry = WheelOdometry(Kinematics(wheels), PERIOD, NOISE)
    finder = detector(wheels)
    slipping = []
    for index, packet in enumerate(counts.tolist()):
        if detect and finder.update(packet, None if commanded is None else commanded[index]):
            odometry.exclude(finder.slipping)
        odometry.update(packet, PERIOD)
        slipping.append(finder.slipping)
    pose, (x, y, yaw) = odometry.pose, end_pose(twists)
    return (math.hypot(pose.x - x, pose.y - y), abs(se2.wrap(pose.yaw - yaw))), finder, slipping


def ten_seconds(direction=0.0):
    """A 10 s drive: a curve at 0.8 m/s, sped up and slowed down for 1 s."""
    seconds = (np.arange(500) + 0.5) * PERIOD
    ramp = np.clip(np.minimum(seconds, 10 - seconds), 0, 1)
    return ramp[:, None] * (0.8 * math.cos(direction), 0.8 * math.sin(direction), 0.3)


SLIP = slice(200, 300)  # 2 s in the middle


@pytest.mark.parametrize("number, wheel, known", [
    (4, 0, True), (4, 1, False), (4, 2, True), (4, 3, False), (5, 0, True), (5, 2, False), (6, 1, True), (6, 5, False)])
def test_a_wheel_that_slips_by_30_percent_is_named_and_left_out(number, wheel, known):
    wheels = read_wheels(even_wheels(number))
    twists = ten_seconds(0.0 if number == 4 else wheels.directions[wheel] + 0.3)
    paths = rolled(wheels, twists)
    assert abs(paths[SLIP, wheel]).mean() > 0.4 * PERIOD
    slipping = paths.copy()
    slipping[SLIP, wheel] *= 1.3  # it turns 30 % more than the floor passes by
    counts = counted(wheels, slipping, NOISE, np.random.default_rng(number * 10 + wheel))
    commanded = twists @ Kinematics(wheels).matrix.T / wheels.metres_per_edge * PERIOD if known else None
    error, finder, named = drive(wheels, counts, twists, commanded)
    first = next(index for index, slipping in enumerate(named) if slipping)
    delay = (first + 1 - SLIP.start) * PERIOD
    assert named[first] == (wheel,)
    assert 0 < delay <= 0.2 + 1e-9
    assert set(named[first:SLIP.stop]) == {(wheel,)}
    back = named.index((), first)
    assert back - SLIP.stop <= 5 * WINDOW
    assert finder.alarms == 1
    without, _, _ = drive(wheels, counts, twists, detect=False)
    assert error[0] <= without[0] / 4
    assert error[1] <= without[1] / 4


@pytest.mark.parametrize("learnt", [1443, 1452, 1473, 1482, 1512])  # packets after which one window shows too little
def test_a_wheel_is_taken_back_however_much_of_the_noise_has_been_learnt(learnt):
    wheels = read_wheels(even_wheels(4))
    finder = detector(wheels, noise=0.012)
    right = Kinematics(wheels).units_of_twist((0.4, 0.0, 0.0))
    for share, packets in ((1.0, learnt), (1.4, 30), (1.0, 50)):
        counts = [round(share * unit if wheel == 2 else unit) for wheel, unit in enumerate(right)]
        for _ in range(packets):
            finder.update(counts, right)
        assert finder.slipping == ((2,) if share > 1.0 else ())


def test_two_wheels_of_six_may_slip_at_once():
    wheels = read_wheels(even_wheels(6, first=0.2))
    twists = ten_seconds()
    paths = rolled(wheels, twists)
    paths[SLIP, 1] *= 0.2
    paths[SLIP, 3] = 0
    counts = counted(wheels, paths, NOISE)
    error, _, named = drive(wheels, counts, twists)
    assert named[SLIP.start + WINDOW] == (1, 3)
    assert named[-1] == ()
    assert error[0] < drive(wheels, counts, twists, detect=False)[0][0] / 4


def test_the_noise_that_is_learnt_is_the_mean_of_the_windows():
    noise, random = LearntNoise(WINDOW), np.random.default_rng(1)
    for _ in range(5000):
        noise.learn(4.0 * random.chisquare(1) / noise.excess)
    assert noise.ratio == pytest.approx(2.0, rel=0.1)


# Command and measurement

WATCHED = read_wheels(even_wheels(3))


def watch(paths, commanded):
    """(the watch, per packet the wheels that do not follow) on paths [edges]."""
    watcher, lagging = CommandWatch(3, RATE), []
    for packet, units in zip(counted(WATCHED, paths * WATCHED.metres_per_edge, NOISE).tolist(), commanded.tolist()):
        watcher.update(packet, tuple(units))
        lagging.append(watcher.lagging)
    return watcher, lagging


def lagged(commanded, constant=0.15):
    """Paths [edges] of motors that follow as a lag of the first order with this time constant [s]."""
    keep = math.exp(-PERIOD / constant)
    return lfilter([1 - keep], [1, -keep], commanded, axis=0)


def test_motors_that_lag_but_follow_raise_no_alarm():
    """Stepwise commands that change every second or so, as from a keyboard."""
    generator = np.random.default_rng(1)
    twists = generator.uniform(-0.6, 0.6, (200, 3)) * generator.integers(0, 2, (200, 3))
    commanded = np.repeat([Kinematics(WATCHED).units_of_twist(twist) for twist in twists],
                          generator.integers(10, 100, 200), axis=0)
    assert not any(watch(lagged(commanded), commanded)[1])


@pytest.mark.parametrize("wheel, share", [(0, 0.0), (1, 0.5), (2, 1.5), (0, -1.0)])
def test_a_wheel_that_does_not_do_as_commanded_is_named(wheel, share):
    commanded = np.tile(Kinematics(WATCHED).units_of_twist((0.05, 0.05, 3.0)), (200, 1))
    paths = lagged(commanded)
    paths[100:, wheel] *= share
    watcher, named = watch(paths, commanded)
    assert not any(named[:100])
    first = next(index for index, wheels in enumerate(named) if wheels)
    assert set(named[first:]) == {(wheel,)}
    assert (first - 100) * PERIOD <= 1.3
    assert watcher.followed[wheel] == pytest.approx(share, abs=0.05)


@pytest.mark.parametrize("degrees", range(1, 9))
def test_chi_square_against_scipy(degrees):
    for value in (0.1, 1.0, 5.0, 30.0):
        assert chi_square_tail(value, degrees) == pytest.approx(chi2.sf(value, degrees), rel=1e-10)
    for rate in (0.5, 0.05, 1e-6, 5.6e-7):
        assert chi_square_limit(rate, degrees) == pytest.approx(chi2.isf(rate, degrees), rel=1e-9)
