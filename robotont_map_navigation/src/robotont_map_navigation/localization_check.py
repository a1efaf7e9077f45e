"""Whether the scan fits the map where amcl believes the robot to be; if not, no goal is pursued."""

import math
import time
from collections import deque

import numpy as np
import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float32, String

from robotont_driver.kinematics.se2 import compose
from robotont_driver.ros.diagnostics import ERROR, OK, WARN, Health, robot_name
from robotont_driver.ros.repeating_thread import RepeatingThread
from robotont_map_navigation.readings import Newest, place_of, rays_of, told_pose
from robotont_map_navigation.scan_fit import Fit, fit_nearby

LOOK_PERIOD = 0.5   # [s] between two scans that are compared with the map
LOOKS = 6           # of which the mean counts
SILENCE = 3.0       # [s] without a scan, or without its place on the map, until it is told
BLIND = 1.0         # [s] without a scan, and navigation stands; also where the pose comes from elsewhere
SETTLING = 1.0      # [s] that amcl may take to go where a person has said that the robot is
FIT_TOLERANCE = 0.2  # [m] from a wall at which a ray still ends at it
MIN_FIT = 0.75      # share of the scan's rays that the map explains, within 0.1 m and 0.1 rad of the pose
THROUGH_WALLS = 0.1  # share of rays that go through walls from which on it is told
MISFIT = 0.4        # a fit's worth, below which more speaks against the pose than one change of the room explains ...
MISFIT_WAY = 1.5    # [m] ... and neither an obstacle nor a gap stays before a robot for so much driving
MOVED = 0.8         # [m] by which a localization does not move a right pose ...
MOVED_WAY = 5.0     # [m] ... in so much driving
TURNED = 1e-3       # [rad] of the map's origin
GOES_WELL = 60.0    # [s] after a jump, until which another one proves a wrong pose
REMEDY = ("set the pose by RViz' 2D Pose Estimate, or let the robot look around: rosrun robotont_map_navigation "
          "relocalize")


