"""How well a scan fits the map, and the message about it; without ROS."""

import math
from typing import NamedTuple

import numpy as np

from robotont_driver.kinematics.se2 import compose

FEWEST_RAYS = 10  # of a scan that end somewhere; fewer prove nothing
MOST_RAYS = 120   # that are followed through the map


class Fit(NamedTuple):
    """Shares, 0 to 1, of the rays of a scan."""

    at_walls: float       # that end at a wall of the map
    through_walls: float  # that go on behind one: no obstacle explains them, a wrong pose or map does


def fit(floor_map, pose, ranges, angles, bounds, tolerance):
    """`Fit` of a scan and a FloorMap, where a ray ends at a wall up to `tolerance` [m] away; None when too few end.

    pose: (x [m], y [m], yaw [rad]) of the sensor on the map; ranges [m] and angles [rad]: N each; bounds: (least,
    largest) range [m] that the sensor measures, beyond which a ray has seen nothing.
    """
    ranges = np.asarray(ranges)
    ends = np.isfinite(ranges) & (ranges >= bounds[0]) & (ranges < bounds[1])
    if ends.sum() < FEWEST_RAYS:
        return None
    ranges, angles = ranges[ends], np.asarray(angles)[ends]
    x, y, _ = compose(pose, (ranges * np.cos(angles), ranges * np.sin(angles), 0.0))
    thin = slice(None, None, 1 + len(x) // MOST_RAYS)
    return Fit(floor_map.share_near_walls((x, y), tolerance),
               floor_map.share_through_walls(pose[:2], (x[thin], y[thin]), tolerance))


def deviations(covariance):
    """(position [m], yaw [rad]): standard deviations of a pose (covariance: 36), in the least certain direction."""
    covariance = np.reshape(covariance, (6, 6))
    return (math.sqrt(max(np.linalg.eigvalsh(covariance[:2, :2])[-1], 0.0)), math.sqrt(max(covariance[5, 5], 0.0)))
