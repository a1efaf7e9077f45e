"""Calibration on synthetic runs: wheels that differ from the parameters, with noise, and measured poses."""

import math

import numpy as np
import pytest

from robotont_calibration.calibration import Stretch, Unknowns, calibrate, end_pose, misfit, stretches_of
from robotont_calibration.synthetic_runs import (
    NOISE,
    TAPE,
    TRACKED,
    recorded,
    taped_runs,
    tracked_runs,
    true_of,
)
from robotont_calibration.trajectory import Trajectory
from robotont_driver.kinematics import Kinematics
from robotont_driver.odometry import WheelOdometry
from robotont_driver.wheels import read_wheels
from robotont_testing.robots import SHIPPED, UNEVEN_4
from robotont_testing.simulated_wheels import PERIOD, path_of, spin, square


def umbmark(parameters, true):
    """[m] UMBmark's E_max,syst of odometry with `parameters` on a `true` robot.

    Five squares of 4 m each way; of the two mean end errors the one farther from zero.
    """
    means = []
    for turn in (1, -1):
        exact = tuple(path_of(square(4.0, turn))[-1])
        means.append(np.mean([
            misfit(read_wheels(parameters), Stretch(counts, exact, TRACKED))
            for counts, _ in (recorded(true, square(4.0, turn), seed, TRACKED) for seed in range(100, 105))], axis=0))
    return max(math.hypot(x, y) for x, y, _ in means)


@pytest.mark.parametrize("wrong", [SHIPPED, UNEVEN_4], ids=["3 wheels", "4 uneven wheels"])
def test_wrong_parameters_are_recovered(wrong):
    """Radius 2 % too large, distance 3 % too small, one angle 1.5 degrees off."""
    true = true_of(wrong, 1.02, 0.97, [(1, 1.5)])
    found = calibrate(wrong, tracked_runs(true), Unknowns(wrong), NOISE)
    radius = found.parameters["wheelRadius"] / true["wheelRadius"] - 1
    distance = np.max(np.divide(found.parameters["wheelDistanceFromCenter"], true["wheelDistanceFromCenter"]) - 1)
    angles = np.degrees(np.subtract(found.parameters["wheelRads"], true["wheelRads"]))
    before, after, best = (umbmark(parameters, true) for parameters in (wrong, found.parameters, true))
    print(f"radius {radius:+.3%}, distance {distance:+.3%}, angles {np.round(angles, 3)} deg; UMBmark "
          f"{1000 * before:.0f} mm before, {1000 * after:.0f} mm after, {1000 * best:.0f} mm with the true parameters")
    assert abs(radius) < 0.002
    assert abs(distance) < 0.002
    assert np.abs(angles).max() < 0.1
    assert after < before / 10
    assert found.undetermined == ()
    assert found.wheel_noise == pytest.approx(NOISE, rel=0.3)


def test_a_tape_will_do():
    """Only where each run ended, measured with a tape to 2 mm and half a degree."""
    true = true_of(SHIPPED, 1.02, 0.97, [(1, 1.5)])
    found = calibrate(SHIPPED, taped_runs(true), Unknowns(SHIPPED), NOISE)
    errors = np.array([found.parameters["wheelRadius"] / true["wheelRadius"] - 1,
                       found.parameters["wheelDistanceFromCenter"] / true["wheelDistanceFromCenter"] - 1,
                       *np.subtract(found.parameters["wheelRads"], true["wheelRads"])])
    before, after = umbmark(SHIPPED, true), umbmark(found.parameters, true)
    print(f"errors {np.round(errors, 5)}, stated {np.round(found.deviations, 5)}; "
          f"UMBmark {1000 * before:.0f} mm before, {1000 * after:.0f} mm after")
    assert abs(errors[:2]).max() < 0.005
    assert after < before / 4


