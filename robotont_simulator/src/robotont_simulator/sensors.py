"""What the simulated robot tells of itself: ground truth, a laser scan, and the readings of an IMU."""

import math

import numpy as np
import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, LaserScan

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
            range_min=SCAN_NEAREST, range_max=SCAN_FARTHEST,
            scan_time=1.0 / rate if rate else 0.0)
        self._scan.header.frame_id = parameters["laser_frame"]
        self._scan_ticks = max(1, round(frequency / rate)) if rate else 0
        self._imu = Imu()
        self._imu.header.frame_id = self._truth.child_frame_id
        self._imu.orientation_covariance[0] = -1.0  # it reports none
        errors = simulation.imu_errors
        if errors:
            for covariance, deviation in (
                    (self._imu.angular_velocity_covariance, errors.gyro_deviation),
                    (self._imu.linear_acceleration_covariance, errors.accelerometer_deviation)):
                covariance[:] = (deviation ** 2 * np.eye(3)).ravel()
        self._truth_publisher = rospy.Publisher("ground_truth/odom", Odometry, queue_size=10)
        self._scan_publisher = rospy.Publisher("scan", LaserScan, queue_size=2)
        self._imu_publisher = rospy.Publisher("imu", Imu, queue_size=IMU_BURST)

    def publish(self, stamp):
        """What there is now, or at the period's end [rospy.Time]."""
        self._ticks += 1
        self._publish_truth(stamp)
        self._publish_imu(stamp)
        if self._scan_ticks and self._ticks % self._scan_ticks == 0:
            self._publish_scan(stamp)

    def _publish_truth(self, stamp):
        truth = self._truth
        truth.header.stamp = stamp
        x, y, yaw = self._simulation.pose()
        truth.pose.pose.position.x, truth.pose.pose.position.y = x, y
        truth.pose.pose.orientation.z, truth.pose.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        twist = truth.twist.twist
        twist.linear.x, twist.linear.y, twist.angular.z = self._simulation.twist()
        self._truth_publisher.publish(truth)

    def _publish_imu(self, stamp):
        """The period's readings, each with its own stamp."""
        imu, readings = self._imu, self._simulation.imu_readings
        for later, (rates, accelerations) in zip(range(len(readings) - 1, -1, -1), readings):
            imu.header.stamp = stamp - rospy.Duration.from_sec(later * self._simulation.imu_interval)
            rate, acceleration = imu.angular_velocity, imu.linear_acceleration
            rate.x, rate.y, rate.z = rates.tolist()
            acceleration.x, acceleration.y, acceleration.z = accelerations.tolist()
            self._imu_publisher.publish(imu)

    def _publish_scan(self, stamp):
        scan = self._scan
        scan.header.stamp = stamp
        scan.ranges = self._simulation.scan(self._angles, scan.range_min, scan.range_max).tolist()
        self._scan_publisher.publish(scan)
