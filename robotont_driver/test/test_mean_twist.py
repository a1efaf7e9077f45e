"""The mean twist over a window: calmer, with a covariance that is true, and one that covers its lag."""

import numpy as np
import pytest
from scipy.stats import chi2

from robotont_driver.kinematics import Kinematics
from robotont_driver.odometry import WheelOdometry
from robotont_driver.wheels import read_wheels
from robotont_testing.robots import SHIPPED
from robotont_testing.simulated_wheels import PERIOD, counted, rolled

WHEELS = read_wheels(SHIPPED)
TWIST = (0.213, -0.117, 0.31)


def newest(twists, window, runs=300, noise=0.005):
    """(errors K x 3 against the newest twist, covariances K x 3 x 3)."""
    generator = np.random.default_rng(1)
    errors, covariances = [], []
    for _ in range(runs):
        odometry = WheelOdometry(Kinematics(WHEELS), PERIOD, noise, window)
        for counts in counted(WHEELS, rolled(WHEELS, twists), noise, generator).tolist():
            odometry.update(counts, 0.0)
        errors.append(np.subtract(odometry.twist, twists[-1]))
        covariances.append(odometry.twist_covariance.matrix)
    return np.array(errors), np.array(covariances)


@pytest.mark.parametrize("window", [0.0, 0.1, 0.3])
def test_the_covariance_is_true_at_constant_speed(window):
    errors, covariances = newest(np.tile(TWIST, (30, 1)), window)
    value = np.mean([error @ np.linalg.solve(covariance, error) for error, covariance in zip(errors, covariances)])
    low, high = chi2.ppf((0.0005, 0.9995), 3 * len(errors)) / len(errors)
    print(f"window {window} s: {1000 * errors[:, 0].std():.2f} mm/s, mean normalised error squared {value:.2f}")
    assert 0.85 * low < value < 1.15 * high  # errors of readings are uniform, not normal


def test_a_window_makes_the_speed_calm():
    alone, mean = (newest(np.tile(TWIST, (30, 1)), window, noise=0.0)[0].std(axis=0) for window in (0.0, 0.2))
    assert np.all(mean < 0.15 * alone)


def test_while_speeding_up_the_covariance_covers_the_lag():
    twists = np.linspace(0.0, 1.0, 50)[:, None] * (1.0, 0.0, 0.0)
    errors, covariances = newest(twists, 0.2, runs=50)
    assert errors[:, 0].mean() < -0.05  # the mean is that of 0.1 s before
    assert np.all(np.abs(errors[:, 0]) < 3 * np.sqrt(covariances[:, 0, 0]))


def test_after_a_stop_it_is_zero_once_the_window_has_passed():
    odometry = WheelOdometry(Kinematics(WHEELS), PERIOD, 0.005, 0.2)
    for counts in [(30, 0, -30)] * 20 + [(0, 0, 0)] * 10:
        odometry.update(counts, 0.0)
    np.testing.assert_allclose(odometry.twist, 0.0, atol=1e-12)
    assert np.all(np.linalg.eigvalsh(odometry.twist_covariance.matrix) > 0)
