"""Gives way: while something comes to where the robot drives, navigation stands, until it has passed or stands, too.

Plans take all that they see for things that stand, and lead so close past a person, or another robot, that both touch.
Who then stands nearer than the scanner measures is for them where it saw him last: so they are told.
"""

import math
import random
import time
from collections import defaultdict, deque

import numpy as np
import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float32

from robotont_driver.kinematics.se2 import between
from robotont_map_navigation.readings import Newest, blind_rays_of, place_of, rays_of

NEAR = 1.0         # [m] from the sensor: what moves farther off may go anywhere
BESIDE = 1.0       # [rad] to each side of the way
BACK = 0.4         # [s] between two views that are compared
FARTHER = 0.12     # [m] than a point lies now, the earlier view saw there
ALIKE = 0.02       # [rad] between a ray and the earlier ones beside it
POINTS = 3         # so many, in two scans on end, or it is noise
BETWEEN = 0.008    # [rad] between two rays that are looked at, about: all 640 of a camera took a fifth of a core
WAIT = 0.4, 1.6    # [s] behind the last motion: by lot, for of two robots that wait for each other one has to begin
LONGEST = 10.0     # [s] of it; what moves on the spot for longer, as a curtain, is driven around as before, until ...
ANOTHER = 3.0      # [s] without motion, and the next one draws again
IDLE = 0.5         # [s] without a command, and nothing drives
TIMEOUT = 0.05     # [s] for the transform of a scan
CLOSE = 0.3        # [m] farther off than the scanner measures: who was seen there last, and then not at all, ...
WIDE = 0.3         # [rad] ... within so much of where he was, ...
STAYS = 2.5        # [s] ... so long behind his last motion, stands before the robot
GAP = 0.03         # [m] more from him, for plans; with none a robot turned to and fro for 25 s


class MovingThings:
    """Finds what has come to where an earlier scan saw through; without ROS."""

    def __init__(self):
        self._views, self._found = deque(), False
        self.comer, self.came = np.zeros((2, 0)), -math.inf  # [m] what came, when it did last; [s] of that scan

    def come(self, place, ends, free, way, now):
        """Whether something that moves is near, and on the way.

        place: (x, y) of the sensor [m]; ends: 2 x N, free: 2 x M [m], from there, as by `rays_of`, in axes that stand;
        way: [rad] in these, or None; now: [s] of the scan.
        """
        rays = np.hstack([ends, free])
        if self._views and now < self._views[-1][0] - BACK:  # the clock was set back
            self._views.clear()
            self.came = -math.inf
        self._views.append((now, place, rays))
        while len(self._views) > 1 and self._views[1][0] <= now - BACK:
            self._views.popleft()
        then, there, before = self._views[0]
        found, self._found = self._found, False
        if way is None or not BACK / 2 < now - then < 2 * BACK or not before.size:
            return False
        ahead = np.cos(np.arctan2(ends[1], ends[0]) - way) > math.cos(BESIDE)
        near = ends[:, ahead & (np.hypot(*ends) < NEAR)]
        points = near + np.subtract(place, there)[:, None]
        across = abs(np.outer(points[0], before[1]) - np.outer(points[1], before[0]))
        alike = across < math.tan(ALIKE) * (points.T @ before)
        seen = np.where(alike, np.hypot(*before), math.inf).min(axis=1, initial=math.inf)
        moving = np.isfinite(seen) & (seen > np.hypot(*points) + FARTHER)
        self._found = np.count_nonzero(moving) >= POINTS
        if found and self._found:
            self.comer, self.came = near[:, moving] + np.reshape(place, (2, 1)), now
        return found and self._found


class GivesWay:
    """`navigation/stand` while something comes; what is too near to be measured is `felt`, a `Felt`."""

    def __init__(self, frames, felt):
        self._frames, self._felt = frames, felt
        self._things = defaultdict(MovingThings)  # by frame: of two scanners each sees its own
        self._command = Newest("cmd_vel", Twist, tcp_nodelay=True)
        self._wait, self._came, self._since = 0.0, -math.inf, 0.0
        self._stand = rospy.Publisher("navigation/stand", Float32, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("scan", LaserScan, self._on_scan, queue_size=5, tcp_nodelay=True)  # of several scanners

    def _on_scan(self, scan):
        now = time.monotonic()
        if now - self._command.came > IDLE:
            return
        sensor = self._frames.look_up(self._frames.odometry, scan.header.frame_id, scan.header.stamp, TIMEOUT)
        robot = self._frames.robot_in(self._frames.odometry)
        if not (sensor and robot):
            return
        wished = self._command.message.linear
        way = robot[2] + math.atan2(wished.y, wished.x) if wished.x or wished.y else None
        things = self._things[scan.header.frame_id]
        step = max(1, int(BETWEEN / abs(scan.angle_increment or BETWEEN)))
        rays = (kind[:, ::step] for kind in rays_of(scan, sensor))
        if things.come(place_of(sensor)[:2], *rays, way, scan.header.stamp.to_sec()):
            if now - self._came > ANOTHER:
                self._wait, self._since = random.uniform(*WAIT), now
                rospy.loginfo("navigation gives way: something comes")
            self._came = now
            if now - self._since < LONGEST:
                self._stand.publish(self._wait)
        if scan.header.stamp.to_sec() - things.came < STAYS:
            self._feel(things.comer, blind_rays_of(scan, sensor)[:, ::step], place_of(sensor)[:2], robot)

    def _feel(self, comer, blind, start, robot):
        """Tell the costmaps who stands where nothing is measured now. All in axes that stand; start: of the rays."""
        reach, seen = np.hypot(*blind), comer - np.reshape(start, (2, 1))
        beside = blind.T @ seen > math.cos(WIDE) * np.outer(reach, np.hypot(*seen))
        near = blind[:, (beside & (np.hypot(*seen) < reach[:, None] + CLOSE)).any(axis=1)]
        if near.size:
            x, y, _ = between(robot, (*(near / 2 + np.reshape(start, (2, 1))), 0.0))
            self._felt.tell(np.unique(np.arctan2(y, x).round(1)), GAP)
