"""Dialects against Robotont's official boards, on a virtual clock."""

import itertools
import math
import os
import random

import pytest
from dialect_bench import REACH, Bench, LineNoise, official_wheels

from robotont_driver.dialects import NAMES, make_dialect
from robotont_driver.dialects.board_wheels import BoardWheels
from robotont_driver.dialects.dialect import DialectError, Power, Ranges
from robotont_driver.dialects.pose_feedback import IN_BASE, IN_ODOM, ORIGIN, PoseLine, body_step, parse_pose
from robotont_driver.dialects.robotont2 import Robotont2
from robotont_driver.kinematics import Kinematics
from robotont_driver.protocol import Packet, PacketError, format_packet, parse_packet
from robotont_driver.wheels import read_wheels
from robotont_testing.dc_motors import Motors
from robotont_testing.official_boards import BOARDS
from robotont_testing.robots import BARE, SHIPPED, UNEVEN_4

SQUARE = ((0.2, 0, 0), (0, 0.2, 0), (-0.2, 0, 0), (0, -0.2, 0))
FUZZED_LINES = int(os.environ.get("FUZZED_LINES", "100000"))  # docs/dialects.md states the figure of 100000


def turning_circle(seconds=12.0, speed=0.15, turns=1, rate=50):
    """Twists, one per command at `rate`, along a circle in the room while the robot turns the other way."""
    turn = 2 * math.pi * turns / seconds
    for step in range(round(seconds * rate)):
        angle = 2 * turn * step / rate
        yield speed * math.cos(angle), speed * math.sin(angle), -turn


def command_of(wheels, twist):
    units = Kinematics(wheels).units_of_twist(twist)
    return parse_packet(format_packet(units, 6), 3)


def board_pose(bench):
    return [float(value) for value in bench.board.odometry.pose]


def assert_near(found, wanted, metres, radians):
    error = math.hypot(found[0] - wanted[0], found[1] - wanted[1])
    assert error <= metres, (found, wanted, error)
    assert abs(math.remainder(found[2] - wanted[2], 2 * math.pi)) <= radians, (found, wanted)


# --- commands


@pytest.mark.parametrize("twist, line", [
    ((0.2, 0, 0), b"MS:-0.1732:0.0000:0.1732\n"),
    ((0, 0.2, 0), b"MS:0.1000:-0.2000:0.1000\n"),
    ((0, 0, 1), b"MS:0.1450:0.1450:0.1450\n"),
    ((0, 0, 0), b"RS:0:0:0\n"),
    ((0.0004, 0, 0), b"RS:0:0:0\n"),
])
def test_worked_values(twist, line):
    wheels = official_wheels()
    assert Robotont2(wheels, REACH).encode(command_of(wheels, twist)) == line


@pytest.mark.parametrize("name, per_unit, step", [
    ("robotont2", 2 * math.pi * 0.035 / 1200 / 0.02, 1e-4), ("robotont3", 2 * math.pi * 0.035 / 1200 / 0.02, 1e-4),
    ("robotont2018", 0.5, 1.0)])
def test_rounding_loses_no_distance(name, per_unit, step):
    """Of a command that is repeated the lines add up; at rest and after it none moves a wheel."""
    dialect = make_dialect(name, official_wheels(), REACH)
    command = Packet([9.37, 9.37, 9.37], "9.37:9.37:9.37;\n")
    lines = [dialect.encode(command).decode() for _ in range(200)]
    for wheel in range(3):
        sent = [float(line.strip().rpartition("MS:")[2].split(":")[wheel]) for line in lines]
        assert sum(sent) == pytest.approx(200 * 9.37 * per_unit, abs=step)
        assert max(sent) - min(sent) <= step * 1.001
    assert {dialect.encode(Packet([0, 0, 0])) for _ in range(20)} == {dialect.stop()}


def test_a_unit_is_an_edge_per_period():
    assert 1 / BoardWheels(official_wheels()).speed_of_unit == pytest.approx(109.1348, abs=1e-4)


