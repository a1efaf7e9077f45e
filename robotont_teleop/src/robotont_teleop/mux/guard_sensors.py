"""The ROS side of the guard: what it is made of, and what it hears, each sensor in its own thread."""

import contextlib
from functools import partial

import rospy
import tf2_ros
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan, Range
from tf2_msgs.msg import TFMessage

from robotont_description.geometry import body
from robotont_description.mounted import rotation_of
from robotont_driver.link.boot_clock import boot_time
from robotont_driver.parameters.parameters import ParameterError, is_number
from robotont_driver.ros.server_parameters import running_wheels
from robotont_driver.rospy_repairs.rospy_internals import connection_header
from robotont_teleop.hand.sensor_view import reading_of
from robotont_teleop.mux.guard import PERIODS, REACTION, Guard

DECELERATION = 1.5  # [m/s^2] at most; less where the driver has a lower limit, or the robot is heavy
ROLLING = 1.0       # [N] that stop the makers' generation 2: at zeros its board, simulated, takes the current away


def make_guard(blind_speed, guard=None):
    """A guard that hears its sensors, or `guard`, for the robot that runs now; None without one, or where negative."""
    with contextlib.suppress(ParameterError):
        if blind_speed >= 0.0:
            wheels = running_wheels(rospy.get_namespace())
            if not guard:
                return SensingGuard(wheels, blind_speed)
            guard.measure(wheels)
    return guard


class SensingGuard(Guard):
    """Hears `odom`, `scan` and `range`; where sensors are by /tf_static alone: /tf has dozens of messages a second."""

    def __init__(self, wheels, blind_speed):
        super().__init__(body(wheels), DECELERATION, blind_speed)
        self.measure(wheels)
        self._frames = tf2_ros.BufferCore()
        for topic, kind, callback in (("/tf_static", TFMessage, self._on_static), ("odom", Odometry, self._on_odom),
                                      ("range", Range, partial(self._take, "range")),
                                      ("scan", LaserScan, partial(self._take, "scan"))):
            self._scan = rospy.Subscriber(topic, kind, callback, queue_size=16, tcp_nodelay=True)  # the last one is its

    def measure(self, wheels):
        """Another robot may run by now."""
        limits = [rospy.get_param(f"driver_node/max_linear_{limit}eleration", 0.0) for limit in ("acc", "dec")]
        force = wheels.amount * wheels.motor.stall_torque * wheels.gear / max(wheels.radii) / 4  # [N] that brake it
        board = rospy.get_param("serial_com_node/packets", rospy.get_param("robot", ""))  # driver_basic.launch: robot
        most = ROLLING / wheels.mass if board == "robotont2" else DECELERATION
        self._braking = min([most, force / wheels.mass, *(one for one in limits if is_number(one) and one > 0)])
        self._base_frame = str(rospy.get_param("odom_node/base_frame", "base_link")).lstrip("/")
        self._body, self._reaction = body(wheels), max(REACTION, PERIODS / wheels.pid_frequency)

    def _has_sensor(self):  # a scanner that is there has not spoken yet, or is dead; each board's `range` is there
        return super()._has_sensor() or self._scan.get_num_connections() > 0

    def _on_static(self, message):
        for transform in message.transforms:
            self._frames.set_transform_static(transform, "")

    def _on_odom(self, message):
        twist = message.twist.twist
        self.moves((twist.linear.x, twist.linear.y, twist.angular.z), boot_time())

    def _take(self, topic, reading):
        frame, stamp, now = reading.header.frame_id.lstrip("/"), reading.header.stamp, boot_time()
        name = f"{topic} of {frame!r} by {connection_header(reading).get('callerid')}"
        age = 0.0 if stamp.is_zero() else max(0.0, (rospy.Time.now() - stamp).to_sec())
        try:
            found = self._frames.lookup_transform_core(self._base_frame, frame, rospy.Time()).transform
            place = rotation_of(found.rotation), (found.translation.x, found.translation.y, found.translation.z)
            self.see(name, place, *reading_of(reading), now - age)
        except tf2_ros.TransformException:
            self._refused[name] = now, f"/tf_static does not tell where it is in {self._base_frame}"
        except ValueError as why:
            self._refused[name] = now, str(why)
