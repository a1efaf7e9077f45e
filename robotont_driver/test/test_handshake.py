"""Which board it is: recognised from its first lines, on the bench."""

import pytest
from checked_bench import Sender
from protocol_bench import Bench, official_wheels

from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.protocol.handshake import Listener
from robotont_driver.protocol.protocols import NAMES, expect_protocol, make_protocol
from robotont_testing.robots import SHIPPED


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
    protocol = make_protocol("auto", official_wheels())
    protocol.usb_id = "0483:5740" if name == "robotont3" else "0483:374b"
    protocol.connect(opened)
    at = opened
    for at, data in talked:
        protocol.feed(data, at)
        if protocol.spoken is not protocol:
            break
        assert protocol.stop() == b""  # nothing is sent before
    assert protocol.spoken.name == protocol.spoken.description == name
    assert at - opened <= 1.0


def test_a_board_of_any_number_of_wheels_is_recognised_and_they_are_counted():
    listener = Listener()
    assert [listener.feed(b"1:2:3:4;\n") for _ in range(2)] == [None, "plain"]
    assert listener.fields == 4


def test_a_checked_packet_that_lost_its_trailer_makes_no_plain_board():
    protocol = make_protocol("auto", official_wheels())
    protocol.connect(0.0)
    (_, one), (_, two), *_ = talk("checked")
    protocol.feed(one.partition(b";")[0] + b";\n", 0.02)
    protocol.feed(two, 0.04)
    assert protocol.spoken.name == "checked"


def test_what_is_unknown_is_named_and_gets_plain_packets_after_a_second():
    protocol = make_protocol("auto", official_wheels())
    protocol.connect(0.0)
    for at, data, words, baudrate in (
            (0.0, b"", "no data from the board", False), (0.1, b"\xfe\x80\x80", r"\xfe\x80\x80", True),
            (0.2, b"\nhello, I am a printer\r\n", "of no known protocol: 'hello, I am a printer'", False),
            (0.3, b"\x8f\x00\xf0\n", r"\x8f\x00\xf0", True)):
        protocol.feed(data, at)
        assert words in protocol.spoken.complaint
        assert ("baudrate" in protocol.spoken.complaint) == baudrate
    assert protocol.stop() == b""
    protocol.tick(1.1)
    assert protocol.stop() == b"0:0:0;\n"
    assert "plain" in protocol.description


def confirmed(name, board, usb_id="", wheels=None):
    """The protocol that a robot of the protocol `name` ("auto" for any) uses on a board."""
    protocol = expect_protocol(name, wheels or official_wheels())
    protocol.usb_id = usb_id
    protocol.connect(0.0)
    for at, data in talk(board):
        protocol.feed(data, at)
    return protocol


@pytest.mark.parametrize("robot, board, usb_id, fits", [
    ("robotont2", "robotont2", "", ""), ("robotont2", "robotont2", "0483:374b", ""),
    ("robotont3", "robotont3", "0483:5740", ""), ("robotont3", "robotont3", "", ""),
    ("auto", "checked", "", ""),
    ("robotont2", "checked", "", "thesis"), ("robotont2", "plain", "", "thesis"),
    ("robotont2", "robotont3", "0483:5740", "robotont3"), ("robotont3", "robotont2", "0483:374b", "robotont2"),
    ("robotont3", "checked", "", "thesis")])
def test_a_board_confirms_its_robot_or_is_refused_with_the_one_that_fits(robot, board, usb_id, fits):
    protocol = confirmed(robot, board, usb_id)
    if not fits:
        assert (protocol.spoken.name, protocol.spoken.obstacle) == (board, "")
        return
    assert f"packets: {robot}): " in protocol.spoken.obstacle
    assert protocol.spoken.obstacle.endswith(f"robot:={fits}")
    protocol.tick(10.0)
    assert protocol.stop() == b""


@pytest.mark.parametrize("robot", ["auto", "robotont2"])
def test_the_firmware_of_june_2018_is_named_and_not_driven(robot):
    protocol = expect_protocol(robot, official_wheels())
    protocol.feed(b"coders 0:0:0\r\n\r\nSetpoints 0:0:0\r\nEncoders 1:-2:3\r\n\r\n", 0.1)
    protocol.tick(10.0)
    assert protocol.spoken.obstacle.startswith("firmware of June 2018: ")
    assert protocol.stop() == b""


def test_the_thesis_robot_on_a_generation_2_board_is_refused_unless_its_file_names_that_board():
    protocol = confirmed("auto", "robotont2", wheels=read_wheels(SHIPPED))
    assert protocol.spoken.obstacle == (
        "the board speaks robotont2, which does not fit this robot (the robot has 0.125 m from centre to wheel, the "
        "board assumes 0.145 m, so turns would be wrong): robot:=robotont2")
    assert protocol.stop() == b""
    assert "0.125 m" in confirmed("robotont2", "robotont2", wheels=read_wheels(SHIPPED)).spoken.complaint
