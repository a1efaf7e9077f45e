"""Health of a node on /diagnostics (REP 107)."""

import contextlib
import threading

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from robotont_driver.ros.repeating_thread import RepeatingThread

FIRST_RATE = 0.5  # [s]
OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


class Health:
    """Publishes /diagnostics every ~diagnostic_period (1 s): (level, message, {key: value}) by each of `subjects`."""

    def __init__(self, hardware, subjects, node=None):
        self._node, self._hardware, self._subjects = node or rospy.get_name(), hardware, subjects
        self._due = threading.Event()
        self._period = 1.0
        with contextlib.suppress(OSError):  # the master has just gone: a node that is there already lives on
            self._period = rospy.get_param(self._node + "/diagnostic_period", self._period)
        self._publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        RepeatingThread(self._publish)

    def _publish(self):
        message = DiagnosticArray()
        for subject, report in self._subjects.items():
            level, words, values = report()
            message.status.append(DiagnosticStatus(level, f"{self._node[1:]}: {subject}", words, self._hardware, [
                KeyValue(key, str(value)) for key, value in values.items()]))
        message.header.stamp = rospy.Time.now()
        self._publisher.publish(message)
        self._due.wait(self._period)
        self._due.clear()
        return 0.0

    def publish_now(self):
        """Something has happened that should not wait for the next second."""
        self._due.set()


def robot_name():
    """The hardware id of a robot's diagnostics: its namespace, or "robotont" without one."""
    return rospy.get_namespace().strip("/") or "robotont"


class Rate:
    """Events per second since the last look that was FIRST_RATE after the one before it, or since the beginning."""

    def __init__(self, begun):
        """begun: [s] when nothing had come yet, by the clock of `look`."""
        self._count, self._time, self._rate = 0, begun, None

    def look(self, count, now):
        """[1/s], from the total `count` of events at time `now` [s]."""
        elapsed = now - self._time
        rate = (count - self._count) / max(elapsed, 0.1)
        if elapsed >= FIRST_RATE:
            self._count, self._time, self._rate = count, now, rate
        return rate if self._rate is None else self._rate
