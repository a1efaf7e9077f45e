"""Lets DWAPlannerROS stay where it has arrived, and turn there to the goal's yaw."""

import contextlib
import math

import rospy
from dynamic_reconfigure.msg import Config, DoubleParameter
from dynamic_reconfigure.srv import Reconfigure
from geometry_msgs.msg import PoseStamped

from robotont_map_navigation.readings import Newest

ARRIVED = 0.01  # [m] from the goal's place, where it arrives: xy_goal_tolerance of dwa_local_planner.yaml
STAYS = 0.04    # [m] and where it stays, until the next goal


class Arrival:
    """Sets DWAPlannerROS' xy_goal_tolerance: wide from the arrival until the next goal.

    It does not remember that it has arrived, and amcl's pose moves by some cm while the robot turns: it would drive
    after its goal, for ever. A tolerance that is always wide would let it stop short of the goal.
    """

    def __init__(self):
        self._goal = Newest("move_base/current_goal", PoseStamped)
        self._reached = self._set = None  # the message of the goal that has been; the newest tolerance [m]
        self._reconfigure = rospy.ServiceProxy("move_base/DWAPlannerROS/set_parameters", Reconfigure)

    def look(self, place):
        """Ten times per second, with the robot at (x [m], y [m], yaw) on the map."""
        goal = self._goal.message
        if not goal:
            return
        if math.dist(place[:2], (goal.pose.position.x, goal.pose.position.y)) <= ARRIVED:
            self._reached = goal
        tolerance = STAYS if goal is self._reached else ARRIVED
        if tolerance != self._set:
            self._set = tolerance
            with contextlib.suppress(rospy.ServiceException):  # another planner has no such service
                self._reconfigure(Config(doubles=[DoubleParameter("xy_goal_tolerance", tolerance)]))
