"""Calibration on synthetic runs: wheels that differ from the parameters, with noise, and measured poses."""

import math

import numpy as np
import pytest
from synthetic_runs import NOISE, TAPE, drives, recorded, taped_runs, tracked_runs, true_of

from robotont_calibration import calibration_runs
from robotont_calibration.calibration_runs import taped_run, tracked_run
from robotont_calibration.free_parameters import FreeParameters
from robotont_calibration.next_run import next_run
from robotont_calibration.trajectory import Trajectory
from robotont_calibration.wheel_estimation import calibrate
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_testing.robots import SHIPPED, UNEVEN_4
from robotont_testing.simulated_wheels import PERIOD, spin

OFF = (1.02, 0.97, [(1, 1.5)])  # radius 2 % too large, distance 3 % too small, one angle 1.5 degrees off
TRUE = true_of(SHIPPED, *OFF)


def errors_of(found, true):
    """What is wrong with a calibration: shares of the radius and of the largest distance, angles [rad]."""
    lengths = [np.max(np.divide(found.parameters[key], true[key])) - 1
               for key in ("wheelRadius", "wheelDistanceFromCenter")]
    return np.array([*lengths, *np.subtract(found.parameters["wheelRads"], true["wheelRads"])])


def calibrated(runs, wrong=SHIPPED, **free):
    return calibrate(list(runs), FreeParameters(wrong, **free))


@pytest.mark.parametrize("wrong", [SHIPPED, UNEVEN_4], ids=["3 wheels", "4 uneven wheels"])
def test_wrong_parameters_are_recovered(wrong):
    true = true_of(wrong, *OFF)
    found = calibrated(tracked_runs(true), wrong)
    lengths, angles = np.split(np.abs(errors_of(found, true)), [2])
    assert lengths.max() < 0.002
    assert angles.max() < math.radians(0.1)
    assert found.undetermined == ()
    assert found.wheel_noise == pytest.approx(NOISE, rel=0.3)


def test_stated_uncertainties_are_the_ones_that_there_are():
    """Of 20 robots 95 % of what is wrong lies within 1.96 stated deviations."""
    ratios = []
    for seed in range(20):
        radius, distance, *angles = np.random.default_rng(seed).normal(0.0, (0.02, 0.02, 1.0, 1.0, 1.0))
        true = true_of(SHIPPED, 1 + radius, 1 + distance, list(enumerate(angles)))
        found = calibrated(taped_runs(true, 1000 * seed))
        ratios.append(errors_of(found, true) / found.deviations)
    within = np.mean(np.abs(ratios) < 1.96)
    print(f"20 robots by tape: 95 % intervals hold {within:.1%} of the true values")
    assert 0.93 <= within <= 0.99


def test_an_outlying_run_loses_its_weight():
    """A robot that was lifted and set down elsewhere."""
    runs = list(taped_runs(TRUE))
    lifted = runs[1]._replace(poses=runs[1].poses + np.array(((0.0, 0.0, 0.0), (0.5, 0.3, 0.3))))
    found = calibrated([runs[0], lifted, *runs[2:], *taped_runs(TRUE, 50)])
    assert found.outlying == (lifted.name,)
    assert calibrated(runs).outlying == ()
    assert np.abs(errors_of(found, TRUE)[:2]).max() < 0.01


def test_runs_that_repeat_a_drive_are_found():
    assert calibration_runs.repeats([*taped_runs(SHIPPED), *taped_runs(SHIPPED, 50)]) == [
        [index, index + 6] for index in range(6)]


def test_the_run_that_is_advised_determines_most():
    """After lines only, a turn or a square; after a hundred of everything, nothing."""
    found = calibrated(list(taped_runs(SHIPPED))[4:])
    name, before, after = next_run(found)
    assert "sideways" not in name
    assert next_run(found, 4.0)[0] == "a square of 4 m, counterclockwise", "of the size that is asked for"
    assert after < before / 2
    assert next_run(calibrated(tracked_runs(SHIPPED, driven=drives(4)))) is None


def test_every_wheel_may_have_a_radius_of_its_own():
    true = {**SHIPPED, "wheelRadius": [SHIPPED["wheelRadius"] * factor for factor in (1.01, 1.0, 0.985)]}
    found = calibrated(tracked_runs(true), radius="each", angles="fixed")
    np.testing.assert_allclose(found.parameters["wheelRadius"], true["wheelRadius"], rtol=0.002)
    assert found.parameters["wheelRads"] == SHIPPED["wheelRads"]


def test_a_turn_on_the_spot_determines_no_radius_and_its_whole_turns_need_not_be_measured():
    """It determines radius over distance, neither of them alone, and no common turn of the angles."""
    counts, poses = recorded(SHIPPED, spin(6 * math.pi), 1, TAPE)
    run, wrapped = (taped_run("spin", counts, (*poses[-1, :2], yaw))
                    for yaw in (poses[-1, 2], math.remainder(poses[-1, 2], 2 * math.pi)))
    assert {"wheelRadius", "wheelDistanceFromCenter"} <= set(calibrated([run]).undetermined)
    one, other = (calibration_runs.errors_along(read_wheels(SHIPPED), each) for each in (run, wrapped))
    assert one == pytest.approx(other, abs=1e-9)


def test_nothing_to_calibrate_with():
    with pytest.raises(ValueError, match="found no run"):
        calibrated([])
    times, ones = np.arange(100) * PERIOD, np.ones((100, 3))
    for still_or_later_or_short in ((times, 0 * ones), (times + 50, ones), (times[:40], ones[:40])):
        with pytest.raises(ValueError, match="found no 1 s of packets with motion"):
            tracked_run("any", *still_or_later_or_short, Trajectory(times, 0 * ones))
