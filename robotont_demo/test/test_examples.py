"""Files of examples/ in a time of their own, on a robot that does at once what it is told: each does what it says."""

import math
import runpy
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
import pytest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan

from robotont_driver.kinematics import se2
from robotont_testing import places

sys.path.append(str(places.package("robotont_calibration") / "test"))
from synthetic_runs import write_run

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SQUARE = [(0.5, 0.0), (0.5, 0.5), (0.0, 0.5)]  # [m]
PERIOD, WALL = 0.02, 1.0  # [s] of the odometry and of the scan, [m] ahead of where the robot starts
WAYS = 0.0, 0.1, 0.2  # [m] of a bag's poses


class Drive:
    """A run of an example, until Ctrl-C at a time [s]; `way`: K x 3 poses as seen from the start."""

    def __init__(self, name, ctrl_c=math.inf, scan=None):
        self._now, self._ctrl_c, self._scan, self._ended = 0.0, ctrl_c, scan, False
        self._hooks, self._heard_by = [], {}
        self._pose, self._poses, self.commands = (3.0, -1.0, 2.0), [], [Twist()]
        rospy = SimpleNamespace(
            init_node=lambda _: None, on_shutdown=self._hooks.append, signal_shutdown=self._end,
            is_shutdown=lambda: not self._hooks, core=SimpleNamespace(is_shutdown_requested=lambda: self._ended),
            Time=SimpleNamespace(now=lambda: self._now), spin=lambda: self._sleep(120.0), sleep=self._sleep,
            Rate=lambda rate: SimpleNamespace(sleep=lambda: self._sleep(1 / rate)), Duration=float,
            Publisher=lambda *_, **__: SimpleNamespace(publish=self._publish, get_num_connections=lambda: 1),
            Subscriber=lambda topic, _kind, callback, **_: self._heard_by.update({topic: callback}))
        with patch.dict("sys.modules", rospy=rospy, time=SimpleNamespace(sleep=self._sleep)):
            runpy.run_path(str(EXAMPLES / f"{name}.py"))
        self.way = np.transpose(se2.between(self._poses[0], np.transpose(self._poses)))

    def _publish(self, command):
        if self._hooks:
            self.commands.append(command)

    def _end(self, _why):
        self._ended = True  # messages still come while the hook runs
        self._hooks[0]()
        self._hooks.clear()

    def _sleep(self, seconds):
        end = self._now + seconds
        while self._now < end - PERIOD / 2 and self._hooks:
            speed = self.commands[-1]
            step = se2.arc((PERIOD * speed.linear.x, PERIOD * speed.linear.y, PERIOD * speed.angular.z))
            self._pose = se2.compose(self._pose, step)
            self._poses.append(self._pose)
            self._now += PERIOD
            odometry, (x, y, yaw) = Odometry(), self._pose
            odometry.pose.pose.position.x, odometry.pose.pose.position.y = x, y
            odometry.pose.pose.orientation.z, odometry.pose.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
            gap = WALL - se2.between(self._poses[0], self._pose)[0]
            scan = self._scan or LaserScan(range_max=4.0, ranges=[gap])
            for topic, message in (("odom", odometry), ("scan", scan)):
                self._heard_by.get(topic, id)(message)
            if self._now >= self._ctrl_c and not self._ended:
                self._end("Ctrl-C")


@pytest.mark.parametrize("name, corners, near, turned", [
    ("square", SQUARE, 0.15, 2 * math.pi), ("square_by_odometry", SQUARE, 0.05, 2 * math.pi),
    ("follow_path", [(0.6, 0.0), (0.9, 0.3), (0.6, 0.6), (0.0, 0.6)], 0.06, 0.0)])
def test_a_way_passes_its_corners_and_ends_where_it_began(name, corners, near, turned):
    way = Drive(name).way
    for corner in (*corners, (0.0, 0.0)):
        assert np.linalg.norm(way[100:, :2] - corner, axis=1).min() < near, corner
    assert way[-1] == pytest.approx((0.0, 0.0, turned), abs=near)
    assert turned or np.abs(way[:, 2]).max() < 0.05


def test_keep_distance_comes_to_half_a_metre_from_the_wall():
    assert WALL - Drive("keep_distance").way[-1, 0] == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize("name", ["square", "square_by_odometry", "follow_path", "keep_distance"])
def test_ctrl_c_sends_zeros(name):
    """What comes after rospy's end is not sent any more."""
    commands = Drive(name, 1.0).commands
    assert commands[-11].linear.x > 0.1
    assert commands[-10:] == [Twist()] * 10


@pytest.mark.parametrize("first", [-0.5, 2 * math.pi - 0.5])
@pytest.mark.parametrize("ahead, beside, speed", [
    (-math.inf, math.inf, -0.2), (-math.inf, 3.0, -0.2), (0.4, math.inf, -0.1), (2.0, 0.4, 0.2),
    (math.inf, 0.4, 0.2), (math.nan, math.inf, 0.0), (9.0, 9.0, 0.0)])
def test_keep_distance_follows_from_what_is_ahead_alone(ahead, beside, speed, first):
    """A post that is nearer than the sensor measures: the example drove on, for beside it there was nothing."""
    scan = LaserScan(angle_min=first, angle_increment=0.1, range_min=0.3, range_max=4.0,
                     ranges=[beside] * 3 + [ahead] * 5 + [beside] * 3)
    assert Drive("keep_distance", PERIOD, scan).commands[1].linear.x == pytest.approx(speed)


def test_plot_bag_draws_odometry_and_truth_from_one_start(tmp_path):
    """The truth of a robot that starts elsewhere in the room, looking elsewhere, lies on a right odometry."""
    from matplotlib import pyplot

    write_run(tmp_path / "way.bag", odom=[(1.0 + way, (way, 0.0, 0.0)) for way in WAYS], **{
        "/ground_truth/odom": [(1.0 + way, (-3.0, way, math.pi / 2)) for way in WAYS]})
    with patch("sys.argv", ["plot_bag.py", str(tmp_path / "way.bag")]):
        runpy.run_path(str(EXAMPLES / "plot_bag.py"))
    odom, truth = (line.get_xydata() for line in pyplot.gca().lines)
    pyplot.close()
    np.testing.assert_allclose(truth, odom, atol=1e-9)


def test_plot_bag_makes_a_picture_of_a_bag_and_tells_what_is_no_whole_one_without_a_traceback(tmp_path):
    def plot_bag(name):
        return subprocess.run([sys.executable, str(EXAMPLES / "plot_bag.py"), str(tmp_path / name)], check=False,
                              text=True, capture_output=True)
    write_run(tmp_path / "square.bag", odom=[(1.0 + way, (way, 0.0, 0.0)) for way in WAYS])
    result = plot_bag("square.bag")
    assert result.stdout.startswith("3 poses, 0 true ones: "), result.stderr
    assert (tmp_path / "square.png").stat().st_size > 1000
    (tmp_path / "cut.bag").write_bytes(b"#ROSBAG V2.0\n" + bytes(100))
    write_run(tmp_path / "other.bag", **{"ground_truth/odom": [(1.0, (0.0, 0.0, 0.0))]})
    for name in ("cut.bag", "none.bag", "other.bag"):
        result = plot_bag(name)
        assert result.returncode == 2
        assert "Traceback" not in result.stderr
        assert name in result.stderr.splitlines()[-1]
