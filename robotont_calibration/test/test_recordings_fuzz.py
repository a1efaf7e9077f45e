"""Whatever a recording contains: a Recording, or a RecordingError that names the file."""

import genpy
import pytest
import rosbag
from geometry_msgs.msg import Twist
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from robotont_calibration.recording_files import read_recording, write_csv
from robotont_calibration.recordings import Recording, RecordingError
from robotont_testing.spoilt import spoilt

TOPICS = {"odometry": "odom", "packets": "serial_read", "commands": "cmd_vel"}


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """Folder with a bag, a CSV file and a run of OptiOdom."""
    folder = tmp_path_factory.mktemp("drive")
    with rosbag.Bag(str(folder / "a.bag"), "w") as bag:
        for number in range(20):
            time = genpy.Time(100 + number, 0)
            bag.write("/odom", Odometry(), time)
            bag.write("/serial_read", String("1:2:-3;\n"), time)
            bag.write("/cmd_vel", Twist(), time)
    write_csv(folder / "a.csv", [(0.02 * number, (1, 2, -3)) for number in range(20)],
              [(0.02 * number, (0.1, 0.2, 0.3)) for number in range(20)])
    (folder / "optiodom.csv").write_text("".join(f"{number}.5,0.1,0.2,0.3,1,2,3\n" for number in range(20)))
    return folder


@pytest.mark.parametrize("name, form", [("a.bag", "auto"), ("a.csv", "auto"), ("optiodom.csv", "optiodom")])
@settings(deadline=None)
@given(seed=st.integers(0, 2 ** 32))
def test_a_file_with_errors(drive, name, form, seed):
    file = drive / f"errors_{name}"
    file.write_bytes(spoilt((drive / name).read_bytes(), seed))
    try:
        recording = read_recording(file, TOPICS, form)
    except RecordingError as error:
        assert str(file) in str(error)
    else:
        assert isinstance(recording, Recording)
