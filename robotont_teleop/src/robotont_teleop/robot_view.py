"""A robot for the web pages: its state and their commands, without any network of its own.

All that a page can ask for and see goes through one object, which tests replace.
"""

import socket
import threading

import rosgraph
import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import Twist
from std_srvs.srv import Trigger

from robotont_driver.ros.publishers import DroppingPublisher
from robotont_driver.ros.worker import Worker
from robotont_map_navigation.goal import Goal
from robotont_map_navigation.goto_client import GoTo
from robotont_teleop.camera import Camera
from robotont_teleop.emergency_stop_client import EmergencyStopClient
from robotont_teleop.robot_requests import NewestGoal, ServiceRequest
from robotont_teleop.robot_topics import MAP_FRAME, RobotTopics
from robotont_teleop.speeds import STOP
from robotont_teleop.twist_message import twist_message

CAMERA_LOOK = 2.0       # [s] between two looks at whether there is a camera
LONGEST_WORDS = 200


class RobotView:
    """State and commands. Calls by pages never wait, and whatever takes its time is never carried out late."""

    def __init__(self, wheels, camera_topic):
        self._lock = threading.Lock()
        self._topics = RobotTopics(wheels)
        self._name = rospy.get_namespace().strip("/") or socket.gethostname()
        self._camera = Camera(camera_topic)
        self._note = {"number": 0, "words": "", "good": True}
        self._sending = threading.RLock()
        self._ended = False
        self._goto = GoTo(MAP_FRAME, lambda words: self._goal.show_progress(words), self._topics.transforms)
        self._goal = NewestGoal(self._goto, self._say)
        self._emergency_stop = EmergencyStopClient(lambda words: self._say(words, False))
        self._publish()
        rospy.on_shutdown(self._stop)
        Worker(self._look_for_camera)

    def _publish(self):
        self._command = DroppingPublisher("cmd_vel/hand", Twist)
        self._cancel = rospy.Publisher("move_base/cancel", GoalID, queue_size=5, tcp_nodelay=True)
        self._reset = ServiceRequest("reset_odometry", "reset odometry", Trigger, self._say)
        self._give_back = ServiceRequest("cmd_vel_mux/give_back", "give back", Trigger, self._say)

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

    def press_emergency_stop(self):
        """It stays pressed until a person releases it."""
        self._emergency_stop.press()

    def release_emergency_stop(self):
        """Ask for its release, after which commands move the robot again."""
        self._emergency_stop.release()

    @property
    def stopped(self):
        """Whether the emergency stop is pressed."""
        return self._emergency_stop.pressed

    @property
    def pressed_at(self):
        """When it was pressed for the last time [s], by time.monotonic()."""
        return self._emergency_stop.pressed_at

    def cancel(self):
        """Take back every goal, whoever has sent it."""
        self._goal.cancel()
        self._cancel.publish(GoalID())

    def goal(self, x, y):
        """Send the robot to (x, y) [m] on the map; it looks in the end as it looks now."""
        self._goal.pursue(Goal(x, y, self._topics.yaw_on_map()))

    def give_back(self):
        """Let navigation drive now."""
        self._give_back.call()

    def reset_odometry(self):
        """Reset the pose."""
        self._reset.call()

    def _say(self, words, good):
        with self._lock:
            self._note = {"number": self._note["number"] + 1, "words": words[:LONGEST_WORDS], "good": good}

    # State for the pages

    def state(self):
        """Fast-changing state, for JSON."""
        return {**self._topics.fast(), "stopped": self.stopped}

    def status(self):
        """Slow-changing state, for JSON."""
        status = {**self._topics.slow(), "camera": self._camera.present, "navigation": self._goto.answers,
                  "goal": self._goal.shown}
        with self._lock:
            return {**status, "note": self._note}

    def figures(self):
        """What `metrics` wants."""
        robot, values = self._topics.figures()
        return [{**robot, "name": self._name, "id": "", "present": True, "age": 0.0, "stopped": self.stopped}], \
            {self._name: values}

    def scan(self):
        """The newest scan for JSON, or None."""
        return self._topics.scan()

    def map_picture(self):
        """PNG of the map, or None."""
        return self._topics.map_picture

    def camera_picture(self):
        """(number, JPEG) of now, or None."""
        return self._camera.picture()

    def _look_for_camera(self):
        try:
            publishers, _, _ = rosgraph.Master(rospy.get_name()).getSystemState()
        except (OSError, rosgraph.MasterException):
            return CAMERA_LOOK
        self._camera.look({name for name, _ in publishers})
        self._camera.wait(CAMERA_LOOK)
        return 0.0
