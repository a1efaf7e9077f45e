"""The recorded topics, and the odometry compared with the truth by the stamps of both."""

import threading
from typing import NamedTuple

import numpy as np
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState

from robotont_driver.kinematics import se2


class TimedPoses(NamedTuple):
    """N poses and when they held."""

    stamps: np.ndarray   # (N,) [s]
    poses: np.ndarray    # N x 3: x [m], y [m], yaw [rad]


class Track:
    """Poses as they come, from any thread."""

    def __init__(self):
        self._lock = threading.Lock()
        self._rows = []  # (stamp, x, y, yaw)

    def add(self, stamp, pose):
        """One more pose (x [m], y [m], yaw [rad]) at a time [s]."""
        with self._lock:
            self._rows.append((stamp, *pose))

    def add_odometry(self, message):
        """One more pose from a nav_msgs/Odometry."""
        self.add(message.header.stamp.to_sec(), se2.pose_of(message.pose.pose))

    def __len__(self):
        return len(self._rows)

    def snapshot(self):
        """`TimedPoses` of all up to now; nothing that comes later changes them."""
        with self._lock:
            rows = np.array(self._rows).reshape(-1, 4)
        return TimedPoses(rows[:, 0], rows[:, 1:])


def distances(odometry, truth):
    """(N,) [m] of each pose of the odometry from where the robot truly was at that stamp."""
    x, y = (np.interp(odometry.stamps, truth.stamps, axis) for axis in truth.poses.T[:2])
    return np.hypot(odometry.poses[:, 0] - x, odometry.poses[:, 1] - y)


def off_path(commanded, truth):
    """(N,) [m] of each true place from the nearest one of the commanded path (K x 2)."""
    begin, step = commanded[:-1], np.diff(commanded, axis=0)
    ways = truth.poses[:, None, :2] - begin
    parts = np.sum(ways * step, axis=2) / np.maximum(np.sum(step ** 2, axis=1), 1e-12)
    return np.min(np.hypot(*np.moveaxis(ways - np.clip(parts, 0.0, 1.0)[..., None] * step, 2, 0)), axis=1)


def end_error(odometry, truth):
    """([m], [rad]) between the last poses of the two."""
    x, y, yaw = odometry.poses[-1] - truth.poses[-1]
    return float(np.hypot(x, y)), abs(se2.wrap(float(yaw)))


class Recorder:
    """Listens to the driver until `end`."""

    def __init__(self):
        self.odometry = Track()
        self.link = None      # values of the link's newest diagnostics, by key
        self.joints = 0, ()   # number of joint_states so far, and the newest angles [rad]
        self._subscribers = [
            rospy.Subscriber("odom", Odometry, self.odometry.add_odometry, tcp_nodelay=True),
            rospy.Subscriber("joint_states", JointState, self._on_joints, tcp_nodelay=True),
            rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics),
        ]

    def _on_joints(self, message):
        self.joints = self.joints[0] + 1, message.position

    def _on_diagnostics(self, message):
        for status in message.status:
            if status.name.endswith(": link"):
                self.link = {value.key: value.value for value in status.values}

    def end(self):
        """Listen no longer."""
        for subscriber in self._subscribers:
            subscriber.unregister()


class Standstill:
    """Whether the wheels keep their angles from one look to the next, over at least five joint_states."""

    def __init__(self, recorder):
        self._recorder = recorder
        self._number, self._angles = recorder.joints

    def reached(self):
        """Ask once more."""
        number, angles = self._recorder.joints
        if number < self._number + 5:
            return False
        unchanged = angles == self._angles
        self._number, self._angles = number, angles
        return unchanged
