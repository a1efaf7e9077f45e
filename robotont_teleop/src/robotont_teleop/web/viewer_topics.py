"""The topics that viewers see, as raw bytes: subscribed only while somebody looks, and thinned."""

import threading
import time

import rospy

from robotont_driver.ros.rospy_internals import connection_header, serialized

TOPICS = ("odom", "scan", "map", "joint_states", "/tf", "/tf_static", "/diagnostics")
RATE = 10.0        # [Hz] at most, of each publisher of a topic
QUEUE = 5
DESCRIPTION = "robot_description"  # parameter with the robot's model


class ViewerTopics:
    """Hands on the messages of some topics, for `RobotView`'s server; nothing is ever published."""

    def __init__(self):
        self._subscribers = []
        self._lock = threading.Lock()
        self._handed = {}  # (topic, publisher): [s] of its newest message that was handed on

    def start(self, hear):
        """Subscribe; hear(topic, type, definition, data, latched) is called from threads of rospy."""
        with self._lock:
            if not self._subscribers:
                self._handed.clear()
                self._subscribers = [
                    rospy.Subscriber(topic, rospy.AnyMsg, self._on_message, (rospy.resolve_name(topic), hear),
                                     queue_size=QUEUE) for topic in TOPICS]

    def stop(self):
        """Unsubscribe."""
        with self._lock:
            for subscriber in self._subscribers:
                subscriber.unregister()
            self._subscribers = []

    def _on_message(self, message, to):
        topic, hear = to
        header, now = connection_header(message), time.monotonic()
        source, latched = (topic, header.get("callerid")), header.get("latching") == "1"
        if not latched:
            if now - self._handed.get(source, 0.0) < 1.0 / RATE - 0.005:  # a message of 50 Hz may come a little early
                return
            self._handed[source] = now
        hear(topic, header.get("type", ""), header.get("message_definition", ""), serialized(message), latched)

    def description(self):
        """The robot's model (URDF), empty where there is none; asks the master."""
        try:
            return str(rospy.get_param(DESCRIPTION, ""))
        except (OSError, rospy.ROSException):
            return ""
