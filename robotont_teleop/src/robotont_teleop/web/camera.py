"""The newest picture of a camera, as long as somebody wants to see it."""

import math
import threading
import time

import rospy
from sensor_msgs.msg import CompressedImage

STALE = 1.0        # [s] an older picture is not shown: it would look like one of now
REST = 10.0        # [s] after the last request for a picture, until the camera is not listened to any more
BUFFER = 2 ** 22   # [bytes] of rospy's, so that a picture arrives in few parts
JPEG = b"\xff\xd8"  # first bytes


class Camera:
    """JPEG pictures of a topic (sensor_msgs/CompressedImage). Only `look` speaks to the master, and may wait for it."""

    def __init__(self, topic):
        self._topic = topic
        self._lock = threading.Lock()
        self._newest, self._received = (0, b""), -math.inf
        self._wanted = -math.inf
        self._subscriber = None  # of `look` alone
        self.present = False     # whether anybody publishes pictures

    def picture(self):
        """(number, JPEG) of now, or None; numbers grow. Asking for one makes `look` listen to the camera."""
        self._wanted = now = time.monotonic()
        with self._lock:
            return self._newest if now - self._received < STALE else None

    def look(self, published):
        """Whether it is there, by the names of all `published` topics; listen to it while its pictures are wanted."""
        self.present = rospy.resolve_name(self._topic) in published
        wanted = time.monotonic() - self._wanted < REST
        if self._subscriber is None and self.present and wanted:
            self._subscriber = rospy.Subscriber(self._topic, CompressedImage, self._on_picture, queue_size=1,
                                                buff_size=BUFFER)
        elif self._subscriber is not None and not wanted:
            self._subscriber.unregister()
            self._subscriber = None

    def _on_picture(self, message):
        if message.data[:2] == JPEG:
            with self._lock:
                self._newest, self._received = (self._newest[0] + 1, bytes(message.data)), time.monotonic()
