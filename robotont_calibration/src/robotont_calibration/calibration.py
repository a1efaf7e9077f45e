"""Wheel parameters from recorded runs, by non-linear least squares over where the counts lead.

A run is a list of packets and where the robot was at some of them. Stretches of it are compared: what the counts
make of each one with some parameters, and how the measured point of the robot really moved meanwhile, in units of
what the measurement and the wheels' noise explain. Each parameter also keeps near its old value, loosely: where the
runs say nothing of it, it stays.
"""

import math
from typing import NamedTuple, Tuple

import numpy as np
from scipy.optimize import least_squares, minimize_scalar

from robotont_driver import se2
from robotont_driver.kinematics import Kinematics
from robotont_driver.wheel_noise import PATH_VARIANCE, variance_per_edge
from robotont_driver.wheels import read_wheels

# How far off a parameter may be before the runs: standard deviations of the loose tie to its old value.
RADIUS_TIE = 0.1     # part of the radius
DISTANCE_TIE = 0.1   # part of the distance
ANGLE_TIE = 0.2      # [rad]
POINT_TIE = 0.3      # [m]
DETERMINED = 0.3     # a parameter counts as determined when the runs leave less than this part of the tie
PASSES = 4           # fits, each with the noise along the way that the one before has found
NOISE_TIE = math.log(3)  # how far off the wheels' noise may be before the runs: a factor, as a logarithm
OUTLYING = 3.0       # a run with errors this many times as large as the noise explains loses weight
TURNING = math.radians(30)  # stretches that end with another heading than this tell where the measured point is
ALIKE = 0.1          # runs whose wheels' paths differ by less than this part of them repeat the same drive


class Run(NamedTuple):
    """A recorded run: what the wheels counted, where the robot was at some packets, and which stretches count."""

    name: str
    counts: np.ndarray             # K x n [edges]
    marks: np.ndarray              # M rising numbers of packets that had come when a pose was measured
    poses: np.ndarray              # M x 3 measured there: x [m], y [m], yaw [rad], whole turns left aside
    deviation: Tuple[float, float]  # standard deviations of each as measured: place [m], yaw [rad]
    stretches: np.ndarray          # L x 2 indices of marks: begin and end

    @property
    def moved(self):
        """L x 3 measured motions, the end of each stretch as seen from its begin."""
        begins, ends = self.stretches.T
        return _seen(self.poses[begins], self.poses[ends])


def taped_run(name, counts, end, deviation):
    """`Run` of which only the end (x [m], y [m], yaw [rad]) is known, as seen from the start."""
    return Run(name, np.asarray(counts), np.array((0, len(counts))), np.array(((0.0, 0.0, 0.0), end)), deviation,
               np.array(((0, 1),)))


def tracked_run(name, times, counts, truth, seconds, deviation):
    """`Run` of which the truth is known all the way, in half overlapping stretches of about so many `seconds`.

    times: K [s] of the packets, rising; counts: K x n; truth: `Trajectory`. Only where the truth is known. Stretches
    without motion are left out. Raises ValueError when nothing is left.
    """
    known = np.flatnonzero((times >= truth.times[0]) & (times <= truth.times[-1]))
    stretches = []
    if len(known) > 1:
        duration = times[known[-1]] - times[known[0]]
        amount = max(1, round(4 * duration / seconds))  # quarters of a stretch
        marks = np.unique(np.linspace(known[0], known[-1], amount + 1).round().astype(int))
        length = min(4, len(marks) - 1)
        begins = np.unique(np.append(np.arange(0, len(marks) - length, 2), len(marks) - 1 - length))
        counts = np.asarray(counts)
        stretches = [(begin, begin + length) for begin in begins.tolist()
                     if counts[marks[begin] + 1:marks[begin + length] + 1].any()]
    if not stretches:
        raise ValueError("found no packets with motion while the true pose is known")
    poses = np.column_stack([np.interp(times[marks], truth.times, column) for column in truth.poses.T])
    first = marks[0] + 1
    return Run(name, counts[first:marks[-1] + 1], marks + 1 - first, poses, deviation, np.array(stretches))


