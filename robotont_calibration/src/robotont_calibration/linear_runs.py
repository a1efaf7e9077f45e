"""Runs around some values of the parameters: misfits, their derivatives, and how uncertain they are.

What makes them uncertain: the wheels on uneven floor, the measured poses and the encoders.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, cholesky, solve_triangular
from scipy.optimize import minimize

from robotont_calibration.calibration_runs import odometry, to_step
from robotont_driver.kinematics import se2
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.odometry.odometry import READING_VARIANCE, variance_per_edge

NOISE = (0.003, 1.0)            # before the runs: wheel noise [m] after 1 m, factor of the measurement's deviation, ...
NOISE_TIE = np.log((3.0, 1.5))  # ... and by what factors they may be off
STEP = 1e-6                     # of a value, for the derivatives of the kinematics


class LinearRun(NamedTuple):
    """A run of L stretches around some values: misfits and covariances; only neighbouring stretches share errors."""

    left: np.ndarray       # 3 L misfits (x [m], y [m], yaw [rad] within half a turn) of the counts' motions
    slopes: np.ndarray     # 3 L x P their derivatives by the values
    wandering: np.ndarray  # 3 L x 3 L of uneven floor, per square of the wheel noise: grows with the way
    measured: np.ndarray   # 3 L x 3 L of the measured poses with their deviation as stated
    edges: np.ndarray      # 3 L x 3 L of the encoders' readings at the marks

    def whitened(self, noise, weight):
        """(misfits, derivatives) in standard deviations, and the logarithm of the covariance's determinant.

        noise: as `NOISE`.
        """
        triangle = cholesky(noise[0] ** 2 * self.wandering + noise[1] ** 2 * self.measured + self.edges, lower=True)
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
    steps, poses, points = to_step(wheels), odometry(wheels, run.counts), odometry(wheels, run.counts, point)[run.marks]
    motions, moved = (np.transpose(se2.between(along[run.stretches].T, along[run.stretches + 1].T))
                      for along in (points, run.poses))
    variances = np.abs(run.counts) * variance_per_edge(1.0, wheels.metres_per_edge)  # [edges^2]
    stretches, marks, slopes, wandering = len(run.stretches), len(run.marks), [], []
    by_pose = np.zeros((stretches, 3, marks, 3))              # misfits by the errors of the measured poses ...
    by_reading = np.zeros((stretches, 3, marks, wheels.amount))  # ... and of the encoders' readings there
    for index, (first, motion) in enumerate(zip(run.stretches, motions)):
        begin, end = run.marks[first:first + 2]
        by_step = _by_step(points[first], poses[begin:end + 1], motion)
        by_values = np.tensordot(np.tensordot(by_step, run.counts[begin:end], (0, 0)), by_value, ((1, 2), (1, 2)))
        if looked_for:  # a turn carries the point along
            cos, sin = math.cos(motion[2]), math.sin(motion[2])
            by_values[:2, -2:] = (cos - 1, -sin), (sin, cos - 1)
        slopes.append(by_values)
        by_wheel = np.dot(by_step, steps)  # K x 3 x n
        wandering.append(np.tensordot(by_wheel * variances[begin:end, None, :], by_wheel, axes=((0, 2), (0, 2))))
        cos, sin = math.cos(run.poses[first, 2]), math.sin(run.poses[first, 2])
        by_end = np.array(((cos, sin, 0.0), (-sin, cos, 0.0), (0.0, 0.0, 1.0)))
        by_pose[index, :, first] = -by_end
        by_pose[index, :2, first, 2] += moved[index, 1], -moved[index, 0]
        by_pose[index, :, first + 1] = by_end
        by_reading[index, :, first], by_reading[index, :, first + 1] = -by_wheel[0], by_wheel[-1]
    left = motions - moved
    left[:, 2] = se2.wrap(left[:, 2])
    place, turned = run.deviation
    by_pose = by_pose.reshape(3 * stretches, -1) * np.tile((place, place, turned), marks)
    by_reading = by_reading.reshape(3 * stretches, -1)
    return LinearRun(left.ravel(), np.concatenate(slopes), block_diag(*wandering), by_pose @ by_pose.T,
                     READING_VARIANCE * by_reading @ by_reading.T)


def _by_step(start, poses, motion):
    """K x 3 x 3 derivatives of a point's motion, seen from its pose `start`, by each step between K + 1 `poses`."""
    x, y, yaw = se2.between(start, ((poses[1:] + poses[:-1]) / 2).T)
    cos, sin, none, one = np.cos(yaw), np.sin(yaw), np.zeros_like(yaw), np.ones_like(yaw)
    # a turn about the middle of a step moves the end by lever x turn
    return np.moveaxis([(cos, -sin, y - motion[1]), (sin, cos, motion[0] - x), (none, none, one)], -1, 0)


def likely_noise(models, weights, start):
    """Likeliest (wheel noise, factor of the measurement's deviation) of `LinearRun`s, tied to `NOISE`."""
    def unlikely(logarithms):
        """Twice the negative logarithm of the likelihood."""
        total = np.sum(((logarithms - np.log(NOISE)) / NOISE_TIE) ** 2)
        for model, weight in zip(models, weights):
            left, _, constant = model.whitened(np.exp(logarithms), weight)
            total += left @ left + constant
        return float(total)
    found = minimize(unlikely, np.log(start), method="Nelder-Mead",
                     options={"xatol": 0.02, "fatol": 0.01, "maxiter": 100})
    return tuple(np.exp(found.x).tolist())
