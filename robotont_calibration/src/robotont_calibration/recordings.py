"""A recorded drive: what was measured and true, and the path that follows from its packets."""

import math
from pathlib import Path

import numpy as np
import rosbag

from robotont_calibration.calibration_runs import odometry
from robotont_calibration.trajectory import Trajectory
from robotont_driver.kinematics import se2
from robotont_driver.odometry.odometry_stamps import SECOND, OdometryStamps
from robotont_driver.protocol.plain import parse_packet
from robotont_driver.protocol.protocol import LONGEST_LINE, PacketError

PACKETS = ("std_msgs/String",)  # types of messages
POSES = ("nav_msgs/Odometry", "geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped")


class RecordingError(ValueError):
    """A recording that cannot be used: what was found, what is allowed, and where."""


class Recording:
    """A recording, in lists of (time [s], value): poses, packets (tuples of counts)."""

    def __init__(self):
        self.odometry = []   # (x, y, yaw) that odom_node published
        self.truth = []      # (x, y, yaw) of a ground truth
        self.packets = []    # counts
        self.refused = 0     # malformed packets and poses

    def take(self, kind, time, message):
        """Take a ROS message of a kind: odometry, truth or packets."""
        if kind == "packets":
            try:
                counts = parse_packet(message.data, message.data[:LONGEST_LINE].partition(";")[0].count(":") + 1)
            except PacketError:
                self.refused += 1
            else:
                self.packets.append((time, counts))
        else:
            pose = se2.pose_of(getattr(message.pose, "pose", message.pose))  # with covariance, or without
            if all(map(math.isfinite, pose)):
                getattr(self, kind).append((message.header.stamp.to_sec() or time, pose))
            else:
                self.refused += 1

    def trajectory(self, kind, lacking="found no poses"):
        """`Trajectory` of "odometry" or "truth". Raises RecordingError with these words where there is none."""
        poses = getattr(self, kind)
        if len(poses) < 2:
            raise RecordingError(lacking)
        return Trajectory(*zip(*poses))

    def counts(self, wheels):
        """(stamps [s] K, as odom_node gives them, counts K x n) of the packets.

        They are numbered as they stand: where one was lost, the line of the stamps begins anew behind it. Raises
        RecordingError unless they have n fields each.
        """
        if not self.packets:
            raise RecordingError("found no packets of counts")
        odd = [counts for _, counts in self.packets if len(counts) != wheels.amount]
        if odd:
            raise RecordingError(
                f"found a packet of {len(odd[0])} wheels, allowed: {wheels.amount}, as in the wheel parameters")
        clock = OdometryStamps(1.0 / wheels.pid_frequency)
        arrivals = [round(arrival * SECOND) for arrival, _ in self.packets]
        stamps = [clock.stamp(at, at, number) for number, at in enumerate(arrivals)]
        return np.array(stamps) / SECOND, np.array([counts for _, counts in self.packets])

    def recomputed(self, wheels, point=(0.0, 0.0)):
        """`Trajectory` of a point (x, y) [m] of base_link, by these packets with other `Wheels`, from the origin."""
        times, counts = self.counts(wheels)
        return Trajectory(times, odometry(wheels, counts, point)[1:])


def read_recording(path, topics):
    """`Recording` of a bag. topics: {kind: topic}, with kinds as in `Recording.take`.

    Topics match with or without a leading slash. Raises RecordingError when the file cannot be read.
    """
    path = Path(path)
    if not path.is_file():
        raise RecordingError(f"{path}: no such file")
    kinds = {"/" + topic.lstrip("/"): kind for kind, topic in topics.items() if topic}
    recording, sources = Recording(), {}
    try:
        with rosbag.Bag(str(path)) as bag:
            found = bag.get_type_and_topic_info().topics
            wanted = {topic: kinds["/" + topic.lstrip("/")] for topic in found if "/" + topic.lstrip("/") in kinds}
            if topics.get("truth") and "truth" not in wanted.values():
                raise RecordingError(f"{path}: found no topic {topics['truth']}; there are: {', '.join(sorted(found))}")
            for topic, kind in wanted.items():
                types = PACKETS if kind == "packets" else POSES
                if found[topic].msg_type not in types:
                    raise RecordingError(f"{path}: {topic}: found {found[topic].msg_type}, allowed: {', '.join(types)}")
            if not wanted:
                raise RecordingError(f"{path}: found none of {', '.join(sorted(kinds))}; there are: "
                                     f"{', '.join(sorted(found)) or 'no topics'}")
            for topic, message, time, header in bag.read_messages(topics=list(wanted), return_connection_header=True):
                name = header.get("callerid", "")
                name = name.decode() if isinstance(name, bytes) else name
                if sources.setdefault(topic, name) != name:  # of two robots' poses or packets no path is one's
                    raise RecordingError(f"{path}: {topic}: found two nodes that publish it, {sources[topic]} and "
                                         f"{name}, allowed: one")
                recording.take(wanted[topic], time.to_sec(), message)
    except RecordingError:
        raise
    except rosbag.ROSBagUnindexedException:
        raise RecordingError(f"{path}: found a bag without its end, as after a loss of power; rosbag reindex {path} "
                             "makes one of what is there") from None
    except Exception as error:  # a corrupt bag can raise whatever rosbag, its decompressors and generated code raise
        words = f"{type(error).__name__}: {str(error)[:200]}"
        raise RecordingError(f"{path}: no bag that can be read: {words}") from error
    return recording