class Unknowns:
    """Which numbers are looked for, as small numbers that are 0 for the old values.

    given: mapping with the keys of wheel_params.yaml. radius: "common" (one factor for all), "each" or "fixed".
    distance: "common" or "fixed". angles: "each" or "fixed". point: "free", or (x, y) [m] in base_link of what the
    measured poses are of. Raises ValueError when nothing is left to look for.
    """

    def __init__(self, given, radius="common", distance="common", angles="each", point=(0.0, 0.0)):
        amount = given["wheelAmount"]
        self._given = given
        self._radii = {"common": 1, "each": amount, "fixed": 0}[radius]
        self._distances = {"common": 1, "fixed": 0}[distance]
        self._angles = {"each": amount, "fixed": 0}[angles]
        self._point = None if point == "free" else tuple(point)
        points = 2 if self._point is None else 0
        self.names = [
            *(["wheelRadius"] if self._radii == 1 else [f"wheelRadius[{wheel}]" for wheel in range(self._radii)]),
            *["wheelDistanceFromCenter"][:self._distances],
            *(f"wheelRads[{wheel}]" for wheel in range(self._angles)),
            *("point x", "point y")[:points],
        ]
        self.ties = np.array([RADIUS_TIE] * self._radii + [DISTANCE_TIE] * self._distances
                             + [ANGLE_TIE] * self._angles + [POINT_TIE] * points)
        if self._radii + self._distances + self._angles == 0:
            raise ValueError("found radius, distance and angles all fixed, allowed: at least one that is not")

    def parameters(self, values):
        """The mapping with these `values`: parts by which radii and distance are larger, [rad] added to angles."""
        given = dict(self._given)
        radii, distance, angles, _ = np.split(
            np.asarray(values), np.cumsum([self._radii, self._distances, self._angles]))
        if len(radii):
            given["wheelRadius"] = _scaled(given["wheelRadius"], 1 + radii)
        if len(distance):
            given["wheelDistanceFromCenter"] = _scaled(given["wheelDistanceFromCenter"], 1 + distance)
        if len(angles):
            given["wheelRads"] = [float(rad + added) for rad, added in zip(given["wheelRads"], angles)]
        return given

    def point(self, values):
        """(x, y) [m] of the measured point in base_link."""
        return self._point or (float(values[-2]), float(values[-1]))


def _scaled(value, factors):
    """A number or list times factors, one or one per wheel; a number stays one where it can."""
    scaled = np.asarray(value, dtype=float) * factors
    return scaled.tolist() if isinstance(value, (list, tuple)) or len(factors) > 1 else float(scaled[0])


class Calibration(NamedTuple):
    """What `calibrate` found."""

    parameters: dict            # with the keys of wheel_params.yaml
    point: Tuple[float, float]  # [m] in base_link, which the measured poses are of
    names: Tuple[str, ...]      # of what was looked for
    values: np.ndarray          # as in Unknowns.parameters, then the point where it was looked for
    covariance: np.ndarray      # of the values
    undetermined: Tuple[str, ...]  # names of what the runs say little or nothing of
    wheel_noise: float          # [m] after 1 m that explains what remains
    outlying: Tuple[str, ...]   # names of runs that lost weight

    @property
    def deviations(self):
        """Standard deviations of the values."""
        return np.sqrt(np.diag(self.covariance))


def calibrate(given, runs, unknowns, wheel_noise):
    """`Calibration` from `Run`s.

    given: mapping with the keys of wheel_params.yaml, the old values. wheel_noise: standard deviation [m]
    of a wheel's path after 1 m, roughly; the runs tell it better. Raises ParameterError for wrong old values,
    ValueError without runs.
    """
    if not runs:
        raise ValueError("found no run to calibrate with")
    values, noise = np.zeros(len(unknowns.names)), wheel_noise
    weights = np.ones(len(runs))
    for _ in range(PASSES):
        wheels, point = read_wheels(unknowns.parameters(values)), unknowns.point(values)
        parts = [_covariances(wheels, run) for run in runs]
        left = [misfits(wheels, run, point) for run in runs]
        noise = _likely_noise(runs, parts, left, weights, wheel_noise)
        whiten = [_whitening(part, noise) * math.sqrt(weight) for part, weight in zip(parts, weights)]
        found = _fit(runs, unknowns, whiten, values)
        values = found.x
        weights = weights * _trust(runs, found.fun)
    covariance = _covariance(runs, unknowns, found)
    deviations = np.sqrt(np.diag(covariance))
    undetermined = tuple(
        name for name, open_, tie in zip(unknowns.names, deviations, unknowns.ties) if open_ > DETERMINED * tie)
    outlying = tuple(run.name for run, weight in zip(runs, weights) if weight < 0.99)
    return Calibration(unknowns.parameters(values), unknowns.point(values), tuple(unknowns.names), values, covariance,
                       undetermined, noise, outlying)


