"""What the simulated robot tells of itself and of its world."""

import math

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import Imu, LaserScan
from visualization_msgs.msg import Marker, MarkerArray

from robotont_driver.kinematics.se2 import compose, pose_of
from robotont_simulator.world import FREE, OCCUPIED, RESOLUTION, draw_map

SCAN_RAYS = 128     # measurements per scan
SCAN_NEAREST, SCAN_FARTHEST = 0.3, 4.0  # [m] nearer things read -inf (REP 117), farther ones are not seen
IMU_BURST = 500  # readings that may wait: more than a stall makes up for


class Sensors:
    """Publishes ground truth, a scan and an IMU's readings, each period of `frequency` [Hz]; parameters: the node's."""

    def __init__(self, simulation, frequency, parameters):
        self._simulation = simulation
        self._ticks = 0
        self._truth = Odometry(child_frame_id=rospy.get_param("odom_node/base_frame", "base_link"))
        self._truth.header.frame_id = "map"
        field, rate = parameters["scan_field_of_view"], parameters["scan_rate"]
        self._angles = np.linspace(-field / 2, field / 2, SCAN_RAYS, endpoint=field < 2 * math.pi - 1e-6)
        self._scan = LaserScan(
            angle_min=self._angles[0], angle_max=self._angles[-1], angle_increment=self._angles[1] - self._angles[0],
            range_min=SCAN_NEAREST, range_max=SCAN_FARTHEST, scan_time=1.0 / rate if rate else 0.0)
        self._scan.header.frame_id = parameters["laser_frame"]
        self._scan_ticks = max(1, round(frequency / rate)) if rate else math.inf
        self._imu = Imu()
        self._imu.header.frame_id = self._truth.child_frame_id
        self._imu.orientation_covariance[0] = -1.0  # it reports none
        errors = simulation.imu_errors
        if errors:
            self._imu.angular_velocity_covariance, self._imu.linear_acceleration_covariance = (
                np.diag(part ** 2).ravel().tolist() for part in np.split(errors.deviation, 2))
        self._publishers = {kind: rospy.Publisher(topic, kind, queue_size=waiting) for kind, topic, waiting in (
            (Odometry, "ground_truth/odom", 10), (LaserScan, "scan", 2), (Imu, "imu", IMU_BURST))}

    def publish(self, stamp):
        """What there is now, or at the period's end [rospy.Time]."""
        self._ticks += 1
        truth, twist = self._truth, self._truth.twist.twist
        fill(truth.pose.pose.position, truth.pose.pose.orientation, self._simulation.pose())
        twist.linear.x, twist.linear.y, twist.angular.z = self._simulation.twist()
        self._send(truth, stamp)
        readings = self._simulation.imu_readings
        rate, acceleration = self._imu.angular_velocity, self._imu.linear_acceleration
        for later, reading in zip(range(len(readings) - 1, -1, -1), readings):  # each with its own stamp
            rate.x, rate.y, rate.z, acceleration.x, acceleration.y, acceleration.z = reading.tolist()
            self._send(self._imu, stamp - rospy.Duration.from_sec(later * self._simulation.imu_interval))
        if self._ticks % self._scan_ticks == 0:
            self._scan.ranges = self._simulation.scan(self._angles, SCAN_NEAREST, SCAN_FARTHEST).tolist()
            self._send(self._scan, stamp)

    def _send(self, message, stamp):
        message.header.stamp = stamp
        self._publishers[type(message)].publish(message)


class WorldMap:
    """The world's own map, latched, and where on it the odometry starts: as a map server and a localization would send.

    Raises ValueError where the start is in a wall.
    """

    def __init__(self, world, odom_frame):
        # static, so that the transforms of a localization which is started later take its place
        self._broadcaster = tf2_ros.StaticTransformBroadcaster()
        self._odom_frame, self._start, self._newest = odom_frame, world.start, None  # newest: pose, its covariance
        self._send_start()
        rospy.Subscriber("odom", Odometry, self._on_odometry, queue_size=50)
        if world.solids:
            self._publisher = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
            self._publisher.publish(message(*draw_map(world)))
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
