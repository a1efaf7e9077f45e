"""The newest pose in shared memory, from which odom_node goes on when it is started again, however it has ended."""

import contextlib
import fcntl
import os
import re
import struct
import uuid
from pathlib import Path
from typing import NamedTuple, Tuple

import rospy

from robotont_driver.odometry.covariance import Covariance
from robotont_driver.ros.node_parameters import RUN

FOLDER = Path("/dev/shm")  # not on a disk: written for each packet, and gone with the machine's run
LONGEST_GAP = 60.0         # [s] after a longer one nobody knows where the robot is
STOPS_WITHIN = 1.0         # [s] for which it may have gone on at its speed, uncounted
CONTENT = struct.Struct("<d12d")  # time [s], pose, its covariance (6), twist; Linux writes so little as a whole


class Kept(NamedTuple):
    """A pose before a gap."""

    pose: Tuple[float, ...]  # x [m], y [m], yaw [rad]
    covariance: Covariance   # with what the gap adds
    gap: float               # [s] since it was measured


class KeptPose:
    """One file per run of a robot and user; a parameter of the node names it, so that a new launch starts anew.

    name: full name of the node. `found`: the `Kept` of the run before, or None. Where there is no shared memory,
    nothing is kept.
    """

    def __init__(self, name, now):
        self.found = self._file = None
        run = rospy.get_param(f"{name}/{RUN}", "")
        prefix = f"robotont_odom_{os.getuid()}_"
        if not re.fullmatch("[0-9a-f]{32}", run):
            run = uuid.uuid4().hex
            rospy.set_param(f"{name}/{RUN}", run)
            _clear_away(prefix, now)
        try:
            self._file = _open(FOLDER / (prefix + run), os.O_CREAT)
            self.found = _read(self._file, now)
        except OSError as error:
            rospy.logwarn("odom_node will not go on from its pose if it is started again: %s", error)

    def keep(self, pose, covariance, twist, now):
        """Keep a pose (3), its Covariance and the twist (3) of `now` [s]."""
        if self._file is not None:
            os.pwrite(self._file, CONTENT.pack(now, *pose, *covariance, *twist), 0)


def _open(path, flags=0):
    """A descriptor of the file, which nobody else has; it is closed as the process ends. Raises OSError."""
    file = os.open(str(path), os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC | flags, 0o600)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(file)
        raise
    return file


def _clear_away(prefix, now):
    """Remove the files of runs that nobody goes on with."""
    for path in FOLDER.glob(prefix + "*"):
        with contextlib.suppress(OSError):  # somebody has it: it runs
            file = _open(path)
            if _read(file, now) is None:
                path.unlink()
            os.close(file)


def _read(file, now):
    """The `Kept` in a file; None: there is none, or it is too old."""
    content = os.pread(file, CONTENT.size, 0)
    if len(content) < CONTENT.size:
        return None
    at, *numbers = CONTENT.unpack(content)
    if not 0.0 <= now - at <= LONGEST_GAP:
        return None
    pose, covariance, (v_x, v_y, omega) = numbers[:3], Covariance(*numbers[3:9]), numbers[9:]
    way = (v_x ** 2 + v_y ** 2) * STOPS_WITHIN ** 2
    unseen = Covariance(way, 0.0, 0.0, way, 0.0, (omega * STOPS_WITHIN) ** 2)
    return Kept(tuple(pose), covariance.plus(unseen), now - at)
