"""The world's own map, latched, and where on it the odometry starts: as a map server and a localization would send."""

import math

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from visualization_msgs.msg import Marker, MarkerArray

from robotont_driver.kinematics.se2 import compose, pose_of
from robotont_simulator.mujoco_model import WALL_COLOUR
from robotont_simulator.scenery import HEIGHT, Shape
from robotont_simulator.world import FREE, OCCUPIED, draw_map

RESOLUTION = 0.05  # [m] per cell


class WorldMap:
    """Publishes them for as long as it lives. Raises WorldError where the start is in a wall."""

    def __init__(self, world, odom_frame):
        # static, so that the transforms of a localization which is started later take its place
        self._broadcaster = tf2_ros.StaticTransformBroadcaster()
        self._odom_frame, self._start, self._newest = odom_frame, world.start, None  # newest: pose, its covariance
        self._send_start()
        rospy.Subscriber("odom", Odometry, self._on_odometry, queue_size=50)
        if world.boxes or world.posts:
            self._publisher = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
            self._publisher.publish(message(*draw_map(world, RESOLUTION)))
        self._markers = rospy.Publisher("world", MarkerArray, queue_size=1, latch=True)
        self._markers.publish(markers(world))

    def _send_start(self):
        start = TransformStamped(child_frame_id=self._odom_frame)
        start.header.stamp, start.header.frame_id = rospy.Time.now(), "map"
        start.transform.translation.x, start.transform.translation.y, yaw = self._start
        start.transform.rotation.z, start.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
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


def markers(world):
    """The MarkerArray of all that stands in a world, or is painted there, for RViz."""
    walls = [Shape("boxes", False, box.x, box.y, HEIGHT / 2, box.length, box.width, HEIGHT, box.yaw, WALL_COLOUR)
             for box in world.boxes]
    array = MarkerArray()
    for number, shape in enumerate((*walls, *world.scenery)):
        marker = Marker(ns="world", id=number, type=Marker.CYLINDER if shape.round else Marker.CUBE)
        marker.header.frame_id = "map"
        place, turned = marker.pose.position, marker.pose.orientation
        place.x, place.y, place.z = shape.x, shape.y, shape.z
        turned.z, turned.w = math.sin(shape.yaw / 2), math.cos(shape.yaw / 2)
        marker.scale.x, marker.scale.y, marker.scale.z = shape.length, shape.width, shape.height
        marker.color.r, marker.color.g, marker.color.b = shape.colour
        marker.color.a = 1.0
        array.markers.append(marker)
    return array


def message(image, origin):
    """The OccupancyGrid of what `draw_map` has drawn."""
    grid = OccupancyGrid()
    grid.header.stamp, grid.header.frame_id = rospy.Time.now(), "map"
    grid.info.resolution, (grid.info.height, grid.info.width) = RESOLUTION, image.shape
    grid.info.origin.position.x, grid.info.origin.position.y = origin
    grid.info.origin.orientation.w = 1.0
    grid.data = np.select([image == FREE, image == OCCUPIED], [0, 100], -1)[::-1].ravel().tolist()
    return grid
