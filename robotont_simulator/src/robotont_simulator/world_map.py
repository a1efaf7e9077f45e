"""The world's own map, latched, and where on it the odometry starts: as a map server and a localization would send."""

import math

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from visualization_msgs.msg import Marker, MarkerArray

from robotont_driver.kinematics.se2 import compose, pose_of
from robotont_simulator.world import FREE, OCCUPIED, draw_map

RESOLUTION = 0.05  # [m] per cell


class WorldMap:
    """Publishes them for as long as it lives. Raises ValueError where the start is in a wall."""

    def __init__(self, world, odom_frame):
        # static, so that the transforms of a localization which is started later take its place
        self._broadcaster = tf2_ros.StaticTransformBroadcaster()
        self._odom_frame, self._start, self._newest = odom_frame, world.start, None  # newest: pose, its covariance
        self._send_start()
        rospy.Subscriber("odom", Odometry, self._on_odometry, queue_size=50)
        if world.solids:
            self._publisher = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
            self._publisher.publish(message(*draw_map(world, RESOLUTION)))
        self._markers = rospy.Publisher("world", MarkerArray, queue_size=1, latch=True)
        self._markers.publish(MarkerArray([marker(number, shape) for number, shape in enumerate(world.shapes)]))

    def _send_start(self):
        start = TransformStamped(child_frame_id=self._odom_frame)
        start.header.stamp, start.header.frame_id = rospy.Time.now(), "map"
        fill(start.transform.translation, start.transform.rotation, self._start)
        self._broadcaster.sendTransform(start)

    def _on_odometry(self, message):
        before, self._newest = self._newest, (pose_of(message.pose.pose), message.pose.covariance)
        if before and is_reset(before[1], message.pose.covariance):
            self._start = compose(self._start, before[0])  # where it had brought the robot, which keeps its place
            self._send_start()


def is_reset(before, now):
    """Whether odometry began anew between two covariances (36 numbers each) of its pose.

    Nothing else takes doubt away: the variances of x, y and yaw fall, each by more than half. With wheel_noise 0
    there is none, and no reset is seen.
    """
    return all(now[number] < before[number] / 2 for number in (0, 7, 35))


def fill(place, orientation, pose):
    """Write (x [m], y [m], yaw [rad]) into a message's parts."""
    place.x, place.y, yaw = pose
    orientation.z, orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)


def marker(number, shape):
    """The Marker of a `Shape`, for RViz."""
    found = Marker(ns="world", id=number, type=Marker.CYLINDER if shape.round else Marker.CUBE)
    found.header.frame_id, found.pose.position.z = "map", shape.z
    fill(found.pose.position, found.pose.orientation, (shape.x, shape.y, shape.yaw))
    found.scale.x, found.scale.y, found.scale.z = shape.length, shape.width, shape.height
    found.color.r, found.color.g, found.color.b, found.color.a = *shape.colour, 1.0
    return found


def message(image, origin):
    """The OccupancyGrid of what `draw_map` has drawn."""
    grid = OccupancyGrid()
    grid.header.stamp, grid.header.frame_id = rospy.Time.now(), "map"
    grid.info.resolution, (grid.info.height, grid.info.width) = RESOLUTION, image.shape
    grid.info.origin.position.x, grid.info.origin.position.y = origin
    grid.info.origin.orientation.w = 1.0
    grid.data = np.select([image == FREE, image == OCCUPIED], [0, 100], -1)[::-1].ravel().tolist()
    return grid
