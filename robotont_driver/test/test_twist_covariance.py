"""The covariance of the twist is true."""

import numpy as np
from scipy.stats import chi2

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheels import read_wheels
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_testing.robots import SHIPPED
from robotont_testing.simulated_wheels import PERIOD, counted, rolled

WHEELS = read_wheels(SHIPPED)
TWIST = (0.213, -0.117, 0.31)


def newest(twists, runs=300, noise=0.005):
    """(errors K x 3 against the newest twist, covariances K x 3 x 3)."""
    generator = np.random.default_rng(1)
    errors, covariances = [], []
    for _ in range(runs):
        odometry = WheelOdometry(Kinematics(WHEELS), PERIOD, noise)
        for counts in counted(WHEELS, rolled(WHEELS, twists), noise, generator).tolist():
            odometry.update(counts, 0.0)
        errors.append(np.subtract(odometry.twist, twists[-1]))
        covariances.append(odometry.twist_covariance.matrix)
    return np.array(errors), np.array(covariances)


def test_the_covariance_is_true_at_constant_speed():
    errors, covariances = newest(np.tile(TWIST, (30, 1)))
    value = np.mean([error @ np.linalg.solve(covariance, error) for error, covariance in zip(errors, covariances)])
    low, high = chi2.ppf((0.0005, 0.9995), 3 * len(errors)) / len(errors)
    print(f"{1000 * errors[:, 0].std():.2f} mm/s, mean normalised error squared {value:.2f}")
    assert 0.85 * low < value < 1.15 * high  # errors of readings are uniform, not normal
