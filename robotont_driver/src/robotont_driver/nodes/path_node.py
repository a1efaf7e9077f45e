"""The ROS side of path_node: odom in, path out."""

import math

import rospy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry, Path

from robotont_driver.kinematics.se2 import yaw_of
from robotont_driver.nodes.travelled_path import Sample, Trail
from robotont_driver.ros.lifecycle import run_without_wheels

MAX_POSES = 1000      # that the path keeps; the oldest go first
MIN_DISTANCE = 0.05   # [m] between two poses of the path
PUBLISH_PERIOD = 0.2  # [s] between two paths


class PathNode:
    """Publishes the way of the robot whenever it has become longer."""

    def __init__(self, _parameters):
        self._trail = Trail(MAX_POSES, MIN_DISTANCE)
        self._frame = ""
        self._changed = False
        self._publisher = rospy.Publisher("path", Path, queue_size=1, latch=True)
        rospy.Subscriber("odom", Odometry, self._on_odometry, queue_size=10, tcp_nodelay=True)
        rospy.Timer(rospy.Duration(PUBLISH_PERIOD), self._publish, reset=True)

    def _on_odometry(self, message):
        self._frame = message.header.frame_id
        if self._trail.add(sample_of(message)):
            self._changed = True

    def _publish(self, _event):
        if self._changed:
            self._changed = False
            self._publisher.publish(path_of(self._frame, tuple(self._trail.poses)))


def sample_of(message):
    """Sample of a nav_msgs/Odometry."""
    position, orientation = message.pose.pose.position, message.pose.pose.orientation
    velocity = message.twist.twist.linear
    return Sample(message.header.stamp.to_sec(), position.x, position.y,
                  yaw_of(orientation), math.hypot(velocity.x, velocity.y))


def path_of(frame, samples):
    """nav_msgs/Path in `frame` of samples, each pose with its own stamp; the path has the newest one's."""
    path = Path()
    path.header.frame_id = frame
    for sample in samples:
        pose = PoseStamped()
        pose.header.frame_id = frame
        pose.header.stamp = rospy.Time.from_sec(sample.time)
        pose.pose.position.x, pose.pose.position.y = sample.x, sample.y
        pose.pose.orientation.z, pose.pose.orientation.w = math.sin(sample.yaw / 2), math.cos(sample.yaw / 2)
        path.poses.append(pose)
    if path.poses:
        path.header.stamp = path.poses[-1].header.stamp
    return path


def main():
    """Run path_node; list wrong parameters, if any, and exit with 1."""
    run_without_wheels("path_node", PathNode, ())