@pytest.mark.parametrize("name, limit", [("robotont2", 0.30), ("robotont3", 0.40)])
def test_too_fast_commands_keep_their_direction(name, limit):
    wheels = official_wheels()
    dialect = make_dialect(name, wheels, REACH)
    kinematics = Kinematics(wheels)
    generator = random.Random(3)
    for _ in range(500):
        wanted = [generator.uniform(-2, 2), generator.uniform(-2, 2), generator.uniform(-5, 5)]
        line = dialect.encode(command_of(wheels, wanted))
        speeds = [float(field) for field in line.decode()[3:].split(":")]
        assert max(map(abs, speeds)) <= limit + 1e-9
        reached = kinematics.twist_of_speeds(speeds)
        assert math.degrees(abs(math.remainder(
            math.atan2(reached[1], reached[0]) - math.atan2(wanted[1], wanted[0]), 2 * math.pi))) < 1.0
        share = math.hypot(*reached[:2]) / math.hypot(*wanted[:2])
        assert reached[2] == pytest.approx(share * wanted[2], abs=2e-3)


@pytest.mark.parametrize("order", itertools.permutations(range(3)))
@pytest.mark.parametrize("positive", ["counterclockwise", "clockwise"])
def test_any_order_and_sign_of_the_same_wheels_gives_the_same_line(order, positive):
    rads = [official_wheels().directions[wheel] + (math.pi if positive == "clockwise" else 0) for wheel in order]
    wheels = official_wheels(wheelRads=rads, positiveRotation=positive)
    twist = (0.07, -0.05, 0.4)
    assert Robotont2(wheels, REACH).encode(command_of(wheels, twist)) == \
        Robotont2(official_wheels(), REACH).encode(command_of(official_wheels(), twist))


def test_the_shipped_wheel_file_is_understood_and_doubted():
    dialect = Robotont2(read_wheels(SHIPPED), REACH)
    assert dialect.encode(command_of(read_wheels(SHIPPED), (0.2, 0, 0))) == b"MS:-0.1732:0.0000:0.1732\n"
    assert "0.125 m" in dialect.complaint
    assert "0.145 m" in dialect.complaint
    assert not Robotont2(official_wheels(wheelDistanceFromCenter=0.1472), REACH).complaint


@pytest.mark.parametrize("given, words", [
    (UNEVEN_4, "wheelAmount: found 4"),
    ({**BARE, "wheelRads": [0.0, 2.1, 4.2]}, "found wheels at 270, 30, 151 degrees"),
    ({**BARE, "pidControlFrequency": 100}, "pidControlFrequency: found 100"),
])
def test_wheels_that_the_board_cannot_have_are_refused_with_words(given, words):
    with pytest.raises(DialectError, match=words):
        Robotont2(read_wheels(given), REACH)


def test_lights_fit_into_the_boards_buffer():
    lines = Robotont2(official_wheels(), REACH).encode_lights(3, [(255, 255, 255)] * 60)
    assert [line.split(b":")[1] for line in lines] == [b"3", b"23", b"43"]
    assert max(map(len, lines)) <= 254
    assert lines[0].startswith(b"LED:3:16777215:")


WHITE, RED, DARK = (255, 255, 255), (255, 0, 0), (0, 0, 0)


@pytest.mark.parametrize("first, colours", [(3, [RED]), (0, [RED] * 60), (10, [RED, WHITE, DARK, WHITE, RED, WHITE]),
                                            (7, [WHITE, RED, RED, RED]), (59, [WHITE])])
def test_lights_of_generation_3_show_what_was_asked_and_nothing_else(first, colours):
    dialect = make_dialect("robotont3", official_wheels(), REACH)
    board = BOARDS["robotont3"](Motors(), lights=True)
    plain = BOARDS["robotont3"](Motors())
    longest = b"MS:-0.4000:-0.4000:-0.4000\n"
    for at, line in enumerate([longest, *dialect.encode_lights(0, [RED, WHITE] * 3), longest,
                               *dialect.encode_lights(first, colours), longest]):
        assert len(line) < 64
        for each in (board, plain):
            each.receive(line, 0.1 * at)
    for each in (board, plain):
        each.advance(1.0)
        assert (each.dead, each.swallowed) == ("", [])
        assert each.setpoints == [-0.4] * 3
    wanted = [0] * 60
    wanted[first:first + len(colours)] = [red << 16 | green << 8 | blue for red, green, blue in colours]
    assert board.shown == wanted
    assert board.lights_mode >= board.MODES, "nothing animates them"


def test_lights_of_generation_3_that_do_not_fit_into_a_transfer_are_not_sent():
    dialect = make_dialect("robotont3", official_wheels(), REACH)
    assert dialect.encode_lights(10, [WHITE, RED] * 4) == []
    assert dialect.encode_lights(10, []) == []


# --- what is sent, when: no trap is stepped into


