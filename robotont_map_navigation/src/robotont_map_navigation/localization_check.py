"""Whether the scan fits the map where amcl believes the robot to be; if not, no goal is pursued."""

import math
import threading
import time
from collections import deque

import numpy as np
import rospy
import tf2_ros
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String

from robotont_description.geometry import rotation_of, seen_from_above
from robotont_driver.kinematics.se2 import between, compose, yaw_of
from robotont_driver.parameters.parameters import Parameter
from robotont_driver.ros.diagnostics import ERROR, OK, WARN, Health, robot_name
from robotont_driver.ros.worker import Worker
from robotont_map_navigation.footprint import base_frame, odometry_frame
from robotont_map_navigation.messages import floor_map_of
from robotont_map_navigation.scan_fit import Fit, deviations, fit

PARAMETERS = (
    Parameter("min_fit", 0.75, "least share of the scan's rays that the map explains", minimum=0.0, maximum=1.0),
    Parameter("fit_time", 3.0, "over which the share is averaged", "s", minimum=0.5, maximum=60.0),
    Parameter("max_position_deviation", 0.6, "largest standard deviation of amcl's position", "m",
              minimum=0.01, maximum=10.0),
    Parameter("max_yaw_deviation", 0.6, "largest standard deviation of amcl's yaw", "rad", minimum=0.01, maximum=4.0),
)
FIT_TOLERANCE = 0.2  # [m] from a wall at which a ray still ends at it
SETTLING = 1.0     # [s] that amcl may take to go where a person has said that the robot is
LOOK_PERIOD = 0.5  # [s] between two scans that are compared with the map
THROUGH_WALLS = 0.1  # share of rays that go through walls from which on it is told
MISFIT = 0.4        # a fit's worth, below which more speaks against the pose than one change of the room explains ...
MISFIT_WAY = 1.5    # [m] ... and neither an obstacle nor a gap stays before a robot for so much driving
MOVED = 0.8         # [m] by which a localization does not move a right pose ...
MOVED_WAY = 5.0     # [m] ... in so much driving
REMEDY = ("set the pose by RViz' 2D Pose Estimate, or let the robot look around: rosrun robotont_map_navigation "
          "relocalize")


