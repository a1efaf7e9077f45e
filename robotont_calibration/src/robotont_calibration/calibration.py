"""Wheel parameters from recorded runs, by non-linear least squares on the motion that the counts give.

A run is a list of packets and the robot's poses at some of them. The stretches from one pose to the next are compared:
the motion computed from the counts with given parameters, and the true motion of the measured point, in standard
deviations of the measurement and of the wheels' noise. Neighbouring stretches share the error of the pose between them,
so a run is whitened as a whole. Each parameter is also tied loosely to its old value: one that the runs do not
determine stays there.
"""

import math
from typing import NamedTuple, Tuple

import numpy as np
from scipy.linalg import block_diag, cho_solve_banded, cholesky_banded
from scipy.optimize import least_squares, minimize, minimize_scalar

from robotont_driver import se2
from robotont_driver.kinematics import Kinematics
from robotont_driver.wheel_noise import READING_VARIANCE, variance_per_edge
from robotont_driver.wheels import read_wheels

# How far off a parameter may be before the runs: standard deviations of the loose tie to its old value.
RADIUS_TIE = 0.1     # part of the radius
DISTANCE_TIE = 0.1   # part of the distance
ANGLE_TIE = 0.2      # [rad]
POINT_TIE = 0.3      # [m]
DETERMINED = 0.3     # a parameter counts as determined when the runs leave less than this part of the tie
PASSES = 3           # fits, each with the noise along the way that the one before has found
NOISE_TIE = np.log((3.0, 1.5))  # by what factors the wheels' noise and the measurement's may be off before the runs
SLIP = 0.0005        # how much parameters differ from drive to drive, to begin with: a share, [rad]
REPEATS = 8          # of a drive, from which on more tell no more about that
SLIP_TIE = math.log(5.0)        # by what factor that may be off before the runs
POINT_SLIP = 0.1     # [m] by which the point differs from drive to drive where lengths differ by their whole
OUTLYING = 3.0       # a run with errors this many times as large as the noise explains loses weight
TURNING = math.radians(30)  # runs in which the heading changes by more than this determine the measured point
STEP = 1e-6          # of a value, for derivatives
BAND = 6             # numbers of two neighbouring stretches
ALIKE = 0.1          # runs whose wheels' paths differ by less than this part of them repeat the same drive


class Run(NamedTuple):
    """A recorded run: the wheels' counts, the robot's poses at some packets, and the stretches that are compared."""

    name: str
    counts: np.ndarray             # K x n [edges]
    marks: np.ndarray              # M rising numbers of packets that had come when a pose was measured
    poses: np.ndarray              # M x 3 measured there: x [m], y [m], yaw [rad], modulo full turns
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
    """`Run` of which the truth is known all the way, in stretches of about so many `seconds`.

    times: K [s] of the packets, rising; counts: K x n; truth: `Trajectory`. Only where the truth is known. Stretches
    without motion are excluded. Raises ValueError when nothing is left.
    """
    tracked = np.flatnonzero((times >= truth.times[0]) & (times <= truth.times[-1]))
    stretches = []
    if len(tracked) > 1:
        amount = max(1, round((times[tracked[-1]] - times[tracked[0]]) / seconds))
        marks = np.unique(np.linspace(tracked[0], tracked[-1], amount + 1).round().astype(int))
        counts = np.asarray(counts)
        stretches = [(number, number + 1) for number, (begin, end) in enumerate(zip(marks.tolist(), marks[1:].tolist()))
                     if counts[begin + 1:end + 1].any()]
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
        self.free_point = self._point is None
        points = 2 if self.free_point else 0
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
    """Result of `calibrate`."""

    parameters: dict            # with the keys of wheel_params.yaml
    point: Tuple[float, float]  # [m] in base_link, which the measured poses are of
    names: Tuple[str, ...]      # of the estimated values
    values: np.ndarray          # as in Unknowns.parameters, then the point where it was looked for
    covariance: np.ndarray      # of the values
    undetermined: Tuple[str, ...]  # names of values that the runs hardly determine
    wheel_noise: float          # [m] after 1 m, which grows with the root of the way and explains what remains,
    measured: float             # together with so many times the stated deviation of the measurement
    slip: float                 # by how much parameters differ from drive to drive: a share of lengths, [rad]
    outlying: Tuple[str, ...]   # names of runs that lost weight

    @property
    def deviations(self):
        """Standard deviations of the values."""
        return np.sqrt(np.diag(self.covariance))


