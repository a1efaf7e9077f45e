"""A thread that repeats its work, whatever fails."""

import threading
import time
import traceback

import rospy

AFTER_FAULT = 0.2  # [s]


class RepeatingThread(threading.Thread):
    """Calls `work` again and again; `work` returns for how long [s] to rest, at least."""

    def __init__(self, work):
        super().__init__(daemon=True)
        self._work = work
        self.start()

    def run(self):
        """Work until ROS shuts down."""
        while not rospy.is_shutdown():
            time.sleep(self._rest())

    def _rest(self):
        """Work once; [s] to rest. A fault is no end: repeats, diagnostics and goals depend on it."""
        try:
            return self._work()
        except Exception as error:
            log_fault(error)
            return AFTER_FAULT


def log_fault(error):
    """Log an exception that only a fault of this program can have caused."""
    if not rospy.core.is_shutdown_requested():  # rospy closes topics before `is_shutdown` says so
        rospy.logerr_throttle(10.0, "a fault of this program; please report it: %s", "".join(
            traceback.format_exception(type(error), error, error.__traceback__)))
