"""The newest pose in shared memory, from which odom_node goes on when roslaunch starts it again, however it ended."""

import contextlib
import os
import struct
import sys
from pathlib import Path

import rospy

from robotont_driver.odometry.odometry import Covariance

FOLDER = Path("/dev/shm")  # not on a disk: written for each packet, and gone with the machine's run
LONGEST_GAP = 60.0         # [s] after a longer one nobody knows where the robot is
CONTENT = struct.Struct("<dq12d")  # time [s], packet's number or -1, pose, covariance (6), twist; written as a whole


class KeptPose:
    """One file per node and roslaunch: who starts a launch anew, or a node by hand, begins at the origin.

    `gap`: [s] since the pose from which it has gone on, or None. Without shared memory nothing is kept.
    """

    def __init__(self, name, now):
        self.gap = self._file = self._before = None
        if not any(argument.startswith("__log:=") for argument in sys.argv):
            return  # not started by roslaunch
        prefix = f"robotont_odom_{os.getuid()}_"
        try:
            for path in FOLDER.glob(prefix + "*"):
                if not (Path("/proc") / path.name[len(prefix):].partition("_")[0]).exists():
                    path.unlink()
            path = FOLDER / f"{prefix}{os.getppid()}_{name.replace('/', '_')}"
            self._file = os.open(str(path), os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_CREAT, 0o600)
            content = os.pread(self._file, CONTENT.size, 0)
        except OSError as error:
            self._give_up(error)
            return
        if len(content) == CONTENT.size:
            at, number, *numbers = CONTENT.unpack(content)
            if 0.0 <= now - at <= LONGEST_GAP:
                self._before, self.gap = (number, *numbers[9:]), now - at
                self.pose, self.covariance = tuple(numbers[:3]), Covariance(*numbers[3:9])

    def unseen(self, number, twist, period):
        """Covariance of what the robot has gone meanwhile; call it once, with the first packet's number and twist.

        It may have gone all the time at the faster of its speeds before and behind the gap, in any direction.
        """
        before, *old = self._before
        missed = number - before - 1 if number is not None and 0 <= before < number else None
        seconds = self.gap if missed is None else missed * period
        way = seconds ** 2 * max(x ** 2 + y ** 2 for x, y, _ in (old, twist))
        turn = seconds ** 2 * max(old[2] ** 2, twist[2] ** 2)
        return Covariance(way, 0.0, 0.0, way, 0.0, turn)

    def keep(self, number, pose, covariance, twist, now):
        """Keep a packet's number, the pose (3), its Covariance and the twist (3) of `now` [s]."""
        if self._file is not None:
            try:
                number = -1 if number is None else number
                os.pwrite(self._file, CONTENT.pack(now, number, *pose, *covariance, *twist), 0)
            except OSError as error:
                self._give_up(error)

    def _give_up(self, error):
        rospy.logwarn("odom_node will begin at the origin if it is started again: %s: %s", FOLDER, error)
        if self._file is not None:
            with contextlib.suppress(OSError):
                os.close(self._file)
        self._file = None
