"""scan_to_distance: a scan in, the distances of its three sectors out, as the makers' courses expect them."""

import math

import rospy
from sensor_msgs.msg import LaserScan

from robotont_driver.ros.lifecycle import init_node


class ScanToDistance:
    """Publishes the minimum and the mean of each third of a scan."""

    def __init__(self, message_type):
        self._message_type = message_type
        self._publisher = rospy.Publisher("scan_to_distance", message_type, queue_size=1)
        rospy.Subscriber("scan", LaserScan, self._on_scan, queue_size=1)

    def _on_scan(self, scan):
        ranges = [distance for _, distance in from_the_right(scan)]
        right, centre, left = sectors(ranges, scan.range_min, scan.range_max)
        self._publisher.publish(self._message_type(
            stamp=scan.header.stamp, leftMin=left[0], leftMean=left[1], centerMin=centre[0], centerMean=centre[1],
            rightMin=right[0], rightMean=right[1]))


def from_the_right(scan):
    """[(angle [rad] from -pi to pi, distance [m])] of a scan, whichever way and from wherever its scanner turns."""
    angles = (math.remainder(scan.angle_min + number * scan.angle_increment, 2 * math.pi)
              for number in range(len(scan.ranges)))
    return sorted(zip(angles, scan.ranges), key=lambda ray: ray[0])


def sectors(ranges, nearest, farthest):
    """((minimum, mean) [m] of the right, the centre and the left third) of a scan from right to left.

    Too near (-inf, or below `nearest`) counts as `nearest`, nothing seen (inf, or beyond) as `farthest` [m]; NaN does
    not count. A third without any number is `farthest`.
    """
    third = len(ranges) / 3
    bounds = [round(third * part) for part in range(4)]
    return tuple(_sector(ranges[begin:end], nearest, farthest) for begin, end in zip(bounds, bounds[1:]))


def _sector(ranges, nearest, farthest):
    seen = [min(max(distance, nearest), farthest) for distance in ranges if not math.isnan(distance)]
    return (min(seen), sum(seen) / len(seen)) if seen else (farthest, farthest)


def main():
    """Run scan_to_distance."""
    init_node("scan_to_distance", __doc__)
    try:
        from robotont_msgs.msg import LaserScanSplit
    except ImportError:
        rospy.logfatal("scan_to_distance publishes robotont_msgs/LaserScanSplit: put the official package "
                       "robotont_msgs (https://github.com/robotont/robotont_msgs) into the workspace and build it")
        raise SystemExit(1) from None
    ScanToDistance(LaserScanSplit)
    rospy.spin()
