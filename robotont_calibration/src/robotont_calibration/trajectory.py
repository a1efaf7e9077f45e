"""Poses over time, (x [m], y [m], yaw [rad]): an estimate and a reference at the same times."""

import numpy as np

from robotont_driver.kinematics import se2


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


def synchronise(estimate, reference):
    """Both trajectories at the times of the estimate, where they overlap; the estimate laid on the reference's start.

    Raises ValueError when they share less than two poses.
    """
    start, end = max(estimate.times[0], reference.times[0]), min(estimate.times[-1], reference.times[-1])
    shared = (estimate.times >= start) & (estimate.times <= end)
    if shared.sum() < 2:
        raise ValueError(
            f"the estimate ({estimate.times[0]:.2f} to {estimate.times[-1]:.2f} s) and the reference "
            f"({reference.times[0]:.2f} to {reference.times[-1]:.2f} s) do not overlap in time")
    reference, poses = reference.at(estimate.times[shared]), estimate.poses[shared]
    moved = se2.compose(reference.poses[0], se2.between(poses[0], poses.T))
    return Trajectory(reference.times, np.transpose(moved)), reference


def seen_from(starts, ends):
    """K x 3 poses of `ends` as seen from `starts`, K x 3 each."""
    return np.transpose(se2.between(starts.T, ends.T))
