"""Wheel parameters from recorded runs, by non-linear least squares on the motion that the counts give.

A run is a list of packets and the robot's poses at some of them. The stretches from one pose to the next are compared:
the motion computed from the counts with given parameters, and the true motion of the measured point, in standard
deviations of the measurement and of the wheels' noise. Neighbouring stretches share the error of the pose between them,
so a run is whitened as a whole. Each parameter is also tied loosely to its old value: one that the runs do not
determine stays there.
"""

import functools
import math
from typing import NamedTuple, Tuple

import numpy as np
from scipy.optimize import least_squares, minimize_scalar

from robotont_calibration.calibration_runs import kinds, misfits, repeats
from robotont_calibration.misfit_covariance import likely_noise, spread_of, whitening
from robotont_driver.kinematics.wheel_params import read_wheels

DETERMINED = 0.3     # a parameter counts as determined when the runs leave less than this part of the tie
PASSES = 3           # fits, each with the noise along the way that the one before has found
SLIP = 0.0005        # how much parameters differ from drive to drive, to begin with: a share, [rad]
REPEATS = 8          # of a drive, from which on more add nothing about that
SLIP_TIE = math.log(5.0)        # by what factor that may be off before the runs
OTHER_KIND = 0.006   # the same from one kind of drive to another on a real robot, while the runs are all of one kind
POINT_SLIP = 0.1     # [m] by which the point differs from drive to drive where lengths differ by their whole
OUTLYING = 3.0       # a run with errors this many times as large as the noise explains loses weight
STEP = 1e-6          # of a value, for derivatives


class Calibration(NamedTuple):
    """Result of `calibrate`."""

    parameters: dict            # with the keys of wheel_params.yaml
    point: Tuple[float, float]  # [m] in base_link, which the measured poses are of
    names: Tuple[str, ...]      # of the estimated values
    values: np.ndarray          # as in FreeParameters.parameters, then the point where it was looked for
    covariance: np.ndarray      # of the values
    undetermined: Tuple[str, ...]  # names of values that the runs hardly determine
    wheel_noise: float          # [m] after 1 m, which grows with the root of the way and explains what remains,
    measured: float             # together with so many times the stated deviation of the measurement
    slip: float                 # by how much parameters differ from drive to drive: a share of lengths, [rad]
    outlying: Tuple[str, ...]   # names of runs that lost weight
    one_kind: bool              # whether the runs are of one kind, so that nothing shows how others differ

    @property
    def deviations(self):
        """Standard deviations of the values."""
        return np.sqrt(np.diag(self.covariance))


def calibrate(given, runs, free, wheel_noise, near=None):
    """`Calibration` from `Run`s.

    near: a `Calibration` of the same parameters from almost the same runs, to begin with its values and noise.

    given: mapping with the keys of wheel_params.yaml, the old values. free: `FreeParameters`. wheel_noise: standard
    deviation [m] of a wheel's path after 1 m, roughly; it is estimated from the runs. Raises ParameterError for wrong
    old values, ValueError without runs.
    """
    if not runs:
        raise ValueError("found no run to calibrate with")
    values, weights = np.zeros(len(free.names)) if near is None else near.values, np.ones(len(runs))
    for _ in range(PASSES if near is None else 1):
        noise, whiten = _weigh(runs, free, values, weights, wheel_noise)
        found = _fit(runs, free, whiten, values)
        values = found.x
        weights = weights * _trust(runs, found.fun)
    for _ in range(2 if near is None else 1):
        groups = _groups(runs, free, whiten, values)
        slip = _likely_slip(groups, free)
        values, covariance, _ = _mixed(groups, free, slip)
    one_kind = kinds(read_wheels(free.parameters(values)), runs) < 2
    if one_kind:
        covariance = covariance + _own(free, max(slip, OTHER_KIND))
    deviations = np.sqrt(np.diag(covariance))
    undetermined = tuple(
        name for name, open_, tie in zip(free.names, deviations, free.ties) if open_ > DETERMINED * tie)
    outlying = tuple(run.name for run, weight in zip(runs, weights) if weight < 0.99)
    return Calibration(free.parameters(values), free.point(values), tuple(free.names), values, covariance,
                       undetermined, *noise.tolist(), slip, outlying, one_kind)


