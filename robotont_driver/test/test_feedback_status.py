"""The board's reports about itself, and what the reader lets out to it: faults, identity, zeros for an unknown one."""

import pytest
from feedback_bench import reader

from robotont_driver.protocol.feedback_reader import QUESTION
from robotont_driver.protocol.packet import add_checksum, crc16


def modern_packet(status, counter=0, wheels=3):
    """A resting board's packet with a status field's text, bytes."""
    body = ":".join("0" * wheels) + f";{counter:02X}" + ":0000" * wheels + f":{status}:"
    return body.encode() + b"%04X\n" % crc16(body.encode())


def sealed(words):
    line = f"# {words};".encode()
    return line + b"%04X\n" % crc16(line)


WHO = "robotont_firmware 2.0.0 wheels {} rate {} units edges/period profile ours reset power"


class TestWhatTheBoardSaysOfItself:
    def test_a_fault_stands_in_every_packet_and_ends_with_it(self):
        auto = reader()
        auto.feed(modern_packet("020000030"))
        assert "wheel 1: counts against its direction" in auto.fault
        auto.feed(modern_packet("000000000", 1))
        assert auto.fault == ""
        auto.feed(modern_packet("000000010", 2))
        auto.connect()
        assert auto.fault == "", "of a board that is not known"

    def test_a_spoilt_word_is_none(self):
        auto = reader()
        auto.feed(modern_packet("000000000") + sealed("crash X").replace(b"X", b"Y"))
        auto.feed(sealed("crash X")[:-3] + b"0\n" + b"# robotont_firmware\n")
        assert list(auto.health.notices) == []
        assert auto.dropped == {"checksum": 3}

    def test_an_unknown_board_is_asked_and_gets_zeros(self):
        auto = reader()
        command = "5:5:5;\n"
        assert auto.encode(command) == b"5:5:5;\n"
        auto.feed(modern_packet("000000000"))
        assert auto.encode(command) == QUESTION + add_checksum("0:0:0;\n")
        auto.feed(sealed("identity " + WHO.format(3, 50)))
        assert auto.encode(command) == add_checksum(command)
        auto.connect()
        auto.feed(modern_packet("000000000"))
        assert auto.encode(command).startswith(QUESTION)

    @pytest.mark.parametrize("wheels, rate, words", [(4, 50, "4 wheels"), (3, 100, "100 Hz")])
    def test_another_robot_is_not_driven(self, wheels, rate, words):
        auto = reader()
        auto.feed(modern_packet("000000000") + sealed("identity " + WHO.format(wheels, rate)))
        assert words in auto.obstacle
        assert auto.encode("5:5:5;\n") == add_checksum("0:0:0;\n")

    def test_two_packets_of_another_robot_show_its_wheels(self):
        auto = reader()
        auto.feed(modern_packet("0000000000", 0, 4))
        assert auto.obstacle == "", "one may be an accident"
        assert auto.encode("5:5:5;\n") == QUESTION + add_checksum("0:0:0;\n"), "but drives nothing"
        auto.feed(modern_packet("0000000000", 1, 4))
        assert "4 wheels" in auto.obstacle
        auto.feed(modern_packet("000000000", 2))
        assert auto.obstacle == ""

    def test_a_start_makes_the_board_known(self):
        auto = reader()
        auto.feed(sealed(WHO.format(3, 50)) + modern_packet("030000000"))
        assert auto.encode("5:5:5;\n") == add_checksum("5:5:5;\n")
        assert auto.health.identity.profile == "ours"
