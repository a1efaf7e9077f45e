"""Parts of examples/ by themselves; how each drives: `rostest_examples.py`."""

import math
import runpy
import subprocess
import sys
from pathlib import Path
from unittest.mock import MagicMock, patch

import pytest
from nav_msgs.msg import Odometry
from rosbag import Bag
from sensor_msgs.msg import LaserScan

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.mark.parametrize("first", [-0.5, 2 * math.pi - 0.5])
@pytest.mark.parametrize("ahead, beside, speed", [
    (-math.inf, math.inf, -0.2), (-math.inf, 3.0, -0.2), (0.4, math.inf, -0.1), (2.0, 0.4, 0.2),
    (math.inf, 0.4, 0.2), (math.nan, math.inf, 0.0), (9.0, 9.0, 0.0)])
def test_keep_distance_follows_from_what_is_ahead_alone(ahead, beside, speed, first):
    """A post that is nearer than the sensor measures: the example drove on, for beside it there was nothing."""
    rospy = MagicMock()
    with patch.dict("sys.modules", rospy=rospy):
        runpy.run_path(str(EXAMPLES / "keep_distance.py"))
    on_scan = rospy.Subscriber.call_args[0][2]
    on_scan(LaserScan(angle_min=first, angle_increment=0.1, range_min=0.3, range_max=4.0,
                      ranges=[beside] * 3 + [ahead] * 5 + [beside] * 3))
    assert rospy.Publisher.return_value.publish.call_args[0][0].linear.x == pytest.approx(speed)


def plot_bag(file):
    return subprocess.run([sys.executable, str(EXAMPLES / "plot_bag.py"), str(file)], check=False, text=True,
                          capture_output=True)


def test_plot_bag_makes_a_picture_of_a_bag(tmp_path):
    with Bag(str(tmp_path / "square.bag"), "w") as bag:
        for step in range(3):
            message = Odometry()
            message.pose.pose.position.x = float(step)
            bag.write("odom", message)
    result = plot_bag(tmp_path / "square.bag")
    assert result.stdout.startswith("3 poses: "), result.stderr
    assert (tmp_path / "square.png").stat().st_size > 1000


def test_plot_bag_tells_what_is_no_whole_bag_without_a_traceback(tmp_path):
    (tmp_path / "cut.bag").write_bytes(b"#ROSBAG V2.0\n" + bytes(100))
    with Bag(str(tmp_path / "other.bag"), "w") as bag:
        bag.write("ground_truth/odom", Odometry())
    for name in ("cut.bag", "none.bag", "other.bag"):
        result = plot_bag(tmp_path / name)
        assert result.returncode == 2
        assert "Traceback" not in result.stderr
        assert name in result.stderr.splitlines()[-1]
