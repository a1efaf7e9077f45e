"""Calibration on synthetic runs: wheels that differ from the parameters, with noise, and measured poses."""

import math

import numpy as np
import pytest
from synthetic_runs import (
    NOISE,
    TAPE,
    TRACKED,
    recorded,
    taped_runs,
    tracked_runs,
    true_of,
)

from robotont_calibration.calibration_runs import (
    end_misfit,
    errors_along,
    misfits,
    poses_at_marks,
    repeats,
    taped_run,
    tracked_run,
    turns,
)
from robotont_calibration.cross_validation import cross_validate, next_run
from robotont_calibration.free_parameters import FreeParameters
from robotont_calibration.trajectory import Trajectory
from robotont_calibration.wheel_estimation import calibrate
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_testing.robots import SHIPPED, UNEVEN_4
from robotont_testing.simulated_wheels import PERIOD, path_of, spin, square

DOUBLED = 0.01            # [m] after 1 m: twice the wheel noise of driver.yaml
MARKER = (0.03, -0.0335)  # [m] 45 mm off the middle


def umbmark(parameters, true, noise=NOISE):
    """[m] UMBmark's E_max,syst of odometry with `parameters` on a `true` robot.

    Five squares of 4 m each way; of the two mean end errors the one farther from zero.
    """
    means = []
    for turn in (1, -1):
        exact = tuple(path_of(square(4.0, turn))[-1])
        means.append(np.mean([
            end_misfit(read_wheels(parameters), taped_run("square", counts, exact, TRACKED))
            for counts, _ in (recorded(true, square(4.0, turn), seed, TRACKED, noise) for seed in range(100, 105))],
            axis=0))
    return max(math.hypot(x, y) for x, y, _ in means)


def errors_of(found, true, point=()):
    """What is wrong with a calibration: shares of radius and distance, angles [rad], the point [m] if there is one."""
    return np.array([found.parameters["wheelRadius"] / true["wheelRadius"] - 1,
                     found.parameters["wheelDistanceFromCenter"] / true["wheelDistanceFromCenter"] - 1,
                     *np.subtract(found.parameters["wheelRads"], true["wheelRads"]),
                     *(np.subtract(found.point, point) if point else ())])


@pytest.mark.parametrize("wrong", [SHIPPED, UNEVEN_4], ids=["3 wheels", "4 uneven wheels"])
def test_wrong_parameters_are_recovered(wrong):
    """Radius 2 % too large, distance 3 % too small, one angle 1.5 degrees off."""
    true = true_of(wrong, 1.02, 0.97, [(1, 1.5)])
    found = calibrate(wrong, tracked_runs(true), FreeParameters(wrong), NOISE)
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


@pytest.mark.parametrize("make, point", [
    (lambda true, seed: taped_runs(true, seed), ()),
    pytest.param(lambda true, seed: tracked_runs(true, seed, DOUBLED, MARKER), MARKER, marks=pytest.mark.long),
], ids=["by tape", "tracked, doubled noise, a point off the middle"])
def test_stated_uncertainties_are_the_ones_that_there_are(make, point):
    """Over 16 calibrations, errors over stated deviations have a root mean square of about one."""
    true = true_of(SHIPPED, 1.01, 0.98, [(0, 1.0)])
    ratios = []
    for seed in range(16):
        free = FreeParameters(SHIPPED, point="free" if point else (0, 0))
        found = calibrate(SHIPPED, make(true, 1000 * seed), free, 0.003)
        ratios.append(errors_of(found, true, point) / found.deviations)
    spread = np.sqrt(np.mean(np.square(ratios), axis=0))
    print("errors over stated deviations:", np.round(spread, 2), "all:", np.sqrt(np.mean(np.square(ratios))).round(2))
    assert 0.8 < np.sqrt(np.mean(np.square(ratios))) < 1.2
    assert spread.min() > 0.5  # 16 samples: three standard deviations of 18 %
    assert spread.max() < 1.5


