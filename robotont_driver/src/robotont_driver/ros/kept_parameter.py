"""A parameter on the master that follows a value of this node, for the node that comes after it."""

import threading

import rospy

from robotont_driver.ros.worker import Worker

AGAIN = 1.0  # [s] after which it is written again, to a master that did not answer, or to a new one


class KeptParameter:
    """Writes `value()` in a thread of its own after each change, the newest only: the master may take its time.

    name: relative to the namespace. Values that count as false are not repeated: a new master has none.
    """

    def __init__(self, name, value):
        self._name = name
        self._value = value
        self._changed = threading.Event()
        self._written = value()
        Worker(self._write)

    def changed(self):
        """The value may be another one now. Returns at once."""
        self._changed.set()

    def _write(self):
        self._changed.wait(AGAIN)
        self._changed.clear()
        value = self._value()
        if value or value != self._written:
            try:
                rospy.set_param(self._name, value)
                self._written = value
            except OSError:
                pass  # no master: again in a while
        return 0.0