def test_stated_uncertainties_are_the_ones_that_there_are():
    """Over 40 calibrations, errors over stated deviations have a root mean square of about one."""
    true = true_of(SHIPPED, 1.01, 0.98, [(0, 1.0)])
    ratios = []
    for seed in range(40):
        found = calibrate(SHIPPED, taped_runs(true, 1000 * seed), Unknowns(SHIPPED), NOISE)
        ratios.append(np.array([
            found.parameters["wheelRadius"] / true["wheelRadius"] - 1,
            found.parameters["wheelDistanceFromCenter"] / true["wheelDistanceFromCenter"] - 1,
            *np.subtract(found.parameters["wheelRads"], true["wheelRads"])]) / found.deviations)
    spread = np.sqrt(np.mean(np.square(ratios), axis=0))
    print("errors over stated deviations:", np.round(spread, 2))
    assert spread.min() > 0.5
    assert spread.max() < 1.5


def test_every_wheel_may_have_a_radius_of_its_own():
    wheels = [1.01, 1.0, 0.985]
    true = {**SHIPPED, "wheelRadius": [SHIPPED["wheelRadius"] * factor for factor in wheels]}
    found = calibrate(SHIPPED, tracked_runs(true), Unknowns(SHIPPED, radius="each", angles="fixed"), NOISE)
    np.testing.assert_allclose(found.parameters["wheelRadius"], true["wheelRadius"], rtol=0.002)
    assert found.parameters["wheelRads"] == SHIPPED["wheelRads"]


def test_runs_that_do_not_tell_a_parameter_are_said_to():
    """Turning on the spot tells radius over distance, neither of them alone, and no common turn of the angles."""
    counts, poses = recorded(SHIPPED, spin(6 * math.pi), 1, TAPE)
    found = calibrate(SHIPPED, [Stretch(counts, tuple(poses[-1]), TAPE)], Unknowns(SHIPPED), NOISE)
    assert {"wheelRadius", "wheelDistanceFromCenter"} <= set(found.undetermined)
    alone = calibrate(SHIPPED, [Stretch(counts, tuple(poses[-1]), TAPE)],
                      Unknowns(SHIPPED, radius="fixed", angles="fixed"), NOISE)
    assert alone.undetermined == ()
    assert abs(alone.values[0]) < 0.002


def test_whole_turns_need_not_be_measured():
    counts, poses = recorded(SHIPPED, spin(6 * math.pi), 1, TAPE)
    wrapped = (*poses[-1, :2], math.remainder(poses[-1, 2], 2 * math.pi))
    one, other = (misfit(read_wheels(SHIPPED), Stretch(counts, moved, TAPE)) for moved in (wrapped, tuple(poses[-1])))
    np.testing.assert_allclose(one, other, atol=1e-9)


def test_the_end_pose_is_that_of_the_odometry():
    wheels = read_wheels(UNEVEN_4)
    counts = np.random.default_rng(5).integers(-60, 60, (500, 4))
    odometry = WheelOdometry(Kinematics(wheels), PERIOD, NOISE)
    for packet in counts.tolist():
        odometry.update(packet, PERIOD)
    x, y, yaw = end_pose(wheels, counts)
    assert (x, y) == pytest.approx((odometry.pose.x, odometry.pose.y), abs=1e-9)
    assert math.remainder(yaw - odometry.pose.yaw, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_nothing_to_calibrate_with():
    with pytest.raises(ValueError, match="found no stretch"):
        calibrate(SHIPPED, [], Unknowns(SHIPPED), NOISE)
    with pytest.raises(ValueError, match="all fixed"):
        Unknowns(SHIPPED, "fixed", "fixed", "fixed")
    times = np.arange(10) * PERIOD
    truth = Trajectory(times, np.zeros((10, 3)))
    with pytest.raises(ValueError, match="found no packets with motion"):
        stretches_of(times, np.zeros((10, 3)), truth, 0.1, TAPE)
    with pytest.raises(ValueError, match="found no packets with motion"):
        stretches_of(times + 50, np.ones((10, 3)), truth, 0.1, TAPE)
