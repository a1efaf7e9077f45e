"""The emergency stop as a node for driving by hand sees and presses it.

Anybody presses it, by true on `emergency_stop`. It is released by false only, which nodes send when a person asks for
it and never by themselves: neither at their start nor at their end.
"""

import threading
import time

import rospy
from std_msgs.msg import Bool

from robotont_driver.driver_node import PRESSED


class EmergencyStop:
    """Publishes presses and releases, and follows those of others.

    A press stays latched, so that nodes which start or connect later receive it, until a release by anybody. A release
    is never latched: a node that starts later could not tell whether it is older than another node's press.
    """

    def __init__(self):
        self._lock = threading.RLock()
        self.pressed = rospy.get_param(PRESSED, False) is True
        self.pressed_at = time.monotonic()  # [s] newest press; before the start of this node nothing was seen
        self._publisher = rospy.Publisher("emergency_stop", Bool, queue_size=5, tcp_nodelay=True, latch=True)
        self._subscriber = rospy.Subscriber("emergency_stop", Bool, self._on_message, queue_size=5, tcp_nodelay=True)

    def press(self):
        """Stop the robot until somebody releases it."""
        with self._lock:
            self._note(True)
            self._publisher.publish(True)

    def release(self):
        """Let commands move the robot again."""
        with self._lock:
            self._note(False)
            self._publisher.publish(False)
            self._unlatch()

    def _on_message(self, message):
        if message._connection_header.get("callerid") == rospy.get_name():
            return
        with self._lock:
            self._note(message.data)
            if not message.data:
                self._unlatch()

    def _note(self, pressed):
        self.pressed = pressed
        if pressed:
            self.pressed_at = time.monotonic()

    def _unlatch(self):
        self._publisher.impl.latch = None
