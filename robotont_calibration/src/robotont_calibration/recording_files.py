"""Recordings in files: a bag (rosbag, without a master) or a CSV file.

CSV: a heading `time,m0,m1,...` and then one line per packet: time [s] and the counts [edges] of one PID
period of each wheel. Behind them may stand `x,y,yaw` [m, m, rad]: where the robot really was after it.
Lines that start with # are comments.

OptiOdom (R. B. Sousa et al., Journal of Intelligent & Robotic Systems 105, 39 (2022)) is a public data set of real
robots with three and four omni wheels, and with others; its runs are read as they are.
"""

import csv
from pathlib import Path

from robotont_calibration.recordings import Recording, RecordingError
from robotont_driver.parameters.parameters import shown

FORMATS = ("auto", "optiodom")
LARGEST_NUMBER = 1e10  # in a CSV file: times are seconds since 1970

TYPES = {  # of the messages on each kind of topic
    "packets": ("std_msgs/String",),
    "commands": ("geometry_msgs/Twist", "geometry_msgs/TwistStamped"),
    "odometry": ("nav_msgs/Odometry", "geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped"),
    "truth": ("nav_msgs/Odometry", "geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped"),
}


def read_recording(path, topics, form="auto"):
    """`Recording` of a .bag or .csv file. topics: {kind: topic}, with kinds as in `Recording.take`.

    form: one of FORMATS; "optiodom" is a run of the data set OptiOdom as it is published.

    Topics match with or without a leading slash. Raises RecordingError when the file cannot be read.
    """
    path = Path(path)
    if not path.is_file():
        raise RecordingError(f"{path}: no such file")
    if form == "optiodom":
        return _read_optiodom(path)
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
            found = bag.get_type_and_topic_info().topics
            wanted = {topic: kinds["/" + topic.lstrip("/")] for topic in found if "/" + topic.lstrip("/") in kinds}
            if topics.get("truth") and "truth" not in wanted.values():
                raise RecordingError(f"{path}: found no topic {topics['truth']}; there are: {', '.join(sorted(found))}")
            for topic, kind in wanted.items():
                if found[topic].msg_type not in TYPES[kind]:
                    raise RecordingError(f"{path}: {topic}: found {found[topic].msg_type}, "
                                         f"allowed: {', '.join(TYPES[kind])}")
            for topic, message, time in bag.read_messages(topics=list(wanted)) if wanted else ():
                recording.take(wanted[topic], time.to_sec(), message)
    except RecordingError:
        raise
    except Exception as error:  # a corrupt bag can raise whatever rosbag, its decompressors and generated code raise
        words = f"{type(error).__name__}: {str(error)[:200]}"
        raise RecordingError(f"{path}: no bag that can be read: {words}") from error
    return recording


def _read_csv(path):
    recording = Recording()
    recording.stamped = True
    rows = [(number, line.strip().split(",")) for number, line in _lines(path)
            if line.strip() and not line.startswith("#")]
    if not rows:
        raise RecordingError(f"{path}: found nothing, allowed: a heading time,m0,m1,... and packets")
    heading = [name.strip() for name in rows[0][1]]
    with_truth = heading[-3:] == ["x", "y", "yaw"]
    wheels = len(heading) - 1 - 3 * with_truth
    if wheels < 3 or heading[:wheels + 1] != ["time", *(f"m{wheel}" for wheel in range(wheels))]:
        raise RecordingError(f"{path}: found the heading {shown(','.join(heading))}, allowed: time,m0,m1,m2,... "
                             "and then nothing or x,y,yaw")
    for number, row in rows[1:]:
        values = _numbers(path, number, row, len(heading))
        recording.packets.append((values[0], tuple(values[1:wheels + 1])))
        if with_truth:
            recording.truth.append((values[0], tuple(values[-3:])))
    return recording


def _lines(path):
    """(number, line) of all lines of a text file. Raises RecordingError."""
    try:
        with open(str(path), newline="", encoding="utf-8-sig") as file:
            return list(enumerate(file, 1))
    except UnicodeDecodeError as error:
        raise RecordingError(f"{path}: found bytes that are not UTF-8, allowed: a CSV") from error


def _read_optiodom(path):
    """`Recording` of lines without a heading: time [s], x [m], y [m], yaw [rad], counts [edges] of each wheel."""
    recording = Recording()
    recording.stamped = True
    for number, line in _lines(path):
        row = line.strip().split(",")
        time, x, y, yaw, *counts = _numbers(path, number, row, max(len(row), 7))
        recording.packets.append((time, tuple(counts)))
        recording.truth.append((time, (x, y, yaw)))
    return recording


def _numbers(path, number, row, amount):
    """The numbers of a line. Raises RecordingError unless there are so many, all finite."""
    try:
        values = [float(field) for field in row]
    except ValueError:
        values = []
    if len(values) != amount or not all(abs(value) <= LARGEST_NUMBER for value in values):
        raise RecordingError(f"{path}, line {number}: found {shown(','.join(row))}, allowed: {amount} numbers up to "
                             f"{LARGEST_NUMBER:g}")
    return values


def write_csv(path, packets, truth=None):
    """Write packets [(time, counts)], and where `truth` [(time, (x, y, yaw))] is given, a pose for each."""
    wheels = len(packets[0][1])
    with open(str(path), "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["time", *(f"m{wheel}" for wheel in range(wheels)), *(("x", "y", "yaw") if truth else ())])
        for index, (time, counts) in enumerate(packets):
            writer.writerow([f"{time:.6f}", *counts, *(truth[index][1] if truth else ())])
