"""The world about a robot: its map and its shapes for RViz, the other robots in it, a visitor.

Of several robots, robot1, robot2, ..., each has its own physics, and sees the others there.
"""

import math
import re

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped, Vector3
from nav_msgs.msg import OccupancyGrid, Odometry
from visualization_msgs.msg import Marker, MarkerArray

from robotont_driver.kinematics.se2 import compose, pose_of
from robotont_driver.parameters.parameters import Parameter, ParameterError
from robotont_simulator.world import FREE, OCCUPIED, RESOLUTION, draw_map, read_world

APART = 0.5  # [m] between the starts, to the left of the first
ROBOTS = Parameter("robots", 1, "in this world: robot1, robot2, ...; this namespace is one of them",
                   minimum=1, maximum=9)


def shared(world, robots, namespace):
    """The `World` as the robot in that namespace has it. Raises ValueError."""
    if robots == 1:
        return world
    found = re.fullmatch(f"/?robot([1-{robots}])/?", namespace)
    if not found:
        raise ValueError(f"robots: found the namespace {namespace} of {robots} robots, "
                         f"allowed: robot1 to robot{robots}")
    start = compose(world.start, (0.0, APART * (int(found[1]) - 1), 0.0))
    return world._replace(start=start, others=(*sorted({*range(1, robots + 1)} - {int(found[1])}),))


def world_of(parameters):
    """`shared` for a node's parameters. Raises ParameterError."""
    try:
        return shared(read_world(parameters["world"]), parameters["robots"], rospy.get_namespace())
    except (OSError, ValueError) as error:
        raise ParameterError([str(error)]) from None


def watch_visitor(put):
    """Call put(0, x, y) with each place [m] that the visitor is given."""
    rospy.Subscriber("simulator_node/visitor", Vector3, lambda message: put(0, message.x, message.y))


def watch(others, put):
    """Call put(place, x, y) with the true places [m] of the others, place: 1, 2, ...."""
    def told(message, place):
        put(place, message.pose.pose.position.x, message.pose.pose.position.y)
    for place, number in enumerate(others, 1):
        rospy.Subscriber(f"/robot{number}/ground_truth/odom", Odometry, told, place, queue_size=1, tcp_nodelay=True)


class WorldMap:
    """The world's own map, latched, and where on it the odometry starts: as a map server and a localization would send.

    Raises ValueError where the start is in a wall.
    """

    def __init__(self, world, odom_frame):
        # static, so that the transforms of a localization which is started later take its place
        self._broadcaster = tf2_ros.StaticTransformBroadcaster()
        self._odom_frame, self._newest = odom_frame, None
        self._send_start(world.start)
        rospy.Subscriber("odom", Odometry, self._on_odometry, queue_size=50)
        if world.solids:
            self._map = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
            image, origin = draw_map(world)
            grid = OccupancyGrid()
            grid.header.stamp, grid.header.frame_id = rospy.Time.now(), "map"
            grid.info.resolution, (grid.info.height, grid.info.width) = RESOLUTION, image.shape
            grid.info.origin.position.x, grid.info.origin.position.y = origin
            grid.info.origin.orientation.w = 1.0
            grid.data = np.select([image == FREE, image == OCCUPIED], [0, 100], -1)[::-1].ravel().tolist()
            self._map.publish(grid)
        self._markers = rospy.Publisher("world", MarkerArray, queue_size=1, latch=True)
        self._markers.publish([marker(number, shape) for number, shape in enumerate(world.shapes)])

    def _send_start(self, pose):
        self._start, start = pose, TransformStamped(child_frame_id=self._odom_frame)
        start.header.stamp, start.header.frame_id = rospy.Time.now(), "map"
        fill(start.transform.translation, start.transform.rotation, pose)
        self._broadcaster.sendTransform(start)

    def _on_odometry(self, message):
        before, self._newest = self._newest, message.pose
        # Nothing but a reset takes doubt away: the variances of x, y and yaw fall, each by more than half. With
        # wheel_noise 0 there is none, and no reset is seen.
        if before and all(message.pose.covariance[place] < before.covariance[place] / 2 for place in (0, 7, 35)):
            self._send_start(compose(self._start, pose_of(before.pose)))  # the robot keeps its place


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
