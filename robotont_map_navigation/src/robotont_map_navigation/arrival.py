"""Lets DWAPlannerROS stay where it has arrived, and turn there to the goal's yaw."""

import math
import threading

import rospy
from dynamic_reconfigure.msg import Config, DoubleParameter
from dynamic_reconfigure.srv import Reconfigure
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseActionFeedback, MoveBaseActionResult

from robotont_driver.parameters.parameters import Parameter

PARAMETERS = (
    Parameter("goal_tolerance", 0.02, "from the goal's place, where DWAPlannerROS arrives: its xy_goal_tolerance", "m",
              minimum=0.001, maximum=1.0),
    Parameter("stay_tolerance", 0.06, "and where it stays, until the goal's end", "m", minimum=0.001, maximum=1.0),
)


class Arrival:
    """Sets DWAPlannerROS' xy_goal_tolerance: wide from the arrival until the goal's end.

    Each new plan makes it forget that it has arrived, and amcl's pose moves by some cm while the robot turns: it would
    drive after its goal, for ever. A tolerance that is always wide would let it stop short of the goal.
    """

    def __init__(self, parameters):
        self._narrow = parameters["goal_tolerance"]
        self._wide = max(self._narrow, parameters["stay_tolerance"])
        self._lock = threading.Lock()  # a subscriber's thread each
        self._set = self._goal = None  # the newest tolerance [m]; (x, y) [m] of what is pursued
        self._reconfigure = rospy.ServiceProxy("move_base/DWAPlannerROS/set_parameters", Reconfigure)
        rospy.Subscriber("move_base/current_goal", PoseStamped, self._on_goal, queue_size=1)
        rospy.Subscriber("move_base/feedback", MoveBaseActionFeedback, self._on_feedback, queue_size=1)
        rospy.Subscriber("move_base/result", MoveBaseActionResult, lambda _: self._allow(self._narrow), queue_size=1)

    def _on_goal(self, message):
        self._goal = message.pose.position.x, message.pose.position.y
        self._allow(self._narrow)

    def _on_feedback(self, message):
        place = message.feedback.base_position.pose.position
        if self._goal and math.dist((place.x, place.y), self._goal) <= self._narrow:
            self._allow(self._wide)

    def _allow(self, tolerance):
        """Another planner has no such service; one that is started again is told at the next goal."""
        with self._lock:
            if tolerance != self._set:
                try:
                    self._reconfigure(Config(doubles=[DoubleParameter("xy_goal_tolerance", tolerance)]))
                    self._set = tolerance
                except rospy.ServiceException:
                    self._set = None
