"""Recorded drives, from a bag (rosbag, without a master) or a CSV file.

CSV: a heading `time,m0,m1,...` and then one line per packet: time [s] and the counts [edges] of one PID
period of each wheel. Behind them may stand `x,y,yaw` [m, m, rad]: where the robot really was after it.
Lines that start with # are comments.
"""

import csv
import math
from pathlib import Path

import numpy as np

from robotont_calibration.trajectory import Trajectory
from robotont_driver.odometry import LONGEST_HOLD, Pose, WheelOdometry
from robotont_driver.packet_clock import SECOND, PacketClock
from robotont_driver.protocol import PacketError, parse_packet
from robotont_driver.se2 import yaw_of

NOISE = 0.0  # these odometries need no covariance


class RecordingError(ValueError):
    """A recording that cannot be used: what was found, what is allowed, and where."""


class Recording:
    """What was recorded, in lists of (time [s], value): poses, packets (tuples of counts), twists."""

    def __init__(self):
        self.odometry = []   # (x, y, yaw) that odom_node published
        self.truth = []      # (x, y, yaw) of a ground truth
        self.packets = []    # counts
        self.stamped = False  # whether the packets' times are when they were made, not when they came
        self.commands = []   # (v_x, v_y, omega) of cmd_vel
        self.refused = 0     # packets that were none

    def take(self, kind, time, message):
        """Take a ROS message of a kind: odometry, truth, packets or commands."""
        if kind == "commands":
            twist = getattr(message, "twist", message)
            self.commands.append((time, (twist.linear.x, twist.linear.y, twist.angular.z)))
        elif kind == "packets":
            try:
                counts = parse_packet(message.data, message.data.partition(";")[0].count(":") + 1)
            except PacketError:
                self.refused += 1
            else:
                self.packets.append((time, counts))
        else:
            stamp = message.header.stamp.to_sec()
            pose = message.pose
            pose = getattr(pose, "pose", pose)  # with covariance, or without
            q = pose.orientation
            yaw = yaw_of(q)
            getattr(self, kind).append((stamp or time, (pose.position.x, pose.position.y, yaw)))

    def trajectory(self, kind):
        """`Trajectory` of "odometry" or "truth", or None where there is none."""
        poses = getattr(self, kind)
        return Trajectory(*zip(*poses)) if len(poses) > 1 else None

    def counts(self, wheels):
        """(times [s] K, counts K x n) of the packets. Raises RecordingError unless they have n fields each."""
        if not self.packets:
            raise RecordingError("found no packets of counts")
        odd = [counts for _, counts in self.packets if len(counts) != wheels.amount]
        if odd:
            raise RecordingError(
                f"found a packet of {len(odd[0])} wheels, allowed: {wheels.amount}, as in the wheel parameters")
        return np.array([time for time, _ in self.packets]), np.array([counts for _, counts in self.packets])

    def recomputed(self, kinematics):
        """`Trajectory` of the odometry that these packets make with other parameters, from the origin.

        At the stamps that odom_node would give them, not those of the packets' arrival.
        """
        times, counts = self.counts(kinematics.wheels)
        if not self.stamped:
            times = stamps_of(times, 1.0 / kinematics.wheels.pid_frequency)
        odometry = WheelOdometry(kinematics, 1.0 / kinematics.wheels.pid_frequency, NOISE)
        poses = []
        for packet in counts.tolist():
            odometry.update(packet, 0.0)
            poses.append((odometry.pose.x, odometry.pose.y, odometry.pose.yaw))
        return Trajectory(times, poses)

    def commanded_path(self):
        """`Trajectory` of a robot that follows each command at once and stops LONGEST_HOLD after the last.

        From the origin; None without commands.
        """
        if len(self.commands) < 2:
            return None
        pose, still = Pose(), np.zeros((3, 3))
        times, poses = [], []
        for (time, twist), (following, _) in zip(self.commands, [*self.commands[1:], (math.inf, None)]):
            times.append(time)
            poses.append((pose.x, pose.y, pose.yaw))
            hold = min(following - time, LONGEST_HOLD)
            for _ in range(max(1, round(hold / 0.02))):  # short steps, for the drawing
                part = hold / max(1, round(hold / 0.02))
                pose.move([speed * part for speed in twist], still)
                times.append(times[-1] + part)
                poses.append((pose.x, pose.y, pose.yaw))
            if following > times[-1] + 1e-6 and following < math.inf:
                times.append(following - 1e-6)
                poses.append(poses[-1])
        return Trajectory(times, poses)


