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
