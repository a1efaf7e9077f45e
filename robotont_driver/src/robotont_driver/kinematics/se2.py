"""Poses and displacements, poses seen from the pose before, in the plane: triples (x [m], y [m], yaw [rad]).

The components are numbers, or arrays of one shape: K x 3 poses go in as `poses.T`. Only `wrap` wraps a yaw.
"""

import math

import numpy as np


def compose(pose, displacement):
    """The pose reached from `pose` by a `displacement` in its frame."""
    x, y, yaw = pose
    forward, left, turn = displacement
    cos, sin = cos_sin(yaw)
    return x + cos * forward - sin * left, y + sin * forward + cos * left, yaw + turn


def between(start, end):
    """The displacement that leads from the pose `start` to the pose `end`, in the frame of `start`."""
    x, y, turn = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    cos, sin = cos_sin(start[2])
    return cos * x + sin * y, cos * y - sin * x, turn


def arc(motion, heading=0.0):
    """The displacement that a constant twist makes, given its integral (v_x t [m], v_y t [m], omega t [rad]).

    The exponential map of SE(2): the chord is the motion shortened by sinc(turn / 2), turned by half of the turn.
    heading: yaw [rad] at its start, in the frame in which the displacement is wanted.
    """
    forward, left, turn = motion
    half = turn / 2
    cos, sin = cos_sin(heading + half)
    chord = sinc(half)
    return chord * (cos * forward - sin * left), chord * (sin * forward + cos * left), turn


def path(motions):
    """K x 3 poses behind each of K `motions` (K x 3, as in `arc`), driven one after the other from the origin."""
    motions = np.asarray(motions)
    forward, left, turn = arc(motions.T)
    yaw = np.cumsum(turn)
    cos, sin = np.cos(yaw - turn), np.sin(yaw - turn)
    return np.column_stack([np.cumsum(cos * forward - sin * left), np.cumsum(sin * forward + cos * left), yaw])


def wrap(angle):
    """The same angle [rad] modulo full turns, within [-pi, pi]."""
    if isinstance(angle, np.ndarray):
        return np.arctan2(np.sin(angle), np.cos(angle))
    return math.remainder(angle, 2 * math.pi)


def yaw_of(quaternion):
    """Yaw [rad], within [-pi, pi], of a quaternion with attributes x, y, z, w (geometry_msgs/Quaternion)."""
    x, y, z, w = quaternion.x, quaternion.y, quaternion.z, quaternion.w
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def pose_of(pose):
    """(x [m], y [m], yaw [rad]) of a geometry_msgs/Pose."""
    return pose.position.x, pose.position.y, yaw_of(pose.orientation)


def cos_sin(angle):
    """(cosine, sine) of an angle [rad] or of an array of them."""
    if isinstance(angle, np.ndarray):
        return np.cos(angle), np.sin(angle)
    return math.cos(angle), math.sin(angle)


def sinc(angle):
    """sin(angle) / angle, and 1 at 0. angle: [rad], one or an array."""
    if isinstance(angle, np.ndarray):
        return np.sinc(angle / math.pi)
    return math.sin(angle) / angle if angle else 1.0
