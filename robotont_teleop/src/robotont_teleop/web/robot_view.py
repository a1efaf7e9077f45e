"""A robot for the web pages: its state and their commands, without any network of its own.

All that a page can ask for and see goes through one object, which tests replace.
"""

import itertools
import socket
import threading

import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import Twist

from robotont_driver.rospy_repairs.dropping_publisher import DroppingPublisher
from robotont_map_navigation.goal import Goal
from robotont_map_navigation.goto_client import GoTo
from robotont_teleop.hand.emergency_stop_publisher import EmergencyStopPublisher
from robotont_teleop.hand.robot_reports import LONGEST_WORDS
from robotont_teleop.hand.service_request import ServiceRequest
from robotont_teleop.hand.speeds import STOP
from robotont_teleop.hand.twist_message import twist_message
from robotont_teleop.web.camera import Camera
from robotont_teleop.web.newest_goal import NewestGoal
from robotont_teleop.web.robot_telemetry import RobotTelemetry


class RobotView(RobotTelemetry):
    """State and commands. Calls by pages never wait, and whatever takes its time is never carried out late."""

    def __init__(self, camera_topic):
        self._notes = itertools.count(1)
        self.emergency_stop = EmergencyStopPublisher(self._say)  # first: on a slow network each takes seconds
        super().__init__()
        self.name = rospy.get_namespace().strip("/") or socket.gethostname()
        self.camera = Camera(camera_topic)
        self._note = {"number": 0, "words": ""}
        self._sending = threading.RLock()
        self._ended = False
        self._goto = GoTo(lambda words: self._goal.show_progress(words))
        self._goal = NewestGoal(self._goto, self._say)
        self._command = DroppingPublisher("cmd_vel/hand", Twist)
        self._cancel = rospy.Publisher("move_base/cancel", GoalID, queue_size=5, tcp_nodelay=True)
        self.reset_odometry = ServiceRequest("reset_odometry", "reset odometry", self._say).call
        self.give_back = ServiceRequest("cmd_vel_mux/give_back", "give back", self._say).call
        rospy.on_shutdown(self._stop)

    # Commands of the pages

    def send(self, twist):
        """A command by hand, (v_x [m/s], v_y [m/s], omega [rad/s])."""
        with self._sending:
            if not self._ended:
                self._command.publish(twist_message(twist))

    def _stop(self):
        """The end of the node: zero is the last command."""
        with self._sending:
            self.send(STOP)
            self._ended = True

    def cancel(self):
        """Take back every goal, whoever has sent it."""
        self._goal.cancel()
        self._cancel.publish(GoalID())

    def goal(self, x, y):
        """Send the robot to (x, y) [m] on the map; it looks in the end as it looks now."""
        self._goal.pursue(Goal(x, y, self.yaw_on_map()))

    def _say(self, words):
        self._note = {"number": next(self._notes), "words": words[:LONGEST_WORDS]}

    # State for the pages

    def state(self):
        """Fast-changing state, for JSON."""
        stop = self.emergency_stop
        return {**super().state(), "stopped": stop.pressed, "stop_waits": stop.waits,
                "pressed_here": stop.latched and not stop.waits, "heard": self._command.get_num_connections() > 0}

    def status(self):
        """Slow-changing state, for JSON."""
        return {**super().status(), "camera": self.camera.present, "navigation": self._goto.answers,
                "goal": self._goal.shown, "note": self._note}

    def figures(self):
        """What `metrics` wants."""
        return [{**self.summary, "name": self.name, "up": self.emergency_stop.has_driver, "age": 0.0,
                 "stopped": self.emergency_stop.pressed}], {self.name: self.values}
