"""The ROS side of driver_node: cmd_vel in, serial_write out."""

import threading
from functools import partial

import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool, Float64, String
from std_srvs.srv import Trigger, TriggerResponse

from robotont_driver.command.command_age import Arrivals
from robotont_driver.command.command_stream import CommandStream
from robotont_driver.command.emergency_stop import EmergencyStop
from robotont_driver.command.limits import Limits
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import doubts
from robotont_driver.link.boot_clock import boot_time
from robotont_driver.parameters.parameters import Parameter
from robotont_driver.protocol.protocol import Packet, format_packet
from robotont_driver.ros.diagnostics import OK, WARN, Health, robot_name
from robotont_driver.ros.repeating_thread import RepeatingThread
from robotont_driver.ros.server_parameters import KeptParameter, kept_names
from robotont_driver.ros.version import version
from robotont_driver.rospy_repairs.rospy_internals import connection_header, connection_numbers
from robotont_driver.rospy_repairs.topic_reconnection import Reconnector, is_local

PARAMETERS = (
    Parameter("publish_rate", 20.0, "how often the newest command is repeated", "Hz", minimum=10.0, maximum=200.0,
              reason="serial_com_node may stop after 0.2 s without one"),
    Parameter("cmd_timeout", 0.5, "zeros after this long without a cmd_vel", "s", minimum=0.05, maximum=2.0,
              reason="for so long the robot drives on when its commander dies"),
    Parameter("command_decimals", 2, "decimals of each wheel speed; 0 for boards that read whole units",
              minimum=0, maximum=3, reason="with more, the packets of many wheels do not fit into a line"),
    Parameter("max_linear_speed", 0.0, "limit of the speed over ground; 0 = off", "m/s", minimum=0.0, maximum=100.0),
    Parameter("max_angular_speed", 0.0, "limit of the turning speed; 0 = off", "rad/s", minimum=0.0, maximum=100.0),
    Parameter("max_wheel_speed", 0.0, "limit of the fastest wheel; 0 = off", "m/s", minimum=0.0, maximum=100.0),
    Parameter("max_linear_acceleration", 0.0, "limit of the change of velocity over ground, bends included; zeros "
              "stop at once; 0 = off", "m/s^2", minimum=0.0, maximum=1000.0),
    Parameter("max_angular_acceleration", 0.0, "limit of the change of turning speed; 0 = off", "rad/s^2",
              minimum=0.0, maximum=1000.0),
    Parameter("max_linear_deceleration", 0.0, "max_linear_acceleration while the robot slows down to another motion; "
              "0 = the same", "m/s^2", minimum=0.0, maximum=1000.0),
)


# Parameters in the namespace of the wheels': a restarted node stays stopped, and knows who has to stop first.
PRESSED_BY, HELD = "emergency_stop_pressed", "emergency_stop_held"
OLD = "a command that may be old (kept back on its way, or latched before) does not drive"


