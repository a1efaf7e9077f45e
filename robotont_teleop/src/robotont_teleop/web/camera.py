"""The newest picture of a camera, as long as somebody wants to see it."""

import contextlib
import math

import rosgraph
import rospy
from sensor_msgs.msg import CompressedImage

from robotont_driver.link.boot_clock import boot_time
from robotont_driver.ros.repeating_thread import RepeatingThread

STALE = 1.0        # [s] an older picture is not shown: it would look like one of now
LOOK_PERIOD = 0.5  # [s] between two looks at whether there is a camera, and who wants to see it
REST = 10.0        # [s] after the last request for a picture, until the camera is not listened to any more
BUFFER = 2 ** 22   # [bytes] of rospy's, so that a picture arrives in few parts
JPEG = b"\xff\xd8"  # first bytes


class Camera:
    """JPEG pictures of a topic (sensor_msgs/CompressedImage); nobody who asks for one waits for the master."""

    def __init__(self, topic):
        self._topic = topic
        self._newest, self._received = (0, b""), -math.inf
        self._wanted = -math.inf
        self._subscriber = None
        self.present = False     # whether anybody publishes pictures
        RepeatingThread(self._look)

    def picture(self):
        """(number, JPEG) of now, or None; numbers grow. Asking for one makes it listen to the camera."""
        self._wanted = now = boot_time()
        return self._newest if now - self._received < STALE else None

    def _look(self):
        """Look whether there is a camera; listen to it while its pictures are wanted. Returns the time to rest."""
        wanted = boot_time() - self._wanted < REST
        if self._subscriber is not None and not wanted:
            self._subscriber.unregister()
            self._subscriber = None
        with contextlib.suppress(OSError, rosgraph.MasterException):
            publishers, _, _ = rosgraph.Master(rospy.get_name()).getSystemState()
            self.present = rospy.resolve_name(self._topic) in {name for name, _ in publishers}
        if self._subscriber is None and self.present and wanted:
            self._subscriber = rospy.Subscriber(self._topic, CompressedImage, self._on_picture, queue_size=1,
                                                buff_size=BUFFER)
        return LOOK_PERIOD

    def _on_picture(self, message):
        if message.data[:2] == JPEG:
            self._newest = self._newest[0] + 1, bytes(message.data)
            self._received = boot_time()
