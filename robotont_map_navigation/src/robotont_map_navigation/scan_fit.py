"""How well a scan fits the map, and the message about it; without ROS."""

import itertools
import math
from typing import NamedTuple

import numpy as np

from robotont_driver.kinematics.se2 import compose

FEWEST_RAYS = 10  # of a scan that show something; fewer prove nothing
MOST_RAYS = 60    # that are compared with the map
NEARLY = tuple(itertools.product((0.0, -0.1, 0.1), repeat=3))  # [m], [m], [rad] off, amcl finds the pose by itself
GOOD = 0.9        # explained less those through walls, from which on no pose beside it is looked at


class Fit(NamedTuple):
    """Shares, 0 to 1, of the rays of a scan."""

    explained: float      # that end at a wall of the map, or see nothing where it has nothing
    through_walls: float  # that go on behind one: no obstacle explains them, a wrong pose or a changed room does

    @property
    def worth(self):
        """What speaks for the pose less what speaks against it, -1 to 1."""
        return self.explained - self.through_walls


def fit(floor_map, pose, ranges, angles, bounds, tolerance):
    """`Fit` of a scan and a FloorMap at a pose or NEARLY there, the best; None when too few rays show anything.

    pose: (x [m], y [m], yaw [rad]) of the sensor on the map; ranges [m] and angles [rad]: N each; bounds: (least,
    largest) range [m] that the sensor measures, inf where a ray has seen nothing (REP 117); tolerance: [m] from a wall
    at which a ray still ends at it.
    """
    ranges = np.asarray(ranges)
    shows = ((ranges >= bounds[0]) & (ranges < bounds[1])) | (ranges == math.inf)
    if shows.sum() < FEWEST_RAYS:
        return None
    thin = slice(None, None, 1 + shows.sum() // MOST_RAYS)
    ranges, angles = ranges[shows][thin], np.asarray(angles)[shows][thin]
    ends, lengths = np.isfinite(ranges), np.minimum(ranges, bounds[1])
    best = Fit(0.0, 1.0)
    for off in NEARLY:
        place = tuple(np.add(pose, off))
        x, y, _ = compose(place, (lengths * np.cos(angles), lengths * np.sin(angles), 0.0))
        through = floor_map.are_behind_walls(place[:2], (x, y), tolerance)
        explained = np.where(ends, floor_map.are_near_walls((x, y), tolerance), ~through)
        best = max(best, Fit(float(explained.mean()), float(through.mean())), key=lambda one: one.worth)
        if best.worth > GOOD:
            break
    return best


def deviations(covariance):
    """(position [m], yaw [rad]): standard deviations of a pose (covariance: 36), in the least certain direction."""
    covariance = np.reshape(covariance, (6, 6))
    return (math.sqrt(max(np.linalg.eigvalsh(covariance[:2, :2])[-1], 0.0)), math.sqrt(max(covariance[5, 5], 0.0)))
