"""What the protocols make of the boards' lines: odometry without loss, readings, malformed lines, restarts."""

import math
import random

import numpy as np
import pytest
from protocol_bench import Bench, official_wheels

from robotont_driver.kinematics import se2
from robotont_driver.protocol.official_boards import Robotont2, added, gap
from robotont_driver.protocol.protocol import Power, Ranges


def follow_a_square_and_a_turning_circle(bench):
    """Drive and stand: the odometry is where the board says. On the circle the robot turns the other way."""
    for twist in ((0.2, 0, 0), (0, 0.2, 0), (-0.2, 0, 0), (0, -0.2, 0)):
        bench.hold(twist, 3.0)
    seconds, speed, rate = 12.0, 0.15, 50
    for angle in np.linspace(0, 4 * math.pi, round(seconds * rate), endpoint=False):
        bench.hold((speed * math.cos(angle), speed * math.sin(angle), -2 * math.pi / seconds), 1 / rate)
    bench.hold((0.0, 0.0, 0.0), 2.0)
    pose = bench.odometry.pose
    x, y, yaw = np.subtract((pose.x, pose.y, pose.yaw), bench.board.odometry.pose)
    assert math.hypot(x, y) <= 1e-3
    assert abs(math.remainder(yaw, 2 * math.pi)) <= 1e-3


@pytest.mark.parametrize("base_frame", [True, False])
def test_a_square_and_a_turning_circle_end_where_the_board_says(base_frame):
    bench = Bench("robotont2", base_frame=base_frame)
    follow_a_square_and_a_turning_circle(bench)
    assert abs(bench.board.odometry.pose[2] + 2 * math.pi) < 0.5  # it has really turned
    edges = [path / (2 * math.pi * 0.035 / 1200) for path in bench.board.odometry.summed]
    assert [sum(column) for column in zip(*bench.counts)] == pytest.approx(edges, abs=1.0)
    assert (bench.protocol.dropped, bench.protocol.restarts) == ({}, 0)


@pytest.mark.parametrize("lost, jitter, stall, seeds, rms", [
    (0.0, 0.0, 0.0, 1, 0.5), (0.2, 0.002, 0.0, 4, 3.0), (0.0, 0.001, 0.5, 1, 1.0)])
def test_generation_3_loses_millimetres_where_its_pose_is_late_by_its_display(lost, jitter, stall, seeds, rms):
    """Where lines are lost by a walk of the roundings: which one it is depends on the computer's last digits, too."""
    off = []  # edges
    for seed in range(7, 7 + seeds):
        chance, bench = random.Random(seed), Bench("robotont3")
        bench.pass_on = line_noise(lost, 0.0)
        until = 0.0

        def arrival(now, chance=chance):
            nonlocal until
            if stall and now % 7.0 < 0.002:
                until = now + stall
            return max(until, now + chance.uniform(0, jitter))
        bench.arrival = arrival
        for _ in range(40):
            bench.hold((chance.uniform(-0.3, 0.3), chance.uniform(-0.3, 0.3), chance.uniform(-1, 1)), 1.5)
        bench.hold((0.0, 0.0, 0.0), 1.0)
        board = [path / (2 * math.pi * 0.035 / 1200) for path in bench.board.odometry.summed]
        assert max(abs(one - other) for one, other in zip(board, bench.motors._counted)) > 50, "what the board loses"
        off += [sum(column) - true for column, true in zip(zip(*bench.counts), bench.motors._counted)]
        assert bench.protocol.restarts == 0
    assert math.sqrt(np.mean(np.square(off))) <= rms


def test_generation_3_reports_a_steady_speed_although_a_tenth_of_its_periods_is_longer():
    bench = Bench("robotont3")
    bench.hold((0.2, 0.0, 0.0), 20.0)
    longer = np.array([packet.periods > 1.2 for packet in bench.counts[100:]])
    speeds = np.array(bench.twists[100:])[:, 0]
    assert longer.mean() == pytest.approx(0.1, abs=0.01)
    assert [speeds[longer].mean(), speeds[~longer].mean()] == pytest.approx([0.2, 0.2], abs=0.01)


@pytest.mark.parametrize("late", [0.003, 0.008, 0.012])
def test_generation_3_loses_no_percent_where_lines_are_read_late(late):
    chance, bench, until = random.Random(1), Bench("robotont3"), 0.0

    def arrival(now):
        nonlocal until
        until = max(until, now + chance.uniform(0.0, late))
        return until
    bench.arrival = arrival
    bench.hold((0.2, 0.0, 0.0), 30.0)
    counted = [sum(column) for column in zip(*bench.counts)]
    np.testing.assert_allclose(counted, bench.motors._counted, rtol=0.01, atol=15)


def line_noise(lines, bytes_):
    """Loses a share of whole lines, replaces a share of bytes."""
    chance, rest = random.Random(1), b""

    def pass_on(data):
        nonlocal rest
        *whole, rest = (rest + data).split(b"\n")
        kept = b"".join(line + b"\n" for line in whole if chance.random() >= lines)
        return bytes(chance.randrange(256) if chance.random() < bytes_ else byte for byte in kept)
    return pass_on


