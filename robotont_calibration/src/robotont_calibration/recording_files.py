"""Recordings in files: a bag (rosbag, without a master) or a CSV file.

CSV: a heading `time,m0,m1,...` and then one line per packet: time [s] and the counts [edges] of one PID
period of each wheel. Behind them may stand `x,y,yaw` [m, m, rad]: where the robot really was after it.
Lines that start with # are comments.
"""

from pathlib import Path

import numpy as np

from robotont_calibration.recordings import Recording, RecordingError
from robotont_driver.parameters.files import write_file
from robotont_driver.parameters.parameters import shown

LARGEST_NUMBER = 1e10  # in a CSV file: times are seconds since 1970
POSES = ("nav_msgs/Odometry", "geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped")
TYPES = {  # of the messages on each kind of topic
    "packets": ("std_msgs/String",), "odometry": POSES, "truth": POSES,
}


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
                _refuse_second(path, topic, sources, header)
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


def _refuse_second(path, topic, sources, header):
    """Raise RecordingError where a second node speaks on a topic: of two robots' poses or packets no path is one's."""
    name = header.get("callerid", "")
    name = name.decode() if isinstance(name, bytes) else name
    if sources.setdefault(topic, name) != name:
        raise RecordingError(f"{path}: {topic}: found two nodes that publish it, {sources[topic]} and {name}, allowed: "
                             "one")


def _read_csv(path):
    try:
        lines = [line for line in path.read_text(encoding="utf-8-sig").split("\n")
                 if line.strip() and not line.startswith("#")] or [""]
        names = [name.strip() for name in lines[0].split(",")]
        wheels = len(names) - (4 if names[-3:] == ["x", "y", "yaw"] else 1)
        if wheels < 3 or names[:wheels + 1] != ["time", *(f"m{wheel}" for wheel in range(wheels))] or not lines[1:]:
            raise RecordingError(f"{path}: found the heading {shown(lines[0])} of {len(lines) - 1} lines, allowed: "
                                 "time,m0,m1,m2,... and then nothing or x,y,yaw, and packets")
        table = np.loadtxt(lines[1:], delimiter=",", ndmin=2)
    except ValueError as error:  # no UTF-8, no numbers, not as many as in the line before
        raise error if isinstance(error, RecordingError) else RecordingError(
            f"{path}: found {str(error)[:200]}, allowed: a CSV of packets") from None
    if table.shape[1] != len(names) or not np.all(np.abs(table) <= LARGEST_NUMBER):
        raise RecordingError(f"{path}: found lines of {table.shape[1]} numbers, allowed: of {len(names)} up to "
                             f"{LARGEST_NUMBER:g}")
    times, recording = table[:, 0].tolist(), Recording()
    recording.stamped = True
    recording.packets = list(zip(times, map(tuple, table[:, 1:wheels + 1].tolist())))
    if len(names) > wheels + 1:
        recording.truth = list(zip(times, map(tuple, table[:, wheels + 1:].tolist())))
    return recording


def write_csv(path, packets, truth=None):
    """Write packets [(time, counts)], and where `truth` [(time, (x, y, yaw))] is given, a pose for each."""
    columns = ["time", *(f"m{wheel}" for wheel in range(len(packets[0][1]))), *(("x", "y", "yaw") if truth else ())]
    poses = [pose for _, pose in truth] if truth else [()] * len(packets)
    rows = [(f"{time:.6f}", *counts, *pose) for (time, counts), pose in zip(packets, poses)]
    write_file(path, "".join(",".join(map(str, row)) + "\n" for row in (columns, *rows)))
