"""Recorded runs of a robot: the wheels' counts, where it was measured meanwhile, and what lies between the two."""

import contextlib
import math
from typing import NamedTuple, Tuple

import numpy as np

from robotont_driver.kinematics import se2
from robotont_driver.kinematics.kinematics import Kinematics

TRACKED = (0.002, math.radians(0.2))  # [m], [rad] error of a ground truth's poses, and of their stamps
TAPED = (0.003, math.radians(0.7))    # [m], [rad] error of a tape and a ruler on the floor
STRETCH = 1.0        # [s] of a run whose true pose is known all the way
TURNING = math.radians(30)  # runs in which the heading changes by more than this determine the measured point
LONGEST_GAP = 5.0    # [s] between two packets of a run; all that the wheels turned within is missing
ALIKE = 0.1          # runs whose wheels' paths differ by less than this part of them repeat the same drive


class Run(NamedTuple):
    """A recorded run: the wheels' counts, the robot's poses at some packets, and the stretches that are compared."""

    name: str
    counts: np.ndarray             # K x n [edges]
    marks: np.ndarray              # M rising numbers of packets that had come when a pose was measured
    poses: np.ndarray              # M x 3 measured there: x [m], y [m], yaw [rad], modulo full turns
    deviation: Tuple[float, float]  # standard deviations of each as measured: place [m], yaw [rad]
    stretches: np.ndarray          # L indices of marks: from each to the next one the two are compared
    missing: int = 0               # packets, by the times of the others
    longest_gap: float = 0.0       # [s] between two packets


def read_end(text):
    """(x [m], y [m], yaw [rad]) of X,Y,YAW in m, m and degrees, with commas or spaces, to 1e6. Raises ValueError."""
    with contextlib.suppress(ValueError):
        x, y, yaw = map(float, text.replace(",", " ").split())
        if all(abs(value) <= 1e6 for value in (x, y, yaw)):
            return x, y, math.radians(yaw)
    raise ValueError(f"found {text!r}, allowed: X,Y,YAW of the end, seen from the start [m, m, degrees]")


def taped_run(name, counts, end):
    """`Run` of which only the end (x [m], y [m], yaw [rad]) is known, as seen from the start."""
    return Run(name, np.asarray(counts), np.array((0, len(counts))), np.array(((0.0, 0.0, 0.0), end)), TAPED,
               np.array((0,)))


def tracked_run(name, times, counts, truth):
    """`Run` of which the truth is known all the way, in stretches of about `STRETCH`.

    times: K [s] of the packets, rising; counts: K x n; truth: `Trajectory`. Only where the truth is known. Stretches
    without motion are excluded. Raises ValueError when nothing is left, or when packets of a long time are missing.
    """
    tracked = np.flatnonzero((times >= truth.times[0]) & (times <= truth.times[-1]))
    stretches = np.array(())
    if len(tracked) and np.ptp(times[tracked]) >= STRETCH:
        gaps = np.diff(times[tracked])
        widest = gaps.argmax()
        if gaps[widest] > LONGEST_GAP:
            raise ValueError(f"found a gap of {gaps[widest]:.6g} s behind the packet at {times[tracked[widest]]:.6f}, "
                             f"allowed: up to {LONGEST_GAP:g} s: make two recordings of it, or repeat the run")
        amount = round((times[tracked[-1]] - times[tracked[0]]) / STRETCH)
        marks = np.unique(np.linspace(tracked[0], tracked[-1], amount + 1).round().astype(int))
        counts = np.asarray(counts)
        stretches = np.flatnonzero([counts[begin + 1:end + 1].any() for begin, end in zip(marks, marks[1:])])
    if not stretches.size:
        raise ValueError(f"found no {STRETCH:g} s of packets with motion while the true pose is known")
    first = marks[0] + 1
    return Run(name, counts[first:marks[-1] + 1], marks + 1 - first, truth.at(times[marks]), TRACKED, stretches)


def repeats(runs):
    """Lists of indices of runs that repeat the same drive: the same paths of the wheels, as shares of all."""
    paths = [np.concatenate([run.counts.sum(axis=0), np.abs(run.counts).sum(axis=0)])
             / max(np.abs(run.counts).sum(), 1) for run in runs]
    groups = []
    for index, path in enumerate(paths):
        near = [group for group in groups if np.linalg.norm(paths[group[0]] - path) < ALIKE]
        if near:
            near[0].append(index)
        else:
            groups.append([index])
    return groups


def turns(runs):
    """Whether the runs turn enough between measured poses to determine the measured point."""
    return any(np.abs(se2.wrap(run.poses[:, 2] - run.poses[0, 2])).max() > TURNING for run in runs)


def odometry(wheels, counts, point=(0.0, 0.0)):
    """K + 1 x 3 poses of a point (x, y) [m] of base_link by counts K x n, of a robot at the origin; yaw not wrapped."""
    poses = np.vstack([np.zeros(3), se2.path(counts @ to_step(wheels).T)])
    return np.transpose(se2.compose(poses.T, (*point, 0.0)))


def errors_along(wheels, run, point=(0.0, 0.0)):
    """(place [m], root of the mean square over the marks; yaw [rad] at the last) by which the odometry is wrong.

    Both are seen from the first mark.
    """
    found, true = (np.array(se2.between(poses[0], poses[1:].T))
                   for poses in (odometry(wheels, run.counts, point)[run.marks], run.poses))
    x, y, yaw = found - true
    return float(np.sqrt(np.mean(x ** 2 + y ** 2))), float(abs(se2.wrap(yaw[-1])))


def to_step(wheels):
    """3 x n: a packet's motion in base_link by its counts, formulas (8)-(11)."""
    return Kinematics(wheels).inverse * np.array(wheels.metres_per_edge)
