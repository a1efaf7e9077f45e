"""Poses over time, (x [m], y [m], yaw [rad]): an estimate and a reference at the same times."""

import numpy as np

from robotont_driver.kinematics import se2


class Trajectory:
    """Poses over time, finite numbers. times: K [s], rising; poses: K x 3, whose yaw is unwrapped here.

    Poses of a stamp that is not newer than the one before are dropped. Raises ValueError when fewer than two remain.
    """

    def __init__(self, times, poses):
        times, poses = np.asarray(times, dtype=float), np.array(poses, dtype=float).reshape(-1, 3)
        newest = np.maximum.accumulate(np.concatenate([[-np.inf], times[:-1]]))
        times, poses = times[times > newest], poses[times > newest]
        if len(times) < 2:
            raise ValueError(f"found {len(times)} poses at different times, allowed: 2 or more")
        poses[:, 2] = np.unwrap(poses[:, 2])
        self.times = times
        self.poses = poses

    def at(self, times):
        """Poses at other `times` [s] within its own, on straight lines between its poses."""
        return np.column_stack([np.interp(times, self.times, column) for column in self.poses.T])


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
    times, poses = estimate.times[shared], estimate.poses[shared]
    true = reference.at(times)
    moved = se2.compose(true[0], se2.between(poses[0], poses.T))
    return Trajectory(times, np.transpose(moved)), Trajectory(times, true)
