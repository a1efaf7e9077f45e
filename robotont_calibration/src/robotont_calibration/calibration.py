"""Wheel parameters from recorded runs, by non-linear least squares over where the counts lead.

A stretch is a list of packets and how the robot really moved meanwhile. What the counts make of it with some
parameters is compared with that, in units of what the measurement and the wheels' noise explain. Each
parameter also keeps near its old value, loosely: where the runs say nothing of it, it stays.
"""

import math
from typing import NamedTuple, Tuple

import numpy as np
from scipy.optimize import least_squares

from robotont_driver import se2
from robotont_driver.kinematics import Kinematics
from robotont_driver.wheel_noise import PATH_VARIANCE, variance_per_edge
from robotont_driver.wheels import read_wheels

# How far off a parameter may be before the runs: standard deviations of the loose tie to its old value.
RADIUS_TIE = 0.1    # part of the radius
DISTANCE_TIE = 0.1  # part of the distance
ANGLE_TIE = 0.2     # [rad]
DETERMINED = 0.3    # a parameter counts as determined when the runs leave less than this part of the tie
PASSES = 3          # fits, each with the noise along the way that the one before has found


class Stretch(NamedTuple):
    """What the wheels counted on a stretch of way, and how the robot really moved."""

    counts: np.ndarray                   # K x n [edges]
    moved: Tuple[float, float, float]    # end seen from the start: x [m], y [m], yaw [rad], whole turns left aside
    deviation: Tuple[float, float]       # standard deviations of start and end as measured: place [m], yaw [rad]


class Unknowns:
    """Which wheel parameters are looked for, as small numbers that are 0 for the old values.

    given: mapping with the keys of wheel_params.yaml. radius: "common" (one factor for all), "each" or "fixed".
    distance: "common" or "fixed". angles: "each" or "fixed". Raises ValueError when nothing is left to look for.
    """

    def __init__(self, given, radius="common", distance="common", angles="each"):
        amount = given["wheelAmount"]
        self._given = given
        self._radii = {"common": 1, "each": amount, "fixed": 0}[radius]
        self._distances = {"common": 1, "fixed": 0}[distance]
        self._angles = {"each": amount, "fixed": 0}[angles]
        self.names = [
            *(["wheelRadius"] if self._radii == 1 else [f"wheelRadius[{wheel}]" for wheel in range(self._radii)]),
            *["wheelDistanceFromCenter"][:self._distances],
            *(f"wheelRads[{wheel}]" for wheel in range(self._angles)),
        ]
        self.ties = np.array([RADIUS_TIE] * self._radii + [DISTANCE_TIE] * self._distances + [ANGLE_TIE] * self._angles)
        if not self.names:
            raise ValueError("found radius, distance and angles all fixed, allowed: at least one that is not")

    def parameters(self, values):
        """The mapping with these `values`: parts by which radii and distance are larger, [rad] added to angles."""
        given = dict(self._given)
        radii, distance, angles = np.split(np.asarray(values), [self._radii, self._radii + self._distances])
        if len(radii):
            given["wheelRadius"] = _scaled(given["wheelRadius"], 1 + radii)
        if len(distance):
            given["wheelDistanceFromCenter"] = _scaled(given["wheelDistanceFromCenter"], 1 + distance)
        if len(angles):
            given["wheelRads"] = [float(rad + added) for rad, added in zip(given["wheelRads"], angles)]
        return given


def _scaled(value, factors):
    """A number or list times factors, one or one per wheel; a number stays one where it can."""
    scaled = np.asarray(value, dtype=float) * factors
    return scaled.tolist() if isinstance(value, (list, tuple)) or len(factors) > 1 else float(scaled[0])


class Calibration(NamedTuple):
    """What `calibrate` found."""

    parameters: dict            # with the keys of wheel_params.yaml
    names: Tuple[str, ...]      # of what was looked for
    values: np.ndarray          # as in Unknowns.parameters
    deviations: np.ndarray      # their standard deviations
    undetermined: Tuple[str, ...]  # names of what the runs say little or nothing of
    wheel_noise: float          # [m] after 1 m that explains what remains


def calibrate(given, stretches, unknowns, wheel_noise):
    """`Calibration` from stretches.

    given: mapping with the keys of wheel_params.yaml, the old values. wheel_noise: standard deviation [m]
    of a wheel's path after 1 m. Raises ParameterError for wrong old values, ValueError without stretches.
    """
    if not stretches:
        raise ValueError("found no stretch of way to calibrate with")
    values = np.zeros(len(unknowns.names))
    for _ in range(PASSES):
        found = _fit(stretches, unknowns, wheel_noise, values)
        values = found.x
    freedom = 3 * len(stretches) - len(unknowns.names)
    spread = math.sqrt(np.sum(found.fun[:3 * len(stretches)] ** 2) / freedom) if freedom > 0 else 1.0
    deviations = np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)))
    undetermined = tuple(
        name for name, left, tie in zip(unknowns.names, deviations, unknowns.ties) if left > DETERMINED * tie)
    return Calibration(unknowns.parameters(found.x), tuple(unknowns.names), found.x,
                       deviations * max(1.0, spread), undetermined, wheel_noise * spread)