def _fit(runs, unknowns, whiten, start):
    """Scipy's result: least squares of all misfits and ties."""

    def left(values):
        """What is left of each stretch (3 numbers) in standard deviations, and the ties."""
        wheels, point = read_wheels(unknowns.parameters(values)), unknowns.point(values)
        return np.concatenate([
            *(np.einsum("lij,lj->li", matrix, misfits(wheels, run, point)).ravel()
              for run, matrix in zip(runs, whiten)), values / unknowns.ties])
    return least_squares(left, start, x_scale=unknowns.ties)


def _slices(runs):
    """Where each run's numbers stand among those of all."""
    ends = np.cumsum([3 * len(run.stretches) for run in runs]).tolist()
    return [slice(begin, end) for begin, end in zip([0, *ends], ends)]


def _trust(runs, left):
    """Factor of each run's weight: below 1 where its errors are far beyond those that the noise explains."""
    sizes = np.array([np.sqrt(np.mean(left[part] ** 2)) for part in _slices(runs)])
    return np.minimum(1.0, (OUTLYING / np.maximum(sizes, 1e-9)) ** 2)


def _covariance(runs, unknowns, found):
    """Covariance of the values: what noise explains, and more where different drives disagree more than that.

    Overlapping stretches share their errors, by the share of the way that they have in common.
    """
    ties = np.diag(unknowns.ties ** -2)
    curvatures, scores, pulls = [], [], []
    for run, part in zip(runs, _slices(runs)):
        jacobian, left = found.jac[part], found.fun[part]
        begins, ends = run.marks[run.stretches].T
        common = np.minimum.outer(ends, ends) - np.maximum.outer(begins, begins)
        shared = np.maximum(common, 0) / np.sqrt(np.outer(ends - begins, ends - begins))
        stacked = jacobian.reshape(len(run.stretches), 3, -1)
        curvatures.append(jacobian.T @ jacobian)
        scores.append(np.einsum("lik,lm,mij->kj", stacked, shared, stacked))
        pulls.append(jacobian.T @ left)
    inverse = np.linalg.inv(sum(curvatures) + ties)
    covariance = inverse @ (sum(scores) + ties) @ inverse
    disagreement, expected = 0.0, 0.0
    for group in repeats(runs):
        curvature, score, pull = (sum(each[index] for index in group) for each in (curvatures, scores, pulls))
        disagreement += pull @ inverse @ pull
        expected += np.trace(inverse @ (score - 2 * curvature @ inverse @ score + curvature @ covariance @ curvature))
    scale = disagreement / expected if expected > 1e-3 * len(inverse) else 1.0
    return covariance * max(1.0, scale)


def repeats(runs):
    """Lists of indices of runs that repeat the same drive: the same paths of the wheels, as shares of all."""
    drives = []
    for index, run in enumerate(runs):
        shape = np.concatenate([run.counts.sum(axis=0), np.abs(run.counts).sum(axis=0)])
        shape = shape / max(np.abs(run.counts).sum(), 1)
        for other, group in drives:
            if np.linalg.norm(other - shape) < ALIKE:
                group.append(index)
                break
        else:
            drives.append((shape, [index]))
    return [group for _, group in drives]


def turns(runs):
    """Whether the runs turn enough between measured poses to tell where the measured point is."""
    return any(np.abs(se2.wrap(run.moved[:, 2])).max() > TURNING for run in runs)


def misfits(wheels, run, point=(0.0, 0.0)):
    """L x 3 (x [m], y [m], yaw [rad]) by which the counts of each stretch lead elsewhere than the robot's `point` went.

    yaw within half a turn.
    """
    begins, ends = run.stretches.T
    poses = poses_at_marks(wheels, run, point)
    left = _seen(poses[begins], poses[ends]) - run.moved
    left[:, 2] = se2.wrap(left[:, 2])
    return left


def poses_at_marks(wheels, run, point=(0.0, 0.0)):
    """M x 3 poses of the measured point at the marks, of the odometry that begins at the origin; yaw is not wrapped."""
    poses = np.vstack([np.zeros(3), se2.path(steps_of(wheels, run.counts))])[run.marks]
    return np.transpose(se2.compose(poses.T, (*point, 0.0)))