def calibrate(given, runs, unknowns, wheel_noise, near=None):
    """`Calibration` from `Run`s.

    near: a `Calibration` of the same unknowns from almost the same runs, to begin with its values and noise.

    given: mapping with the keys of wheel_params.yaml, the old values. wheel_noise: standard deviation [m]
    of a wheel's path after 1 m, roughly; it is estimated from the runs. Raises ParameterError for wrong old values,
    ValueError without runs.
    """
    if not runs:
        raise ValueError("found no run to calibrate with")
    values, weights = np.zeros(len(unknowns.names)) if near is None else near.values, np.ones(len(runs))
    for _ in range(PASSES if near is None else 1):
        noise, whiten = _weigh(runs, unknowns, values, weights, wheel_noise)
        found = _fit(runs, unknowns, whiten, values)
        values = found.x
        weights = weights * _trust(runs, found.fun)
    for _ in range(2 if near is None else 1):
        groups = _linear(runs, unknowns, whiten, values)
        slip = _likely_slip(groups, [len(group) for group in repeats(runs)], unknowns)
        values, covariance, _ = _mixed(groups, unknowns, slip)
    deviations = np.sqrt(np.diag(covariance))
    undetermined = tuple(
        name for name, open_, tie in zip(unknowns.names, deviations, unknowns.ties) if open_ > DETERMINED * tie)
    outlying = tuple(run.name for run, weight in zip(runs, weights) if weight < 0.99)
    return Calibration(unknowns.parameters(values), unknowns.point(values), tuple(unknowns.names), values, covariance,
                       undetermined, *noise.tolist(), slip, outlying)


def _weigh(runs, unknowns, values, weights, wheel_noise):
    """(likeliest noise, as in `_Spread.at`; whitening matrix of each run) at `values`, with a weight of each run."""
    wheels, point = read_wheels(unknowns.parameters(values)), unknowns.point(values)
    spreads = [_spread(wheels, run) for run in runs]
    noise = _likely_noise(spreads, [misfits(wheels, run, point) for run in runs], weights, (wheel_noise, 1.0))
    return noise, [_whitening(spread, noise) * math.sqrt(weight) for spread, weight in zip(spreads, weights)]


def _residuals(runs, unknowns, whiten, values):
    """Residuals of each stretch (3 numbers), of all runs, in standard deviations."""
    wheels, point = read_wheels(unknowns.parameters(values)), unknowns.point(values)
    return np.concatenate([matrix @ misfits(wheels, run, point).ravel() for run, matrix in zip(runs, whiten)])


def _slopes(runs, unknowns, whiten, values):
    """Derivatives of `_residuals` by the values."""
    wheels, point = read_wheels(unknowns.parameters(values)), unknowns.point(values)
    by_value = _by_value(unknowns, values)
    return np.concatenate([
        matrix @ _slopes_of_misfits(wheels, run, point, by_value, unknowns.free_point).reshape(-1, len(values))
        for run, matrix in zip(runs, whiten)])


def _by_value(unknowns, values):
    """3 x n x P derivatives of the step per edge by the values."""
    return np.stack([(_edge_steps(unknowns, values + step) - _edge_steps(unknowns, values - step)) / (2 * STEP)
                     for step in STEP * np.eye(len(values))], axis=-1)


def _edge_steps(unknowns, values):
    """3 x n step of the robot per edge of each wheel."""
    wheels = read_wheels(unknowns.parameters(values))
    return Kinematics(wheels).inverse * np.array(wheels.metres_per_edge)


