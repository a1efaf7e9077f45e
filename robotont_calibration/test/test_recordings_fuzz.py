"""Whatever a recording contains: a Recording, or a RecordingError that names the file."""

import genpy
import pytest
import rosbag
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from robotont_calibration.recordings import Recording, RecordingError, read_recording
from robotont_testing.spoilt import spoilt

TOPICS = {"odometry": "odom", "packets": "serial_read"}


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """Folder with a bag."""
    folder = tmp_path_factory.mktemp("drive")
    with rosbag.Bag(str(folder / "a.bag"), "w") as bag:
        for number in range(20):
            time = genpy.Time(100 + number, 0)
            bag.write("/odom", Odometry(), time)
            bag.write("/serial_read", String("1:2:-3;\n"), time)
    return folder


@settings(deadline=None)
@given(seed=st.integers(0, 2 ** 32))
def test_a_file_with_errors(drive, seed):
    file = drive / "errors.bag"
    file.write_bytes(spoilt((drive / "a.bag").read_bytes(), seed))
    try:
        recording = read_recording(file, TOPICS)
    except RecordingError as error:
        assert str(file) in str(error)
    else:
        assert isinstance(recording, Recording)


def test_a_bag_without_its_end_and_one_of_another_robot_are_told_with_the_remedy(drive, tmp_path):
    (tmp_path / "cut.bag").write_bytes((drive / "a.bag").read_bytes()[:-100])
    with pytest.raises(RecordingError, match="found a bag without its end, .* rosbag reindex .*cut.bag"):
        read_recording(tmp_path / "cut.bag", TOPICS)
    with pytest.raises(RecordingError, match="found none of /robot1/odom; there are: /odom, /serial_read"):
        read_recording(drive / "a.bag", {"odometry": "robot1/odom"})


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
