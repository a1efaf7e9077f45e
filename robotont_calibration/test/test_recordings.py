"""Whatever a recording contains: a Recording, or a RecordingError that names the file."""

import math

import genpy
import pytest
import rosbag
from nav_msgs.msg import Odometry
from std_msgs.msg import String, UInt8MultiArray
from synthetic_runs import write_run

from robotont_calibration.recordings import Recording, RecordingError, read_recording

TOPICS = {"odometry": "odom", "packets": "serial_read"}


@pytest.mark.parametrize("length, topics, words", [
    (-100, TOPICS, "found a bag without its end, .* rosbag reindex .*bad.bag"),
    (0, TOPICS, "bad.bag: "),
    (None, {"odometry": "robot1/odom"}, "found none of /robot1/odom; there are: odom, serial_read"),
    (None, {**TOPICS, "truth": "truth"}, "found no topic truth; there are: odom, serial_read"),
])
def test_a_bag_without_its_end_and_one_of_another_robot_are_told_with_the_remedy(tmp_path, length, topics, words):
    bag = tmp_path / "bad.bag"
    write_run(bag, odom=[(100, (0, 0, 0))], serial_read=[(100, (1, 2, -3))])
    bag.write_bytes(bag.read_bytes()[:length])
    with pytest.raises(RecordingError, match=words):
        read_recording(bag, topics)


@pytest.mark.parametrize("topic, message", [("/odom", Odometry()), ("/serial_read", String("1:2:-3;"))])
def test_of_two_robots_on_one_topic_no_path_is_one_robots(tmp_path, topic, message):
    with rosbag.Bag(str(tmp_path / "two.bag"), "w") as bag:
        for number in range(6):
            bag._topic_connections.clear()  # a connection for each node, as rosbag record writes them
            bag.write(topic, message, genpy.Time(100 + number, 0), connection_header={
                "topic": topic, "type": message._type, "md5sum": message._md5sum,
                "message_definition": message._full_text, "callerid": f"/node{number % 2}"})
    with pytest.raises(RecordingError, match=f"{topic}: found two nodes that publish it, /node0 and /node1"):
        read_recording(tmp_path / "two.bag", TOPICS)


@pytest.mark.parametrize("kind", ["packets", "odometry", "truth"])
def test_a_topic_with_other_messages_is_refused(tmp_path, kind):
    with rosbag.Bag(str(tmp_path / "other.bag"), "w") as file:
        file.write("topic", UInt8MultiArray(), genpy.Time(1))
    with pytest.raises(RecordingError, match="topic: found std_msgs/UInt8MultiArray, allowed: "):
        read_recording(tmp_path / "other.bag", {kind: "topic"})


def test_malformed_packets_and_poses_are_counted():
    recording, nowhere = Recording(), Odometry()
    packets = ["1:2:3;\n", "9" * 400 + ":0:0;\n", "9" * 10 ** 6, "nan:0:0;\n", ":" * 10 ** 5, ""]
    for packet in packets:
        recording.take("packets", 1.0, String(packet))
    nowhere.pose.pose.position.x = math.nan
    recording.take("odometry", 1.0, nowhere)
    assert recording.packets == [(1.0, (1, 2, 3))]
    assert recording.odometry == []
    assert recording.refused == len(packets)
