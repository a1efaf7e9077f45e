"""Where the tags are, for programs: the frames of tags_node, or of another program that finds tags."""

import math

import rospy
import tf2_ros

MEMORY = 0.5  # [s] for which a tag that is not seen counts


class SeenTags:
    """Listens to the frames tag_N."""

    def __init__(self):
        self._frames = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._frames)

    def see(self, number):
        """(x, y [m], yaw [rad]) of a tag in base_link, yaw being the way it looks; None while it is not seen."""
        try:
            found = self._frames.lookup_transform("base_link", f"tag_{number}", rospy.Time(0))
        except tf2_ros.TransformException:
            return None
        place, turned = found.transform.translation, found.transform.rotation
        out = (turned.y * turned.z - turned.w * turned.x, turned.x * turned.z + turned.w * turned.y)
        fresh = (rospy.Time.now() - found.header.stamp).to_sec() <= MEMORY
        return (place.x, place.y, math.atan2(*out)) if fresh else None
