"""Tells the costmaps what stands at the robot's edge and no scan measures, so that the next plan leads around it."""

import math

import rospy
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

from robotont_driver.ros.repeating_thread import RepeatingThread
from robotont_map_navigation.readings import needed_radius

# [m] from the edge that plans keep free to what is felt, and its height: the local costmap takes the lower one, that no
# motion may touch, the global one the higher one, so that plans begin outside of it
LOCAL, GLOBAL = (0.0, 0.05), (0.06, 0.15)
CLOUDS = 1.0        # [s] between two clouds: a costmap counts the age of what is felt up to the newest one


class Felt:
    """`navigation/felt`: what the robot has touched, and what is nearer than its scanner measures."""

    def __init__(self, frames):
        self._edge, self._frames = needed_radius(), frames  # now: the master may be gone when it is needed
        self._clouds = rospy.Publisher("navigation/felt", PointCloud2, queue_size=1)
        RepeatingThread(self.tell)

    def tell(self, bearings=(), gap=0.0):
        """Something stands in these directions [rad] on the robot; plans keep `gap` [m] more; the time to rest."""
        reaches = (self._edge + LOCAL[0], LOCAL[1]), (self._edge + gap + GLOBAL[0], GLOBAL[1])
        points = [(reach * math.cos(bearing), reach * math.sin(bearing), height)
                  for reach, height in reaches for bearing in bearings]
        self._clouds.publish(point_cloud2.create_cloud_xyz32(Header(0, rospy.Time.now(), self._frames.base), points))
        return CLOUDS
