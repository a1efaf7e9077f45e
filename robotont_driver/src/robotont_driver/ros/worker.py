"""Work at intervals, in a thread."""

import threading
import time

import rospy


class Worker(threading.Thread):
    """A thread that calls `work` again and again; `work` returns for how long [s] to rest (at most)."""

    def __init__(self, work):
        super().__init__(daemon=True)
        self._work = work
        self.start()

    def run(self):
        """Work until ROS shuts down."""
        while not rospy.is_shutdown():
            time.sleep(self._work())