class DriverNode:
    """Sends each command at once, repeats the newest, and stops when commands stop."""

    def __init__(self, name, wheels, parameters, topic):
        self._period = 1.0 / parameters["publish_rate"]
        self._tick_period = parameters["cmd_timeout"] / 8  # [s] of the watch for gaps
        self._board_period = 1.0 / wheels.pid_frequency
        if doubts(wheels):
            rospy.logwarn("%s", doubts(wheels))
        self._decimals = parameters["command_decimals"]
        limits = Limits(*(parameters["max_" + limit] for limit in Limits._fields))
        self._stream = CommandStream(Kinematics(wheels), limits, parameters["cmd_timeout"], self._period,
                                     kept_names(HELD), boot_time())
        self._emergency_stop = EmergencyStop(rospy.get_param(PRESSED_BY, ()))
        rospy.set_param("version", version())
        self._stream.emergency_stop(self._emergency_stop.pressed, boot_time())
        self._buttons = rospy.resolve_name("emergency_stop")  # the topic
        self._lock = threading.Lock()
        self._sent_at = boot_time()
        heard = []  # subscribers of commands
        self._arrivals = Arrivals(parameters["cmd_timeout"], self._sent_at, partial(is_local, heard))
        self._publish = topic("serial_write").advertise()
        self._limited = rospy.Publisher("cmd_vel/limited", Twist, queue_size=1, tcp_nodelay=True)
        self._pressed_by = rospy.Publisher("emergency_stop/pressed_by", String, queue_size=1, latch=True)
        self._pressed_by.publish(", ".join(self._emergency_stop.pressed_by))
        self._kept = (KeptParameter(PRESSED_BY, lambda: list(self._emergency_stop.pressed_by)),
                      KeptParameter(HELD, lambda: self._stream.waiting(boot_time())))
        RepeatingThread(self._repeat)
        rospy.on_shutdown(self._stop)
        emergency_stop = rospy.Subscriber("emergency_stop", Bool, self._on_emergency_stop, tcp_nodelay=True)
        rospy.Service("emergency_stop/release", Trigger, self._on_release)
        cmd_vel = rospy.Subscriber("cmd_vel", Twist, self._on_command, queue_size=1, tcp_nodelay=True)
        # the board may limit each wheel alone, which would bend the path
        rospy.Subscriber("board_wheel_limit", Float64, lambda limit: self._stream.limit_wheels(limit.data))
        heard.append(cmd_vel)
        RepeatingThread(Reconnector(boot_time, [cmd_vel, emergency_stop]).look)
        Health(robot_name(), {"command stream": self._report}, name)

    def _on_command(self, message):
        now, header = boot_time(), connection_header(message)
        linear = message.linear.x, message.linear.y, message.linear.z
        angular = message.angular.x, message.angular.y, message.angular.z
        with self._lock:
            old = not self._arrivals.are_new(header, now) and (any(linear) or any(angular))  # zeros stop at any age
            refusal = "" if old else self._stream.command(linear, angular, now, header.get("callerid", ""))
            if not old:
                self._send()
        if old:
            rospy.logwarn_throttle(10.0, OLD)
        elif refusal:  # on a line of its own: each line of the program has its own 10 s
            rospy.logwarn_throttle(10.0, "cmd_vel refused, the robot stops: " + refusal)

    def _on_emergency_stop(self, message):
        header = connection_header(message)
        who, latched = header.get("callerid", "somebody"), header.get("latching") == "1"
        with self._lock:
            if self._emergency_stop.hear(who, message.data, latched, *connection_numbers(self._buttons, header)):
                self._follow_emergency_stop(boot_time())

    def _on_release(self, request):
        """A person releases all presses, whoever has pressed; none that he has not seen, where his node says so."""
        seen = connection_header(request).get("seen")
        with self._lock:
            now = boot_time()
            if not self._arrivals.gaps.settled(now):  # a press may be newer
                return TriggerResponse(False, "not released: this node was stopped or starved; ask again")
            pressed_by = self._emergency_stop.pressed_by
            newer = () if seen is None else [node for node in pressed_by if node not in seen.split(", ")]
            if newer:
                return TriggerResponse(False, f"not released: {', '.join(newer)} pressed it meanwhile; ask again")
            before = ", ".join(pressed_by)
            if self._emergency_stop.release():
                self._follow_emergency_stop(now)
        return TriggerResponse(True, f"released; {before} had pressed it" if before else "was not pressed")

    def _follow_emergency_stop(self, now):
        """Carry out a change, then tell it."""
        pressed_by = ", ".join(self._emergency_stop.pressed_by)
        if self._stream.emergency_stop(self._emergency_stop.pressed, now):
            self._send()
            rospy.logwarn("emergency stop %s", f"pressed by {pressed_by}" if pressed_by else
                          "released; waiting for new commands")
        self._pressed_by.publish(pressed_by)
        for kept in self._kept:
            kept.changed()

    def _send(self):
        """Send what may go out now: since a command was judged this process may have been stopped."""
        self._sent_at = now = boot_time()
        twist = self._stream.twist(now)
        units = self._stream.kinematics.units_of_twist(twist)
        self._publish(Packet(units, format_packet(units, self._decimals)))
        if self._limited.get_num_connections():
            limited = Twist()
            limited.linear.x, limited.linear.y, limited.angular.z = twist
            self._limited.publish(limited)

    def _repeat(self):
        """Send the newest command again when nothing went out for a period; return the time to rest."""
        with self._lock:
            now = boot_time()
            self._arrivals.gaps.tick(now)
            pace = min(self._period, self._board_period) if self._stream.ramping else self._period
            if now - self._sent_at >= pace or self._stream.time_left(now) == 0.0:
                self._send()
            left = self._stream.time_left(now)
            return min(self._sent_at + pace - now, pace if left is None else left, self._tick_period)

    def _stop(self):
        with self._lock:
            self._stream.end()
            self._send()

    def _report(self):
        with self._lock:
            now, stream = boot_time(), self._stream
            age, complaint = stream.age(now), stream.complaint(now)
            values = {
                "commands": stream.commands,
                "refused": stream.refused,
                "time-outs": stream.timeouts,
                "newest command limited": "yes" if stream.limited else "no",
                "emergency stop": ", ".join(self._emergency_stop.pressed_by) or "not pressed",
                "times that this node was stopped or starved": self._arrivals.gaps.amount,
                "age of newest command [s]": "none yet" if age is None else f"{age:.2f}",
            }
        newest = "no cmd_vel yet" if age is None else f"no cmd_vel for {age:.0f} s"
        words = complaint or ("following cmd_vel" if stream.time_left(now) else newest)
        return WARN if complaint else OK, words, values