class LocalizationCheck:
    """Compares scans with the map, and reports what it finds: in the diagnostics, a change of its level in the log.

    While the pose is wrong it tells `localization/trouble`, and cancels whatever goal makes move_base drive.
    """

    def __init__(self, frames):
        self._frames = frames
        self.floor_map = None    # what scans are compared with: a FloorMap
        self._scan = Newest("scan", LaserScan)
        self._new_pose = Newest("initialpose", PoseWithCovarianceStamped)  # where a person has said that the robot is
        self._pose = rospy.Publisher("initialpose", PoseWithCovarianceStamped, queue_size=1)
        self._put_back = -math.inf  # [s] when this node has said it, where the odometry has it
        # [s] when a scan was laid on the map, when one came, and at the begin
        self._laid = self._scan.came = self._started = time.monotonic()
        self._stand = rospy.Publisher("navigation/stand", Float32, queue_size=1, tcp_nodelay=True)
        self._begin()
        self._wrong = ""         # why the pose is wrong, as goto has been told
        self._report = OK, "", {}
        self._trouble = rospy.Publisher("localization/trouble", String, queue_size=1, latch=True)
        self._trouble.publish("")
        self._cancel = rospy.Publisher("move_base/cancel", GoalID, queue_size=1)
        rospy.Subscriber("cmd_vel", Twist, self._on_command, queue_size=1)
        RepeatingThread(self._look)
        Health(robot_name(), {"localization": lambda: self._report})

    def _begin(self):
        """What the scans have shown does not count any more."""
        self._outside = ""       # why amcl's pose is none where a robot can be
        self._fits = deque(maxlen=LOOKS)
        self._odometry = None    # (x, y, yaw) on the map of the odometry's frame, at the newest look
        self._misfit_way = 0.0   # [m] driven with scans that did not fit, less that with those that did
        self._moved, self._way = 0j, 0.0  # [m] x + iy: the localization has moved the robot's place, in so much driving
        self._kept = None        # (x, y, yaw) of the odometry's frame before that
        self._place = None       # (x, y, yaw) of the robot in it, at the newest look
        self._steps = deque(maxlen=2)  # [m] of the robot in it

    def _on_command(self, message):
        if self._wrong and message != Twist():
            self._cancel.publish(GoalID())

    def _look(self):
        """Compare the newest scan with the map, and tell what is found; returns the time to rest."""
        if time.monotonic() - self._scan.came > BLIND and self._has_sensor():
            self._stand.publish(2 * LOOK_PERIOD)
        scan, self._scan.message = self._scan.message, None
        by_person = self._new_pose.came > self._put_back + SETTLING  # its own one comes at once
        if by_person and self._scan.came < self._new_pose.came:
            self._new_pose.came = time.monotonic()  # amcl goes there with its next scan
        if self._is_settling() and by_person:
            self._begin()
        elif scan and self.floor_map and not self._is_settling():
            self._compare(scan, self.floor_map)
        settling, mean = self._is_settling(), Fit(*np.mean(self._fits, axis=0)) if self._fits else None
        # where nothing is known: as it was, or as a person has set it
        wrong = "" if settling and by_person else self._outside or (
            self._misfit(mean) if mean and not settling else self._wrong)
        level, words = self._describe(mean, wrong)
        if level != self._report[0]:
            (rospy.loginfo if level == OK else rospy.logwarn)("localization: %s", words)
        if bool(wrong) != bool(self._wrong):
            self._wrong = wrong
            self._trouble.publish(wrong)
        values = {"rays that the map explains": f"{mean.explained:.0%}",
                  "rays that go through the map's walls": f"{mean.through_walls:.0%}"} if mean else {}
        self._report = level, words, values
        return LOOK_PERIOD

    def _has_sensor(self):
        """Whether a scan has come, or somebody is there to send one: who drives without any knows it."""
        return self._scan.came > self._started or self._scan.subscriber.get_num_connections() > 0

    def _is_settling(self):
        return time.monotonic() < max(self._new_pose.came, self._put_back) + SETTLING

    def _compare(self, scan, floor_map):
        sensor = self._frames.look_up(floor_map.frame, scan.header.frame_id, scan.header.stamp, LOOK_PERIOD)
        odometry = place_of(self._frames.look_up(floor_map.frame, self._frames.odometry))
        place = self._frames.robot_in(self._frames.odometry)
        if not (sensor and odometry and place):
            return
        robot = compose(odometry, place)  # tf would have it between two of amcl's words, and a jump in two parts
        self._laid = time.monotonic()
        self._place, place_before = place, self._place or place
        refusal = floor_map.refusal(robot[:2])
        self._outside = refusal and f"the pose {refusal}"
        # also before anything is seen: the first view may move the pose
        step = math.dist(place_before[:2], place[:2])  # by the odometry: a jump of the localization is no driving
        self._steps.append(step)
        expected = compose(self._odometry or odometry, place)
        self._odometry, self._kept = odometry, self._kept or odometry
        self._moved += complex(robot[0] - expected[0], robot[1] - expected[1])
        self._way += step
        if abs(self._moved) > MOVED:
            self._go_back(floor_map.frame, sum(self._steps) < MOVED)
        elif self._way > MOVED_WAY:
            self._moved, self._way, self._kept = 0j, 0.0, odometry
        found = fit_nearby(floor_map, (*place_of(sensor)[:2], 0.0), rays_of(scan, sensor), FIT_TOLERANCE)
        if found is None:
            self._fits.clear()
            return
        self._fits.append(found)
        self._misfit_way = max(0.0, self._misfit_way + (step if found.worth < MISFIT else -step))

    def _go_back(self, frame, may):
        """Once: a changed room may fit elsewhere, and the odometry knows better.

        may: unless the odometry has jumped itself: a reset, of which the localization may hear a look later.
        """
        if not self._wrong and time.monotonic() > self._put_back + GOES_WELL:
            self._put_back = time.monotonic()
            if may:
                rospy.loginfo("the localization has jumped by %.1f m, and is put back", abs(self._moved))
                self._pose.publish(told_pose(frame, compose(self._kept, self._place)))

    def _misfit(self, mean):
        """Why a mean `Fit` proves a wrong pose; empty when it does not. A move is not made good by a view that fits."""
        found, cause = _explains(mean), ": a map of another place, or a wrong pose"
        if abs(self._moved) > MOVED:
            return f"{found}, but the localization has moved the pose by {abs(self._moved):.1f} m{cause}"
        if mean.explained < MIN_FIT and mean.worth < MISFIT and self._misfit_way >= MISFIT_WAY:
            return (f"{found}, and {mean.through_walls:.0%} go through its walls, for {self._misfit_way:.1f} m of "
                    f"driving{cause}")
        return ""

    def _describe(self, mean, wrong):
        """(level, message) of the diagnostics."""
        own = rospy.get_namespace()
        silence, unlaid = (time.monotonic() - since for since in (self._scan.came, self._laid))
        found = _explains(mean) if mean else "nothing to compare yet, or nothing is seen where the map knows something"
        explained, through = mean or (1.0, 0.0)
        return next((level, words) for applies, level, words in (
            (self.floor_map is None, WARN, "no map: does anybody publish it?"),
            (silence <= SILENCE < unlaid, WARN, "the scan cannot be laid on the map: no transform of its time leads to "
             "its frame (odometry, amcl, clocks?)"),
            (wrong, ERROR, f"{wrong}; {REMEDY}" + f" __ns:={own}" * (own != "/")),
            (self.floor_map and abs(self.floor_map.origin[2]) > TURNED, ERROR,
             "the map's origin has a yaw, which move_base takes for 0: draw the map along its axes"),
            (silence > SILENCE, WARN,
             f"no scan for {silence:.0f} s: does its sensor run? Navigation through cmd_vel_mux stands until it comes"
             if self._has_sensor() else "no scan yet: does its sensor run? Navigation does not see"),
            (explained >= MIN_FIT, OK, found),
            (through >= THROUGH_WALLS, WARN,
             f"{found}, and {through:.0%} go through its walls: the room has changed, or the pose is wrong"),
            (True, WARN, f"{found}, the others end before its walls: something that the map lacks fills the view, or "
             "the robot is elsewhere"),
        ) if applies)


def _explains(mean):
    return f"the map explains {mean.explained:.0%} of the scan's rays"