def _slopes_of_misfits(wheels, run, point, by_value, free_point):
    """L x 3 x P derivatives of `misfits`, given those of the robot's step per edge, 3 x n x P.

    A step that differs moves each later pose, and turns it about where the step was: about its middle.
    """
    poses = np.vstack([np.zeros(3), se2.path(steps_of(wheels, run.counts))])
    x, y, yaw = ((poses[1:] + poses[:-1]) / 2).T
    lift = np.zeros((len(x), 3, 3))
    lift[:, 0, 0] = lift[:, 1, 1] = np.cos(yaw)
    lift[:, 1, 0] = np.sin(yaw)
    lift[:, 0, 1] = -lift[:, 1, 0]
    lift[:, 0, 2], lift[:, 1, 2], lift[:, 2, 2] = y, -x, 1.0
    moved = (lift[:, :, :, None] * run.counts[:, None, None, :]).reshape(len(x), -1)
    sums = np.cumsum(np.vstack([np.zeros(moved.shape[1]), moved]), axis=0)[run.marks]
    along = np.tensordot(sums.reshape(len(run.marks), 3, 3, -1), by_value, axes=((2, 3), (0, 1)))  # M x 3 x P
    poses = poses[run.marks]
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    places = np.transpose(se2.compose(poses.T, (*point, 0.0)))
    along[:, 0] -= places[:, 1, None] * along[:, 2]
    along[:, 1] += places[:, 0, None] * along[:, 2]
    if free_point:
        along[:, :2, -2:] += np.moveaxis(np.array(((cos, -sin), (sin, cos))), 2, 0)
    begins, ends = run.stretches.T
    seen = _seen(places[begins], places[ends])
    cos, sin = cos[begins, None], sin[begins, None]
    change = along[ends] - along[begins]
    turned = along[begins, 2]
    return np.stack([cos * change[:, 0] + sin * change[:, 1] + seen[:, 1, None] * turned,
                     cos * change[:, 1] - sin * change[:, 0] - seen[:, 0, None] * turned, change[:, 2]], axis=1)


def _fit(runs, unknowns, whiten, start):
    """Scipy's result: least squares of all misfits and ties."""
    ties = np.diag(1 / unknowns.ties)
    return least_squares(
        lambda values: np.concatenate([_residuals(runs, unknowns, whiten, values), values / unknowns.ties]), start,
        jac=lambda values: np.vstack([_slopes(runs, unknowns, whiten, values), ties]),
        x_scale=unknowns.ties, ftol=1e-5)


def _linear(runs, unknowns, whiten, values):
    """(H, b) of each group of repeats at `values`: the information, and the pull on the values: they tend to H^-1 b."""
    now, jacobian = (function(runs, unknowns, whiten, values) for function in (_residuals, _slopes))
    slices = _slices(runs)
    groups = []
    for group in repeats(runs):
        parts = [(jacobian[slices[index]], now[slices[index]]) for index in group]
        groups.append((sum(slopes.T @ slopes for slopes, _ in parts),
                       sum(slopes.T @ (slopes @ values - left) for slopes, left in parts)))
    return groups


def _by_step(poses, begin, end):
    """K x 3 x 3 derivatives of the motion from one of the poses to another by each step between them."""
    part = _seen(np.broadcast_to(poses[begin], (end - begin, 3)), poses[begin + 1:end + 1])
    lever = part[-1, :2] - part[:, :2]  # a turn at the pose k moves the end by lever x turn
    jacobians = np.zeros((len(part), 3, 3))
    jacobians[:, 0, 0] = jacobians[:, 1, 1] = np.cos(part[:, 2])
    jacobians[:, 1, 0] = np.sin(part[:, 2])
    jacobians[:, 0, 1] = -jacobians[:, 1, 0]
    jacobians[:, 0, 2], jacobians[:, 1, 2], jacobians[:, 2, 2] = -lever[:, 1], lever[:, 0], 1.0
    return jacobians


def _mixed(groups, unknowns, slip):
    """(values, covariance, likelihood) when each drive has parameters of its own, by `slip` around the common ones.

    A random-effects model: a group whose curvature is H and pull b estimates H^-1 b with the covariance H^-1 + D.
    likelihood: twice its negative logarithm, but for a constant.
    """
    own = _own(unknowns, slip)
    unit = np.eye(len(own))
    information, pull, unlikely = np.diag(unknowns.ties ** -2), np.zeros(len(own)), 0.0
    for curvature, towards in groups:
        shrink = np.linalg.inv(unit + curvature @ own)
        information, pull = information + shrink @ curvature, pull + shrink @ towards
        unlikely -= towards @ own @ shrink @ towards + np.linalg.slogdet(shrink)[1]
    covariance = np.linalg.inv(information)
    values = covariance @ pull
    return values, covariance, unlikely - pull @ values + np.linalg.slogdet(information)[1]


def _likely_slip(groups, amounts, unknowns):
    """By how much the parameters differ from drive to drive, likeliest, loosely tied to SLIP.

    groups: as of `_linear`; amounts: of runs in each. Of many repeats only the information of REPEATS counts here: the
    derivatives contain the noise of the counts, which many runs would take for parameters that differ widely.
    """
    shares = [min(1.0, REPEATS / amount) for amount in amounts]
    groups = [(share * curvature, share * towards) for share, (curvature, towards) in zip(shares, groups)]
    found = minimize_scalar(
        lambda logarithm: _mixed(groups, unknowns, math.exp(logarithm))[2]
        + ((logarithm - math.log(SLIP)) / SLIP_TIE) ** 2, bounds=np.log((1e-6, 0.1)), method="bounded")
    return math.exp(found.x)