def allowed_by_information(found, true, amount=4000):
    """[m] E_max,syst of so many calibrations whose errors have the covariance of `found`, the least that there can be.

    Its covariance is the inverse of the information in the runs (Cramér and Rao), for parameters close to `true`.
    """
    def ends(errors):
        radius, distance, *angles = errors
        wheels = read_wheels({
            **true, "wheelRadius": true["wheelRadius"] * (1 + radius),
            "wheelDistanceFromCenter": np.multiply(true["wheelDistanceFromCenter"], 1 + distance).tolist(),
            "wheelRads": np.add(true["wheelRads"], angles).tolist()})
        return np.concatenate([end_misfit(wheels, run)[:2] for run in runs])
    runs = [taped_run("square", recorded(true, square(4.0, turn), 0, TRACKED, 0.0)[0],
                      tuple(path_of(square(4.0, turn))[-1]), TRACKED) for turn in (1, -1)]
    steps = 1e-4 * np.eye(5)
    slopes = np.column_stack([(ends(step) - ends(-step)) / 2e-4 for step in steps])
    errors = np.random.default_rng(0).multivariate_normal(np.zeros(5), found.covariance[:5, :5], amount) @ slopes.T
    return np.hypot(errors.reshape(-1, 2, 2)[..., 0], errors.reshape(-1, 2, 2)[..., 1]).max(axis=1)


def test_a_point_off_the_middle_and_doubled_noise():
    """UMBmark's systematic error is cut as far as the runs' information allows; the point within 2 mm.

    The aim is 98 %. With wheels as noisy as these the 30 runs do not hold enough for it: an ideal calibration cuts half
    of the time by less than 97 %. Four times as many runs do.
    """
    true = true_of(SHIPPED, 1.02, 0.97, [(1, 1.5)])
    runs = tracked_runs(true, 7, DOUBLED, MARKER, times=5)
    found = calibrate(SHIPPED, runs, FreeParameters(SHIPPED, point="free"), 0.003)
    before, after = umbmark(SHIPPED, true, 0.0), umbmark(found.parameters, true, 0.0)
    allowed = allowed_by_information(found, true)
    cuts = 1 - np.percentile(allowed, (50, 95)) / before
    off = math.hypot(*np.subtract(found.point, MARKER))
    print(f"UMBmark {1000 * before:.0f} mm before, {1000 * after:.0f} mm after, cut by {1 - after / before:.2%}; "
          f"the runs allow {cuts[0]:.2%} half of the time and {cuts[1]:.2%} in 95 % of all cases; "
          f"point {1000 * off:.1f} mm off, stated {1000 * found.deviations[-2:]} mm")
    assert after < np.percentile(allowed, 99)
    assert cuts[0] < 0.98 < 1 - np.median(allowed) / math.sqrt(4) / before  # errors fall with the root of the runs
    assert off < 0.002


@pytest.mark.long
@pytest.mark.parametrize("seed", [7, 1007, 2007])
def test_enough_runs_cut_umbmark_by_98_percent(seed):
    """80 runs of each drive, two and a half hours of driving; and with many runs the result does not get worse."""
    true = true_of(SHIPPED, 1.02, 0.97, [(1, 1.5)])
    runs = tracked_runs(true, seed, DOUBLED, MARKER, times=80)
    found = calibrate(SHIPPED, runs, FreeParameters(SHIPPED, point="free"), 0.003)
    before, after = umbmark(SHIPPED, true, 0.0), umbmark(found.parameters, true, 0.0)
    off = math.hypot(*np.subtract(found.point, MARKER))
    print(f"UMBmark {1000 * before:.0f} mm before, {1000 * after:.0f} mm after, cut by {1 - after / before:.2%}; "
          f"point {1000 * off:.2f} mm off")
    assert after < 0.02 * before
    assert off < 0.002


def test_an_outlying_run_loses_its_weight():
    """A robot that was lifted and set down elsewhere."""
    true = true_of(SHIPPED, 1.02, 0.97, [(1, 1.5)])
    runs = taped_runs(true)
    clean = calibrate(SHIPPED, runs, FreeParameters(SHIPPED), 0.003)
    lifted = runs[1]._replace(poses=runs[1].poses + np.array(((0.0, 0.0, 0.0), (0.5, 0.3, 0.3))))
    found = calibrate(SHIPPED, [runs[0], lifted, *runs[2:], *taped_runs(true, 50)], FreeParameters(SHIPPED), 0.003)
    assert found.outlying == (lifted.name,)
    assert clean.outlying == ()
    assert np.abs(errors_of(found, true)[:2]).max() < 0.01


