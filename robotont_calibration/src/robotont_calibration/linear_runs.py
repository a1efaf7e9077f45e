"""Runs around some values of the parameters: misfits, their derivatives, and how uncertain they are.

What makes them uncertain: the wheels on uneven floor, the measured poses and the encoders.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve, solve_triangular
from scipy.optimize import minimize

from robotont_calibration.calibration_runs import to_step
from robotont_calibration.trajectory import seen_from
from robotont_driver.kinematics import se2
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.odometry.odometry import READING_VARIANCE, variance_per_edge

NOISE_TIE = np.log((3.0, 1.5))  # by what factors the wheels' noise and the measurement's may be off before the runs
STEP = 1e-6                     # of a value, for the derivatives of the kinematics


class LinearRun(NamedTuple):
    """A run of L stretches around some values: misfits and covariances; only neighbouring stretches share errors."""

    left: np.ndarray       # 3 L misfits (x [m], y [m], yaw [rad] within half a turn) of the counts' motions
    slopes: np.ndarray     # 3 L x P their derivatives by the values
    wandering: np.ndarray  # 3 L x 3 L of uneven floor, per square of the wheel noise: grows with the way
    measured: np.ndarray   # 3 L x 3 L of the measured poses with their deviation as stated
    edges: np.ndarray      # 3 L x 3 L of the encoders' readings at the marks

    def factor(self, noise):
        """Cholesky factor of the covariance with (wheel noise [m] after 1 m, factor of the measurement's deviation)."""
        return cho_factor(noise[0] ** 2 * self.wandering + noise[1] ** 2 * self.measured + self.edges, lower=True,
                          check_finite=False)

    def whitened(self, noise, weight):
        """(misfits, derivatives) in standard deviations, and the logarithm of the covariance's determinant."""
        triangle = self.factor(noise)[0]
        both = math.sqrt(weight) * solve_triangular(triangle, np.column_stack([self.left, self.slopes]), lower=True)
        return both[:, 0], both[:, 1:], 2 * np.log(np.diag(triangle)).sum() - len(both) * math.log(weight)


def linear_runs(free, values, runs):
    """`LinearRun` of each `Run` at `values` of the `FreeParameters`."""
    def wheels(step=0.0):
        return read_wheels(free.parameters(values + step))
    by_value = np.array([(to_step(wheels(step)) - to_step(wheels(-step))) / (2 * STEP)
                         for step in STEP * np.eye(len(values))])  # P x 3 x n
    return [_linear(run, wheels(), by_value, np.array(free.point(values)), "point x" in free.names) for run in runs]


def _linear(run, wheels, by_value, point, looked_for):
    steps = to_step(wheels)
    poses = np.vstack([np.zeros(3), se2.path(run.counts @ steps.T)])
    variances = np.abs(run.counts) * variance_per_edge(1.0, wheels.metres_per_edge)  # [edges^2]
    stretches, marks, left, slopes, wandering = len(run.stretches), len(run.marks), [], [], []
    by_pose = np.zeros((stretches, 3, marks, 3))              # misfits by the errors of the measured poses ...
    by_reading = np.zeros((stretches, 3, marks, wheels.amount))  # ... and of the encoders' readings there
    for index, ((first, last), moved) in enumerate(zip(run.stretches, run.moved)):
        begin, end = run.marks[first], run.marks[last]
        motion, by_step = _motion(poses[begin:end + 1])
        cos, sin = math.cos(motion[2]), math.sin(motion[2])
        swing = np.array(((cos - 1, -sin), (sin, cos - 1)))  # a turn carries the point along
        motion[:2] += swing @ point
        by_step[:, :2, 2] += (-sin * point[0] - cos * point[1], cos * point[0] - sin * point[1])
        left.append(motion - moved)
        by_values = np.tensordot(np.tensordot(by_step, run.counts[begin:end], (0, 0)), by_value, ((1, 2), (1, 2)))
        if looked_for:
            by_values[:2, -2:] = swing
        slopes.append(by_values)
        by_wheel = np.dot(by_step, steps)  # K x 3 x n
        wandering.append(np.tensordot(by_wheel * variances[begin:end, None, :], by_wheel, axes=((0, 2), (0, 2))))
        cos, sin = math.cos(run.poses[first, 2]), math.sin(run.poses[first, 2])
        by_end = np.array(((cos, sin, 0.0), (-sin, cos, 0.0), (0.0, 0.0, 1.0)))
        by_pose[index, :, first] = -by_end + np.outer((moved[1], -moved[0], 0.0), (0.0, 0.0, 1.0))
        by_pose[index, :, last] = by_end
        by_reading[index, :, first], by_reading[index, :, last] = -by_wheel[0], by_wheel[-1]
    left = np.array(left)
    left[:, 2] = se2.wrap(left[:, 2])
    place, turned = run.deviation
    by_pose = by_pose.reshape(3 * stretches, -1) * np.tile((place, place, turned), marks)
    by_reading = by_reading.reshape(3 * stretches, -1)
    return LinearRun(left.ravel(), np.concatenate(slopes), block_diag(*wandering), by_pose @ by_pose.T,
                     READING_VARIANCE * by_reading @ by_reading.T)


def _motion(poses):
    """(motion from the first to the last of K + 1 poses, K x 3 x 3 derivatives of it by each step between them)."""
    middles = (poses[1:] + poses[:-1]) / 2
    seen = seen_from(np.tile(poses[0], (len(poses), 1)), np.vstack([middles, poses[-1]]))
    parts, end = seen[:-1], seen[-1]
    lever = end[:2] - parts[:, :2]  # a turn about the middle of a step moves the end by lever x turn
    jacobians = np.zeros((len(parts), 3, 3))
    jacobians[:, 0, 0] = jacobians[:, 1, 1] = np.cos(parts[:, 2])
    jacobians[:, 1, 0] = np.sin(parts[:, 2])
    jacobians[:, 0, 1] = -jacobians[:, 1, 0]
    jacobians[:, 0, 2], jacobians[:, 1, 2], jacobians[:, 2, 2] = -lever[:, 1], lever[:, 0], 1.0
    return end, jacobians


def likely_noise(models, weights, expected, start):
    """Likeliest (wheel noise, factor of the measurement's deviation) of `LinearRun`s, tied to `expected`."""
    middle = np.log(expected)

    def unlikely(logarithms):
        """Twice the negative logarithm of the likelihood."""
        total = np.sum(((logarithms - middle) / NOISE_TIE) ** 2)
        for model, weight in zip(models, weights):
            factor = model.factor(np.exp(logarithms))
            solved = cho_solve(factor, model.left, check_finite=False)
            total += 2 * np.log(np.diag(factor[0])).sum() + weight * model.left @ solved
        return float(total)
    found = minimize(unlikely, np.log(start), method="Nelder-Mead",
                     options={"xatol": 0.02, "fatol": 0.01, "maxiter": 100})
    return tuple(np.exp(found.x).tolist())
