"""The newest pose in shared memory, from which odom_node goes on when roslaunch starts it again, however it ended."""

import os
import struct
import sys
from pathlib import Path

import rospy

from robotont_driver.odometry.odometry import Covariance

FOLDER = Path("/dev/shm")  # not on a disk: written for each packet, and gone with the machine's run
LONGEST_GAP = 60.0         # [s] after a longer one nobody knows where the robot is
CONTENT = struct.Struct("<13d")  # time [s], pose, covariance (6), twist; written as a whole


class KeptPose:
    """One file per node and roslaunch; a new launch begins at the origin. `gap`: [s] since the pose; None: no pose."""

    def __init__(self, name, now):
        self.gap = self._file = None
        if not any(argument.startswith("__log:=") for argument in sys.argv):
            return  # not started by roslaunch
        path = FOLDER / f"robotont_odom_{os.getuid()}_{os.getppid()}_{name.replace('/', '_')}"
        try:
            self._file = os.open(str(path), os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_CREAT, 0o600)
            content = os.pread(self._file, CONTENT.size, 0)
        except OSError as error:
            self._give_up(error)
            return
        if len(content) < CONTENT.size:
            return
        at, *numbers = CONTENT.unpack(content)
        if 0.0 <= now - at <= LONGEST_GAP:  # since then the robot may have gone on at its speed, in any direction
            (x, y, turn), gap = numbers[9:], now - at
            way = gap ** 2 * (x ** 2 + y ** 2)
            unseen = Covariance(way, 0.0, 0.0, way, 0.0, (gap * turn) ** 2)
            self.gap, self.pose, self.covariance = gap, tuple(numbers[:3]), Covariance(*numbers[3:9]).plus(unseen)

    def keep(self, pose, covariance, twist, now):
        """Keep the pose (3), its Covariance and the twist (3) of `now` [s]."""
        if self._file is not None:
            try:
                os.pwrite(self._file, CONTENT.pack(now, *pose, *covariance, *twist), 0)
            except OSError as error:
                self._give_up(error)

    def _give_up(self, error):
        rospy.logwarn("odom_node will begin at the origin if it is started again: %s: %s", FOLDER, error)
        self._file = None