@pytest.mark.parametrize("lines, bytes_, base_frame", [(0.0, 0.001, False), (0.2, 0.001, True)])
def test_a_bad_line_loses_no_distance(lines, bytes_, base_frame):
    bench = Bench(base_frame=base_frame)
    bench.pass_on = line_noise(lines, bytes_)
    follow_a_square_and_a_turning_circle(bench)
    assert bench.protocol.repaired > 25 * lines
    assert bench.protocol.restarts == 0
    assert max(max(map(abs, counts)) for counts in bench.counts) < 2 * 0.3 / (2 * math.pi * 0.035 / 1200) * 0.02


@pytest.mark.parametrize("old", [3, 20, 50])
def test_old_lines_that_come_again_move_nobody(old):
    bench, lines = Bench("robotont2"), []

    def pass_on(data):
        lines.extend(data.splitlines(keepends=True))
        return data
    bench.pass_on = pass_on
    bench.hold((0.2, 0.1, 0.3), 6.0)
    for packet in bench.protocol.feed(b"".join(lines[-old:]), bench.now):
        bench.counts.append(packet)
    bench.hold((0.2, -0.1, 0.0), 2.0)
    edges = [path / (2 * math.pi * 0.035 / 1200) for path in bench.board.odometry.summed]
    assert [sum(column) for column in zip(*bench.counts)] == pytest.approx(edges, abs=1.0)
    assert bench.protocol.restarts == 0


@pytest.mark.parametrize("text, kind", [
    ("ODOM:nan:0.000000:0.000000:0.000000:0.000000:0.000000", "number"),
    ("ODOM:0.000000:-inf:0.000000:0.000000:0.000000:0.000000", "number"),
    ("ODOM:0.000000:0.000000:0.000000:0.000000:0.000000", "fields"),
    ("ODOM:0.000000:0.000000:0.000000:0.000000:0.000000:", "number"),
    ("ODOM:0.000000:0.000000:0.000000:0.000000:0.000000:1e5", "number"),
])
def test_a_line_that_is_none_is_dropped_and_counted(text, kind):
    protocol = Robotont2(official_wheels())
    assert protocol.feed(text.encode() + b"\r\n", 0.0) == []
    assert protocol.dropped == {kind: 1}


def driven(steps, move):
    """Lines (x, y, yaw, vx, vy, turn) of a board behind each of K steps (forward [m], left [m], turn [rad])."""
    lines = [(1.0, -2.0, 0.7, 0.0, 0.0, 0.0)]
    for step in steps:
        pose = se2.compose(lines[-1][:3], step)
        twist = step if move is se2.compose else np.subtract(pose, lines[-1][:3])
        lines.append((*pose, *(part / 0.02 for part in twist)))
    return lines


@pytest.mark.parametrize("move", [se2.compose, added])
def test_nothing_is_guessed_where_one_line_is_lost(move):
    steps = [(0.004, -0.002, 0.02), (0.001, 0.003, -0.05), (-0.002, 0.004, 0.01)]
    lines = driven(steps, move)
    assert np.array(gap(lines[1], lines[3], 2, move)[0]) == pytest.approx(np.array(steps[1:]))


def test_a_line_with_a_spoilt_twist_moves_nobody_even_where_the_next_confirms_its_pose():
    lines = driven([(0.002, 0.001, 0.01)] * 6, se2.compose)
    lines[4] = (*lines[4][:5], lines[4][5] - 1.0)  # the line before it is lost
    protocol = Robotont2(official_wheels())
    packets = []
    for at in (0, 1, 2, 4, 5, 6):
        text = "ODOM:" + ":".join(f"{value:.6f}" for value in lines[at]) + "\r\n"
        packets += protocol.feed(text.encode(), 0.02 * at)
    assert len(packets) == 6
    assert np.ptp(packets, axis=0) == pytest.approx([0.0] * 3, abs=0.02)


@pytest.mark.parametrize("turn", [0.0, 0.02, -0.1])
def test_steps_that_change_evenly_are_found_in_a_gap(turn):
    steps = [(0.001 * at, 0.004 - 0.001 * at, turn + 0.001 * at) for at in range(1, 9)]
    lines = driven(steps, se2.compose)
    found, rough = gap(lines[1], lines[8], 7, se2.compose)
    assert np.array(found) == pytest.approx(np.array(steps[1:]))
    assert rough == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert np.sum(gap(lines[1], lines[8], 3, se2.compose)[0], axis=0)[2] == pytest.approx(lines[8][2] - lines[1][2])


def test_ranges_and_power():
    protocol = Robotont2(official_wheels())
    protocol.feed(b"RANGE:" + b":".join(b"%d" % (100 * sensor) for sensor in range(12)) + b"\r\nPOWER:1.5:14.8\r\n"
                 b"BATSTATE:1.25:0.5:19.0:15.1\nRANGE:1:2\r\nPOWER:x:14.8\r\nPOWER:nan:1\r\n", 0.0)
    ranges, power, battery = protocol.readings
    assert ranges == Ranges(tuple(sensor / 10 for sensor in range(12)))
    assert power == Power(14.8, 1.5)
    assert battery == Power(15.1, 1.75)
    assert protocol.dropped == {"fields": 1, "number": 2}
