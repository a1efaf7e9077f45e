"""What a robot says of itself to a fleet: the ROS side, without any network of its own."""

import math
import threading
import time
from pathlib import Path
from xml.etree import ElementTree

import rospkg
import rospy
from actionlib_msgs.msg import GoalID
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import BatteryState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from robotont_driver.kinematics.se2 import between
from robotont_driver.robots.battery import EMPTY
from robotont_fleet.transforms import Chain
from robotont_teleop.hand.emergency_stop_button import EmergencyStopButton
from robotont_teleop.hand.robot_reports import NewestDiagnostics
from robotont_teleop.web.page_setup import own_address

LONGEST_WORDS = 200
SHORTEST = 0.2          # [s] over which a speed is measured
LONGEST_WAY = 1.0       # [m] between two states; beyond, somebody has put the robot elsewhere


class RobotState:
    """The newest of everything that a fleet wants to know, and what it may order."""

    def __init__(self, page):
        self._lock = threading.Lock()
        prefix = (rospy.get_namespace().strip("/") + "/").lstrip("/")
        self.chain = Chain(prefix + "base_link", prefix)
        self._diagnostics = NewestDiagnostics(rospy.get_namespace().strip("/"))
        self._battery = None
        self._driven_by = ""
        self._page = page
        package = Path(rospkg.RosPack().get_path("robotont_fleet")) / "package.xml"
        self._version = ElementTree.parse(str(package)).findtext("version", "unknown")
        self._last = 0.0, None  # time [s] and pose of the state before
        self._speeds = None
        self._driven = 0.0     # [m]
        self.emergency_stop = EmergencyStopButton()
        self._goals = rospy.Publisher("move_base_simple/goal", PoseStamped, queue_size=1)
        self._cancels = rospy.Publisher("move_base/cancel", GoalID, queue_size=5)
        for topic, kind, callback in (
                ("/tf", TFMessage, lambda message: self._on_transforms(message, False)),
                ("/tf_static", TFMessage, lambda message: self._on_transforms(message, True)),
                ("/diagnostics", DiagnosticArray, lambda message: self._diagnostics.hear(message, time.monotonic())),
                ("battery", BatteryState, self._on_battery), ("cmd_vel/driven_by", String, self._on_driven_by)):
            rospy.Subscriber(topic, kind, callback, queue_size=50)

    # Orders

    def stop(self):
        """Press the emergency stop; a person beside the robot releases it. Goals are taken back."""
        self.emergency_stop.press()
        self._cancels.publish(GoalID())

    def cancel(self, message=None):
        """Take back the goal that a GoalID names, or all."""
        self._cancels.publish(message or GoalID())

    def goal(self, message):
        """Send the robot to a PoseStamped on the map; returns why not, or ""."""
        place, turn = message.pose.position, message.pose.orientation
        if not all(map(math.isfinite, (place.x, place.y, turn.x, turn.y, turn.z, turn.w))):
            return "goal refused: it is no place"
        if self.emergency_stop.pressed:
            return "goal refused: the emergency stop is pressed"
        if self._battery and self._battery["charge"] is not None and self._battery["charge"] <= EMPTY:
            return "goal refused: the battery is empty"
        if not self._goals.get_num_connections():
            return "goal refused: no navigation runs"
        self._goals.publish(message)
        return ""

    def goal_at(self, x, y):
        """As `goal`, for (x, y) [m] on the map; the robot looks in the end as it looks now."""
        frame, pose = self.chain.pose(time.monotonic())
        if frame != "map":
            return "goal refused: the robot does not know its place on a map"
        message = PoseStamped()
        message.header.frame_id = frame
        message.header.stamp = rospy.Time.now()
        message.pose.position.x, message.pose.position.y = x, y
        message.pose.orientation.z, message.pose.orientation.w = math.sin(pose[2] / 2), math.cos(pose[2] / 2)
        return self.goal(message)

    # For the fleet

    def state(self, now):
        """The state at time `now` [s], for JSON."""
        frame, pose = self.chain.pose(now)
        with self._lock:
            return {"frame": frame, "pose": rounded(pose, 3), "speed": rounded(self._speed(pose, now), 3),
                    "driven": round(self._driven, 2), "battery": self._battery, "driven_by": self._driven_by,
                    "stopped": self.emergency_stop.pressed_by, "worst": self._diagnostics.worst(now),
                    "page": self._page, "versions": {"robotont": self._version, "board": self._diagnostics.board}}

    def values(self, now):
        """{task: {"level", key: number}} of the diagnostics at time `now` [s], for JSON."""
        return self._diagnostics.values(now)

    def _speed(self, pose, now):
        """([m/s], [rad/s]) since the state before, or None."""
        then, before = self._last
        if now - then < SHORTEST:
            return self._speeds
        self._last, self._speeds = (now, pose), None
        if pose and before:
            x, y, turn = between(before, pose)
            way = math.hypot(x, y)
            self._driven += way if way < LONGEST_WAY else 0.0
            self._speeds = way / (now - then), math.remainder(turn, math.tau) / (now - then)
        return self._speeds

    # From the robot

    def _on_transforms(self, message, fixed):
        self.chain.hear(message.transforms, time.monotonic(), fixed)

    def _on_battery(self, message):
        self._battery = {"voltage": finite(message.voltage, 1), "charge": finite(message.percentage, 2)}

    def _on_driven_by(self, message):
        self._driven_by = message.data[:LONGEST_WORDS]


def page_address():
    """Address of the robot's own page, or "" where other computers cannot open it."""
    parameters = rospy.get_param("web_teleop_node", {})
    if parameters.get("address") not in ("0.0.0.0", "::"):
        return ""
    scheme = "https" if parameters.get("certificate") else "http"
    return f"{scheme}://{own_address()}:{parameters.get('port', 8100)}/"


def rounded(values, decimals):
    """List of the values, None for None."""
    return None if values is None else [round(value, decimals) for value in values]


def finite(value, decimals):
    """The value rounded, or None where it is not finite."""
    return round(value, decimals) if math.isfinite(value) else None
