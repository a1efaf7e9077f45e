"""The topics that viewers see, as raw bytes: subscribed only while somebody looks, and thinned."""

import time

import rospy

from robotont_driver.ros.worker import Worker
from robotont_driver.rospy_repairs.rospy_internals import connection_header, serialized

TOPICS = ("odom", "scan", "map", "joint_states", "/tf", "/tf_static", "/diagnostics")
RATE = 10.0        # [Hz] at most, of each publisher of a topic
QUEUE = 5
LOOK_PERIOD = 0.2  # [s] between two looks at whether somebody looks
DESCRIPTION = "robot_description"  # parameter with the robot's model


class ViewerTopics:
    """Hands on the messages of some topics; nothing is ever published.

    wanted(): whether somebody looks. hear(topic, type, definition, data, latched): called from threads of rospy.
    """

    def __init__(self, wanted, hear):
        self._wanted, self._hear = wanted, hear
        self._subscribers = []
        self._handed = {}  # (topic, publisher): [s] of its newest message that was handed on
        Worker(self._follow)

    def _follow(self):
        """Subscribe, or unsubscribe, which may wait for the master; returns the time to rest."""
        if self._wanted() and not self._subscribers:
            self._subscribers = [rospy.Subscriber(topic, rospy.AnyMsg, self._on_message, rospy.resolve_name(topic),
                                                  queue_size=QUEUE) for topic in TOPICS]
        elif not self._wanted():
            while self._subscribers:
                self._subscribers.pop().unregister()
        return LOOK_PERIOD

    def _on_message(self, message, topic):
        header, now = connection_header(message), time.monotonic()
        source, latched = (topic, header.get("callerid")), header.get("latching") == "1"
        if not latched:
            if now - self._handed.get(source, 0.0) < 1.0 / RATE - 0.005:  # a message of 50 Hz may come a little early
                return
            self._handed[source] = now
        self._hear(topic, header.get("type", ""), header.get("message_definition", ""), serialized(message), latched)

    def description(self):
        """The robot's model (URDF), empty where there is none; asks the master."""
        try:
            return str(rospy.get_param(DESCRIPTION, ""))
        except (OSError, rospy.ROSException):
            return ""
