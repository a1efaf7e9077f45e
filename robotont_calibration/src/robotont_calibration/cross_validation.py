"""How good a calibration is on runs that it was not fitted to, and the run that would improve it most."""

import math
from typing import NamedTuple

import numpy as np
from scipy.stats import ttest_rel

from robotont_calibration.calibration_runs import Run, errors_along, poses_at_marks, repeats, taped_run
from robotont_calibration.standard_drives import calibration_drives
from robotont_calibration.wheel_estimation import calibrate, derivatives, information
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels

WORTH = 0.95     # more radii are taken when they leave less than this part of the error on held-out runs ...
CHANCE = 0.025   # ... and by chance that much less would be rarer than this
LITTLE = 0.9     # another run is recommended when it leaves less than this part of the expected error


class HeldOut(NamedTuple):
    """Errors of each run with parameters that were found without it and its repeats."""

    places: np.ndarray  # [m] root of the mean square along each run, or at its end
    yaws: np.ndarray    # [rad] at its end

    @property
    def place(self):
        """[m] mean over the runs."""
        return float(self.places.mean())

    def is_better_than(self, other):
        """Whether the places of the same runs are better than `other` ones by enough for more parameters."""
        chance = ttest_rel(other.places, self.places).pvalue / 2  # of both signs, and only one is asked for
        return bool(self.place < WORTH * other.place and chance < CHANCE)


def cross_validate(given, runs, free, wheel_noise, found):
    """`HeldOut` of runs, or None where they all repeat one drive. found: `Calibration` from all of them.

    Runs that repeat a drive are held out together, because they share the parameters of that drive.
    """
    groups = repeats(runs)
    if len(groups) < 2:
        return None
    places, yaws = np.empty(len(runs)), np.empty(len(runs))
    for group in groups:
        others = [run for index, run in enumerate(runs) if index not in group]
        blind = calibrate(given, others, free, wheel_noise, near=found)
        wheels = read_wheels(blind.parameters)
        for index in group:
            places[index], yaws[index] = errors_along(wheels, runs[index], blind.point)
    return HeldOut(places, yaws)


class Recommendation(NamedTuple):
    """The most informative next run."""

    name: str      # of the drive, for display
    now: float     # [m] expected error at the end of the drives, of parameters alone
    then: float    # [m] the same with another such run


def next_run(found, free, deviation):
    """`Recommendation`, or None where no single run would improve much.

    found: `Calibration`. free: those that it was made with. deviation: place [m] and yaw [rad] of a measured end.
    Judged by the root mean square of the place over all these drives that the parameters' uncertainty makes.
    """
    wheels = read_wheels(found.parameters)
    runs = [_ideal_run(what, wheels, twists, deviation)
            for _, what, _, twists in calibration_drives(wheels.pid_frequency)]
    slopes = [_slope_of_end(free, found.values, run) for run in runs]

    def expected(covariance):
        return math.sqrt(np.mean([np.trace(slope @ covariance @ slope.T) for slope in slopes]))
    now = expected(found.covariance)
    prior = np.linalg.inv(found.covariance)
    then, name = min((expected(np.linalg.inv(prior + information(run, free, found))), run.name) for run in runs)
    return Recommendation(name, now, then) if then < LITTLE * now else None


def _ideal_run(name, wheels, twists, deviation):
    """`Run` of a robot that drives exactly these twists, measured at its end."""
    counts = np.array(list(twists)) @ Kinematics(wheels).matrix.T / np.array(wheels.metres_per_edge) \
        / wheels.pid_frequency
    run = taped_run(name, counts, (0.0, 0.0, 0.0), deviation)
    return Run(*run[:3], poses_at_marks(wheels, run), *run[4:])


def _slope_of_end(free, values, run):
    """2 x P derivatives of the odometry's place at the end of a run by the values."""
    def end(at):
        return poses_at_marks(read_wheels(free.parameters(at)), run)[-1, :2]
    return derivatives(end, values)