def stamps_of(arrivals, period):
    """[s] when packets of a `period` [s] were made that came at `arrivals` [s], as odom_node stamps them."""
    clock = PacketClock(period)
    return np.array([clock.stamp(at, at) for at in (round(arrival * SECOND) for arrival in arrivals.tolist())]) / SECOND


def read_recording(path, topics):
    """`Recording` of a .bag or .csv file. topics: {kind: topic}, with kinds as in `Recording.take`.

    Topics match with or without a leading slash. Raises RecordingError when the file cannot be read.
    """
    path = Path(path)
    if not path.is_file():
        raise RecordingError(f"{path}: no such file")
    if path.suffix == ".csv":
        return _read_csv(path)
    if path.suffix == ".bag":
        return _read_bag(path, topics)
    raise RecordingError(f"{path}: found a file of type {path.suffix or 'none'!r}, allowed: .bag, .csv")


def _read_bag(path, topics):
    import rosbag  # here, for CSV needs no ROS

    kinds = {"/" + topic.lstrip("/"): kind for kind, topic in topics.items() if topic}
    recording = Recording()
    try:
        with rosbag.Bag(str(path)) as bag:
            found = set(bag.get_type_and_topic_info().topics)
            missing = topics.get("truth") and "/" + topics["truth"].lstrip("/") not in found
            if missing:
                raise RecordingError(f"{path}: found no topic {topics['truth']}; there are: {', '.join(sorted(found))}")
            for topic, message, time in bag.read_messages(topics=list(kinds)):
                recording.take(kinds[topic], time.to_sec(), message)
    except (rosbag.ROSBagException, AttributeError) as error:
        raise RecordingError(f"{path}: {error}") from error
    return recording


def _read_csv(path):
    recording = Recording()
    recording.stamped = True
    with open(str(path), newline="") as file:
        lines = [(number, line) for number, line in enumerate(file, 1) if line.strip() and not line.startswith("#")]
    rows = list(zip((number for number, _ in lines), csv.reader(line for _, line in lines)))
    if not rows:
        raise RecordingError(f"{path}: found nothing, allowed: a heading time,m0,m1,... and packets")
    heading = [name.strip() for name in rows[0][1]]
    with_truth = heading[-3:] == ["x", "y", "yaw"]
    wheels = len(heading) - 1 - 3 * with_truth
    if wheels < 3 or heading[:wheels + 1] != ["time", *(f"m{wheel}" for wheel in range(wheels))]:
        raise RecordingError(f"{path}: found the heading {','.join(heading)!r}, allowed: time,m0,m1,m2,... "
                             "and then nothing or x,y,yaw")
    for number, row in rows[1:]:
        try:
            values = [float(field) for field in row]
        except ValueError:
            values = []
        if len(values) != len(heading) or not all(map(math.isfinite, values)):
            raise RecordingError(f"{path}, line {number}: found {','.join(row)!r}, allowed: {len(heading)} numbers")
        recording.packets.append((values[0], tuple(values[1:wheels + 1])))
        if with_truth:
            recording.truth.append((values[0], tuple(values[-3:])))
    return recording


def write_csv(path, packets, truth=None):
    """Write packets [(time, counts)], and where `truth` [(time, (x, y, yaw))] is given, a pose for each."""
    wheels = len(packets[0][1])
    with open(str(path), "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["time", *(f"m{wheel}" for wheel in range(wheels)), *(("x", "y", "yaw") if truth else ())])
        for index, (time, counts) in enumerate(packets):
            writer.writerow([f"{time:.6f}", *counts, *(truth[index][1] if truth else ())])
