"""A robot's place out of /tf, by the order in which transforms come: a clock that is set changes nothing.

tf2 would hold a place of before until the clock has come there again.
"""

import math

import numpy as np
import rospy
from tf2_msgs.msg import TFMessage

from robotont_description.mounted import rotation_of
from robotont_driver.link.boot_clock import boot_time

STALE = 1.0       # [s] a transform that has not come for so long is no place
MOST_FRAMES, DEEPEST = 500, 10


class FrameChain:
    """The newest transforms by child frame. prefix: of frames' names, which is taken off."""

    def __init__(self, prefix=""):
        self._prefix = prefix
        self._newest = {}  # child frame: (transform, when it came [s], whether it is fixed)

    def listen(self):
        """Hear /tf and /tf_static."""
        for topic, fixed in (("/tf", False), ("/tf_static", True)):
            rospy.Subscriber(topic, TFMessage, lambda message, fixed=fixed: self.hear(
                message.transforms, boot_time(), fixed), queue_size=50)

    def hear(self, transforms, now, fixed=False):
        """Transforms came at time `now` [s]; fixed: on /tf_static."""
        for transform in transforms:
            if transform.child_frame_id in self._newest or len(self._newest) < MOST_FRAMES:
                self._newest[transform.child_frame_id] = (transform, now, fixed)

    def pose(self, frame, now, until=None):
        """(frame, (x [m], y [m], yaw [rad])) of a robot's frame in `until`, or in the outermost one.

        ("", None) where nothing is known of it, or the odometry on the way is silent.
        """
        frame, place = self.place(frame, now, until)
        return frame, place and (*place[1][:2].tolist(), math.atan2(place[0][1, 0], place[0][0, 0]))

    def place(self, frame, now, until=None):
        """(frame, (3 x 3 rotation, (x, y, z) [m])) likewise: for what may hang or tilt."""
        rotation, place, moves = np.eye(3), np.zeros(3), False
        if frame not in self._newest:
            return "", None
        for _ in range(DEEPEST):
            if frame == until or frame not in self._newest:
                break
            transform, at, fixed = self._newest[frame]
            if not (fixed or moves) and now - at > STALE:  # the first that moves is the odometry's
                return "", None
            moves = moves or not fixed
            step, turn = transform.transform.translation, rotation_of(transform.transform.rotation)
            rotation, place = turn.dot(rotation), np.add(turn.dot(place), (step.x, step.y, step.z))
            frame = transform.header.frame_id
        frame = frame.lstrip("/")
        return frame[len(self._prefix):] if frame.startswith(self._prefix) else frame, (rotation, place)
