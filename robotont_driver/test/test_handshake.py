"""One connection: which board it is, by its first lines, what is sent to it, and whether it comes at its rate."""

import numpy as np
import pytest
from checked_bench import Sender
from protocol_bench import Bench, official_wheels

from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.protocol.connection import CLOSED, LISTENING, NAMES, SILENT, SPEAKING, Connection, Listener
from robotont_driver.protocol.protocol import Packet
from robotont_testing.robots import SHIPPED, UNEVEN_4
from robotont_testing.stand_in_board import identity, sealed

COMMAND = Packet((5, 5, 5))


def talk(name):
    """What a board says, cold: (time, bytes)."""
    if name in ("plain", "checked"):
        sender = Sender(checked=name == "checked")
        return [(period * 0.02, sender.packet([period % 7, -period % 5, 3])) for period in range(110)]
    bench = Bench(name)
    heard = []
    bench.pass_on = lambda data: heard.append((bench.now, data)) or b""
    bench.hold((0.1, 0.05, 0.2), 2.2)
    return [(at, data) for at, data in heard if data]


@pytest.mark.parametrize("start", ["cold", "in mid-stream", "in the middle of a line"])
@pytest.mark.parametrize("name", NAMES[1:])
def test_each_board_is_recognised_within_a_second(name, start):
    opened = 0.0 if start == "cold" else 0.7
    talked = [(at, data) for at, data in talk(name) if at >= opened]
    if start == "in the middle of a line":
        talked[0] = (talked[0][0], talked[0][1][7:])
    usb_id = "0483:5740" if name == "robotont3" else "0483:374b"
    connection = Connection(official_wheels(), "auto", usb_id=usb_id, now=opened)
    assert connection.state(opened) == LISTENING
    at = opened
    for at, data in talked:
        connection.feed(data, at)
        if connection.protocol:
            break
        assert connection.stop(at) == b""  # nothing is sent before
    assert connection.protocol.name == name
    assert at - opened <= 1.0


def test_a_connection_listens_speaks_falls_silent_and_closes():
    connection = Connection(official_wheels(), "checked")
    states = [connection.state(0.1)]
    connection.feed(talk("checked")[0][1], 0.2)
    states += [connection.state(5.1), connection.state(5.3)]
    connection.trouble = "gone"
    assert [*states, connection.state(5.3)] == [LISTENING, SPEAKING, SILENT, CLOSED]


def test_a_board_of_any_number_of_wheels_is_recognised_and_they_are_counted():
    listener = Listener()
    assert [listener.feed(b"1:2:3:4;\n") for _ in range(2)] == [None, "plain"]
    assert listener.fields == 4
    assert listener.feed(sealed(identity(wheels=5))) == "checked"
    assert listener.fields == 5
    assert listener.feed(b"# robotont_firmware 1.0\n") == "checked", "which has not told how many it drives"
    assert listener.fields == 0


def test_a_checked_packet_that_lost_its_trailer_makes_no_plain_board():
    connection = Connection(official_wheels())
    (_, one), (_, two), *_ = talk("checked")
    connection.feed(one.partition(b";")[0] + b";\n", 0.02)
    connection.feed(two, 0.04)
    assert connection.protocol.name == "checked"


@pytest.mark.parametrize(("wheels", "robot"), [(4, "FOLDER_OF_4_WHEELS"), (2, ""), (3, "thesis")])
def test_a_plain_board_of_another_number_of_wheels_is_not_driven(wheels, robot):
    connection = Connection(read_wheels(UNEVEN_4 if wheels == 3 else SHIPPED))
    for at in np.arange(0.0, 2.0, 0.02):
        connection.feed(b":".join([b"0"] * wheels) + b";\n", at)
    assert connection.protocol is None
    assert connection.obstacle.endswith(f" wheels instead of {7 - wheels}): robot:={robot}" if robot else "")
    assert connection.stop(2.0) == (b"" if robot else b"0:0:0;\n")  # of two wheels there is no robot: unknown text
    board = connection._wheels.amount
    for at in (2.1, 2.2, 2.3):  # and one that was only cut or spoilt twice is driven again
        connection.feed(b":".join([b"0"] * board) + b";\n", at)
    assert (connection.protocol.name, connection.obstacle) == ("plain", "")


def test_what_is_unknown_is_named_and_gets_plain_packets_after_a_second():
    connection = Connection(official_wheels())
    for at, data, words, baudrate in (
            (0.0, b"", "no data from the board", False), (0.1, b"\xfe\x80\x80", r"\xfe\x80\x80", True),
            (0.2, b"\nhello, I am a printer\r\n", "of no known protocol: 'hello, I am a printer'", False),
            (0.3, b"\x8f\x00\xf0\n", r"\x8f\x00\xf0", True)):
        connection.feed(data, at)
        assert words in connection.complaint
        assert ("baudrate" in connection.complaint) == baudrate
    assert connection.stop(0.9) == b""
    assert connection.stop(1.1) == connection.last_stop() == b"0:0:0;\n"


def confirmed(name, board, usb_id="", wheels=None):
    """The connection of a robot whose board speaks the protocol `name` ("auto" for any), at a board."""
    connection = Connection(wheels or official_wheels(), name, usb_id=usb_id)
    for at, data in talk(board):
        connection.feed(data, at)
    return connection


