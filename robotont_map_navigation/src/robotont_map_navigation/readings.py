"""What this package reads of ROS: topics, move_base's parameters of the robot, maps, transforms, scans."""

import math
import time

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import Point, Pose, PoseWithCovariance, PoseWithCovarianceStamped, Quaternion
from std_msgs.msg import Header

from robotont_description.mounted import rotation_of, seen_from_above
from robotont_driver.kinematics.se2 import pose_of, yaw_of
from robotont_map_navigation.floor_map import FloorMap

DEVIATION = 0.1  # [m], [rad] with which amcl is told of a place
COSTMAP = "move_base/global_costmap/"


class Newest:
    """The newest message of a topic, and when it came."""

    def __init__(self, topic, kind, message=None, **options):
        """message: what counts before the first one; options: of rospy.Subscriber."""
        self.message, self.came = message, -math.inf  # [s] of time.monotonic()
        self.subscriber = rospy.Subscriber(topic, kind, self._on_message, queue_size=1, **options)

    def _on_message(self, message):
        self.message, self.came = message, time.monotonic()


def needed_radius():
    """[m] of the circle that move_base keeps free around the robot, by its parameters; 0 when they name none."""
    return sum(rospy.get_param(COSTMAP + name, 0.0) for name in ("robot_radius", "footprint_padding"))


def floor_map_of(message):
    """FloorMap of a nav_msgs/OccupancyGrid."""
    cells = np.array(message.data, np.int8).reshape(message.info.height, message.info.width)
    return FloorMap(cells, message.info.resolution, pose_of(message.info.origin), message.header.frame_id)


def message_of(pose):
    """geometry_msgs/Pose of (x [m], y [m], yaw [rad])."""
    x, y, yaw = pose
    return Pose(Point(x, y, 0.0), Quaternion(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)))


def told_pose(frame, pose):
    """geometry_msgs/PoseWithCovarianceStamped by which amcl is told of a pose (x [m], y [m], yaw [rad]) in a frame."""
    told = PoseWithCovariance(message_of(pose), (DEVIATION ** 2 * np.eye(6)).ravel().tolist())
    return PoseWithCovarianceStamped(Header(0, rospy.Time.now(), frame), told)


class Frames:
    """What tf knows. By move_base's parameters, base: the robot's frame; map, odometry: the costmaps'."""

    def __init__(self):
        self.map = rospy.get_param(COSTMAP + "global_frame", "map")
        self.base = rospy.get_param(COSTMAP + "robot_base_frame", "base_link")
        self.odometry = rospy.get_param("move_base/local_costmap/global_frame", "odom")
        self._transforms = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._transforms)

    def look_up(self, frame, child, stamp=None, timeout=0.0):
        """TransformStamped of a frame `child` in `frame`, the newest or that of a stamp; None when unknown."""
        try:
            return self._transforms.lookup_transform(frame, child, stamp or rospy.Time(), rospy.Duration(timeout))
        except tf2_ros.TransformException:
            return None

    def robot_in(self, frame):
        """(x [m], y [m], yaw [rad]) of the robot in a frame; None when unknown."""
        return place_of(self.look_up(frame, self.base))


def place_of(found):
    """(x [m], y [m], yaw [rad]) of a geometry_msgs/TransformStamped; None of None."""
    return found and (found.transform.translation.x, found.transform.translation.y, yaw_of(found.transform.rotation))


def rays_of(scan, sensor):
    """(ends 2 x N, free 2 x M) [m] of a sensor_msgs/LaserScan, from the sensor in the axes that `sensor` leads to.

    Where rays have ended, and how far those saw that met nothing (inf, REP 117). Other rays show nothing. sensor:
    TransformStamped of its frame, which may hang or tilt.
    """
    ranges = np.array(scan.ranges)
    ways = np.clip(ranges, 0.0, scan.range_max) * _ways(scan, sensor)
    return ways[:, (ranges >= scan.range_min) & (ranges < scan.range_max)], ways[:, ranges == math.inf]


def blind_rays_of(scan, sensor):
    """2 x K [m], as of `rays_of`: those without a reading, which may meet something before range_min."""
    ranges = np.array(scan.ranges)
    return scan.range_min * _ways(scan, sensor)[:, ~(ranges >= scan.range_min)]


def _ways(scan, sensor):
    """2 x N, a ray's way from above per metre."""
    angles, shares = seen_from_above(rotation_of(sensor.transform.rotation),
                                     scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges)))
    return shares * np.array((np.cos(angles), np.sin(angles)))
