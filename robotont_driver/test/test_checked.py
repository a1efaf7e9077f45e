"""The protocol of this project's board: what is dropped, what is repaired, and what is let out to which board."""

import math

import pytest
from checked_bench import REACH, Reader, Sender
from hypothesis import given
from hypothesis import strategies as st

from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.protocol.checked import QUESTION, Checked, add_checksum, crc16
from robotont_driver.protocol.connection import Connection
from robotont_driver.protocol.protocol import Packet
from robotont_testing.robots import SHIPPED
from robotont_testing.stand_in_board import PERIOD, identity, sealed

COMMAND = Packet([5, 5, 5])
DRIVES, STANDS, ZEROS = add_checksum("5:5:5;\n"), add_checksum("0:0:0;\n"), Packet([0, 0, 0])


def state(checked):
    return checked.restarts, checked.repaired, dict(checked.dropped)


def resting(status, counter=0, wheels=3):
    """A resting board's packet with a status field's text, bytes."""
    body = ":".join("0" * wheels) + f";{counter:02X}" + ":0000" * wheels + f":{status}:"
    return body.encode() + b"%04X\n" % crc16(body.encode())


def test_a_banner_shows_a_restart_even_where_counters_happen_to_fit():
    sender, checked = Sender(), Reader()
    for _ in range(200):
        checked.feed(sender.packet([1, 1, 1]))
    for restarts in (1, 2):
        packet, = checked.feed(b"# robotont_firmware 1.0\n" + Sender().packet([5, 5, 5]))
        assert (packet, packet.number) == ((5, 5, 5), 0)
        assert state(checked) == (restarts, 0, {})
    assert checked.health.banner == "robotont_firmware 1.0"


def test_a_valid_packet_that_fits_nothing_is_not_believed_alone():
    sender, checked = Sender(), Reader()
    read = checked.feed(sender.packet() + Sender(start=0x5000, seed=9).packet()) + checked.feed(sender.packet())
    assert read == sender.sent
    assert state(checked) == (0, 0, {"inconsistent": 1})


@pytest.mark.parametrize("old", [1, 50, 120])
def test_old_lines_that_come_again_are_no_restart_and_drive_nobody(old):
    sender, checked = Sender(), Reader()
    lines = [sender.packet() for _ in range(200)]
    read = checked.feed(b"".join(lines[:50]))
    for line in lines[50:]:
        Sender.now += PERIOD
        read += checked.feed(line)
    read += checked.feed(b"".join(lines[-old:]))
    read += checked.feed(sender.packet())
    assert read == sender.sent
    assert state(checked)[:2] == (0, 0)


@given(st.lists(st.integers(0, 100), max_size=30))
def test_counts_are_conserved_under_any_loss(losses):
    sender, checked = Sender(start=0xFFF0), Reader()
    read = checked.feed(sender.packet())
    for lost in losses:
        for _ in range(lost):
            sender.packet()
        read += checked.feed(sender.packet())
        assert read[-1] == sender.sent[-1]
    assert [packet.number for packet in read] == list(range(len(read)))
    assert [sum(column) for column in zip(*read)] == [sum(column) for column in zip(*sender.sent)]
    assert len(read) == len(sender.sent)
    assert state(checked) == (0, sum(losses), {})


@pytest.mark.parametrize("rate, held, lost", [(50, 10, 30), (50, 87, 38), (200, 0, 280), (200, 280, 0), (200, 80, 240)])
def test_what_is_lost_behind_a_queue_or_while_the_counter_goes_round_is_recovered(rate, held, lost):
    sender, checked, read = Sender(), Checked(read_wheels({**SHIPPED, "pidControlFrequency": rate})), []
    for at, line in enumerate([sender.packet([20, 20, -20]) for _ in range(600)]):
        if not 0 <= at - 100 - held < lost:
            read += checked.feed(line, max(at, 100 + held + lost if at >= 100 else 0) / rate)
    assert read == sender.sent
    assert [packet.number for packet in read] == list(range(600))
    assert state(checked) == (0, lost, {})


@pytest.mark.parametrize("edges, lost", [(64, 110), (64, 150), (4096, 2), (4096, 20)])
def test_behind_a_gap_whose_counts_cannot_be_known_the_next_packet_decides(edges, lost):
    """And not one seconds later, when the board might have started in the gap: packets were refused until then."""
    checked = Checked(read_wheels({**SHIPPED, "encoderEdgesPerMotorRevolution": edges}))
    sender, read = Sender(), []
    for at, line in enumerate([sender.packet() for _ in range(32 + lost)]):
        if not 0 <= at - 30 < lost:
            read += checked.feed(line, at * PERIOD)
    assert read == sender.sent[:30] + sender.sent[-2:]
    assert state(checked) == (1, 0, {})


