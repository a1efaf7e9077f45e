"""What the protocols send to the boards, and when: on the bench, a virtual clock."""

import itertools
import math
import random

import pytest
from protocol_bench import Bench, command_of, official_wheels

from robotont_boards import BOARDS
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.protocol.connection import KINDS
from robotont_driver.protocol.official_boards import Robotont2
from robotont_driver.protocol.protocol import ProtocolError
from robotont_testing.dc_motors import Motors
from robotont_testing.robots import BARE, SHIPPED, UNEVEN_4

FORWARD, LEFT, TURN, REST = (0.2, 0, 0), (0, 0.2, 0), (0, 0, 1), (0, 0, 0)
GOLDEN = [  # protocol, what differs from the wheels as delivered, twist, line
    ("robotont2", {}, FORWARD, b"MS:-0.1732:0.0000:0.1732\n"),
    ("robotont2", {}, LEFT, b"MS:0.1000:-0.2000:0.1000\n"),
    ("robotont2", {}, TURN, b"MS:0.1450:0.1450:0.1450\n"),
    ("robotont2", {}, REST, b"RS:0:0:0\n"),
    ("robotont2", {}, (0.0004, 0, 0), b"RS:0:0:0\n"),
    ("robotont2", {}, (0, 0.6, 0), b"MS:0.1500:-0.3000:0.1500\n"),  # too fast: the direction is kept
    ("robotont2", SHIPPED, FORWARD, b"MS:-0.1732:0.0000:0.1732\n"),
    ("robotont3", {}, (0, 0.6, 0), b"MS:0.2000:-0.4000:0.2000\n"),
]


@pytest.mark.parametrize("name, wheels, twist, line", GOLDEN)
def test_worked_values(name, wheels, twist, line):
    wheels = official_wheels(**wheels)
    protocol = KINDS[name](wheels)
    assert protocol.encode(command_of(wheels, twist)) == line


@pytest.mark.parametrize("order", itertools.permutations(range(3)))
@pytest.mark.parametrize("positive", ["counterclockwise", "clockwise"])
def test_any_order_and_sign_of_the_same_wheels_gives_the_same_line(order, positive):
    rads = [official_wheels().directions[wheel] + (math.pi if positive == "clockwise" else 0) for wheel in order]
    wheels = official_wheels(wheelRads=rads, positiveRotation=positive)
    twist = (0.07, -0.05, 0.4)
    assert Robotont2(wheels).encode(command_of(wheels, twist)) == \
        Robotont2(official_wheels()).encode(command_of(official_wheels(), twist))


def test_other_distances_are_doubted():
    complaint = Robotont2(read_wheels(SHIPPED)).complaint
    assert "0.125 m" in complaint
    assert "0.145 m" in complaint
    assert not Robotont2(official_wheels(wheelDistanceFromCenter=0.1472)).complaint


@pytest.mark.parametrize("given, words", [
    (UNEVEN_4, "wheelAmount: found 4"),
    ({**BARE, "wheelRads": [0.0, 2.1, 4.2]}, "found wheels at 270, 30, 151 degrees"),
    ({**BARE, "pidControlFrequency": 100}, "pidControlFrequency: found 100"),
])
def test_wheels_that_the_board_cannot_have_are_refused_with_words(given, words):
    with pytest.raises(ProtocolError, match=words):
        Robotont2(read_wheels(given))


def speeds_of(line):
    """Wheel speeds [m/s] in a line of the official protocols."""
    return [float(field) for field in line.decode().strip().split(":")[1:]]


@pytest.mark.parametrize("minutes", [1, pytest.param(10, marks=pytest.mark.long)])
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
            bench.run(max(0.001, generator.expovariate(rate)))
    bench.run(0.2)
    lines = [line.strip() for _, line in bench.sent if line != b"\x1b"]
    assert bench.board.swallowed == []
    assert bench.board.inversions == 0
    assert [line for _, line in bench.board.executed] == lines
    newest_line = bench.protocol.encode(bench.commanded)  # the last digit may differ by the rounding that is carried on
    assert speeds_of(lines[-1]) == pytest.approx(speeds_of(newest_line), abs=1.01e-4)
    starts = [at for at, _ in bench.sent]
    assert min(later - earlier for earlier, later in zip(starts, starts[1:])) >= 0.03 - 1e-9
    assert not bench.board.dead


def test_lights_fit_into_the_boards_buffer():
    lines = Robotont2(official_wheels()).encode_lights(3, [(255, 255, 255)] * 60)
    assert [line.split(b":")[1] for line in lines] == [b"3", b"23", b"43"]
    assert max(map(len, lines)) <= 254
    assert lines[0].startswith(b"LED:3:16777215:")


WHITE, RED, DARK = (255, 255, 255), (255, 0, 0), (0, 0, 0)


@pytest.mark.parametrize("first, colours", [(3, [RED]), (0, [RED] * 60), (10, [RED, WHITE, DARK, WHITE, RED, WHITE]),
                                            (7, [WHITE, RED, RED, RED]), (59, [WHITE])])
def test_lights_of_generation_3_show_what_was_asked_and_nothing_else(first, colours):
    protocol = KINDS["robotont3"](official_wheels())
    board = BOARDS["robotont3"](Motors(), lights=True)
    plain = BOARDS["robotont3"](Motors())
    longest = b"MS:-0.4000:-0.4000:-0.4000\n"
    for at, line in enumerate([longest, *protocol.encode_lights(0, [RED, WHITE] * 3), longest,
                               *protocol.encode_lights(first, colours), longest]):
        assert len(line) < 64
        for each in (board, plain):
            each.receive(line, 0.1 * at)
    for each in (board, plain):
        each.advance(1.0)
        assert (each.dead, each.swallowed) == ("", [])
        assert each.setpoints == pytest.approx([-0.4] * 3)  # single precision
    wanted = [0] * 60
    wanted[first:first + len(colours)] = [red << 16 | green << 8 | blue for red, green, blue in colours]
    assert board.shown == wanted
    assert board.lights_mode >= board.MODES, "nothing animates them"


def test_lights_of_generation_3_that_do_not_fit_into_a_transfer_are_not_sent():
    protocol = KINDS["robotont3"](official_wheels())
    assert protocol.encode_lights(10, [WHITE, RED] * 4) == []
    assert protocol.encode_lights(10, []) == []
