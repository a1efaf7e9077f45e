"""What the dialects make of the boards' lines: odometry without loss, readings, malformed lines, restarts."""

import math
import os
import random

import pytest
from dialect_bench import REACH, SQUARE, Bench, LineNoise, assert_near, official_wheels, turning_circle

from robotont_driver.protocol.dialects.dialect import Power, Ranges
from robotont_driver.protocol.dialects.pose_feedback import IN_BASE, IN_ODOM, ORIGIN, PoseLine, body_step, parse_pose
from robotont_driver.protocol.dialects.robotont2 import Robotont2
from robotont_driver.protocol.packet import PacketError

FUZZED_LINES = int(os.environ.get("FUZZED_LINES", "20000"))  # docs/dialects.md states the figures of more


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
    assert abs(bench.dialect.board_pose.yaw + 2 * math.pi) < 0.5  # it has really turned
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


def test_no_wrong_line_is_accepted():
    """Half of the lines are spoilt in the ways of serial lines and of spite, digits above all."""
    bench = Bench()
    generator = random.Random(5)
    true = []
    bench.pass_on = lambda data: true.extend(data.splitlines(keepends=True)) or b""
    while len(true) < 5000:
        bench.hold([generator.uniform(-most, most) for most in (0.3, 0.3, 1)], generator.uniform(0.05, 1.0))
    poses = [parse_pose(line.decode().strip()) if line.startswith(b"ODOM") else ORIGIN for line in true]
    wrong = accepted = judged = 0
    for _ in range(math.ceil(FUZZED_LINES / len(true))):
        dialect = Robotont2(bench.wheels, REACH)
        dialect.connect(0.0)
        before = None
        for index, line in enumerate(true):
            dialect.feed(spoil(line, generator) if generator.random() < 0.5 else line, index * 0.02)
            judged += 1
            newest = dialect.board_pose
            if newest is not before:
                before = newest
                wrong += not any(distance(newest, pose) < 1e-5 for pose in poses[max(0, index - 60):index + 1])
        accepted += dialect.packets
        assert dialect.restarts <= 1  # of the banner, when that came twice
    print(f"{judged} lines, {accepted} packets accepted, {wrong} of them wrong")
    assert wrong == 0
    assert judged >= FUZZED_LINES
    assert accepted > 0.2 * FUZZED_LINES


def test_two_lines_that_are_wrong_alike_move_nothing():
    """Both 0.2 m off, by a corrupted digit each: they agree with each other, and a third has to agree with them."""
    dialect = Robotont2(official_wheels(), REACH)
    dialect.connect(0.0)
    twist = "0.200000:0.000000:0.000000\r\n"
    lines = [f"ODOM:{0.004 * number:.6f}:0.000000:0.000000:{twist}" for number in range(1, 13)]
    true = list(map(sum, feed_all(dialect, lines)))
    dialect = Robotont2(official_wheels(), REACH)
    dialect.connect(0.0)
    for number in (6, 7):
        lines[number] = lines[number].replace("ODOM:0.0", "ODOM:0.2", 1)
    packets = feed_all(dialect, lines)
    assert max(max(map(abs, packet)) for packet in packets) <= 20
    assert sum(map(sum, packets)) == sum(true)
    assert dialect.restarts == 0
    assert dialect.board_pose.x == pytest.approx(0.048)


def feed_all(dialect, lines):
    """All packets that lines, one per period, complete."""
    return [packet for number, line in enumerate(lines) for packet in dialect.feed(line.encode(), 0.02 * number)]


def distance(one, other):
    return max(abs(one.x - other.x), abs(one.y - other.y), abs(one.yaw - other.yaw))


def spoil(line, generator):
    """The line as noise, a lost byte, or a malicious mind would have it."""
    kind = generator.randrange(7)
    place = generator.randrange(len(line))
    digit = bytes(generator.choice(b"0123456789") for _ in range(generator.randrange(1, 3)))
    if kind < 3:  # another digit or two
        return line[:place] + digit + line[place + len(digit):]
    if kind == 3:
        return line[:place] + bytes((generator.randrange(256),)) + line[place + 1:]
    if kind == 4:
        return line[:place] + line[place + 1:]
    if kind == 5:
        return line[:place] + line
    return b"" if generator.random() < 0.5 else line + line


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
    dialect = Robotont2(official_wheels(), REACH)
    assert dialect.feed(text.encode() + b"\r\n", 0.0) == []
    assert dialect.dropped == {kind: 1}


def test_steps_of_the_pose_are_undone_in_both_frames():
    before = PoseLine(1.0, -2.0, 7.5, 0, 0, 0)
    for frame in (IN_BASE, IN_ODOM):
        vx, vy, turn = 0.21, -0.13, 0.9
        dx, dy = (0.02 * vx, 0.02 * vy) if frame is IN_ODOM else (
            0.02 * (math.cos(7.5) * vx - math.sin(7.5) * vy), 0.02 * (math.sin(7.5) * vx + math.cos(7.5) * vy))
        line = PoseLine(1.0 + dx, -2.0 + dy, 7.5 + 0.018, vx, vy, turn)
        assert frame.fits(before, line)
        step = body_step(before, line, 1)
        assert math.hypot(*step[:2]) == pytest.approx(0.02 * math.hypot(vx, vy))


def test_the_motion_of_several_lost_lines_is_undone_as_the_board_made_it():
    x = y = yaw = 0.0
    for _ in range(7):
        x += 0.004 * math.cos(yaw) - 0.002 * math.sin(yaw)
        y += 0.004 * math.sin(yaw) + 0.002 * math.cos(yaw)
        yaw += 0.02
    step = body_step(PoseLine(0, 0, 0, 0, 0, 0), PoseLine(x, y, yaw, 0, 0, 0), 7)
    assert step == pytest.approx((0.028, 0.014, 0.14))


def test_ranges_and_power():
    dialect = Robotont2(official_wheels(), REACH)
    dialect.feed(b"RANGE:" + b":".join(b"%d" % (100 * sensor) for sensor in range(12)) + b"\r\nPOWER:1.5:14.8\r\n"
                 b"BATSTATE:1.25:0.5:19.0:15.1\nRANGE:1:2\r\nPOWER:x:14.8\r\nPOWER:nan:1\r\n", 0.0)
    ranges, power, battery = dialect.take_readings()
    assert ranges == Ranges(tuple(sensor / 10 for sensor in range(12)))
    assert power == Power(14.8, 1.5)
    assert battery == Power(15.1, 1.75)
    assert dialect.dropped == {"fields": 1, "number": 2}
    assert dialect.take_readings() == []
