"""How uncertain the misfits of a run are: by the wheels on uneven floor, the measured poses and the encoders."""

import math
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve
from scipy.optimize import minimize

from robotont_calibration.calibration_runs import steps_of
from robotont_calibration.trajectory import seen_from
from robotont_driver.kinematics import se2
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.odometry.odometry import READING_VARIANCE, variance_per_edge

NOISE_TIE = np.log((3.0, 1.5))  # by what factors the wheels' noise and the measurement's may be off before the runs


class Spread(NamedTuple):
    """Covariances of the misfits of a run's L stretches, 3 L x 3 L each; only neighbouring stretches share errors."""

    wandering: np.ndarray  # of uneven floor, per square of the wheel noise: grows with the way
    measured: np.ndarray   # of the measured poses with their deviation as stated
    edges: np.ndarray      # of the encoders' readings at the marks

    def at(self, noise):
        """Their sum with (wheel noise [m] after 1 m, factor of the measurement's deviation)."""
        return noise[0] ** 2 * self.wandering + noise[1] ** 2 * self.measured + self.edges


def whitening(spread, noise):
    """3 L x 3 L matrix that makes the misfits of a run independent, with unit variance."""
    return np.linalg.inv(np.linalg.cholesky(spread.at(noise)))


def spread_of(wheels, run):
    """`Spread` of a run, along the way that the odometry with these wheels makes of it."""
    to_step = Kinematics(wheels).inverse * np.array(wheels.metres_per_edge)
    poses = np.vstack([np.zeros(3), se2.path(steps_of(wheels, run.counts))])
    variances = np.abs(run.counts) * variance_per_edge(1.0, wheels.metres_per_edge)  # [edges^2]
    stretches, marks = len(run.stretches), len(run.marks)
    wandering = []
    by_pose = np.zeros((stretches, 3, marks, 3))              # misfits by the errors of the measured poses ...
    by_reading = np.zeros((stretches, 3, marks, wheels.amount))  # ... and of the encoders' readings there
    for index, ((first, last), moved) in enumerate(zip(run.stretches, run.moved)):
        begin, end = run.marks[first], run.marks[last]
        by_wheel = _by_step(poses, begin, end) @ to_step  # K x 3 x n
        wandering.append(np.tensordot(by_wheel * variances[begin:end, None, :], by_wheel, axes=((0, 2), (0, 2))))
        cos, sin = math.cos(run.poses[first, 2]), math.sin(run.poses[first, 2])
        by_end = np.array(((cos, sin, 0.0), (-sin, cos, 0.0), (0.0, 0.0, 1.0)))
        by_pose[index, :, first] = -by_end + np.outer((moved[1], -moved[0], 0.0), (0.0, 0.0, 1.0))
        by_pose[index, :, last] = by_end
        by_reading[index, :, first], by_reading[index, :, last] = -by_wheel[0], by_wheel[-1]
    place, turned = run.deviation
    by_pose = by_pose.reshape(3 * stretches, -1) * np.tile((place, place, turned), marks)
    by_reading = by_reading.reshape(3 * stretches, -1)
    return Spread(block_diag(*wandering), by_pose @ by_pose.T, READING_VARIANCE * by_reading @ by_reading.T)


def likely_noise(spreads, left, weights, expected):
    """Likeliest (wheel noise, factor of the measurement's deviation) for the residuals `left`, tied to `expected`."""
    middle = np.log(expected)

    def unlikely(logarithms):
        """Twice the negative logarithm of the likelihood."""
        total = np.sum(((logarithms - middle) / NOISE_TIE) ** 2)
        for spread, misfit, weight in zip(spreads, left, weights):
            factor = cho_factor(spread.at(np.exp(logarithms)), lower=True)
            total += 2 * np.log(np.diag(factor[0])).sum() + weight * misfit.ravel() @ cho_solve(factor, misfit.ravel())
        return float(total)
    found = minimize(unlikely, middle, method="Nelder-Mead", options={"xatol": 0.02, "fatol": 0.01, "maxiter": 100})
    return np.exp(found.x)


def _by_step(poses, begin, end):
    """K x 3 x 3 derivatives of the motion from one of the poses to another by each step between them."""
    part = seen_from(np.broadcast_to(poses[begin], (end - begin, 3)), poses[begin + 1:end + 1])
    lever = part[-1, :2] - part[:, :2]  # a turn at the pose k moves the end by lever x turn
    jacobians = np.zeros((len(part), 3, 3))
    jacobians[:, 0, 0] = jacobians[:, 1, 1] = np.cos(part[:, 2])
    jacobians[:, 1, 0] = np.sin(part[:, 2])
    jacobians[:, 0, 1] = -jacobians[:, 1, 0]
    jacobians[:, 0, 2], jacobians[:, 1, 2], jacobians[:, 2, 2] = -lever[:, 1], lever[:, 0], 1.0
    return jacobians
