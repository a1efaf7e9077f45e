"""Lets DWAPlannerROS stay where it has arrived, and turn there to the goal's yaw."""

import math
import threading

import rospy
from dynamic_reconfigure.msg import Config, DoubleParameter
from dynamic_reconfigure.srv import Reconfigure
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseActionFeedback

ARRIVED = 0.02  # [m] from the goal's place, where it arrives: xy_goal_tolerance of dwa_local_planner.yaml
STAYS = 0.06    # [m] and where it stays, until the next goal


class Arrival:
    """Sets DWAPlannerROS' xy_goal_tolerance: wide from the arrival until the next goal.

    Each new plan makes it forget that it has arrived, and amcl's pose moves by some cm while the robot turns: it would
    drive after its goal, for ever. A tolerance that is always wide would let it stop short of the goal.
    """

    def __init__(self):
        self._lock = threading.Lock()  # a subscriber's thread each
        self._set = self._goal = None  # the newest tolerance [m]; (x, y) [m] of what is pursued
        self._reconfigure = rospy.ServiceProxy("move_base/DWAPlannerROS/set_parameters", Reconfigure)
        rospy.Subscriber("move_base/current_goal", PoseStamped, self._on_goal, queue_size=1)
        rospy.Subscriber("move_base/feedback", MoveBaseActionFeedback, self._on_feedback, queue_size=1)

    def _on_goal(self, message):
        self._goal = message.pose.position.x, message.pose.position.y
        self._allow(ARRIVED)

    def _on_feedback(self, message):
        place = message.feedback.base_position.pose.position
        if self._goal and math.dist((place.x, place.y), self._goal) <= ARRIVED:
            self._allow(STAYS)

    def _allow(self, tolerance):
        """Another planner has no such service; one that is started again is told at the next goal."""
        with self._lock:
            if tolerance != self._set:
                try:
                    self._reconfigure(Config(doubles=[DoubleParameter("xy_goal_tolerance", tolerance)]))
                    self._set = tolerance
                except rospy.ServiceException:
                    self._set = None
