"""The ROS side of the guard: what it is made of, and the readings of `scan` and `range`, each in its own thread."""

import numpy as np
import rospy
import tf2_ros
from sensor_msgs.msg import LaserScan, Range
from tf2_msgs.msg import TFMessage

from robotont_description.geometry import robot_radius
from robotont_driver.command.limits import Limits
from robotont_driver.kinematics.se2 import yaw_of
from robotont_driver.parameters.parameters import ParameterError
from robotont_driver.ros.clocks import boot_time
from robotont_driver.ros.node_parameters import parameter_of_another, running_wheels
from robotont_teleop.mux.guard import BEYOND, Guard

OLDEST = 1.0   # [s] more a stamp does not count
CONE_RAYS = 5  # as which the cone of a range sensor counts: what it has measured may be anywhere in it


def make_guard(blind_speed):
    """A `Guard` that hears `scan` and `range`; None where there is none, by its parameter or without a robot."""
    if blind_speed < 0.0:
        return None
    try:
        radius = robot_radius(running_wheels(rospy.get_namespace()))
    except ParameterError:
        return None
    limits = Limits(**{name: parameter_of_another(f"driver_node/max_{name}", 0.0) for name in (
        "linear_acceleration", "linear_deceleration", "angular_acceleration")})
    guard = Guard(radius, limits, blind_speed)
    _Sensors(guard, rospy.get_param("odom_node/base_frame", "base_link"))
    return guard


class _Sensors:
    """Tells the guard what the sensors read whose places are known by /tf_static; /tf has 100 messages per second."""

    def __init__(self, guard, base_frame):
        self._guard, self._base_frame = guard, base_frame
        self._frames = tf2_ros.BufferCore()
        self._places = {}
        rospy.Subscriber("/tf_static", TFMessage, self._on_static)
        rospy.Subscriber("scan", LaserScan, self._on_scan, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("range", Range, self._on_range, queue_size=16, tcp_nodelay=True)

    def _on_static(self, message):
        for transform in message.transforms:
            self._frames.set_transform_static(transform, "")

    def _on_scan(self, scan):
        angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
        self._see(scan, angles, np.array(scan.ranges, float), scan.range_min)

    def _on_range(self, message):
        angles = np.linspace(-0.5, 0.5, CONE_RAYS) * message.field_of_view
        distance = message.range if message.range <= message.max_range else np.inf
        self._see(message, angles, np.full(CONE_RAYS, distance), message.min_range, BEYOND)

    def _see(self, message, angles, ranges, nearest, beyond=0.0):
        place = self._place(message.header.frame_id)
        if place and len(ranges) and np.isfinite(angles).all():
            age = min(max((rospy.Time.now() - message.header.stamp).to_sec(), 0.0), OLDEST)
            order = slice(None, None, -1 if angles[-1] < angles[0] else 1)
            at = boot_time() - age
            self._guard.see(message.header.frame_id, place, angles[order], ranges[order], nearest, at, beyond)

    def _place(self, frame):
        """(x, y, yaw) of a sensor in base_link; None where nobody has said it."""
        if frame not in self._places:
            try:
                transform = self._frames.lookup_transform_core(self._base_frame, frame, rospy.Time(0)).transform
            except tf2_ros.TransformException:
                return None
            self._places[frame] = (transform.translation.x, transform.translation.y, yaw_of(transform.rotation))
        return self._places[frame]
