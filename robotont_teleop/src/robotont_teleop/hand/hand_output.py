"""Where commands by hand go, and the feedback: shared by keyboard_teleop and gamepad_teleop."""

import rosgraph
import rospy
from geometry_msgs.msg import Twist

from robotont_driver.rospy_repairs.publishers import DroppingPublisher
from robotont_teleop.hand.emergency_stop_publisher import EmergencyStopPublisher
from robotont_teleop.hand.robot_reports import RobotReports
from robotont_teleop.hand.speeds import STOP
from robotont_teleop.hand.twist_message import twist_message

HAND, DIRECT = "cmd_vel/hand", "cmd_vel"


class HandOutput:
    """Publishes commands for the mux, or straight on cmd_vel where no mux runs when it starts."""

    def __init__(self):
        self.topic = HAND if self._mux_runs() else DIRECT
        self._command = DroppingPublisher(self.topic, Twist)
        self.emergency_stop = EmergencyStopPublisher()
        self.reports = RobotReports(rospy.get_namespace().strip("/"))
        self.sent = STOP

    def send(self, twist):
        """Publish (v_x [m/s], v_y [m/s], omega [rad/s]); behind the call it is out, also where the process ends."""
        self.sent = twist
        self._command.publish(twist_message(twist))

    def press_emergency_stop(self):
        """Also stops by an ordinary command."""
        self.emergency_stop.press()
        self.send(STOP)

    @property
    def listeners(self):
        """Description of the receivers of the commands."""
        count = self._command.get_num_connections()
        if not count:
            return f"no node listens to {rospy.resolve_name(self.topic)}"
        if self.reports.driven_by:
            return f"drives: {self.reports.driven_by}"
        return f"{count} listen to {rospy.resolve_name(self.topic)}"

    @property
    def connected(self):
        """Whether anybody gets the commands."""
        return self._command.get_num_connections() > 0

    @staticmethod
    def _mux_runs():
        """Anybody may listen to commands by hand, as a recorder does; who drives only the mux tells."""
        publishers, _, _ = rosgraph.Master(rospy.get_name()).getSystemState()
        name = rospy.resolve_name("cmd_vel/driven_by")
        return any(topic == name for topic, _ in publishers)
