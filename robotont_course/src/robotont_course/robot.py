"""The robot as a beginner's program sees it: the newest word of each sensor, and one command 20 times a second.

An ordinary node: all that it does is done by rospy, with the topics of every robot of this project.
"""

import math
import sys
from pathlib import Path

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import Image, LaserScan

from robotont_course.scan_to_distance import from_the_right
from robotont_driver.kinematics import se2

MEMORY = 0.5  # [s] for which a tag that is not seen counts


class Robot:
    """Its sensors. A topic is listened to from the first question on, which waits for the first message."""

    def __init__(self):
        self._newest = {}
        self._frames = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._frames)

    def _message(self, topic, kind):
        if topic not in self._newest:
            self._newest[topic] = rospy.wait_for_message(topic, kind)
            rospy.Subscriber(topic, kind, lambda message: self._newest.update({topic: message}), queue_size=1,
                             buff_size=2 ** 24)
        return self._newest[topic]

    @property
    def odometry(self):
        """x, y [m] and yaw [rad] since the robot was started."""
        return se2.pose_of(self._message("odom", Odometry).pose.pose)

    @property
    def points(self):
        """What the scan sees, from the right to the left: (angle [rad], left positive; distance [m]) of each point."""
        scan = self._message("scan", LaserScan)
        return [(angle, distance) for angle, distance in from_the_right(scan)
                if scan.range_min <= distance <= scan.range_max]

    @property
    def ahead(self):
        """The least distance [m] in the scan's middle third; infinite: nothing there, -infinite: too near."""
        rays = from_the_right(self._message("scan", LaserScan))
        third = len(rays) // 3
        return min((distance for _, distance in rays[third:-third] if not math.isnan(distance)), default=math.inf)

    @property
    def picture(self):
        """The camera's picture, rows from the top x columns x (red, green, blue, 0 to 255)."""
        image = self._message("camera/color/image_raw", Image)
        return np.frombuffer(image.data, np.uint8).reshape(image.height, image.width, 3).astype(int)

    def see(self, number):
        """x, y [m] of a tag (ahead, to the left) and the way that it looks [rad]; None while it is not seen."""
        found = self._frame("base_link", f"tag_{number}")
        if not found or (rospy.Time.now() - found.header.stamp).to_sec() > MEMORY:
            return None
        place, turned = found.transform.translation, found.transform.rotation
        return place.x, place.y, math.atan2(turned.y * turned.z - turned.w * turned.x,
                                            turned.x * turned.z + turned.w * turned.y)

    @property
    def on_map(self):
        """x, y [m] and yaw [rad] on the map; waits until that is known."""
        while True:
            found = self._frame("map", "base_link")
            if found:
                place = found.transform.translation
                return place.x, place.y, se2.yaw_of(found.transform.rotation)
            rospy.sleep(0.05)

    def free(self, x, y):
        """Whether the map has nothing at a place [m]."""
        grid = self._message("map", OccupancyGrid)
        column = int((x - grid.info.origin.position.x) / grid.info.resolution)
        row = int((y - grid.info.origin.position.y) / grid.info.resolution)
        inside = 0 <= column < grid.info.width and 0 <= row < grid.info.height
        return inside and grid.data[row * grid.info.width + column] == 0

    def _frame(self, parent, child):
        try:
            return self._frames.lookup_transform(parent, child, rospy.Time(0))
        except tf2_ros.TransformException:
            return None


def run(drive, frequency=20):
    """Call drive(command, robot) so many times a second [Hz], and publish each command, a Twist, on cmd_vel."""
    rospy.init_node(Path(sys.argv[0]).stem)
    publisher, robot = rospy.Publisher("cmd_vel", Twist, queue_size=1), Robot()
    rate = rospy.Rate(frequency)
    while not rospy.is_shutdown():
        command = Twist()
        drive(command, robot)
        publisher.publish(command)
        rate.sleep()
