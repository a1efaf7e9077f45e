"""The odometry as ROS' messages: odom, TF and joint_states, one of each per packet."""

import math

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState

from robotont_driver.odometry.odometry_stamps import SECOND
from robotont_driver.parameters.parameters import ParameterError, fault
from robotont_driver.rospy_repairs.publishers import DroppingPublisher

# Variance of z, roll and pitch (and their rates): a robot on the floor has none; filters like no zeros.
FLAT = 1e-6


class OdometryMessages:
    """Made once, with all that never changes; each packet fills in the rest. parameters: those of odom_node."""

    def __init__(self, parameters, wheels):
        self._odom = Odometry(child_frame_id=parameters["base_frame"])
        self._odom.header.frame_id = parameters["odom_frame"]
        self._transform = TransformStamped(child_frame_id=parameters["base_frame"])
        self._transform.header.frame_id = parameters["odom_frame"]
        self._joints = JointState(name=[
            parameters["joint_prefix"] + name for name in joint_names(parameters["joint_names"], wheels)])
        self._stamp = rospy.Time()  # of all three messages
        for message in (self._odom, self._transform, self._joints):
            message.header.stamp = self._stamp
        self._broadcaster = tf2_ros.TransformBroadcaster() if parameters["publish_tf"] else None
        self._odom_publisher = DroppingPublisher("odom", Odometry)
        self._joint_publisher = DroppingPublisher("joint_states", JointState)

    def publish(self, odometry, covariance, nanoseconds):
        """Publish a WheelOdometry and its pose's Covariance with a stamp [ns]."""
        self._stamp.secs, self._stamp.nsecs = divmod(nanoseconds, SECOND)
        pose, odom, joints, transform = odometry.pose, self._odom, self._joints, self._transform.transform
        position, orientation = odom.pose.pose.position, odom.pose.pose.orientation
        position.x = transform.translation.x = pose.x
        position.y = transform.translation.y = pose.y
        orientation.z = transform.rotation.z = math.sin(pose.yaw / 2)
        orientation.w = transform.rotation.w = math.cos(pose.yaw / 2)
        odom.twist.twist.linear.x, odom.twist.twist.linear.y, odom.twist.twist.angular.z = odometry.twist
        odom.pose.covariance = planar(covariance)
        odom.twist.covariance = planar(odometry.twist_covariance)
        self._odom_publisher.publish(odom)
        if self._broadcaster:
            self._broadcaster.sendTransform(self._transform)
        joints.position = odometry.wheel_angles
        joints.velocity = odometry.wheel_rates
        self._joint_publisher.publish(joints)


def joint_names(given, wheels):
    """Names of the joints: those `given` between blanks, or wheel_0_joint, ... Raises ParameterError."""
    names = given.split() or [f"wheel_{wheel}_joint" for wheel in range(wheels)]
    if len(names) != wheels:
        raise ParameterError([fault("~joint_names", given, f"{wheels} names between blanks")])
    return names


def planar(covariance):
    """The 36 numbers of a message (x, y, z, roll, pitch, yaw; row by row) for a Covariance."""
    xx, xy, xa, yy, ya, aa = covariance
    return [xx, xy, 0.0, 0.0, 0.0, xa, xy, yy, 0.0, 0.0, 0.0, ya, 0.0, 0.0, FLAT, 0.0, 0.0, 0.0,
            0.0, 0.0, 0.0, FLAT, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, FLAT, 0.0, xa, ya, 0.0, 0.0, 0.0, aa]