def test_runs_left_out_together_repeat_the_same_drive():
    runs = taped_runs(SHIPPED) + taped_runs(SHIPPED, 50)
    assert repeats(runs) == [[index, index + 6] for index in range(6)]
    found = calibrate(SHIPPED, runs, FreeParameters(SHIPPED), 0.003)
    blind = cross_validate(SHIPPED, runs, FreeParameters(SHIPPED), 0.003, found)
    fitted = np.mean([errors_along(read_wheels(found.parameters), run)[0] for run in runs])
    assert fitted < blind.place < 10 * fitted
    assert cross_validate(SHIPPED, [runs[0], runs[6]], FreeParameters(SHIPPED), 0.003, found) is None


def test_the_run_that_is_advised_determines_most():
    """After lines only, a turn or a square; after a hundred of everything, nothing."""
    lines = taped_runs(SHIPPED)[4:]
    unknowns = FreeParameters(SHIPPED)
    found = calibrate(SHIPPED, lines, unknowns, 0.003)
    advice = next_run(found, unknowns, TAPE)
    assert "sideways" not in advice.name
    assert advice.then < advice.now / 2
    known = calibrate(SHIPPED, tracked_runs(SHIPPED, times=4), unknowns, 0.003)
    assert next_run(known, unknowns, TAPE) is None


def test_only_turns_determine_where_the_point_is():
    runs = tracked_runs(SHIPPED)
    assert turns(runs)
    assert not turns(runs[4:])


def test_every_wheel_may_have_a_radius_of_its_own():
    wheels = [1.01, 1.0, 0.985]
    true = {**SHIPPED, "wheelRadius": [SHIPPED["wheelRadius"] * factor for factor in wheels]}
    found = calibrate(SHIPPED, tracked_runs(true), FreeParameters(SHIPPED, radius="each", angles="fixed"), NOISE)
    np.testing.assert_allclose(found.parameters["wheelRadius"], true["wheelRadius"], rtol=0.002)
    assert found.parameters["wheelRads"] == SHIPPED["wheelRads"]


def test_parameters_that_the_runs_do_not_determine_are_named():
    """Turning on the spot determines radius over distance, neither of them alone, and no common turn of the angles."""
    counts, poses = recorded(SHIPPED, spin(6 * math.pi), 1, TAPE)
    found = calibrate(SHIPPED, [taped_run("spin", counts, poses[-1], TAPE)], FreeParameters(SHIPPED), NOISE)
    assert {"wheelRadius", "wheelDistanceFromCenter"} <= set(found.undetermined)


def test_whole_turns_need_not_be_measured():
    counts, poses = recorded(SHIPPED, spin(6 * math.pi), 1, TAPE)
    wrapped = (*poses[-1, :2], math.remainder(poses[-1, 2], 2 * math.pi))
    one, other = (
        misfits(read_wheels(SHIPPED), taped_run("spin", counts, moved, TAPE)) for moved in (wrapped, poses[-1]))
    np.testing.assert_allclose(one, other, atol=1e-9)


def test_the_end_pose_is_that_of_the_odometry():
    wheels = read_wheels(UNEVEN_4)
    counts = np.random.default_rng(5).integers(-60, 60, (500, 4))
    odometry = WheelOdometry(Kinematics(wheels), PERIOD, NOISE)
    for packet in counts.tolist():
        odometry.update(packet, PERIOD)
    x, y, yaw = poses_at_marks(wheels, taped_run("any", counts, (0, 0, 0), TAPE))[-1]
    assert (x, y) == pytest.approx((odometry.pose.x, odometry.pose.y), abs=1e-9)
    assert math.remainder(yaw - odometry.pose.yaw, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_nothing_to_calibrate_with():
    with pytest.raises(ValueError, match="found no run"):
        calibrate(SHIPPED, [], FreeParameters(SHIPPED), NOISE)
    times = np.arange(10) * PERIOD
    truth = Trajectory(times, np.zeros((10, 3)))
    with pytest.raises(ValueError, match="found no packets with motion"):
        tracked_run("still", times, np.zeros((10, 3)), truth, 0.1, TAPE)
    with pytest.raises(ValueError, match="found no packets with motion"):
        tracked_run("later", times + 50, np.ones((10, 3)), truth, 0.1, TAPE)
