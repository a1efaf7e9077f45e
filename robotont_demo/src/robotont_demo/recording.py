"""The recorded topics, and the odometry compared with the truth by the stamps of both."""

from typing import NamedTuple

import numpy as np
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry

from robotont_driver.kinematics import se2


class TimedPoses(NamedTuple):
    """N poses and when they held."""

    stamps: np.ndarray   # (N,) [s]
    poses: np.ndarray    # N x 3: x [m], y [m], yaw [rad]


def timed(rows):
    """`TimedPoses` of rows (stamp, x, y, yaw); of those up to now, while more are appended."""
    table = np.array(list(rows)).reshape(-1, 4)
    return TimedPoses(table[:, 0], table[:, 1:])


def distances(odometry, truth):
    """(N,) [m] of each pose of the odometry from where the robot truly was at that stamp."""
    x, y = (np.interp(odometry.stamps, truth.stamps, axis) for axis in truth.poses.T[:2])
    return np.hypot(odometry.poses[:, 0] - x, odometry.poses[:, 1] - y)


def end_error(odometry, truth):
    """([m], [rad]) between the last poses of the two."""
    x, y, yaw = odometry.poses[-1] - truth.poses[-1]
    return float(np.hypot(x, y)), abs(se2.wrap(float(yaw)))


class Recorder:
    """Listens to the stack until `end`. `odometry`, `truth`: rows (stamp, x, y, yaw); wheels slip a little."""

    def __init__(self):
        self.odometry, self.truth = [], []
        self.stands_since = None  # [s] stamp of the first true pose of a robot that stands; None while it moves
        self.link = None          # values of the link's newest diagnostics, by key
        self.drives = False       # whether commands reach the board, and it obeys them
        self._subscribers = [
            rospy.Subscriber("odom", Odometry, lambda message: self.odometry.append(row_of(message)), tcp_nodelay=True),
            rospy.Subscriber("ground_truth/odom", Odometry, self._on_truth, tcp_nodelay=True),
            rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics),
        ]

    def _on_truth(self, message):
        self.truth.append(row_of(message))
        twist = message.twist.twist
        if max(abs(twist.linear.x), abs(twist.linear.y), abs(twist.angular.z)) >= 2e-3:
            self.stands_since = None
        elif self.stands_since is None:
            self.stands_since = self.truth[-1][0]

    def _on_diagnostics(self, message):
        for status in message.status:
            if status.name.endswith(": link"):
                self.link = {value.key: value.value for value in status.values}
            if status.name.endswith(": board"):
                self.drives = obeys(status, self.link)

    def end(self):
        """Listen no longer."""
        for subscriber in self._subscribers:
            subscriber.unregister()


def obeys(board, link):
    """Whether a board follows commands, by its DiagnosticStatus and the link's values (None: not known yet).

    At the start the board is asked who it is, and driver_node connects to the link: a command before that comes late.
    """
    return board.level == board.OK and link is not None and int(link["packets written"]) > 0


def row_of(message):
    """(stamp, x, y, yaw) of a nav_msgs/Odometry."""
    return (message.header.stamp.to_sec(), *se2.pose_of(message.pose.pose))