@pytest.mark.parametrize("robot, board, usb_id, fits", [
    ("robotont2", "robotont2", "", ""), ("robotont2", "robotont2", "0483:374b", ""),
    ("robotont3", "robotont3", "0483:5740", ""), ("robotont3", "robotont3", "", ""),
    ("auto", "checked", "", ""),
    ("robotont2", "checked", "", "thesis"), ("robotont2", "plain", "", "thesis"),
    ("robotont2", "robotont3", "0483:5740", "robotont3"), ("robotont3", "robotont2", "0483:374b", "robotont2"),
    ("robotont3", "checked", "", "thesis")])
def test_a_board_confirms_its_robot_or_is_refused_with_the_one_that_fits(robot, board, usb_id, fits):
    connection = confirmed(robot, board, usb_id)
    if not fits:
        assert (connection.protocol.name, connection.obstacle) == (board, "")
        return
    assert f"packets: {robot}): " in connection.obstacle
    assert connection.obstacle.endswith(f"robot:={fits}")
    assert connection.stop(10.0) == b""


@pytest.mark.parametrize("lines", [
    b"coders 0:0:0\r\n\r\nSetpoints 0:0:0\r\nEncoders 1:-2:3\r\n\r\n",  # June 2018
    b"Setpoint 1, 0.200000\r\n",  # August 2018 and later
    b"Speed[0]: 0.000000 (0.000000): \r\n",
    b"ODOM:0.100000:0.000000:0.000000:0.100000:0.000000:0.000000\r\nMOTOR 1: \r\n",
    b"MOTOR 1: \r\nODOM:0.100000:0.000000:0.000000:0.100000:0.000000:0.000000\r\n",
    b"".join(b"ODOM:%.6f:0.000000:0.000000:0.100000:0.000000:0.000000\r\n" % (0.01 * step) for step in range(60)),
])  # the last one moves by 0.1 s times its twist
@pytest.mark.parametrize("robot", ["auto", "robotont2"])
def test_firmware_from_before_2020_is_named_and_not_driven(robot, lines):
    connection = Connection(official_wheels(), robot)
    for line in lines.splitlines(keepends=True):
        connection.feed(line, 0.1)
    assert connection.obstacle.startswith("firmware from before March 2020: ")
    assert connection.encode(COMMAND, 10.0) in (b"", b"RS:0:0:0\n")


@pytest.mark.parametrize("speed", [0.0, 0.1])
def test_single_spoilt_lines_of_a_delivered_board_never_make_it_an_old_one(speed):
    connection = Connection(official_wheels(), "robotont2")
    for line in range(1200):
        spoilt = line % 10 == 9
        connection.feed(b"ODOM:%.6f:%d.000000:0.000000:%.6f:0.000000:0.000000\r\n" % (
            0.02 * speed * line, spoilt, speed), 0.02 * line)
    assert connection.protocol.dropped["inconsistent"] >= 120
    assert connection.obstacle == ""
    assert connection.encode(COMMAND, 30.0).startswith(b"MS:")


def test_a_board_that_is_flashed_with_the_robots_firmware_while_the_port_is_open_is_no_longer_refused():
    connection = Connection(official_wheels(), "robotont2")
    for board in ("checked", "robotont2"):
        for at, data in talk(board):
            connection.feed(data, at)
        assert bool(connection.obstacle) == (board == "checked")
    assert connection.encode(COMMAND, 5.0).startswith(b"MS:")


def test_the_thesis_robot_on_a_generation_2_board_is_refused_unless_its_file_names_that_board():
    connection = confirmed("auto", "robotont2", wheels=read_wheels(SHIPPED))
    assert connection.obstacle == (
        "the board speaks robotont2, which does not fit this robot (the robot has 0.125 m from centre to wheel, the "
        "board assumes 0.145 m, so turns would be wrong): robot:=robotont2")
    assert connection.stop(10.0) == b""
    assert "0.125 m" in confirmed("robotont2", "robotont2", wheels=read_wheels(SHIPPED)).complaint


@pytest.mark.parametrize("rate, spoken", [(100, "refused"), (75.5, "refused"), (74, "odd"), (56, "odd"), (54, ""),
                                          (50, ""),
                                          (46, ""), (45, "odd"), (34, "odd"), (33, "refused"), (5, "refused")])
def test_a_rate_that_is_not_the_robots_is_told_and_a_very_different_one_is_not_driven(rate, spoken):
    connection = Connection(official_wheels(), "plain")
    for packet in range(int(4.5 * rate) + 20):
        connection.feed(b"1:2:3;\n", packet / rate)
    assert bool(connection.obstacle) == (spoken == "refused")
    assert bool(connection.complaint) == (spoken == "odd")
    assert connection.encode(COMMAND, 9.0) == (b"0:0:0;\n" if spoken == "refused" else b"5:5:5;\n")
    if spoken:
        assert f"{rate:.0f} packets come per second instead of 50" in connection.obstacle + connection.complaint


@pytest.mark.parametrize("told", [True, False])
def test_a_board_that_says_its_rate_is_driven_however_late_its_packets_come(told):
    connection, sender = Connection(official_wheels(), "checked"), Sender(identity=identity())
    if told:
        connection.feed(sealed("identity " + identity()), 0.0)
    for packet in range(150):
        connection.feed(sender.packet([1, 2, 3]), packet * 0.04)
    assert bool(connection.obstacle) == (not told)
    assert bool(connection.complaint) == told


def test_a_computer_that_stood_still_refuses_no_board():
    connection = Connection(official_wheels(), "plain")
    now = 0.0
    for packet in range(1500):
        now = max(now, packet * 0.02 if packet % 300 else packet * 0.02 + 3.0)
        connection.feed(b"1:2:3;\n", now)
        assert connection.obstacle == ""