def errors_along(wheels, run, point=(0.0, 0.0)):
    """(place [m], root of the mean square over the marks; yaw [rad] at the last) of the odometry from the first mark."""
    poses = poses_at_marks(wheels, run, point)
    start = np.zeros(len(poses), dtype=int)
    left = (_seen(poses[start], poses) - _seen(run.poses[start], run.poses))[1:]
    return (float(np.sqrt(np.mean(left[:, 0] ** 2 + left[:, 1] ** 2))),
            float(abs(se2.wrap(left[-1, 2]))))


def end_misfit(wheels, run, point=(0.0, 0.0)):
    """(x [m], y [m], yaw [rad]) by which the odometry misses the last mark, seen from the first one."""
    poses = poses_at_marks(wheels, run, point)
    left = (_seen(poses[:1], poses[-1:]) - _seen(run.poses[:1], run.poses[-1:]))[0]
    left[2] = se2.wrap(left[2])
    return left


def _seen(starts, ends):
    """K x 3 displacements from `starts` to `ends`, K x 3 each."""
    return np.transpose(se2.between(starts.T, ends.T))


def steps_of(wheels, counts):
    """K x 3 steps in base_link, formulas (8)-(11)."""
    return (counts * np.array(wheels.metres_per_edge)) @ Kinematics(wheels).inverse.T


def _covariances(wheels, run):
    """(L x 3 x 3 of each misfit per square of the wheel noise, L x 3 x 3 of the measurement and the edges)."""
    to_step = Kinematics(wheels).inverse * np.array(wheels.metres_per_edge)
    poses = np.vstack([np.zeros(3), se2.path(steps_of(wheels, run.counts))])
    variances = np.abs(run.counts) * variance_per_edge(1.0, wheels.metres_per_edge)  # [edges^2]
    place, turned = run.deviation
    by_wheels, others = [], []
    for (begin, end), (x, y, _) in zip(run.marks[run.stretches], run.moved):
        part = _seen(np.broadcast_to(poses[begin], (end - begin, 3)), poses[begin + 1:end + 1])
        cos, sin = np.cos(part[:, 2]), np.sin(part[:, 2])
        lever = part[-1, :2] - part[:, :2]  # a turn at the pose k moves the end by lever x turn
        jacobians = np.zeros((len(part), 3, 3))  # of the end by step k, in base_link
        jacobians[:, 0, 0], jacobians[:, 0, 1], jacobians[:, 0, 2] = cos, -sin, -lever[:, 1]
        jacobians[:, 1, 0], jacobians[:, 1, 1], jacobians[:, 1, 2] = sin, cos, lever[:, 0]
        jacobians[:, 2, 2] = 1.0
        by_wheel = jacobians @ to_step  # K x 3 x n
        weighted = by_wheel * variances[begin:end, None, :]
        by_wheels.append(np.tensordot(weighted, by_wheel, axes=((0, 2), (0, 2))))
        start = np.array((y, -x, -1.0)) * turned  # a start that looks elsewhere than measured turns the end
        others.append(PATH_VARIANCE * to_step @ to_step.T + np.outer(start, start)
                      + np.diag([2 * place ** 2, 2 * place ** 2, turned ** 2]))
    return np.array(by_wheels), np.array(others)


def _whitening(parts, noise):
    """L x 3 x 3 matrices that make the misfits of stretches unit noise."""
    by_wheels, others = parts
    return np.linalg.inv(np.linalg.cholesky(noise ** 2 * by_wheels + others))


def _likely_noise(runs, parts, left, weights, expected):
    """[m] after 1 m: the wheels' noise that makes what is left likeliest, loosely tied to what was `expected`."""
    by_wheels = np.concatenate([part[0] for part in parts])
    others = np.concatenate([part[1] for part in parts])
    left = np.concatenate(left)
    weight = np.concatenate([np.full(len(run.stretches), each) for run, each in zip(runs, weights)])
    alone = np.concatenate([np.full(len(run.stretches), 0.5 if len(run.stretches) > 1 else 1.0) for run in runs])

    def unlikely(logarithm):
        """Twice the negative logarithm of the likelihood; half of it for stretches that overlap by half."""
        covariances = math.exp(2 * logarithm) * by_wheels + others
        squares = np.einsum("li,lij,lj->l", left, np.linalg.inv(covariances), left)
        numbers = np.linalg.slogdet(covariances)[1] + weight * squares
        return float(np.sum(alone * numbers)) + ((logarithm - math.log(expected)) / NOISE_TIE) ** 2
    middle = math.log(expected)
    found = minimize_scalar(unlikely, bounds=(middle - 5, middle + 5), method="bounded")
    return math.exp(found.x)