def speeds_of(line):
    """Wheel speeds [m/s] in a line of the official dialects."""
    return [float(field) for field in line.decode().strip().split(":")[1:]]


@pytest.mark.parametrize("minutes", [2, pytest.param(10, marks=pytest.mark.long)])
@pytest.mark.parametrize("name", ["robotont2", "robotont3"])
def test_minutes_of_random_commands_lose_none_and_let_no_older_one_win(name, minutes):
    bench = Bench(name)
    generator = random.Random(11)
    newest = None
    while bench.now < 60 * minutes:
        rate = 10 ** generator.uniform(0, 2)
        for _ in range(generator.randrange(1, 40)):
            newest = (generator.uniform(-0.6, 0.6), generator.uniform(-0.6, 0.6), generator.uniform(-3, 3))
            bench.command(newest)
            bench.run(max(0.001, generator.expovariate(rate)), step=0.001)
    bench.run(0.2)
    lines = [line.strip() for _, line in bench.sent if line != b"\x1b"]
    assert bench.board.swallowed == []
    assert bench.board.inversions == 0
    assert [line for _, line in bench.board.executed] == lines
    newest_line = bench.dialect.encode(bench._command)  # the last digit may differ by the rounding that is carried on
    assert speeds_of(lines[-1]) == pytest.approx(speeds_of(newest_line), abs=1.01e-4)
    starts = [at for at, _ in bench.sent]
    assert min(later - earlier for earlier, later in zip(starts, starts[1:])) >= 0.03 - 1e-9
    assert not bench.board.dead


def test_the_board_does_have_the_traps_that_are_avoided():
    def send(*writes):
        bench = Bench()
        bench.run(0.1)
        for at, data in writes:
            bench.run(0.185 + at - bench.now)
            bench.board.receive(data, bench.now)
        bench.run(0.2)
        return bench.board
    board = send((0, b"RS:0.1:0:0\n"), (0.005, b"RS:0.2:0:0\n"))  # two in one loop
    assert (board.inversions, board.executed[-1][1]) == (1, b"RS:0.1:0:0")
    board = send((0, b"RS:0.1:0:0\n"), (0.03, b"\n"), (0.1, b"RS:0.2:0:0\n"))  # an empty line
    assert [line for _, line in board.swallowed] == [b"RS:0.2:0:0"]
    assert "fields missing" in send((0, b"RS:0.1\n")).dead
    board = send((0, b"MS:nan:0:0\n"))
    assert board.setpoints[0] == 0.3  # full speed


def test_generation_3_does_have_the_traps_that_are_avoided():
    def send(*writes):
        bench = Bench("robotont3")
        for data in writes:
            bench.run(0.1)
            bench.board.receive(data, bench.now)
        bench.run(0.1)
        return bench.board
    board = send(b"RS:0.1:0:0\n", b"RS:0.", b"2:0:0\n")  # a line split into two transfers: each is a message
    assert "fields missing" in board.dead or board.setpoints != send(b"RS:0.2:0:0\n").setpoints
    assert "fields missing" in send(b"RS:0.1\n").dead
    assert send(b"OR\n").odometry.pose.tolist() == [0, 0, 0]


def test_without_commands_the_board_stops_after_a_second():
    for name in ("robotont2", "robotont3"):
        bench = Bench(name)
        bench.hold((0.2, 0, 0), 1.0)
        bench._repeat_at = math.inf
        bench.run(0.9)
        assert max(map(abs, bench.motors.speeds)) > 0.1
        bench.run(0.6)
        assert max(map(abs, bench.motors.speeds)) < 0.01


# --- odometry


@pytest.mark.parametrize("name, base_frame", [("robotont2", True), ("robotont2", False), ("robotont3", None)])
def test_a_square_and_a_turning_circle_end_where_the_board_says(name, base_frame):
    bench = Bench(name, **({} if base_frame is None else {"base_frame": base_frame}))
    for twist in SQUARE:
        bench.hold(twist, 3.0)
    bench.settle()
    assert_near(bench.pose(), bench.dialect.board_pose, 1e-3, 1e-3)
    for twist in turning_circle():
        bench.hold(twist, 0.02)
    bench.settle()
    assert_near(bench.pose(), bench.dialect.board_pose, 1e-3, 1e-3)
    assert abs(bench.dialect.board_pose.yaw + 2 * math.pi) < 0.5  # it has really turned
    assert not bench.dialect.dropped
    assert not bench.dialect.restarts


