"""Recordings in bags (rosbag), read without a master."""

from pathlib import Path

import rosbag

from robotont_calibration.recordings import Recording, RecordingError

POSES = ("nav_msgs/Odometry", "geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped")
TYPES = {  # of the messages on each kind of topic
    "packets": ("std_msgs/String",), "odometry": POSES, "truth": POSES,
}


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