def _weigh(runs, free, values, weights, wheel_noise):
    """(likeliest noise, as in `Spread.at`; whitening matrix of each run) at `values`, with a weight of each run."""
    wheels, point = read_wheels(free.parameters(values)), free.point(values)
    spreads = [spread_of(wheels, run) for run in runs]
    noise = likely_noise(spreads, [misfits(wheels, run, point) for run in runs], weights, (wheel_noise, 1.0))
    return noise, [whitening(spread, noise) * math.sqrt(weight) for spread, weight in zip(spreads, weights)]


def _residuals(runs, free, whiten, values):
    """Residuals of each stretch (3 numbers), of all runs, in standard deviations."""
    wheels, point = read_wheels(free.parameters(values)), free.point(values)
    return np.concatenate([matrix @ misfits(wheels, run, point).ravel() for run, matrix in zip(runs, whiten)])


def derivatives(function, values):
    """N x P derivatives of a function of P values that has N, by central differences."""
    return np.column_stack([(function(values + step) - function(values - step)) / (2 * STEP)
                            for step in STEP * np.eye(len(values))])


def _fit(runs, free, whiten, start):
    """Scipy's result: least squares of all misfits and ties."""
    return least_squares(
        lambda values: np.concatenate([_residuals(runs, free, whiten, values), values / free.ties]), start,
        jac="3-point", x_scale=free.ties, ftol=1e-5)


def _groups(runs, free, whiten, values):
    """(H, b, amount of runs) of each group of repeats at `values`.

    H: the information; b: the pull on the values, which tend to H^-1 b.
    """
    groups = []
    for group in repeats(runs):
        some, matrices = [runs[index] for index in group], [whiten[index] for index in group]
        now = _residuals(some, free, matrices, values)
        slopes = derivatives(functools.partial(_residuals, some, free, matrices), values)
        groups.append((slopes.T @ slopes, slopes.T @ (slopes @ values - now), len(group)))
    return groups


def _mixed(groups, free, slip):
    """(values, covariance, likelihood) when each drive has parameters of its own, by `slip` around the common ones.

    A random-effects model: a group whose curvature is H and pull b estimates H^-1 b with the covariance H^-1 + D.
    likelihood: twice its negative logarithm, but for a constant.
    """
    own = _own(free, slip)
    unit = np.eye(len(own))
    information, pull, unlikely = np.diag(free.ties ** -2), np.zeros(len(own)), 0.0
    for curvature, towards, _ in groups:
        shrink = np.linalg.inv(unit + curvature @ own)
        information, pull = information + shrink @ curvature, pull + shrink @ towards
        unlikely -= towards @ own @ shrink @ towards + np.linalg.slogdet(shrink)[1]
    covariance = np.linalg.inv(information)
    values = covariance @ pull
    return values, covariance, unlikely - pull @ values + np.linalg.slogdet(information)[1]


def _likely_slip(groups, free):
    """By how much the parameters differ from drive to drive, likeliest, loosely tied to SLIP.

    Of many repeats only the information of REPEATS counts here: the derivatives contain the noise of the counts, which
    many runs would take for parameters that differ widely.
    """
    groups = [(matrix * REPEATS / max(amount, REPEATS), pull * REPEATS / max(amount, REPEATS), amount)
              for matrix, pull, amount in groups]
    found = minimize_scalar(
        lambda logarithm: _mixed(groups, free, math.exp(logarithm))[2]
        + ((logarithm - math.log(SLIP)) / SLIP_TIE) ** 2, bounds=np.log((1e-6, 0.1)), method="bounded")
    return math.exp(found.x)


def information(run, free, found):
    """P x P information that a further `Run` would add to the `Calibration` found, with its noise and slip."""
    noise = (found.wheel_noise, found.measured)
    whiten = [whitening(spread_of(read_wheels(found.parameters), run), noise)]
    (curvature, *_), = _groups([run], free, whiten, found.values)
    own = _own(free, found.slip)
    return np.linalg.inv(np.eye(len(own)) + curvature @ own) @ curvature


def _own(free, slip):
    """P x P covariance of one drive's parameters around the common ones."""
    return np.diag((slip * np.where(np.char.startswith(free.names, "point"), POINT_SLIP, 1.0)) ** 2)


def _trust(runs, left):
    """Factor of each run's weight: below 1 where its errors are far beyond those that the noise explains."""
    ends = np.cumsum([3 * len(run.stretches) for run in runs])
    sizes = np.array([np.sqrt(np.mean(part ** 2)) for part in np.split(left, ends)[:-1]])
    return np.minimum(1.0, (OUTLYING / np.maximum(sizes, 1e-9)) ** 2)
