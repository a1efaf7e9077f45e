"""The command relocalize: turns the robot around once, and finds by what it has seen where on the map it is."""

import math
import time

import numpy as np
import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist, Vector3
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String

from robotont_driver.kinematics.se2 import between, compose
from robotont_map_navigation.goal import Goal, Outcome, Status
from robotont_map_navigation.readings import Frames, Newest, floor_map_of, needed_radius, place_of, rays_of, told_pose
from robotont_map_navigation.scan_fit import same_place, search
from robotont_map_navigation.tool import wait_for

SPEED = 0.6      # [rad/s] of the turn
PERIOD = 0.1     # [s] between two commands
STUCK = 3.0      # [s] without a tenth of the turn that is due, and something holds the robot
RUN_OUT = 0.5    # [s] after the turn, until the robot stands
WAIT = 10.0      # [s] for map, scan and transforms
LEAST = 0.7      # share of the rays that the map has to explain, less those through walls
CLEARER = 0.05   # by which every other place has to fit less
ASK = "drive by hand to where more can be seen and try again, or set the pose by RViz' 2D Pose Estimate"


class Relocalize:
    """Sees the scans while the robot turns, in the odometry's frame."""

    def __init__(self):
        self._map = Newest("map", OccupancyGrid)
        self._trouble = Newest("localization/trouble", String, String())
        self._driver = Newest("cmd_vel/driven_by", String)  # the mux' own word: others listen to the command, too
        self._scans = []
        self._frames = Frames()
        self._command = rospy.Publisher("cmd_vel/navigation", Twist, queue_size=1)
        self._pose = rospy.Publisher("initialpose", PoseWithCovarianceStamped, queue_size=1)
        rospy.Subscriber("scan", LaserScan, self._scans.append, queue_size=5)

    def run(self):
        """Turn and search; the Outcome."""
        for what, there in (("map", lambda: self._map.message), ("scan", lambda: self._scans),
                            ("odometry", self._place), ("amcl", self._pose.get_num_connections),
                            ("cmd_vel_mux", lambda: self._driver.message)):
            if not wait_for(there, WAIT):
                return Outcome(Status.NOT_THERE, f"no {what} in {WAIT:g} s: do robot.launch, navigation.launch and "
                               "the driver of the scan's sensor run?")
        del self._scans[:]
        return self._turn() or self._find()

    def _find(self):
        """Search with what has been seen; the Outcome."""
        floor_map, rays = floor_map_of(self._map.message), self._seen()
        believed = self._frames.robot_in(floor_map.frame)
        found = search(floor_map, rays, needed_radius() / 2, believed) if rays[0].size else []
        well = [one for one in found if one.share >= LEAST]
        if not well:
            return Outcome(Status.LOST,
                           f"no place of the map fits what is seen by {LEAST:.0%}, or no wall is seen: {ASK}")
        first = well[0]  # one before it is where amcl had it, and fits less
        others = [one for one in found if one is not first]
        rival = max(others, key=lambda one: one.share, default=None)
        stays = believed and same_place(first.pose, believed)
        if rival and not stays and first.share - rival.share < CLEARER:
            return Outcome(Status.LOST, f"{Goal(*first.pose)} and {Goal(*rival.pose)} look alike from here: {ASK}")
        self._pose.publish(told_pose(floor_map.frame, first.pose))
        if not wait_for(lambda: same_place(self._frames.robot_in(floor_map.frame) or (1e9, 0, 0), first.pose), WAIT):
            return Outcome(Status.NOT_THERE, f"found {Goal(*first.pose)}, but nobody takes it there: is amcl alive?")
        if not wait_for(lambda: not self._trouble.message.data, WAIT):
            return Outcome(Status.LOST, f"found {Goal(*first.pose)}, but {self._trouble.message.data}: {ASK}")
        elsewhere = max(0.0, rival.share if rival else 0.0)
        room = "; amcl had it there: the room has changed, or it is elsewhere" * bool(stays and elsewhere > first.share)
        return Outcome(Status.DONE, f"found at {Goal(*first.pose)}: the map fits what is seen by {first.share:.0%}, "
                       f"at other places by {elsewhere:.0%} at most{room}")

    def _turn(self):
        """Turn once around; an Outcome when something holds the robot."""
        message, turned, yaw, moved = Twist(angular=Vector3(z=SPEED)), 0.0, self._place()[2], time.monotonic()
        try:
            while turned < 2 * math.pi:
                self._command.publish(message)
                time.sleep(PERIOD)
                step = math.remainder(self._place()[2] - yaw, 2 * math.pi)
                turned, yaw = turned + step, yaw + step
                if step > 0.1 * SPEED * PERIOD:
                    moved = time.monotonic()
                if time.monotonic() - moved > STUCK:
                    return Outcome(Status.GAVE_UP, "the robot does not turn: is it stopped, held or unplugged, or "
                                   "does somebody else drive?")
        finally:
            self._command.publish(Twist())
        time.sleep(RUN_OUT)
        return None

    def _seen(self):
        """(ends 2 x N, free 2 x M) [m] of all scans, in the robot's frame as it stands now."""
        here, seen = self._place(), [(np.zeros((2, 0)),) * 2]
        for scan in tuple(self._scans):
            sensor = self._frames.look_up(self._frames.odometry, scan.header.frame_id, scan.header.stamp)
            if sensor:
                from_here = between(here, (*place_of(sensor)[:2], 0.0))
                seen.append([np.array(compose(from_here, (*rays, 0.0))[:2]) for rays in rays_of(scan, sensor)])
        return [np.hstack(each) for each in zip(*seen)]

    def _place(self):
        """Pose (x, y, yaw) of the robot in the odometry's frame; None when unknown."""
        return self._frames.robot_in(self._frames.odometry)