def test_lines_that_come_twice_count_once_though_all_come_late():
    """Two in a row passed for a board that begins anew, where an encoder's counts are not known behind two periods."""
    checked = Checked(read_wheels({**SHIPPED, "encoderEdgesPerMotorRevolution": 4096}))
    sender, read = Sender(), []
    lines = [sender.packet() for _ in range(60)]
    for at, line in enumerate([*lines[:50], *lines[47:]]):
        read += checked.feed(line, (at + 6 * (at > 40)) * PERIOD if at < 50 else (at + 3) * PERIOD)
    assert read == sender.sent
    assert state(checked)[0] == 0


def test_each_line_that_is_no_packet_is_counted_by_its_kind():
    sender, checked = Sender(), Reader()
    packet = sender.packet()
    assert checked.feed(packet + packet + sender.packet()) == sender.sent, "the same twice counts once"
    assert checked.feed(sender.packet([REACH + 1, 0, 0])) == []
    for line in (b"1:2:3;\n", b"1:2:3;00:0001:0002:0003:0000\n", b"\xff\n", b"1" * 5000 + b"\n",
                 sealed("identity").replace(b"i", b"x"), resting("0000000004D23")):
        assert checked.feed(line) == []
        assert checked.newest_error
    assert state(checked) == (0, 0, {"repeated": 1, "reach": 1, "trailer": 1, "checksum": 2, "not ascii": 1,
                                     "overlong": 1, "fields": 1})
    assert checked.packets == 2


def test_a_fault_stands_in_every_packet_and_ends_with_it():
    checked = Reader()
    for counter, (status, words) in enumerate((("020000030", "wheel 1: counts against its direction"),
                                               ("000000000", ""), ("000000010", "wheel 1: "))):
        checked.feed(resting(status, counter))
        assert words in checked.health.fault
        assert bool(words) == bool(checked.health.fault)
    assert checked.feed(b"# fault cleared\n") == []
    assert checked.health.fault, "a board of today says nothing without a checksum"
    checked = Reader()
    checked.feed(b"# fault motor 1\n")
    assert "the board has reported: fault motor 1" in checked.report_board()[1], "firmware before 2.0"


def test_the_battery_of_our_own_board_is_a_reading_once_a_second():
    for status, readings in (("0000000004D231", 3), ("00000000000031", 0)):  # the latter: not measured
        checked = Reader()
        for counter in range(149):
            Sender.now += 0.02
            checked.feed(resting(status, counter))
        assert [(power.voltage, math.isnan(power.current)) for power in checked.readings] == [(12.34, True)] * readings


def test_an_unknown_board_is_asked_and_gets_only_the_zeros_that_are_commanded():
    checked = Reader()
    assert (checked.encode(COMMAND), checked.drives) == (b"", False), "nothing has come"
    assert checked.encode(ZEROS) == checked.stop() == STANDS
    checked.feed(Sender().packet())
    assert (checked.encode(COMMAND), checked.drives) == (DRIVES, True), "firmware before 2.0"
    checked = Reader()
    checked.feed(resting("000000000"))
    assert (checked.encode(COMMAND), checked.drives) == (QUESTION, False)
    assert checked.encode(ZEROS) == QUESTION + STANDS
    checked.feed(sealed("identity " + identity()))
    assert checked.encode(COMMAND) == DRIVES
    checked = Reader()
    checked.feed(sealed(identity()) + resting("030000000"))  # a start makes the board known, too
    assert checked.encode(COMMAND) == DRIVES
    assert checked.health.identity.profile == "ours"


@pytest.mark.parametrize("status", ["020000000", "010000000"])
def test_the_link_itself_sends_no_zeros_to_a_board_that_waits_for_them_or_stops_by_itself(status):
    checked = Reader()
    checked.feed(resting(status))  # restarted, or a wheel has a fault; timed out
    assert checked.stop() == b""
    checked.feed(sealed("identity " + identity()))
    assert (checked.stop(), checked.encode(COMMAND), checked.encode(ZEROS)) == (b"", DRIVES, STANDS)
    checked.feed(resting("000000000", counter=1))
    assert checked.stop() == STANDS


@pytest.mark.parametrize("wheels, rate, words", [(4, 50, "4 wheels"), (3, 100, "100 Hz")])
def test_another_robot_is_not_driven(wheels, rate, words):
    connection = Connection(read_wheels(SHIPPED), "checked")
    connection.feed(resting("000000" + "0" * wheels, wheels=wheels), 0.0)
    assert connection.encode(COMMAND, 0.0) == QUESTION
    connection.feed(sealed("identity " + identity(wheels, rate)), 0.1)
    assert words in connection.obstacle
    assert connection.encode(COMMAND, 0.1) == STANDS


def test_one_packet_of_another_robot_may_be_an_accident():
    checked = Reader()
    for status, wheels in (("0000000000", 4), ("000000000", 3)):
        checked.feed(resting(status, wheels=wheels))
        assert checked.encode(COMMAND) == QUESTION
    checked.feed(sealed("identity " + identity()))
    checked.feed(resting("0000000000", wheels=4))
    assert checked.encode(COMMAND) == DRIVES
