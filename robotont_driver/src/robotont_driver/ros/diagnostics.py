"""Health of a node on /diagnostics (REP 107), and which refused messages get a line in the log."""

import threading

import diagnostic_updater
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from robotont_driver.ros.worker import Worker

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


class Health:
    """Publishes /diagnostics every ~diagnostic_period (1 s), one task per subject (REP 107).

    `subjects` maps a name to a function that returns (level, message, {key: value}). node: its full name, where it is
    not the name of the process.
    """

    def __init__(self, hardware, subjects, node=None):
        node = node or rospy.get_name()
        self._due = threading.Event()
        self._updater = _Updater(node)
        self._period = rospy.get_param(node + "/diagnostic_period", 1.0)
        self._updater.setHardwareID(hardware)
        for name, report in subjects.items():
            self._updater.add(name, _task(report))
        Worker(self._publish)

    def _publish(self):
        if not rospy.is_shutdown():
            self._updater.force_update()
        self._due.wait(self._period)
        self._due.clear()
        return 0.0

    def publish_now(self):
        """Something has happened that should not wait for the next second."""
        self._due.set()


class _Updater(diagnostic_updater.Updater):
    """Publishes under the name of a node, in whatever process it is."""

    def __init__(self, node):
        super().__init__()
        self._prefix = node[1:] + ": "

    def publish(self, statuses):
        """Publish a status, or a list of them."""
        statuses = statuses if isinstance(statuses, list) else [statuses]
        for status in statuses:
            status.name = self._prefix + status.name
        message = DiagnosticArray(status=statuses)
        message.header.stamp = rospy.Time.now()
        self.publisher.publish(message)


def robot_name():
    """The hardware id of a robot's diagnostics: its namespace, or "robotont" without one."""
    return rospy.get_namespace().strip("/") or "robotont"


def _task(report):
    def run(status):
        level, message, values = report()
        status.summary(level, message)
        for key, value in values.items():
            status.add(key, str(value))
        return status
    return run


class Rate:
    """Events per second since the last look, or the one before where that is less than half a second ago."""

    def __init__(self):
        self._count = 0
        self._time = 0.0
        self._rate = 0.0

    def look(self, count, now):
        """[1/s], from the total `count` of events at time `now` [s]."""
        elapsed = now - self._time
        if elapsed >= 0.5:
            self._rate = (count - self._count) / elapsed
            self._count, self._time = count, now
        return self._rate


QUIET = 10.0  # [s] without refusals, after which the next one is news again
PAUSE = 1.0   # [s] between two lines at least


class Refusals:
    """Counts refused messages. Times [s] are the caller's, from a clock that never goes back."""

    def __init__(self):
        self.amount = 0
        self._kind = None       # of the newest line in the log
        self._refused_at = self._logged_at = float("-inf")

    def refuse(self, kind, now):
        """Count a message, refused for a reason of that kind; returns whether to log it."""
        self.amount += 1
        quiet = now - self._refused_at > QUIET
        self._refused_at = now
        news = (quiet or kind != self._kind) and now - self._logged_at >= PAUSE
        if news:
            self._kind, self._logged_at = kind, now
        return news
