"""examples/plot_bag.py draws the way of a recorded drive."""

import subprocess
import sys
from pathlib import Path

from nav_msgs.msg import Odometry
from rosbag import Bag

PROGRAM = Path(__file__).resolve().parents[2] / "examples" / "plot_bag.py"


def test_a_bag_becomes_a_picture(tmp_path):
    with Bag(str(tmp_path / "square.bag"), "w") as bag:
        for step in range(3):
            message = Odometry()
            message.pose.pose.position.x = float(step)
            bag.write("odom", message)
    result = subprocess.run([sys.executable, str(PROGRAM), str(tmp_path / "square.bag")], check=True,
                            stdout=subprocess.PIPE, text=True)
    assert result.stdout.startswith("3 poses: ")
    assert (tmp_path / "square.png").stat().st_size > 1000


def test_what_is_no_whole_bag_is_told_without_a_traceback(tmp_path):
    (tmp_path / "cut.bag").write_bytes(b"#ROSBAG V2.0\n" + bytes(100))
    for name in ("cut.bag", "none.bag"):
        result = subprocess.run([sys.executable, str(PROGRAM), str(tmp_path / name)], check=False,
                                stderr=subprocess.PIPE, text=True)
        assert result.returncode == 2
        assert "Traceback" not in result.stderr
        assert f"{name}" in result.stderr.splitlines()[-1]
