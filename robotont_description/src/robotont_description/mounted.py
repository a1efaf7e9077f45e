"""How what is mounted on the robot lies."""

import numpy as np


def rotation_of(quaternion):
    """3 x 3 rotation matrix of a quaternion with attributes x, y, z, w: for what hangs or tilts and has no mere yaw."""
    x, y, z, w = quaternion.x, quaternion.y, quaternion.z, quaternion.w
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def seen_from_above(rotation, angles):
    """(angles [rad], shares) of a scanner's rays as they lie on the floor, for its 3 x 3 `rotation`; angles: N.

    What hangs upside down is mirrored, and what tilts shortened: a share is that of the ray's length.
    """
    x, y = np.dot(np.asarray(rotation)[:2, :2], (np.cos(angles), np.sin(angles)))
    return np.arctan2(y, x), np.hypot(x, y)
