"""Where commands by hand go, and what comes back: always to the mux, whoever starts first."""

import rospy
from geometry_msgs.msg import Twist

from robotont_driver.rospy_repairs.dropping_publisher import DroppingPublisher
from robotont_teleop.hand.emergency_stop_publisher import EmergencyStopPublisher
from robotont_teleop.hand.robot_reports import RobotReports
from robotont_teleop.hand.speeds import STOP
from robotont_teleop.hand.twist_message import twist_message

TOPIC = "cmd_vel/hand"


class HandOutput:
    """Publishes commands for cmd_vel_mux."""

    def __init__(self):
        self.emergency_stop = EmergencyStopPublisher()  # first: on a slow network each takes seconds
        self._command = DroppingPublisher(TOPIC, Twist)
        self.reports = RobotReports()
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
        if not self.connected:
            return f"no cmd_vel_mux on {rospy.resolve_name(TOPIC)}"
        return f"drives: {self.reports.driven_by or '?'}"

    @property
    def connected(self):
        """Whether anybody gets the commands."""
        return self._command.get_num_connections() > 0
