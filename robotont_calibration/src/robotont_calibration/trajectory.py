"""How far an estimated path is from a reference: absolute and relative error, drift, timing.

Poses are (x [m], y [m], yaw [rad]), K x 3; times in [s]. The measures are those of J. Sturm et al., A
Benchmark for the Evaluation of RGB-D SLAM Systems (IROS 2012), on the plane.
"""

import math
from typing import NamedTuple

import numpy as np

from robotont_driver.kinematics import se2

ALIGNMENTS = ("origin", "best", "none")


class Trajectory:
    """Poses over time. times: K [s], rising; poses: K x 3, whose yaw is unwrapped here.

    Poses of a stamp that is not newer than the one before are dropped. Raises ValueError when fewer than
    two remain or a number is not finite.
    """

    def __init__(self, times, poses):
        times, poses = np.asarray(times, dtype=float), np.array(poses, dtype=float).reshape(-1, 3)
        if len(times) != len(poses):
            raise ValueError(f"found {len(times)} times for {len(poses)} poses, allowed: one time per pose")
        if not (np.isfinite(times).all() and np.isfinite(poses).all()):
            raise ValueError("found a time or pose that is not a finite number")
        newest = np.maximum.accumulate(np.concatenate([[-np.inf], times[:-1]]))
        times, poses = times[times > newest], poses[times > newest]
        if len(times) < 2:
            raise ValueError(f"found {len(times)} poses at different times, allowed: 2 or more")
        poses[:, 2] = np.unwrap(poses[:, 2])
        self.times = times
        self.poses = poses

    def at(self, times):
        """The trajectory at other `times` [s] within its own, on straight lines between its poses."""
        return Trajectory(times, np.column_stack([
            np.interp(times, self.times, column) for column in self.poses.T]))

    def between(self, start, end):
        """The part from `start` to `end` [s]."""
        inside = (self.times >= start) & (self.times <= end)
        return Trajectory(self.times[inside], self.poses[inside])

    @property
    def steps(self):
        """[m] K - 1 distances from each pose to the next."""
        return np.hypot(*np.diff(self.poses[:, :2], axis=0).T)

    @property
    def length(self):
        """[m] of the path."""
        return float(self.steps.sum())

    @property
    def turned(self):
        """[rad] turned to and fro on the whole."""
        return float(np.abs(np.diff(self.poses[:, 2])).sum())

    def speeds(self, window=0.2):
        """(times [s], speeds [m/s], turning speeds [rad/s]): differences over a `window` [s]."""
        times = np.arange(self.times[0], self.times[-1] - window, window / 2)
        start, end = (np.column_stack([np.interp(at, self.times, column) for column in self.poses.T])
                      for at in (times, times + window))
        moved = (end - start) / window
        return times + window / 2, np.hypot(moved[:, 0], moved[:, 1]), moved[:, 2]


def synchronise(estimate, reference):
    """Both trajectories at the times of the estimate, where they overlap.

    Raises ValueError when they share less than two poses.
    """
    start, end = max(estimate.times[0], reference.times[0]), min(estimate.times[-1], reference.times[-1])
    if ((estimate.times >= start) & (estimate.times <= end)).sum() < 2:
        raise ValueError(
            f"the estimate ({estimate.times[0]:.2f} to {estimate.times[-1]:.2f} s) and the reference "
            f"({reference.times[0]:.2f} to {reference.times[-1]:.2f} s) do not overlap in time")
    estimate = estimate.between(start, end)
    return estimate, reference.at(estimate.times)


def align(estimate, reference, how):
    """The estimate moved as a whole, of two synchronised trajectories.

    how: "origin": first poses the same; "best": least sum of squared distances (S. Umeyama, 1991, without
    scale); "none". Raises ValueError for anything else.
    """
    if how == "none":
        return estimate
    if how == "origin":
        turn = reference.poses[0, 2] - estimate.poses[0, 2]
        source, target = estimate.poses[0, :2], reference.poses[0, :2]
    elif how == "best":
        source, target = estimate.poses[:, :2].mean(axis=0), reference.poses[:, :2].mean(axis=0)
        ours, theirs = estimate.poses[:, :2] - source, reference.poses[:, :2] - target
        turn = math.atan2(np.sum(ours[:, 0] * theirs[:, 1] - ours[:, 1] * theirs[:, 0]), np.sum(ours * theirs))
    else:
        raise ValueError(f"found alignment {how!r}, allowed: {', '.join(ALIGNMENTS)}")
    moved = se2.between((*source, 0.0), estimate.poses.T)
    return Trajectory(estimate.times, np.transpose(se2.compose((*target, turn), moved)))


def absolute_errors(estimate, reference):
    """(distances [m], K; headings [rad], K, within half a turn) of two synchronised, aligned trajectories."""
    difference = estimate.poses - reference.poses
    return np.hypot(difference[:, 0], difference[:, 1]), np.abs(se2.wrap(difference[:, 2]))


def relative_errors(estimate, reference, delta):
    """Errors of the motion over consecutive stretches of `delta` [m] of the reference's path.

    The stretches are those of evo_rpe: from one pose at which another `delta` was complete to the next, so that
    the first one begins `delta` behind the start. Returns (distances [m], headings [rad]), one per stretch; none
    where the path is shorter than two.
    """
    marks, gone = [], 0.0
    for index, step in enumerate(reference.steps, 1):
        gone += step
        if gone >= delta:
            marks.append(index)
            gone = 0.0
    begins, ends = marks[:-1], marks[1:]
    moved = seen_from(reference.poses[begins], reference.poses[ends])
    believed = seen_from(estimate.poses[begins], estimate.poses[ends])
    errors = seen_from(moved, believed)
    return np.hypot(errors[:, 0], errors[:, 1]), np.abs(se2.wrap(errors[:, 2]))


def seen_from(starts, ends):
    """K x 3 poses of `ends` as seen from `starts`, K x 3 each."""
    return np.transpose(se2.between(starts.T, ends.T))


def root_mean_square(values):
    """Root of the mean square; not a number of nothing."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else math.nan


class Timing(NamedTuple):
    """When messages came."""

    messages: int
    rate: float       # [1/s]
    period: float     # [s] median between two messages
    jitter: float     # [s] 99 % of the periods are within this of the median
    longest: float    # [s] between two messages
    missing: int      # periods without a message


def timing(times):
    """`Timing` of K >= 2 rising stamps [s]."""
    periods = np.diff(times)
    median = float(np.median(periods))
    missing = np.maximum(np.round(periods / median) - 1, 0).sum() if median > 0 else 0
    return Timing(len(times), (len(times) - 1) / (times[-1] - times[0]), median,
                  float(np.percentile(np.abs(periods - median), 99)), float(periods.max()), int(missing))


def write_tum(path, trajectory):
    """Write a file in TUM format: `time x y z qx qy qz qw` a line, as evo and others read it."""
    with open(path, "w") as file:
        for time, (x, y, yaw) in zip(trajectory.times.tolist(), trajectory.poses.tolist()):
            file.write(f"{time:.9f} {x!r} {y!r} 0 0 0 {math.sin(yaw / 2)!r} {math.cos(yaw / 2)!r}\n")
