"""Recorded runs of a robot: the wheels' counts, where it was measured meanwhile, and what lies between the two."""

import math
from typing import NamedTuple, Tuple

import numpy as np

from robotont_calibration.trajectory import seen_from
from robotont_driver.kinematics import se2
from robotont_driver.kinematics.kinematics import Kinematics

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
    stretches: np.ndarray          # L x 2 indices of marks: begin and end
    missing: int = 0               # packets, by the times of the others
    longest_gap: float = 0.0       # [s] between two packets

    @property
    def moved(self):
        """L x 3 measured motions, the end of each stretch as seen from its begin."""
        begins, ends = self.stretches.T
        return seen_from(self.poses[begins], self.poses[ends])


def taped_run(name, counts, end, deviation):
    """`Run` of which only the end (x [m], y [m], yaw [rad]) is known, as seen from the start."""
    return Run(name, np.asarray(counts), np.array((0, len(counts))), np.array(((0.0, 0.0, 0.0), end)), deviation,
               np.array(((0, 1),)))


def tracked_run(name, times, counts, truth, seconds, deviation):
    """`Run` of which the truth is known all the way, in stretches of about so many `seconds`.

    times: K [s] of the packets, rising; counts: K x n; truth: `Trajectory`. Only where the truth is known. Stretches
    without motion are excluded. Raises ValueError when nothing is left, or when packets of a long time are missing.
    """
    tracked = np.flatnonzero((times >= truth.times[0]) & (times <= truth.times[-1]))
    stretches = []
    if len(tracked) > 1:
        gaps = np.diff(times[tracked])
        widest = gaps.argmax()
        if gaps[widest] > LONGEST_GAP:
            raise ValueError(f"found a gap of {gaps[widest]:.6g} s behind the packet at {times[tracked[widest]]:.6f}, "
                             f"allowed: up to {LONGEST_GAP:g} s: make two recordings of it, or repeat the run")
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


def poses_at_marks(wheels, run, point=(0.0, 0.0)):
    """M x 3 poses of the measured point at the marks, of odometry that begins at the origin; yaw is not wrapped."""
    poses = np.vstack([np.zeros(3), se2.path(steps_of(wheels, run.counts))])[run.marks]
    return np.transpose(se2.compose(poses.T, (*point, 0.0)))


def misfits(wheels, run, point=(0.0, 0.0)):
    """M - 1 x 3 (x [m], y [m], yaw [rad]) by which the odometry misses each further mark, seen from the first one."""
    poses = poses_at_marks(wheels, run, point)
    start = np.zeros(len(poses) - 1, dtype=int)
    left = seen_from(poses[start], poses[1:]) - seen_from(run.poses[start], run.poses[1:])
    left[:, 2] = se2.wrap(left[:, 2])
    return left


def errors_along(wheels, run, point=(0.0, 0.0)):
    """(place [m], root of the mean square over the marks; yaw [rad] at the last) by which the odometry is wrong."""
    left = misfits(wheels, run, point)
    return float(np.sqrt(np.mean(left[:, 0] ** 2 + left[:, 1] ** 2))), float(abs(left[-1, 2]))


def steps_of(wheels, counts):
    """K x 3 steps in base_link, of counts K x n."""
    return counts @ to_step(wheels).T


def to_step(wheels):
    """3 x n: a packet's motion in base_link by its counts, formulas (8)-(11)."""
    return Kinematics(wheels).inverse * np.array(wheels.metres_per_edge)