def information(run, unknowns, found):
    """P x P information that a further `Run` would add to the `Calibration` found, with its noise and slip."""
    noise = (found.wheel_noise, found.measured)
    whiten = [_whitening(_spread(read_wheels(found.parameters), run), noise)]
    (curvature, _), = _linear([run], unknowns, whiten, found.values)
    own = _own(unknowns, found.slip)
    return np.linalg.inv(np.eye(len(own)) + curvature @ own) @ curvature


def _own(unknowns, slip):
    """P x P covariance of one drive's parameters around the common ones."""
    return np.diag((slip * np.where(np.char.startswith(unknowns.names, "point"), POINT_SLIP, 1.0)) ** 2)


def _slices(runs):
    """Where each run's numbers stand among those of all."""
    ends = np.cumsum([3 * len(run.stretches) for run in runs]).tolist()
    return [slice(begin, end) for begin, end in zip([0, *ends], ends)]


def _trust(runs, left):
    """Factor of each run's weight: below 1 where its errors are far beyond those that the noise explains."""
    sizes = np.array([np.sqrt(np.mean(left[part] ** 2)) for part in _slices(runs)])
    return np.minimum(1.0, (OUTLYING / np.maximum(sizes, 1e-9)) ** 2)


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
    """Whether the runs turn enough between measured poses to determine the measured point."""
    return any(np.abs(se2.wrap(run.poses[:, 2] - run.poses[0, 2])).max() > TURNING for run in runs)


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
    """M x 3 poses of the measured point at the marks, of odometry that begins at the origin; yaw is not wrapped."""
    poses = np.vstack([np.zeros(3), se2.path(steps_of(wheels, run.counts))])[run.marks]
    return np.transpose(se2.compose(poses.T, (*point, 0.0)))


def errors_along(wheels, run, point=(0.0, 0.0)):
    """(place [m], root of the mean square over the marks; yaw [rad] at the last) by which the odometry is wrong."""
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


class _Spread(NamedTuple):
    """Covariances of the misfits of a run's L stretches, 3 L x 3 L each; only neighbouring stretches share errors."""

    wandering: np.ndarray  # of uneven floor, per square of the wheel noise: grows with the way
    measured: np.ndarray   # of the measured poses with their deviation as stated
    edges: np.ndarray      # of the encoders' readings at the marks

    def at(self, noise):
        """Their sum with (wheel noise [m] after 1 m, factor of the measurement's deviation)."""
        return noise[0] ** 2 * self.wandering + noise[1] ** 2 * self.measured + self.edges


def _whitening(spread, noise):
    """3 L x 3 L matrix that makes the misfits of a run independent, with unit variance."""
    return np.linalg.inv(np.linalg.cholesky(spread.at(noise)))


def _spread(wheels, run):
    """`_Spread` of a run, along the way that the odometry with these wheels makes of it."""
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
    return _Spread(block_diag(*wandering), by_pose @ by_pose.T, READING_VARIANCE * by_reading @ by_reading.T)


def _likely_noise(spreads, left, weights, expected):
    """Likeliest (wheel noise, factor of the measurement's deviation) for the residuals `left`, tied to `expected`."""
    spread = _Spread(*(np.hstack(list(map(_band, parts))) for parts in zip(*spreads)))
    left = np.concatenate([math.sqrt(weight) * misfit.ravel() for misfit, weight in zip(left, weights)])
    middle = np.log(expected)

    def unlikely(logarithms):
        """Twice the negative logarithm of the likelihood."""
        factor = cholesky_banded(spread.at(np.exp(logarithms)), lower=True)
        return float(2 * np.log(factor[0]).sum() + left @ cho_solve_banded((factor, True), left)
                     + np.sum(((logarithms - middle) / NOISE_TIE) ** 2))
    found = minimize(unlikely, middle, method="Nelder-Mead", options={"xatol": 0.02, "fatol": 0.01, "maxiter": 100})
    return np.exp(found.x)


def _band(covariance):
    """BAND x N: the diagonal and those below it of a covariance of N numbers, as scipy takes them; the rest is 0."""
    size = len(covariance)
    band = np.zeros((BAND, size))
    for below in range(min(BAND, size)):
        band[below, :size - below] = np.diagonal(covariance, -below)
    return band
