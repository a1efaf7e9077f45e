"""Calibration on a real robot: how far its odometry is from the truth on drives that it was not fitted on.

The data set is OptiOdom (https://github.com/sousarbarb/optiodom, folder data/omni3), a robot with three omni wheels
tracked by OptiTrack. OPTIODOM=FOLDER names that folder; without it there is nothing to measure. The joystick drives
are what is judged by: nothing is ever fitted or chosen on them.
"""

import math
import os
from pathlib import Path

import numpy as np

from robotont_calibration.calibrate_wheels import SECONDS, TRACKED, WHEEL_NOISE
from robotont_calibration.calibration_runs import end_misfit, errors_along, steps_of, tracked_run
from robotont_calibration.recording_files import read_recording
from robotont_calibration.trajectory import seen_from
from robotont_calibration.unknowns import Unknowns
from robotont_calibration.wheel_estimation import calibrate
from robotont_driver.kinematics import se2
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.nodes.odom_node import PARAMETERS
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_driver.robots.wheel_file import read_wheel_file
from robotont_testing.figures import row

ROOT = Path(__file__).resolve().parents[1]
NOMINAL = ROOT / "robotont_calibration" / "test" / "data" / "optiodom" / "wheel_params.yaml"
SETS = {"circles": ("circular/221220201701", "circular/221220201750"),
        "squares": ("square/221220201934", "square/221220201953"),
        "joystick": ("joystick/221220202228", "joystick/221220202235")}
MOST = {"joystick": "<= 55"}  # [mm]


def runs_of(folder, name):
    """`Run`s of one of SETS."""
    wheels = read_wheel_file(NOMINAL)[0]
    runs = []
    for part in SETS[name]:
        for file in sorted((folder / part).glob("*_run-[0-9][0-9].csv")):
            recording = read_recording(file, {}, "optiodom")
            times, counts = recording.counts(wheels)
            runs.append(tracked_run(file.stem, times, counts, recording.trajectory("truth"), SECONDS, TRACKED))
    return runs


def bench_splits(_options):
    """Rows of the error on sets that were not fitted, for each choice of what is."""
    folder = os.environ.get("OPTIODOM")
    if not folder:
        return [row("calibration on OptiOdom", None, "mm", note="OPTIODOM=FOLDER/data/omni3 is not set")]
    given = read_wheel_file(NOMINAL)[1]
    runs = {name: runs_of(Path(folder), name) for name in SETS}
    rows = []
    for fitted in ((), ("circles",), ("squares",), ("circles", "squares")):
        for radius in ("common", "each") if fitted else ("common",):
            parameters, point = given, (0.0, 0.0)
            if fitted:
                unknowns = Unknowns(given, radius, point="free")
                found = calibrate(given, [run for name in fitted for run in runs[name]], unknowns, WHEEL_NOISE)
                parameters, point = found.parameters, found.point
            if len(fitted) == 2 and radius == "common":
                rows.append(row("normalised squared error at the joystick drives' ends, wheel_noise by default",
                                normalised_error(read_wheels(parameters), runs["joystick"], point), "", bound="<= 4.5",
                                note="3 is right; 95 % bounds 1.8 to 4.5"))
            for unseen in sorted(runs.keys() - set(fitted)):
                errors = np.mean([errors_along(read_wheels(parameters), run, point) for run in runs[unseen]], axis=0)
                rows.append(row(f"{' + '.join(fitted) or 'nominal'} ({radius} radius) -> {unseen}", 1000 * errors[0],
                                "mm", bound=MOST.get(unseen, "") if len(fitted) == 2 and radius == "common" else "",
                                note=f"heading at the end {math.degrees(errors[1]):.1f} deg; at the ends "
                                     + ends(read_wheels(parameters), runs[unseen], point)))
    return rows


def ends(wheels, runs, point):
    """The data set's own four measures: errors of place and heading where runs end, on average and at worst."""
    errors = np.array([end_misfit(wheels, run, point) for run in runs])
    places, turns = np.hypot(errors[:, 0], errors[:, 1]), np.degrees(np.abs(errors[:, 2]))
    return (f"{places.mean():.3f} m and {turns.mean():.1f} deg on average, "
            f"{places.max():.3f} m and {turns.max():.1f} deg at worst")


def normalised_error(wheels, runs, point):
    """Mean over runs of the pose's squared error by its covariance, of odometry with the default `wheel_noise`."""
    (noise,) = (parameter.default for parameter in PARAMETERS if parameter.name == "wheel_noise")
    errors, mark = [], (*point, 0.0)
    for run in runs:
        odometry = WheelOdometry(Kinematics(wheels), 1.0 / wheels.pid_frequency, noise)
        for counts in run.counts[:run.marks[-1]].tolist():
            odometry.update(counts, 0.0)
        moved = seen_from(run.poses[:1], run.poses[-1:])[0]
        truth = se2.compose(se2.compose(mark, moved), se2.between(mark, (0.0, 0.0, 0.0)))
        pose = odometry.pose
        error = np.subtract((pose.x, pose.y, pose.yaw), truth)
        error[2] = se2.wrap(float(error[2]))
        errors.append(error @ np.linalg.solve(odometry.pose_covariance.matrix, error))
    return float(np.mean(errors))


def bench_headings():
    """Rows of what headings allow: three free numbers, fitted to the headings at the runs' ends and nothing else.

    No odometry that is linear in the counts can have better headings on the runs it is fitted to. What it leaves there
    is no error of the parameters: the robot turns less while it drives than on the spot.
    """
    folder = os.environ.get("OPTIODOM")
    if not folder:
        return []
    wheels = read_wheel_file(NOMINAL)[0]
    turned = {name: tuple(map(np.array, zip(*(_turned(wheels, run) for run in runs_of(Path(folder), name)))))
              for name in SETS}
    rows = []
    for fitted in (("circles",), ("squares",), ("circles", "squares")):
        numbers = np.linalg.lstsq(*(np.concatenate(parts) for parts in zip(*(turned[name] for name in fitted))),
                                  rcond=None)[0]
        for name, (steps, headings) in turned.items():
            left = np.degrees(np.abs(headings - steps @ numbers).mean())
            rows.append(row(f"heading alone, three free numbers: {' + '.join(fitted)} -> {name}", left, "deg",
                            note="the runs it is fitted to" if name in fitted else ""))
    return rows


def _turned(wheels, run):
    """(3 sums of the nominal steps in base_link, [rad] that the robot turned) of a run."""
    steps = steps_of(wheels, run.counts).sum(axis=0)
    turned = np.unwrap(run.poses[:, 2])
    return steps, turned[-1] - turned[0]


PARTS = (bench_splits, bench_headings)
