"""Recordings in files: a bag (rosbag, without a master) or a CSV file.

CSV: a heading `time,m0,m1,...` and then one line per packet: time [s] and the counts [edges] of one PID
period of each wheel. Behind them may stand `x,y,yaw` [m, m, rad]: where the robot really was after it.
Lines that start with # are comments.

OptiOdom (R. B. Sousa et al., Journal of Intelligent & Robotic Systems 105, 39 (2022)) is a public data set of real
robots with three and four omni wheels, and with others; its runs are read as they are.
"""

import csv
import io
from pathlib import Path

import numpy as np

from robotont_calibration.recordings import Recording, RecordingError
from robotont_driver.parameters.files import write_file
from robotont_driver.parameters.parameters import shown

FORMATS = ("auto", "optiodom")
LARGEST_NUMBER = 1e10  # in a CSV file: times are seconds since 1970
POSES = ("nav_msgs/Odometry", "geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped")
TYPES = {  # of the messages on each kind of topic
    "packets": ("std_msgs/String",), "commands": ("geometry_msgs/Twist", "geometry_msgs/TwistStamped"),
    "odometry": POSES, "truth": POSES,
}


def read_recording(path, topics, form="auto"):
    """`Recording` of a .bag or .csv file. topics: {kind: topic}, with kinds as in `Recording.take`.

    form: one of FORMATS; "optiodom" is a run of the data set OptiOdom as it is published.

    Topics match with or without a leading slash. Raises RecordingError when the file cannot be read.
    """
    path = Path(path)
    if not path.is_file():
        raise RecordingError(f"{path}: no such file")
    if form == "optiodom":  # time, x, y, yaw, counts
        table = _numbers(path, _lines(path))
        return _recording(table[:, 0], table[:, 4:], table[:, 1:4])
    if path.suffix == ".csv":
        return _read_csv(path)
    if path.suffix == ".bag":
        return _read_bag(path, topics)
    raise RecordingError(f"{path}: found a file of type {path.suffix or 'none'!r}, allowed: .bag, .csv")


def _read_bag(path, topics):
    import rosbag  # here, for CSV needs no ROS

    kinds = {"/" + topic.lstrip("/"): kind for kind, topic in topics.items() if topic}
    recording, sources = Recording(), {}
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
            if not wanted:
                raise RecordingError(f"{path}: found none of {', '.join(sorted(kinds))}; there are: "
                                     f"{', '.join(sorted(found)) or 'no topics'}")
            for topic, message, time, header in bag.read_messages(topics=list(wanted), return_connection_header=True):
                _refuse_second(path, topic, wanted[topic], sources, header)
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


def _refuse_second(path, topic, kind, sources, header):
    """Raise RecordingError where a second node speaks on a topic: of two robots' poses or packets no path is one's."""
    name = header.get("callerid", "")
    name = name.decode() if isinstance(name, bytes) else name
    if kind != "commands" and sources.setdefault(topic, name) != name:
        raise RecordingError(f"{path}: {topic}: found two nodes that publish it, {sources[topic]} and {name}, allowed: "
                             "one")


def _read_csv(path):
    heading, *lines = _lines(path)
    names = [name.strip() for name in heading.split(",")]
    wheels = len(names) - (4 if names[-3:] == ["x", "y", "yaw"] else 1)
    if wheels < 3 or names[:wheels + 1] != ["time", *(f"m{wheel}" for wheel in range(wheels))]:
        raise RecordingError(f"{path}: found the heading {shown(heading)}, allowed: time,m0,m1,m2,... "
                             "and then nothing or x,y,yaw")
    table = _numbers(path, lines, len(names))
    return _recording(table[:, 0], table[:, 1:wheels + 1], table[:, wheels + 1:])


def _lines(path):
    """The lines of a text file, at least one, without comments. Raises RecordingError."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise RecordingError(f"{path}: found bytes that are not UTF-8, allowed: a CSV") from error
    lines = [line for line in text.split("\n") if line.strip() and not line.startswith("#")]
    if not lines:
        raise RecordingError(f"{path}: found nothing, allowed: packets")
    return lines


def _numbers(path, lines, columns=None):
    """The numbers in lines, K x `columns`, or 7 or more as the first. Raises RecordingError unless all are finite."""
    if not lines:
        raise RecordingError(f"{path}: found a heading only, allowed: packets")
    columns, table = columns or max(7, lines[0].count(",") + 1), []
    for line in lines:
        try:
            table.append(np.array(line.split(","), dtype=float))
        except ValueError:
            table.append(np.empty(0))
        if len(table[-1]) != columns or not np.all(np.abs(table[-1]) <= LARGEST_NUMBER):
            raise RecordingError(f"{path}: found the line {shown(line)}, allowed: {columns} numbers up to "
                                 f"{LARGEST_NUMBER:g}, with commas between them")
    return np.array(table)


def _recording(times, counts, poses):
    """`Recording` of packets, and where `poses` has columns, of true poses."""
    recording = Recording()
    recording.stamped = True
    recording.packets = list(zip(times.tolist(), map(tuple, counts.tolist())))
    if poses.size:
        recording.truth = list(zip(times.tolist(), map(tuple, poses.tolist())))
    return recording


def write_csv(path, packets, truth=None):
    """Write packets [(time, counts)], and where `truth` [(time, (x, y, yaw))] is given, a pose for each."""
    wheels = len(packets[0][1])
    file = io.StringIO(newline="")
    writer = csv.writer(file)
    writer.writerow(["time", *(f"m{wheel}" for wheel in range(wheels)), *(("x", "y", "yaw") if truth else ())])
    for index, (time, counts) in enumerate(packets):
        writer.writerow([f"{time:.6f}", *counts, *(truth[index][1] if truth else ())])
    write_file(path, file.getvalue())
