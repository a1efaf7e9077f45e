"""Where something holds the robot, navigation stands, and then its goal ends: it must not push what it does not see."""

import math
import threading
import time

import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Float32, Header, String

from robotont_driver.ros.diagnostics import ERROR, OK, Health, robot_name
from robotont_driver.ros.worker import Worker
from robotont_map_navigation.hold_watch import STAND, HoldWatch
from robotont_map_navigation.readings import Newest, needed_radius

NOTHING = 0.0, 0.0, 0.0
# [m] from the edge that plans keep free to what is felt, and its height: the local costmap takes the lower one, that no
# motion may touch, the global one the higher one, so that plans begin outside of it
FELT = (0.0, 0.05), (0.06, 0.15)
# [rad] from the direction of travel, where it may be: so little that a camera at the front sees past it, or no scan
# would ever clear it
FRONT = -0.1, 0.0, 0.1
PERIOD = 1.0  # [s] between two clouds: a costmap counts the age of what is felt up to the newest one, and forgets then


class Held:
    """Where the robot does not move as navigation commands, `navigation/stand` lets it stand for a moment.

    `navigation/felt` tells the costmaps what it has touched, so that the next plan leads around it.
    Where that happens again and again, every goal is cancelled; `navigation/held` tells why.
    """

    def __init__(self, frame):
        """frame: the robot's."""
        self._lock = threading.Lock()  # a subscriber's thread each
        self._edge, self._frame = needed_radius(), frame  # now: the master may be gone when they are needed
        self._watch = HoldWatch(self._edge)
        # where there is no mux to tell it is navigation
        self._driver = Newest("cmd_vel/driven_by", String, String("navigation"), tcp_nodelay=True)
        self._words, self._command = "", NOTHING
        self._felt = rospy.Publisher("navigation/felt", PointCloud2, queue_size=1)
        self._stand = rospy.Publisher("navigation/stand", Float32, queue_size=1, tcp_nodelay=True)
        self._told = rospy.Publisher("navigation/held", String, queue_size=1, latch=True)
        self._told.publish("")
        self._cancel = rospy.Publisher("move_base/cancel", GoalID, queue_size=1)
        for topic, kind, callback in (("cmd_vel/limited", Twist, self._on_command), ("odom", Odometry, self._on_odom),
                                      ("move_base/current_goal", PoseStamped, lambda _: self._tell(""))):  # tries anew
            rospy.Subscriber(topic, kind, callback, queue_size=1, tcp_nodelay=True)
        Worker(self._tell_costmaps)
        Health(robot_name(), {"motion": self._report})

    def _on_command(self, message):
        with self._lock:
            self._command = _twist(message) if self._driver.message.data == "navigation" else NOTHING
            self._watch.command(self._command, time.monotonic())

    def _on_odom(self, message):
        with self._lock:
            now = time.monotonic()
            age = max(0.0, (rospy.Time.now() - message.header.stamp).to_sec())  # another computer's clock may be ahead
            ahead = self._command
            stand, words = self._watch.measure(_twist(message.twist.twist), now - age, now)
        if stand:
            self._stand.publish(STAND)
            self._tell_costmaps(ahead)
        if words:
            rospy.logwarn("navigation ends its goal: %s", words)
            self._tell(words)  # first: who has sent the goal asks why it ended
            self._cancel.publish(GoalID())

    def _tell_costmaps(self, ahead=NOTHING):
        """Something is in the way of a twist, of a turn on the spot nobody knows where; returns the time to rest."""
        bearing, edge = math.atan2(ahead[1], ahead[0]), self._edge
        points = [((edge + off) * math.cos(bearing + side), (edge + off) * math.sin(bearing + side), height)
                  for off, height in FELT for side in FRONT if any(ahead[:2])]
        self._felt.publish(point_cloud2.create_cloud_xyz32(Header(0, rospy.Time.now(), self._frame), points))
        return PERIOD

    def _tell(self, words):
        self._words = words
        self._told.publish(words)

    def _report(self):
        values = {"driven by": self._driver.message.data}
        return (ERROR, self._words, values) if self._words else (OK, "as commanded", values)


def _twist(message):
    return message.linear.x, message.linear.y, message.angular.z
