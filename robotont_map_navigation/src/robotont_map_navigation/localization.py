"""How well a scan fits the map, and the message about it; without ROS."""

import math

import numpy as np

from robotont_driver.kinematics.se2 import compose

FEWEST_RAYS = 10  # of a scan that end somewhere; fewer prove nothing


def fit(floor_map, pose, ranges, angles, bounds, tolerance):
    """Share, 0 to 1, of the rays that end at most `tolerance` [m] from a wall of a FloorMap; None when too few end.

    pose: (x [m], y [m], yaw [rad]) of the sensor on the map; ranges [m] and angles [rad]: N each; bounds: (least,
    largest) range [m] that the sensor measures, beyond which a ray has seen nothing.
    """
    ranges = np.asarray(ranges)
    ends = np.isfinite(ranges) & (ranges >= bounds[0]) & (ranges < bounds[1])
    if ends.sum() < FEWEST_RAYS:
        return None
    ranges, angles = ranges[ends], np.asarray(angles)[ends]
    x, y, _ = compose(pose, (ranges * np.cos(angles), ranges * np.sin(angles), 0.0))
    return floor_map.share_near_walls((x, y), tolerance)


def deviations(covariance):
    """(position [m], yaw [rad]): standard deviations of a pose (covariance: 36), in the least certain direction."""
    covariance = np.reshape(covariance, (6, 6))
    return (math.sqrt(max(np.linalg.eigvalsh(covariance[:2, :2])[-1], 0.0)), math.sqrt(max(covariance[5, 5], 0.0)))
