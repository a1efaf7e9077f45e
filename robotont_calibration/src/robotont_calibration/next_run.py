"""The run that would improve a calibration most."""

import math

import numpy as np

from robotont_calibration.calibration_runs import odometry, taped_run
from robotont_calibration.linear_runs import linear_runs
from robotont_calibration.standard_drives import calibration_drives
from robotont_calibration.wheel_estimation import information
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels

LITTLE = 0.9     # another run is recommended when it leaves less than this part of the expected error


def next_run(found, *sizes):
    """(name of a drive, expected error [m] at the end of the drives now, and then); None: no run would improve much.

    found: `Calibration`; sizes: of `calibration_drives`. Judged by the root mean square of the place over all these
    drives that the uncertainty of its parameters makes.
    """
    wheels = read_wheels(found.parameters)
    runs = [_ideal_run(what, wheels, twists) for _, what, _, twists in calibration_drives(wheels.pid_frequency, *sizes)]
    slopes = [model.slopes[:2] for model in linear_runs(found.free, found.values, runs)]

    def expected(covariance):
        return math.sqrt(np.mean([np.trace(slope @ covariance @ slope.T) for slope in slopes]))
    now = expected(found.covariance)
    prior = np.linalg.inv(found.covariance)
    then, name = min((expected(np.linalg.inv(prior + information(run, found))), run.name) for run in runs)
    return (name, now, then) if then < LITTLE * now else None


def _ideal_run(name, wheels, twists):
    """`Run` of a robot that drives exactly these twists, measured at its end by tape."""
    kinematics = Kinematics(wheels)
    counts = np.array(list(twists)) @ kinematics.matrix.T * kinematics.units_per_speed
    return taped_run(name, counts, odometry(wheels, counts)[-1])
