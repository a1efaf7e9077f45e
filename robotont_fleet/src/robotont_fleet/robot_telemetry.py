"""What a robot says of itself to a fleet, and what that may order: the ROS side, without any network of its own."""

import contextlib
import math

import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import String

from robotont_driver.link.boot_clock import boot_time
from robotont_driver.robots.battery import EMPTY
from robotont_driver.ros.repeating_thread import RepeatingThread
from robotont_teleop.hand.emergency_stop_publisher import EmergencyStopPublisher
from robotont_teleop.hand.robot_reports import LONGEST_WORDS, RobotReports, rounded
from robotont_teleop.web.access import is_loopback
from robotont_teleop.web.frame_chain import FrameChain
from robotont_teleop.web.page_setup import page_url

NEXT_PAGE = 5.0  # [s] between two looks at where the robot's own page is


class RobotTelemetry(RobotReports):
    """The newest of everything that a fleet wants to know, and what it may order.

    on_pressed_by(message): called when driver_node has said who presses the emergency stop. not_released(words): why it
    was not released.
    """

    def __init__(self, on_pressed_by, not_released):
        namespace = rospy.get_namespace().strip("/")
        prefix = namespace and namespace + "/"
        self._frames, self._base = FrameChain(prefix), prefix + "base_link"
        super().__init__()
        self._page = ""
        RepeatingThread(self._look_for_page)
        self.emergency_stop = EmergencyStopPublisher(not_released)
        rospy.Subscriber("emergency_stop/pressed_by", String, on_pressed_by, queue_size=5)  # behind what it listens to
        self._goals = rospy.Publisher("move_base_simple/goal", PoseStamped, queue_size=1)
        self._cancels = rospy.Publisher("move_base/cancel", GoalID, queue_size=5)
        self._frames.listen()

    def _look_for_page(self):
        """Where other computers can open the robot's own page, whose node may start later; returns the time to rest."""
        with contextlib.suppress(OSError):  # the master is away
            given = rospy.get_param("web_teleop_node", {})
            address = given.get("address", "127.0.0.1")
            self._page = "" if is_loopback(address) else page_url(
                address, given.get("port", 8100), given.get("certificate"))
        return NEXT_PAGE

    # Orders

    def stop(self):
        """Press the emergency stop, and take back all goals."""
        self.emergency_stop.press()
        self._cancels.publish(GoalID())

    @property
    def stopped_from_here(self):
        """Whether driver_node says that the robot stands because this node has pressed."""
        return self.emergency_stop.has_driver and rospy.get_name() in self.emergency_stop.pressed_by.split(", ")

    def release(self):
        """Let the robot go where nobody else has pressed; returns why not, or ""."""
        others = set(self.emergency_stop.pressed_by.split(", ")) - {rospy.get_name()}
        if others:
            return f"not released: also pressed by {', '.join(sorted(others))}; release it on the robot's own page"
        self.emergency_stop.release()
        return ""

    def cancel(self):
        """Take back all goals."""
        self._cancels.publish(GoalID())

    def goal(self, x, y):
        """Send the robot to (x, y) [m] on the map, where it looks as it looks now; returns why not, or ""."""
        frame, pose = self._pose()
        if frame != "map":
            return "goal refused: the robot does not know its place on a map"
        if self.emergency_stop.pressed:
            return "goal refused: the emergency stop is pressed"
        charge = self.newest_charge
        if charge is not None and charge <= EMPTY:
            return "goal refused: the battery is empty"
        if not self._goals.get_num_connections():
            return "goal refused: no navigation runs"
        message = PoseStamped()
        message.header.frame_id = frame
        message.header.stamp = rospy.Time.now()
        message.pose.position.x, message.pose.position.y = x, y
        message.pose.orientation.z, message.pose.orientation.w = math.sin(pose[2] / 2), math.cos(pose[2] / 2)
        self._goals.publish(message)
        return ""

    # For the fleet

    def state(self):
        """The state, for JSON."""
        frame, pose = self._pose()
        stop = self.emergency_stop
        return {**self.summary, "frame": frame, "pose": rounded(pose, 3), "driver": stop.has_driver, "page": self._page,
                "stopped": stop.pressed_by[:LONGEST_WORDS] if stop.has_driver else ""}

    def _pose(self):
        return self._frames.pose(self._base, boot_time())
