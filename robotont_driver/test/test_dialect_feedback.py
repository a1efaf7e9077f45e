"""What the dialects make of the boards' lines: odometry without loss, readings, malformed lines, restarts."""

import math

import pytest
from dialect_bench import SQUARE, Bench, LineNoise, assert_near, official_wheels, turning_circle

from robotont_driver.protocol.dialects import make_dialect
from robotont_driver.protocol.dialects.dialect import Power, Ranges
from robotont_driver.protocol.dialects.pose_feedback import PoseLine, body_step, parse_pose, rotate
from robotont_driver.protocol.dialects.robotont2 import Robotont2
from robotont_driver.protocol.packet import PacketError


def follow(bench, *twists, seconds):
    """Drive and stand; the odometry is where the board says."""
    for twist in twists:
        bench.hold(twist, seconds)
    bench.settle(2.0)
    assert_near(bench.pose(), bench.board_pose(), 1e-3, 1e-3)


@pytest.mark.parametrize("name, base_frame", [("robotont2", True), ("robotont2", False), ("robotont3", None)])
def test_a_square_and_a_turning_circle_end_where_the_board_says(name, base_frame):
    bench = Bench(name, **({} if base_frame is None else {"base_frame": base_frame}))
    follow(bench, *SQUARE, seconds=3.0)
    follow(bench, *turning_circle(), seconds=0.02)
    assert abs(bench.board_pose()[2] + 2 * math.pi) < 0.5  # it has really turned
    edges = [path / (2 * math.pi * 0.035 / 1200) for path in bench.board.odometry.summed]
    assert [sum(column) for column in zip(*bench.counts)] == pytest.approx(edges, abs=1.0)
    assert (bench.dialect.dropped, bench.dialect.restarts) == ({}, 0)


def test_june_2018_ends_near_there():
    bench = Bench("robotont2018")
    bench.hold((0.2, 0, 0), 3.0)
    true = (bench.motors.paths[2] - bench.motors.paths[0]) / math.sqrt(3)
    assert bench.pose()[0] == pytest.approx(true, rel=0.05)  # every second window is a guess
    assert not bench.dialect.dropped


@pytest.mark.parametrize("lines, bytes_, base_frame", [(0.2, 0.0, True), (0.0, 0.001, False), (0.2, 0.001, True)])
def test_a_bad_line_loses_no_distance(lines, bytes_, base_frame):
    bench = Bench(base_frame=base_frame)
    bench.pass_on = LineNoise(lines, bytes_)
    follow(bench, *SQUARE, seconds=3.0)
    follow(bench, *turning_circle(), seconds=0.02)
    assert bench.dialect.repaired > 25 * lines
    assert bench.dialect.restarts == 0
    assert max(max(map(abs, counts)) for counts in bench.counts) < 2 * 0.3 / (2 * math.pi * 0.035 / 1200) * 0.02


@pytest.mark.parametrize("text, kind", [
    ("ODOM:nan:0.000000:0.000000:0.000000:0.000000:0.000000", "not finite"),
    ("ODOM:0.000000:-inf:0.000000:0.000000:0.000000:0.000000", "not finite"),
    ("ODOM:0.000000:0.000000:0.000000:0.000000:0.000000", "fields"),
    ("ODOM:0.000000:0.000000:0.000000:0.000000:0.000000:", "number"),
    ("ODOM:0.000000:0.000000:0.000000:0.000000:0.000000:1e5", "number"),
    ("ODOM:0.000000:0.000000:0.000000:0.000000:0.000000:0.00000", "number"),
    ("ODOM:00.000000:0.000000:0.000000:0.000000:0.000000:0.000000", "number"),
])
def test_a_line_that_is_none_is_dropped_and_counted(text, kind):
    with pytest.raises(PacketError) as raised:
        parse_pose(text)
    assert raised.value.kind == kind
    dialect = Robotont2(official_wheels())
    assert dialect.feed(text.encode() + b"\r\n", 0.0) == []
    assert dialect.dropped == {kind: 1}


@pytest.mark.parametrize("name, line", [("robotont2", b"POWER:0.5:14.8\r\n"), ("robotont2018", b"Encoders 1:2:3\r\n")])
def test_half_a_line_of_an_earlier_connection_is_forgotten(name, line):
    dialect = make_dialect(name, official_wheels())
    dialect.feed(line[:5], 0.0)
    dialect.connect(0.0)
    dialect.feed(line, 0.0)
    assert dialect.dropped == {}


@pytest.mark.parametrize("periods", [1, 2, 7])
@pytest.mark.parametrize("turn", [0.0, 0.02, -0.1])
def test_equal_steps_of_the_board_add_up_to_what_is_read_from_its_poses(periods, turn):
    before = PoseLine(1.0, -2.0, 0.7, 0.0, 0.0, 0.0)
    x, y, yaw = before[:3]
    for _ in range(periods):
        dx, dy = rotate(0.004, -0.002, yaw)
        x, y, yaw = x + dx, y + dy, yaw + turn
    found = body_step(before, PoseLine(x, y, yaw, 0.0, 0.0, 0.0), periods)
    assert found == pytest.approx((0.004 * periods, -0.002 * periods, turn * periods))


def test_ranges_and_power():
    dialect = Robotont2(official_wheels())
    dialect.feed(b"RANGE:" + b":".join(b"%d" % (100 * sensor) for sensor in range(12)) + b"\r\nPOWER:1.5:14.8\r\n"
                 b"BATSTATE:1.25:0.5:19.0:15.1\nRANGE:1:2\r\nPOWER:x:14.8\r\nPOWER:nan:1\r\n", 0.0)
    ranges, power, battery = dialect.take_readings()
    assert ranges == Ranges(tuple(sensor / 10 for sensor in range(12)))
    assert power == Power(14.8, 1.5)
    assert battery == Power(15.1, 1.75)
    assert dialect.dropped == {"fields": 1, "number": 2}
    assert dialect.take_readings() == []
