"""The board's reports about itself, and what the reader lets out to it: faults, identity, zeros for an unknown one."""

import math

import pytest
from feedback_bench import reader

from robotont_driver.protocol.checksum import add_checksum, crc16
from robotont_driver.protocol.dialects.checked import Checked
from robotont_driver.protocol.feedback_reader import QUESTION
from robotont_driver.robots.robot_folder import read_robot
from robotont_testing.stand_in_board import identity, sealed

COMMAND = "5:5:5;\n"
DRIVES, ASKS, STANDS = add_checksum(COMMAND), QUESTION + add_checksum("0:0:0;\n"), add_checksum("0:0:0;\n")


def modern_packet(status, counter=0, wheels=3):
    """A resting board's packet with a status field's text, bytes."""
    body = ":".join("0" * wheels) + f";{counter:02X}" + ":0000" * wheels + f":{status}:"
    return body.encode() + b"%04X\n" % crc16(body.encode())


def test_a_fault_stands_in_every_packet_and_ends_with_it():
    auto = reader()
    for counter, (status, words) in enumerate((("020000030", "wheel 1: counts against its direction"),
                                               ("000000000", ""), ("000000010", "wheel 1: "))):
        auto.feed(modern_packet(status, counter))
        assert words in auto.health.fault
        assert bool(words) == bool(auto.health.fault)
    auto.connect()
    assert auto.health.fault == "", "of a board that is not known"
    for words, fault in ((b"fault motor 1", "fault motor 1"), (b"fault cleared", "")):  # firmware before 2.0
        auto.feed(b"# " + words + b"\n")
        assert auto.health.fault == fault


def test_the_battery_of_our_own_board_is_a_reading_once_a_second():
    dialect = Checked(read_robot("").wheels, 300)
    taken = []
    for counter in range(150):
        dialect.feed(modern_packet("0000000004D231", counter), counter / 50)
        taken += dialect.take_readings()
    assert [(power.voltage, math.isnan(power.current)) for power in taken] == [(12.34, True)] * 3
    assert dialect.report_board()[2]["battery [V]"] == "12.34"
    for counter in range(150, 250):
        dialect.feed(modern_packet("00000000000031", counter), counter / 50)
    assert dialect.take_readings() == [], "not measured"
    assert dialect.packets == 250
    dialect.feed(modern_packet("0000000004D23", 250), 5.0)
    assert dialect.dropped == {"fields": 1}, "a status of no known length"


def test_an_unknown_board_is_asked_and_gets_zeros():
    auto = reader()
    assert auto.encode(COMMAND) == COMMAND.encode()
    for _ in range(2):
        auto.feed(modern_packet("000000000"))
        assert auto.encode(COMMAND) == ASKS
        auto.feed(sealed("identity " + identity()))
        assert auto.encode(COMMAND) == DRIVES
        auto.connect()
    auto.feed(sealed(identity()) + modern_packet("030000000"))  # a start makes the board known, too
    assert auto.encode(COMMAND) == DRIVES
    assert auto.health.identity.profile == "ours"


@pytest.mark.parametrize("wheels, rate, words", [(4, 50, "4 wheels"), (3, 100, "100 Hz")])
def test_another_robot_is_not_driven(wheels, rate, words):
    auto = reader()
    auto.feed(modern_packet("000000000") + sealed("identity " + identity(wheels, rate)))
    assert words in auto.health.obstacle
    assert auto.encode(COMMAND) == STANDS


def test_two_packets_of_another_robot_show_its_wheels():
    auto = reader()
    auto.feed(modern_packet("0000000000", 0, 4))
    assert auto.health.obstacle == "", "one may be an accident"
    assert auto.encode(COMMAND) == ASKS, "but drives nothing"
    auto.feed(modern_packet("0000000000", 1, 4))
    assert "4 wheels" in auto.health.obstacle
    auto.feed(modern_packet("000000000", 2))
    assert auto.health.obstacle == ""