def test_every_step_of_the_board_is_given_back_edge_by_edge():
    bench = Bench()
    for twist in turning_circle(rate=20):
        bench.hold(twist, 0.05)
    bench.settle()
    edges = [path / (2 * math.pi * 0.035 / 1200) for path in bench.board.odometry.summed]
    assert [sum(column) for column in zip(*bench.counts)] == pytest.approx(edges, abs=1.0)


@pytest.mark.parametrize("lines, bytes_", [(0.2, 0.0), (0.0, 0.001), (0.2, 0.001)])
@pytest.mark.parametrize("base_frame", [True, False])
def test_a_bad_line_loses_no_distance(lines, bytes_, base_frame):
    bench = Bench(base_frame=base_frame)
    bench.pass_on = LineNoise(lines, bytes_)
    for twist in SQUARE * 4:
        bench.hold(twist, 3.0)
    bench.settle(2.0)
    assert_near(bench.pose(), board_pose(bench), 1e-3, 1e-3)
    for twist in turning_circle():
        bench.hold(twist, 0.02)
    bench.settle(2.0)
    assert_near(bench.pose(), board_pose(bench), 1e-3, 1e-3)
    assert bench.dialect.repaired > 50 * lines
    assert bench.dialect.restarts == 0
    assert max(max(map(abs, counts)) for counts in bench.counts) < 2 * 0.3 / (2 * math.pi * 0.035 / 1200) * 0.02


def test_no_wrong_line_is_accepted():
    """Half of the lines are spoilt in the ways of serial lines and of spite, digits above all."""
    bench = Bench()
    generator = random.Random(5)
    true = []
    bench.pass_on = lambda data: true.extend(data.splitlines(keepends=True)) or b""
    while len(true) < 20000:
        bench.command((generator.uniform(-0.3, 0.3), generator.uniform(-0.3, 0.3), generator.uniform(-1, 1)))
        bench.run(generator.uniform(0.05, 1.0))
    poses = [parse_pose(line.decode().strip()) if line.startswith(b"ODOM") else ORIGIN for line in true]
    wrong = accepted = judged = 0
    for _ in range(math.ceil(FUZZED_LINES / len(true))):
        dialect = Robotont2(bench.wheels, REACH)
        dialect.connect(0.0)
        before = None
        for index, line in enumerate(true):
            dialect.feed(spoil(line, generator) if generator.random() < 0.5 else line, index * 0.02)
            judged += 1
            told = dialect.board_pose
            if told is not before:
                before = told
                wrong += not any(distance(told, pose) < 1e-5 for pose in poses[max(0, index - 60):index + 1])
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


@pytest.mark.parametrize("banner", [True, False])
def test_a_board_that_restarts_is_taken_afresh(banner):
    bench = Bench()
    bench.hold((0.2, 0.1, 0.3), 3.0)
    bench.settle()
    before, counted = bench.pose(), [sum(column) for column in zip(*bench.counts)]
    bench.board = type(bench.board)(bench.motors, start=bench.now)
    if not banner:
        bench.board._outgoing.clear()
    bench.run(0.3)
    assert bench.dialect.restarts == 1
    assert bench.pose() == before
    assert [sum(column) for column in zip(*bench.counts)] == counted
    bench.hold((0.2, 0, 0), 2.0)
    bench.settle()
    gone = math.hypot(bench.pose()[0] - before[0], bench.pose()[1] - before[1])
    assert gone == pytest.approx(math.hypot(*board_pose(bench)[:2]), abs=1e-3)


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


# --- June 2018


def test_june_2018():
    wheels = official_wheels()
    dialect = make_dialect("robotont2018", wheels, REACH)
    assert dialect.encode(Packet((20.0, -30.6, 0.0), "")) == b"10:-15:0\r"
    assert dialect.encode(Packet((400.0, -200.0, 0.0), "")) == b"100:-50:0\r"
    assert dialect.stop() == b"0:0:0\r"
    bench = Bench("robotont2018")
    bench.hold((0.2, 0, 0), 3.0)
    moving = bench.pose()[0]
    true = (bench.motors.paths[2] - bench.motors.paths[0]) / math.sqrt(3)
    assert moving == pytest.approx(true, rel=0.05)  # every second window is a guess
    assert not bench.dialect.dropped
    bench.board.receive(b"\x1b", bench.now)
    bench._repeat_at = math.inf
    bench.run(1.0)
    assert max(map(abs, bench.motors.speeds)) < 0.01


# --- recognition


