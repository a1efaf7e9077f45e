"""What tests of this folder share: a walled room as a map, scans, and a stand-in for rospy and time."""

import math
import sched
import time
from collections import defaultdict

import numpy as np
import rospy
from nav_msgs.msg import MapMetaData, OccupancyGrid
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header

from robotont_driver.kinematics.se2 import between
from robotont_map_navigation import felt, held, localization_check, navigation_monitor
from robotont_map_navigation.readings import COSTMAP, message_of, place_of
from robotont_testing.bus import Bus, transform

CELL = 0.05  # [m]


def walled(rows, columns):
    """Cells of an empty room with walls around it."""
    cells = np.zeros((rows, columns), np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = 100
    return cells


def grid(cells, x=0.0, y=0.0):
    """A map of cells, the corner of the first at (x, y) [m]."""
    info = MapMetaData(rospy.Time(), CELL, cells.shape[1], cells.shape[0], message_of((x, y, 0.0)))
    return OccupancyGrid(Header(frame_id="map"), info, cells.ravel().tolist())


ANGLES = np.linspace(-math.pi, math.pi, 90, endpoint=False)  # [rad] of a scanner all around


def ranges_in_box(pose, left, right, low, high):
    """[m] that a scanner at a pose (x, y, yaw) sees at ANGLES, in a room from x = left to right, y = low to high."""
    x, y, yaw = pose
    cos, sin = np.cos(ANGLES + yaw), np.sin(ANGLES + yaw)
    return np.minimum(np.where(cos > 0, right - x, left - x) / cos, np.where(sin > 0, high - y, low - y) / sin)


def scan_of(ranges, sees=8.0, stamp=None, frame="laser"):
    """A LaserScan all around."""
    return LaserScan(header=Header(0, stamp or rospy.Time(), frame), angle_min=-math.pi,
                     angle_increment=2 * math.pi / 90, range_min=0.05, range_max=sees, ranges=ranges)


class TimedBus(Bus):
    """A `Bus` of which time.monotonic and time.sleep are the time, too."""

    def __init__(self, monkeypatch):
        super().__init__(monkeypatch)
        self.connections = defaultdict(lambda: 1)
        self.parameters[COSTMAP + "robot_radius"] = 0.16
        self._due = sched.scheduler(lambda: self.now, lambda _: None)
        for owner, name, stand_in in ((rospy, "get_rostime", lambda: rospy.Time.now()),
                                      (time, "monotonic", lambda: self.now), (time, "sleep", self.sleep)):
            monkeypatch.setattr(owner, name, stand_in)

    def sleep(self, seconds):
        """Let time pass, with what was put off until then."""
        end = self.now + seconds
        while True:
            step = self._due.run(blocking=False)
            if step is None or self.now + step > end:
                break
            self.now += step
        self.now = end

    def hear(self, topic, message):
        """What comes on a topic; these nodes may ask the master meanwhile."""
        for callback in self.heard_by[topic]:
            callback(message)

    def later(self, seconds, function, *given):
        """Call a function then."""
        self._due.enter(seconds, 0, function, given)


class Monitor(TimedBus):
    """navigation_monitor in a room of 6 m x 2 m around the origin, (OK, words, values) by the subject of its `reports`.

    places: TransformStamped by frame, on the map; measured: that of the robot by the odometry.
    """

    base, map, odometry = "base_link", "map", "odom"

    def __init__(self, monkeypatch, parameters=()):
        super().__init__(monkeypatch)
        self.parameters.update(parameters)
        self.places, self.reports, self.measured = {}, {}, None
        for module in localization_check, navigation_monitor, felt:
            monkeypatch.setattr(module, "RepeatingThread", lambda function: self.later(0.0, self._work, function))
        for module in localization_check, held:
            monkeypatch.setattr(module, "Health", lambda _, subjects: self.reports.update(subjects))
            monkeypatch.setattr(module, "robot_name", lambda: "")
        monkeypatch.setattr(navigation_monitor, "Frames", lambda: self)
        navigation_monitor.NavigationMonitor(())
        self.hear("map", grid(walled(42, 122), -3.05, -1.05))

    def _work(self, function):
        self.later(function(), self._work, function)

    def look_up(self, frame, child, *_):
        return self.measured if (frame, child) == (self.odometry, self.base) else self.places.get(child)

    def robot_in(self, frame):
        here, odometry = (place_of(self.places.get(child)) for child in (self.base, self.odometry))
        return between(odometry, here) if frame == self.odometry and here else here

    def stand(self, x, y, yaw, odometry=0.0):
        """Where the localization has the robot, whose sensor is in its middle, and x [m] where its odometry begins."""
        here = transform("", "", x, y, yaw)
        self.places = {"laser": here, "base_link": here, "odom": transform("", "", odometry, 0.0)}
