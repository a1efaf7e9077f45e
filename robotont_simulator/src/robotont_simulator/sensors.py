"""What the simulated robot tells of itself: ground truth, a laser scan, and the readings of an IMU."""

import math

import numpy as np
import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, LaserScan

from robotont_simulator.world_map import fill

SCAN_RAYS = 128     # measurements per scan
SCAN_NEAREST, SCAN_FARTHEST = 0.3, 4.0  # [m] nearer things read -inf (REP 117), farther ones are not seen
IMU_BURST = 500  # readings that may wait: more than a stall makes up for


class Sensors:
    """Publishes them, once per period; `frequency`: of the periods [Hz]; `parameters`: simulator_node's."""

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
                (deviation ** 2 * np.eye(3)).ravel().tolist()
                for deviation in (errors.gyro_deviation, errors.accelerometer_deviation))
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
        for later, (rates, accelerations) in zip(range(len(readings) - 1, -1, -1), readings):  # each with its own stamp
            rate, acceleration = self._imu.angular_velocity, self._imu.linear_acceleration
            rate.x, rate.y, rate.z = rates.tolist()
            acceleration.x, acceleration.y, acceleration.z = accelerations.tolist()
            self._send(self._imu, stamp - rospy.Duration.from_sec(later * self._simulation.imu_interval))
        if self._ticks % self._scan_ticks == 0:
            self._scan.ranges = self._simulation.scan(self._angles, SCAN_NEAREST, SCAN_FARTHEST).tolist()
            self._send(self._scan, stamp)

    def _send(self, message, stamp):
        message.header.stamp = stamp
        self._publishers[type(message)].publish(message)
