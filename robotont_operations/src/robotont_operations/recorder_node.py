"""The ROS side of the black box: the messages of the last minute before a fault."""

import math
import threading
import time

import rospy

from robotont_driver.parameters.parameters import Parameter
from robotont_driver.ros.diagnostics import ERROR, OK, WARN, Health, robot_name
from robotont_driver.ros.lifecycle import refuse, run_without_wheels
from robotont_driver.ros.repeating_thread import RepeatingThread
from robotont_driver.rospy_repairs.rospy_internals import connection_header, serialized
from robotont_operations.black_box_files import BlackBox, Record

PARAMETERS = (
    Parameter("folder", "/var/lib/robotont/black_box", "where the files are kept"),
    Parameter("topics", "cmd_vel cmd_vel/hand cmd_vel/navigation cmd_vel/default emergency_stop serial_write "
              "serial_read odom /diagnostics /rosout", "what is recorded, separated by blanks"),
    Parameter("keep", 60.0, "how long this run's messages are kept, within 15 MB", "s", minimum=1.0, maximum=3600.0,
              reason="more than an hour does not fit"),
)
PERIOD = 1.0         # [s] between two files, each flushed to the disk: what a loss of power may cost
WAITING = 8_000_000  # [bytes] that may wait for the disk
RECENTLY = 10.0      # [s] for which the diagnostics warn of lost messages


class RecorderNode:
    """Gathers messages and hands them to the black box once a period."""

    def __init__(self, parameters):
        try:
            self._box = BlackBox(parameters["folder"], parameters["keep"])
        except OSError as error:
            refuse([f"~folder: found {error}, allowed: a folder that this user may write to"])
        self._lock = threading.Lock()
        self._writing = threading.Lock()
        self._records = []
        self._size = 0
        self._written = self._dropped = 0
        self._dropped_at = -math.inf  # [s]
        self._dropped_why = ""
        self._trouble = ""
        for topic in parameters["topics"].split():
            rospy.Subscriber(topic, rospy.AnyMsg, self._on_message, rospy.resolve_name(topic), tcp_nodelay=True)
        rospy.on_shutdown(self._write)
        RepeatingThread(self._work)
        Health(robot_name(), {"black box": self._report})
        rospy.loginfo("recording to %s", self._box.folder)

    def _on_message(self, message, topic):
        record = Record(topic, time.time(), serialized(message), connection_header(message))
        with self._lock:
            if self._size > WAITING:
                self._drop(1, "the disk is too slow")
                return
            self._records.append(record)
            self._size += len(record.data)

    def _work(self):
        begun = time.monotonic()
        self._write()
        return max(0.0, begun + PERIOD - time.monotonic())

    def _write(self):
        with self._writing:
            with self._lock:
                records, self._records, self._size = self._records, [], 0
            try:
                left_out = self._box.write(records, time.monotonic())
                self._written += len(records) - left_out
                self._trouble = ""
                if left_out:
                    self._drop(left_out, "of types that nobody explains, or of a second type on a topic")
            except Exception as error:  # whatever it is: the next second shall be recorded
                self._trouble = (f"cannot write to {self._box.folder}: {type(error).__name__}: {error}: is there room, "
                                 "and may this user write there?")
                self._drop(len(records), self._trouble)
                rospy.logerr_throttle(60.0, "%s", self._trouble)

    def _drop(self, amount, why):
        self._dropped += amount
        self._dropped_why = why
        self._dropped_at = time.monotonic()

    def _report(self):
        values = {"messages written": self._written, "messages lost": self._dropped, "folder": self._box.folder}
        if self._trouble:
            return ERROR, self._trouble, values
        if time.monotonic() - self._dropped_at < RECENTLY:
            return WARN, f"{self._dropped} messages lost, the newest: {self._dropped_why}", values
        oldest = self._records[:1]
        if oldest and time.time() - oldest[0].time > RECENTLY:
            return WARN, f"nothing is written since {RECENTLY:g} s: the disk hangs, or is too slow", values
        return OK, "recording", values


def main():
    """Run recorder_node."""
    run_without_wheels("recorder_node", RecorderNode, PARAMETERS)