def talk(name, seconds=1.2):
    """What a board says, cold: (time, bytes)."""
    if name in ("plain", "checked"):
        return own_talk(name == "checked", seconds)
    bench = Bench(name)
    heard = []
    bench.pass_on = lambda data: heard.append((bench.now, data)) or b""
    bench.hold((0.1, 0.05, 0.2), seconds + 1.0)
    return [(at, data) for at, data in heard if data]


def own_talk(checked, seconds):
    from robotont_testing.stand_in_board import Board
    board = Board("nobody", checked=checked, banner="")
    talked = []
    for period in range(round(seconds / 0.02) + 50):
        counts = [period % 7, -period % 5, 3]
        board.motors.counted = [total + count for total, count in zip(board.motors.counted, counts)]
        talked.append((period * 0.02, board.packet(counts)))
        board.counter = (board.counter + 1) % 256
    return talked


@pytest.mark.parametrize("start", ["cold", "in mid-stream", "in the middle of a line"])
@pytest.mark.parametrize("name", NAMES[1:])
def test_each_board_is_recognised_within_a_second(name, start):
    wheels = official_wheels()
    talked = talk(name)
    if start != "cold":
        begin = 0.7
        talked = [(at, data) for at, data in talked if at >= begin]
        if start == "in the middle of a line":
            talked[0] = (talked[0][0], talked[0][1][7:])
    dialect = make_dialect("auto", wheels, REACH)
    dialect.usb_id = "0483:5740" if name == "robotont3" else "0483:374b"
    opened = 0.0 if start == "cold" else 0.7
    dialect.connect(opened)
    at = opened
    for at, data in talked:
        dialect.feed(data, at)
        if dialect.spoken is not dialect:
            break
        assert dialect.stop() == b""  # nothing is sent before
    assert dialect.spoken.name == name
    assert at - opened <= 1.0


def test_nothing_that_led_to_the_recognition_is_lost():
    wheels = official_wheels()
    talked = b"".join(data for _, data in own_talk(True, 1.0))
    alone, recognised = make_dialect("checked", wheels, REACH), make_dialect("auto", wheels, REACH)
    recognised.connect(0.0)
    parts = [talked[begin:begin + 13] for begin in range(0, len(talked), 13)]
    assert [counts for part in parts for counts in recognised.feed(part, 0.1)] == alone.feed(talked, 0.1)


def test_a_checked_packet_that_lost_its_trailer_makes_no_plain_board():
    dialect = make_dialect("auto", official_wheels(), REACH)
    dialect.connect(0.0)
    (_, one), (_, two), *_ = own_talk(True, 1.0)
    dialect.feed(one.partition(b";")[0] + b";\n", 0.02)
    dialect.feed(two, 0.04)
    assert dialect.spoken.name == "checked"


def test_what_is_unknown_is_named_and_gets_plain_packets_after_a_second():
    wheels = official_wheels()
    dialect = make_dialect("auto", wheels, REACH)
    dialect.connect(0.0)
    assert "no data from the board" in dialect.spoken.complaint
    dialect.feed(b"\xfe\x80\x80", 0.1)
    assert r"\xfe\x80\x80" in dialect.spoken.complaint
    dialect.feed(b"\nhello, I am a printer\r\n", 0.2)
    assert "hello, I am a printer" in dialect.spoken.complaint
    assert dialect.stop() == b""
    dialect.tick(1.1)
    assert dialect.stop() == b"0:0:0;\n"
    assert "plain" in dialect.description


def test_a_board_that_cannot_have_the_wheels_is_an_obstacle():
    dialect = make_dialect("auto", read_wheels(UNEVEN_4), REACH)
    dialect.connect(0.0)
    for _, data in talk("robotont2"):
        dialect.feed(data, 2.0)
    assert "wheelAmount: found 4" in dialect.spoken.obstacle
    assert dialect.stop() == b""
    with pytest.raises(DialectError):
        make_dialect("robotont3", read_wheels(UNEVEN_4), REACH)


@pytest.mark.parametrize("name", NAMES)
def test_no_bytes_can_raise(name):
    dialect = make_dialect(name, official_wheels(), REACH)
    dialect.connect(0.0)
    generator = random.Random(2)
    words = [b"ODOM:", b"RANGE:", b"POWER:", b"0.000000", b":", b";", b"\r\n", b"\n", b"#", b"Encoders ", b"nan", b"-"]
    for index in range(20000):
        dialect.feed(generator.choice([*words, bytes(generator.randrange(256) for _ in range(3))]), index / 1000)