def _fit(stretches, unknowns, wheel_noise, start):
    """Scipy's result: least squares of all misfits and ties, the noise taken along the way that `start` gives."""
    wheels = read_wheels(unknowns.parameters(start))
    whiten = [_whitening(wheels, stretch, wheel_noise) for stretch in stretches]

    def misfits(values):
        """What is left of each stretch (3 numbers) in standard deviations, and the ties."""
        now = read_wheels(unknowns.parameters(values))
        left = [matrix @ misfit(now, stretch) for matrix, stretch in zip(whiten, stretches)]
        return np.concatenate([*left, values / unknowns.ties])
    return least_squares(misfits, start, x_scale=unknowns.ties)


def misfit(wheels, stretch):
    """(x [m], y [m], yaw [rad]) by which the counts lead elsewhere than the robot went; yaw within half a turn."""
    difference = end_pose(wheels, stretch.counts) - stretch.moved
    difference[2] = se2.wrap(difference[2])
    return difference


def end_pose(wheels, counts):
    """(x [m], y [m], yaw [rad]) of K x n counts [edges] from the origin; yaw is not wrapped."""
    return se2.path(_steps(wheels, counts))[-1]


def _steps(wheels, counts):
    """K x 3 steps in base_link, formulas (8)-(11)."""
    return (counts * np.array(wheels.metres_per_edge)) @ Kinematics(wheels).inverse.T


def _whitening(wheels, stretch, wheel_noise):
    """3 x 3 matrix that makes the misfit of a stretch unit noise: of the measurement, the wheels and the edges."""
    to_step = Kinematics(wheels).inverse * np.array(wheels.metres_per_edge)
    poses = se2.path(_steps(wheels, stretch.counts))
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    lever = poses[-1, :2] - poses[:, :2]  # a turn at the pose k moves the end by lever x turn
    jacobians = np.zeros((len(poses), 3, 3))  # of the end by step k, in base_link
    jacobians[:, 0, 0], jacobians[:, 0, 1], jacobians[:, 0, 2] = cos, -sin, -lever[:, 1]
    jacobians[:, 1, 0], jacobians[:, 1, 1], jacobians[:, 1, 2] = sin, cos, lever[:, 0]
    jacobians[:, 2, 2] = 1.0
    by_wheel = jacobians @ to_step  # K x 3 x n
    variances = np.abs(stretch.counts) * variance_per_edge(wheel_noise, wheels.metres_per_edge)  # [edges^2]
    covariance = np.einsum("kin,kn,kjn->ij", by_wheel, variances, by_wheel)
    covariance += PATH_VARIANCE * to_step @ to_step.T
    place, yaw = stretch.deviation
    x, y, _ = stretch.moved
    start = np.array((y, -x, -1.0)) * yaw  # a start that looks elsewhere than measured turns the end
    covariance += np.diag([2 * place ** 2, 2 * place ** 2, yaw ** 2]) + np.outer(start, start)
    return np.linalg.inv(np.linalg.cholesky(covariance))


def stretches_of(times, counts, truth, seconds, deviation):
    """`Stretch`es of about so many seconds from K packets (times [s] K, counts K x n) and a true `Trajectory`.

    deviation: as in `Stretch`. Only where the truth is known. Stretches without motion are left out.
    Raises ValueError when nothing is left.
    """
    known = np.flatnonzero((times >= truth.times[0]) & (times <= truth.times[-1]))
    found = []
    if len(known) > 1:
        per = max(1, round(seconds * (len(known) - 1) / max(times[known[-1]] - times[known[0]], 1e-9)))
        marks = known[:-1:per]
        if len(marks) > 1 and known[-1] - marks[-1] < per / 2:
            marks = marks[:-1]  # a short rest joins the stretch before it
        marks = np.append(marks, known[-1])
        poses = np.column_stack([np.interp(times[marks], truth.times, column) for column in truth.poses.T])
        for (begin, start), (last, end) in zip(zip(marks, poses), zip(marks[1:], poses[1:])):
            part = counts[begin + 1:last + 1]
            if part.any():
                found.append(Stretch(part, se2.between(start, end), deviation))
    if not found:
        raise ValueError("found no packets with motion while the true pose is known")
    return found
