"""The path that a robot has travelled: poses some distance apart, at most a given number."""

import math
from collections import deque
from typing import NamedTuple

# A step this many times as long as the speed explains, plus JUMP, means that the odometry was reset.
STRETCH = 2.0
JUMP = 0.1           # [m] more than noise and a late packet
LONGEST_GAP = 1.0    # [s] a longer silence explains no longer step


class Sample(NamedTuple):
    """One odometry message."""

    time: float   # [s]
    x: float      # [m]
    y: float      # [m]
    yaw: float    # [rad]
    speed: float  # [m/s] over ground


class Trail:
    """Keeps a sample when it lies `min_distance` [m] or more from the last one kept.

    `poses`: the kept samples, oldest first; of more than `max_poses` the oldest are forgotten.
    """

    def __init__(self, max_poses, min_distance):
        self.poses = deque(maxlen=max_poses)
        self._min_distance = min_distance
        self._newest = None

    def add(self, sample):
        """Take a Sample; returns whether the path has changed.

        The path starts again where time runs backwards (a bag played again) or where the robot cannot have
        driven to (a reset of the odometry, another start of its node).
        """
        if self._newest and self._is_jump(self._newest, sample):
            self.poses.clear()
        self._newest = sample
        if self.poses and distance(self.poses[-1], sample) < self._min_distance:
            return False
        self.poses.append(sample)
        return True

    @staticmethod
    def _is_jump(before, after):
        elapsed = after.time - before.time
        reach = max(before.speed, after.speed) * min(elapsed, LONGEST_GAP)
        return elapsed < 0.0 or distance(before, after) > STRETCH * reach + JUMP


def distance(one, other):
    """[m] between two samples."""
    return math.hypot(one.x - other.x, one.y - other.y)
