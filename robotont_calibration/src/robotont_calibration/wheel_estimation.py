"""Wheel parameters from recorded runs: Gauss-Newton on the motion that the counts give, in a random-effects model.

A run is a list of packets and the robot's poses at some of them. The stretches from one pose to the next are compared:
the motion computed from the counts with given parameters, and the true motion of the measured point, in standard
deviations of the measurement and of the wheels' noise. Neighbouring stretches share the error of the pose between them,
so a run is whitened as a whole. Each drive has parameters of its own, scattered around the common ones; those are tied
loosely to their old values: one that the runs do not determine stays there.
"""

import math
from typing import NamedTuple, Tuple

import numpy as np
from scipy.optimize import minimize_scalar

from robotont_calibration.calibration_runs import repeats
from robotont_calibration.free_parameters import FreeParameters
from robotont_calibration.linear_runs import NOISE, likely_noise, linear_runs

DETERMINED = 0.3     # a parameter counts as determined when the runs leave less than this part of the tie
PASSES = 6           # Gauss-Newton steps, each with the noise and the slip that are likeliest there
MOST_TIES = 3.0      # no parameter goes farther from its old value
SLIP = 0.0005        # how much parameters differ from drive to drive, to begin with: a share, [rad]
REPEATS = 8          # of a drive, from which on more add nothing about that
SLIP_TIE = math.log(5.0)        # by what factor that may be off before the runs
POINT_SLIP = 0.1     # [m] by which the point differs from drive to drive where lengths differ by their whole
OUTLYING = 3.0       # a run with errors this many times as large as the noise explains loses weight


class Calibration(NamedTuple):
    """Result of `calibrate`."""

    free: FreeParameters        # what was looked for
    parameters: dict            # with the keys of wheel_params.yaml
    point: Tuple[float, float]  # [m] in base_link, which the measured poses are of
    values: np.ndarray          # as in FreeParameters.parameters, then the point where it was looked for
    covariance: np.ndarray      # of the values
    undetermined: Tuple[str, ...]  # names of values that the runs hardly determine
    wheel_noise: float          # [m] after 1 m, which grows with the root of the way and explains what remains,
    measured: float             # together with so many times the stated deviation of the measurement
    slip: float                 # by how much parameters differ from drive to drive: a share of lengths, [rad]
    outlying: Tuple[str, ...]   # names of runs that lost weight
    unlikely: float             # minus twice the logarithm of the evidence: of two models the lower one is likelier

    @property
    def deviations(self):
        """Standard deviations of the values."""
        return np.sqrt(np.diag(self.covariance))


def calibrate(runs, free):
    """`Calibration` of `FreeParameters` by `Run`s. Raises ParameterError for wrong old values, ValueError: no runs."""
    if not runs:
        raise ValueError("found no run to calibrate with")
    values, weights, noise, drives = np.zeros(len(free.names)), np.ones(len(runs)), NOISE, repeats(runs)
    for _ in range(PASSES):
        models = linear_runs(free, values, runs)
        noise = likely_noise(models, weights, noise)
        whitened = [model.whitened(noise, weight) for model, weight in zip(models, weights)]
        groups = [_group([whitened[index] for index in drive], values) for drive in drives]
        slip = _likely_slip(groups, free)
        before = values
        values, covariance, unlikely = _mixed(groups, free, slip)
        values = np.clip(values, -MOST_TIES * free.ties, MOST_TIES * free.ties)
        sizes = np.array([np.sqrt(np.mean((left + slopes @ (values - before)) ** 2)) for left, slopes, _ in whitened])
        weights = weights * np.minimum(1.0, (OUTLYING / np.maximum(sizes, 1e-9)) ** 2)
    deviations = np.sqrt(np.diag(covariance))
    undetermined = tuple(
        name for name, open_, tie in zip(free.names, deviations, free.ties) if open_ > DETERMINED * tie)
    outlying = tuple(run.name for run, weight in zip(runs, weights) if weight < 0.99)
    return Calibration(free, free.parameters(values), free.point(values), values, covariance, undetermined, *noise,
                       slip, outlying, unlikely)


class _Group(NamedTuple):
    """What the runs that repeat a drive say: information H, pull b (the values tend to H^-1 b), constant, amount."""

    curvature: np.ndarray
    pull: np.ndarray
    constant: float
    amount: int


def _group(whitened, values):
    left, slopes = (np.concatenate(parts) for parts in list(zip(*whitened))[:2])
    towards = slopes @ values - left
    return _Group(slopes.T @ slopes, slopes.T @ towards,
                  float(towards @ towards + sum(constant for *_, constant in whitened)), len(whitened))


def _mixed(groups, free, slip):
    """(values, covariance, minus twice the logarithm of the evidence) when each drive has parameters of its own.

    A random-effects model: a group's own parameters scatter by `slip` around the common ones, so it estimates
    H^-1 b with the covariance H^-1 + D.
    """
    own = _own(free, slip)
    unit = np.eye(len(own))
    information, pull, unlikely = np.diag(free.ties ** -2.0), np.zeros(len(own)), 2 * np.log(free.ties).sum()
    for curvature, towards, constant, _ in groups:
        shrink = np.linalg.inv(unit + curvature @ own)
        information, pull = information + shrink @ curvature, pull + shrink @ towards
        unlikely += constant - towards @ own @ shrink @ towards - np.linalg.slogdet(shrink)[1]
    covariance = np.linalg.inv(information)
    values = covariance @ pull
    return values, covariance, float(unlikely - pull @ values + np.linalg.slogdet(information)[1])


def _likely_slip(groups, free):
    """By how much the parameters differ from drive to drive, likeliest, loosely tied to SLIP.

    Of many repeats only the information of REPEATS counts here: the derivatives contain the noise of the counts, which
    many runs would take for parameters that differ widely.
    """
    groups = [_Group(*(part * min(1.0, REPEATS / group.amount) for part in group[:-1]), group.amount)
              for group in groups]
    found = minimize_scalar(
        lambda logarithm: _mixed(groups, free, math.exp(logarithm))[2]
        + ((logarithm - math.log(SLIP)) / SLIP_TIE) ** 2, bounds=np.log((1e-6, 0.1)), method="bounded")
    return math.exp(found.x)


def information(run, found):
    """P x P information that a further `Run` would add to the `Calibration` found, with its noise and slip."""
    model, = linear_runs(found.free, found.values, [run])
    curvature = _group([model.whitened((found.wheel_noise, found.measured), 1.0)], found.values).curvature
    own = _own(found.free, found.slip)
    return np.linalg.inv(np.eye(len(own)) + curvature @ own) @ curvature


def _own(free, slip):
    """P x P covariance of one drive's parameters around the common ones."""
    return np.diag((slip * np.where(np.char.startswith(free.names, "point"), POINT_SLIP, 1.0)) ** 2)