class LocalizationCheck:
    """Compares scans with the map, and reports what it finds in the diagnostics and, at each change, in the log.

    While the pose is wrong it tells `localization/trouble`, and cancels whatever goal makes move_base drive. While
    it may be wrong, or an obstacle may fill the view, it tells `localization/doubt`.
    """

    def __init__(self, parameters, transforms):
        self._parameters = parameters
        self._lock = threading.Lock()
        self._map = self._scan = self._covariance = self._frames = None
        self._scanned = time.monotonic()  # [s] when the newest scan came
        self._lost = ""          # why the newest scan could not be laid on the map
        self._laid_at = time.monotonic()  # [s] when the newest one that could be was
        self._outside = ""       # why amcl's pose is none where a robot can be
        self._fits = deque()     # (time [s], Fit)
        self._settled = 0.0      # [s] from when on scans count
        self._place = None       # (x, y) [m] at the newest of them
        self._misfit_way = 0.0   # [m] driven with those that did not fit, less that with those that did
        self._odometry = None    # (x, y, yaw) of the odometry's frame on the map at the newest scan
        self._moved = 0j         # [m] x + iy, by which the localization has moved the robot's place ...
        self._way = 0.0          # [m] ... in so much driving
        self._wrong = ""         # why the pose is wrong, as goto has been told
        self._trouble = rospy.Publisher("localization/trouble", String, queue_size=1, latch=True)
        self._trouble.publish("")
        self._doubted = ""       # as goto has been told
        self._doubt = rospy.Publisher("localization/doubt", String, queue_size=1, latch=True)
        self._level = OK
        self._cancel = rospy.Publisher("move_base/cancel", GoalID, queue_size=1)
        self._transforms = transforms
        for topic, kind, callback in (("map", OccupancyGrid, self._on_map), ("scan", LaserScan, self._on_scan),
                                      ("amcl_pose", PoseWithCovarianceStamped, self._on_pose),
                                      ("initialpose", PoseWithCovarianceStamped, self._on_new_pose),
                                      ("cmd_vel", Twist, self._on_command)):
            rospy.Subscriber(topic, kind, callback, queue_size=1)
        Worker(self._look)
        Health(robot_name(), {"localization": self._report})

    def _on_map(self, message):
        found = message.header.frame_id, floor_map_of(message)
        with self._lock:
            self._map = found
            self._fits.clear()

    def _on_scan(self, message):
        self._scan, self._scanned = message, time.monotonic()

    def _on_pose(self, message):
        self._covariance = message.pose.covariance

    def _on_new_pose(self, _message):
        """A person has said where the robot is: what the scans showed before does not count."""
        with self._lock:
            self._fits.clear()
            self._place, self._misfit_way, self._odometry, self._moved = None, 0.0, None, 0j
            self._settled = time.monotonic() + SETTLING

    def _on_command(self, message):
        if self._wrong and message != Twist():
            self._cancel.publish(GoalID())

    def _look(self):
        """Compare the newest scan with the map; returns the time to rest."""
        scan, self._scan = self._scan, None
        if scan is not None and self._map is not None:
            frame, floor_map = self._map
            try:
                found = self._transforms.lookup_transform(
                    frame, scan.header.frame_id, scan.header.stamp, rospy.Duration(LOOK_PERIOD))
                self._frames = self._frames or (base_frame(), odometry_frame())
                base, odometry = (_pose(self._transforms.lookup_transform(frame, child, rospy.Time()))
                                  for child in self._frames)
            except tf2_ros.TransformException as error:
                self._lost = str(error)
                return LOOK_PERIOD
            angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
            angles, shares = seen_from_above(rotation_of(found.transform.rotation), angles)
            found = fit(floor_map, (*_pose(found)[:2], 0.0), shares * scan.ranges, angles,
                        (scan.range_min, scan.range_max), FIT_TOLERANCE)
            with self._lock:
                self._lost = ""
                self._laid_at = time.monotonic()
                self._outside = _outside(floor_map, base[:2])
                if found is not None and time.monotonic() >= self._settled:
                    self._fits.append((time.monotonic(), found))
                    self._add_way(found, base[:2])
                    self._add_move(odometry, base)
        return LOOK_PERIOD

    def _add_way(self, found, place):
        """Count how far the robot drives with a view that the map does not explain."""
        step = math.dist(self._place, place) if self._place else 0.0
        self._place = place
        self._way += step
        fits = found.worth >= MISFIT
        self._misfit_way = max(0.0, self._misfit_way + (-step if fits else step))

    def _add_move(self, odometry, base):
        """How far the pose (x, y, yaw) `base` is moved; too far is not made good by a view that fits then."""
        before = compose(self._odometry or odometry, between(odometry, base))
        self._odometry = odometry
        self._moved += complex(base[0] - before[0], base[1] - before[1])
        if self._way > MOVED_WAY and abs(self._moved) <= MOVED:
            self._moved, self._way = 0j, 0.0

    def _report(self):
        oldest = time.monotonic() - self._parameters["fit_time"]
        with self._lock:
            lost = self._lost if self._laid_at < oldest else ""  # a transform that is late now and then is no fault
            while self._fits and self._fits[0][0] < oldest:
                self._fits.popleft()
            fits = [found for _, found in self._fits]
            outside = self._outside
        mean = Fit(*np.mean(fits, axis=0)) if fits else None
        level, words, values, wrong = self._judge(mean, lost, outside)
        if level != self._level:
            self._level = level
            (rospy.loginfo if level == OK else rospy.logwarn)("localization: %s", words)
        if bool(wrong) != bool(self._wrong):
            self._wrong = wrong
            self._trouble.publish(wrong)
        doubt = words if mean and not wrong and mean.explained < self._parameters["min_fit"] else ""
        if bool(doubt) != bool(self._doubted):
            self._doubted = doubt
            self._doubt.publish(doubt)
        return level, words, values

    def _judge(self, mean, lost, outside):
        """(level, message, values, why the pose is wrong; empty when it may be right)."""
        position, yaw = deviations(self._covariance) if self._covariance is not None else (0.0, 0.0)
        values = {"rays that the map explains": "unknown" if mean is None else f"{mean.explained:.0%}",
                  "rays that go through the map's walls": "unknown" if mean is None else f"{mean.through_walls:.0%}",
                  "deviation of the position [m]": f"{position:.2f}", "deviation of the yaw [rad]": f"{yaw:.2f}"}
        wrong = outside or self._unsure(position, yaw, mean) or self._misfit(mean)
        if self._map is None:
            return WARN, "no map: does map_server run?", values, ""
        if lost:
            return WARN, f"the scan cannot be laid on the map: {lost}", values, self._wrong
        if wrong:
            return ERROR, f"{wrong}; {REMEDY}", values, wrong
        level, words = self._describe(mean)
        return level, words, values, ""

    def _unsure(self, position, yaw, mean):
        """Why amcl's deviations [m], [rad] are too large to drive; empty when they are not.

        Something that fills the view makes amcl unsure, and no pose wrong, until the robot has driven with it.
        """
        limits = self._parameters
        if mean is None or (mean.worth < MISFIT and mean.through_walls < THROUGH_WALLS
                            and self._misfit_way < MISFIT_WAY):
            return self._wrong  # as it was
        if position <= limits["max_position_deviation"] and yaw <= limits["max_yaw_deviation"]:
            return ""
        return f"amcl is unsure of the pose: {position:.2f} m, {yaw:.2f} rad"

    def _misfit(self, mean):
        """Why a mean `Fit` proves a wrong pose; empty when it does not."""
        if mean is None:  # nothing new since: as it was
            return self._wrong
        if mean.explained >= self._parameters["min_fit"] and abs(self._moved) <= MOVED:
            return ""
        found = f"the map explains {mean.explained:.0%} of the scan's rays"
        cause = ": a map of another place, or a wrong pose"
        if abs(self._moved) > MOVED:
            return f"{found}, but the localization has moved the pose by {abs(self._moved):.1f} m{cause}"
        if mean.worth < MISFIT and self._misfit_way >= MISFIT_WAY:
            return (f"{found}, and {mean.through_walls:.0%} go through its walls, for {self._misfit_way:.1f} m of "
                    f"driving{cause}")
        return ""

    def _describe(self, mean):
        silence = time.monotonic() - self._scanned
        if silence > self._parameters["fit_time"]:
            return WARN, f"no scan for {silence:.0f} s: does its sensor run? move_base stands until it comes again"
        if mean is None:
            return OK, "nothing to compare: the scan shows nothing"
        found = f"the map explains {mean.explained:.0%} of the scan's rays"
        if mean.explained < self._parameters["min_fit"] and mean.through_walls >= THROUGH_WALLS:
            return WARN, (f"{found}, and {mean.through_walls:.0%} go through its walls: the room has changed, or the "
                          "pose is wrong")
        if mean.explained < self._parameters["min_fit"]:
            return WARN, f"{found}, the others end before its walls: something that the map lacks fills the view"
        return OK, found


def _pose(message):
    """(x, y [m], yaw [rad]) of a TransformStamped."""
    transform = message.transform
    return transform.translation.x, transform.translation.y, yaw_of(transform.rotation)


def _outside(floor_map, place):
    """Why the robot cannot be at a place (x, y) [m]; empty when it can."""
    where = "off the map" if place not in floor_map else "in a wall of the map" if floor_map.is_occupied(place) else ""
    return where and f"the pose ({place[0]:.2f}, {place[1]:.2f}) is {where}"
