"""The ROS side of the guard: what it is made of, and the readings of `scan` and `range`, each in its own thread."""

import numpy as np
import rospy
import tf2_ros
from sensor_msgs.msg import LaserScan, Range
from tf2_msgs.msg import TFMessage

from robotont_description.geometry import laser_height, robot_radius
from robotont_driver.command.limits import Limits
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.se2 import rotation_of
from robotont_driver.parameters.parameters import ParameterError
from robotont_driver.ros.clocks import boot_time
from robotont_driver.ros.lifecycle import parameter_of_another, running_wheels
from robotont_driver.rospy_repairs.rospy_internals import connection_header
from robotont_teleop.mux.guard import Guard
from robotont_teleop.mux.sensor_view import cone

OLDEST = 1.0  # [s] that a reading may be old


def make_guard(blind_speed):
    """A `Guard` that hears `scan` and `range`; None where there is none, by its parameter or without a robot."""
    if blind_speed < 0.0:
        return None
    try:
        wheels = running_wheels(rospy.get_namespace())
    except ParameterError:
        return None
    limits = Limits(**{name: parameter_of_another(f"driver_node/max_{name}", 0.0) for name in Limits._fields})
    body = robot_radius(wheels), min(wheels.radii) / 2, laser_height(wheels)
    guard = Guard(body, limits, Kinematics(wheels).wheel_speeds, blind_speed)
    _Sensors(guard, rospy.get_param("odom_node/base_frame", "base_link").lstrip("/"))
    return guard


class _Sensors:
    """Tells the guard what the sensors read whose places are known by /tf_static; /tf has 100 messages per second."""

    def __init__(self, guard, base_frame):
        self._guard, self._base_frame, self._frames = guard, base_frame, tf2_ros.BufferCore()
        rospy.Subscriber("/tf_static", TFMessage, self._on_static)
        rospy.Subscriber("scan", LaserScan, self._on_scan, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("range", Range, self._on_range, queue_size=16, tcp_nodelay=True)

    def _on_static(self, message):
        for transform in message.transforms:
            self._frames.set_transform_static(transform, "")

    def _on_scan(self, scan):
        angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
        self._see("scan", scan, angles, scan.ranges, (scan.range_min, scan.range_max))

    def _on_range(self, message):
        angles = cone(message.field_of_view)
        self._see("range", message, angles, [message.range] * len(angles), (message.min_range, message.max_range))

    def _see(self, topic, message, angles, ranges, bounds):
        frame, stamp, now = message.header.frame_id.lstrip("/"), message.header.stamp, boot_time()
        name = f"{topic} of {frame!r} by {connection_header(message).get('callerid')}"
        age = 0.0 if stamp.is_zero() else max(0.0, (rospy.Time.now() - stamp).to_sec())
        try:
            if age > OLDEST:
                raise ValueError(f"its stamps are {age:.1f} s old")
            found = self._frames.lookup_transform_core(self._base_frame, frame, rospy.Time()).transform
            place = rotation_of(found.rotation), (found.translation.x, found.translation.y, found.translation.z)
            self._guard.see(name, place, angles, np.array(ranges, float), bounds, now - age)
        except tf2_ros.TransformException:
            self._guard.refuse(name, f"/tf_static does not tell where it is in {self._base_frame}", now)
        except ValueError as why:
            self._guard.refuse(name, str(why), now)
