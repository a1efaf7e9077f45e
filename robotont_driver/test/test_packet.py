"""Packets as text and bytes: golden vectors, plain packets, lines, and counts spread over packets."""

import json

import pytest
from checked_bench import Reader

from robotont_driver.protocol.checked import CheckedPacket, add_checksum, crc16
from robotont_driver.protocol.plain import parse_packet
from robotont_driver.protocol.protocol import LONGEST_LINE, LineSplitter, Packet, PacketError, format_packet
from robotont_testing import places

GOLDEN = json.loads(places.data("golden_packets.json").read_text())


class TestGolden:
    @pytest.mark.parametrize("text, crc", GOLDEN["crc16"])
    def test_crc(self, text, crc):
        assert crc16(text.encode()) == int(crc, 16)

    @pytest.mark.parametrize("vector", GOLDEN["commands"], ids=lambda v: v["plain"].strip())
    def test_commands_are_written_to_the_letter(self, vector):
        plain = format_packet(vector["units"], vector["decimals"])
        assert plain == vector["plain"]
        assert add_checksum(plain).decode() == vector["checked"]

    @pytest.mark.parametrize("vector", [*GOLDEN["feedback"], *GOLDEN["feedback_with_status"],
                                        *GOLDEN["feedback_with_battery"]])
    def test_feedback_is_read(self, vector):
        packet = CheckedPacket(vector["packet"].rstrip("\n"), len(vector["counts"]))
        assert (list(packet.counts), packet.counter) == (vector["counts"], vector["counter"])
        assert list(packet.totals) == vector["totals"]
        status = packet.status
        assert (status is None) == ("flags" not in vector)
        if status:
            found = [status.flags, status.missed, status.refused, list(status.wheels)]
            assert found == [vector[name] for name in ("flags", "missed", "refused", "faults")]
            assert (status.voltage, status.load) == (vector.get("battery", 0) / 100, vector.get("load", 0))

    @pytest.mark.parametrize("line", GOLDEN["bad_feedback"])
    def test_bad_feedback_is_refused(self, line):
        checked = Reader()
        assert checked.feed(line.encode()) == []
        assert sum(checked.dropped.values()) == 1


class TestPlainPackets:
    @pytest.mark.parametrize("text, kind, words", [
        ("1:2:3", "fields", "no semicolon"), ("", "fields", "no semicolon"),
        ("1:2;", "fields", "2 fields instead of 3"),
        ("1:2:3:4;", "fields", "4 fields instead of 3"), ("1::3;", "number", "'' is not a number"),
        ("1:2:nan;", "number", "'nan'"), ("1:2:inf;", "number", "'inf'"), ("1:2:1e3;", "number", "'1e3'"),
        ("1:2:+3;", "number", "'+3'"), ("1:2: 3;", "number", "' 3'"), ("1:2:1_0;", "number", "'1_0'"),
        ("1:2:3.;", "number", "'3.'"), ("1:2:.5;", "number", "'.5'"), ("1:2:--3;", "number", "'--3'"),
        ("1:2:٣;", "number", "'٣'"),
        ("1:2:12345678;", "number", "'12345678' is not a number of up to 7 digits"),
        ("1:2:0.1234567890;", "number", "'0.1234567890'"),
        ("1:2:" + "9" * 200 + ";", "number", ""), ("1" * 310 + ".0:0:0;", "overlong", "317 characters"),
        ("9" * 10 ** 6, "overlong", "1000000 characters, allowed: a line of 256"),
        (";", "number", "''"), ("x1:2:3;", "number", "'x1'"),
    ], ids=lambda value: repr(value)[:30])
    def test_what_is_no_packet_is_explained(self, text, kind, words):
        with pytest.raises(PacketError) as raised:
            parse_packet(text, 3)
        assert raised.value.kind == kind
        assert words in str(raised.value)

    @pytest.mark.parametrize("text, values", [
        ("0:10.75:-10.75;\n", (0, 10.75, -10.75)), ("1:-2:3;", (1, -2, 3)),
        ("1:2:3;00:0001:0002:0003:0000\n", (1, 2, 3)), ("0.00:0:0;rest", (0, 0, 0)), ("1:2:3;7 \n", (1, 2, 3)),
        ("1:2:3;" + "9" * 16, (1, 2, 3)), ("1:2:3;-1\n", (1, 2, 3)), ("1:2:3;٣\n", (1, 2, 3)),
    ])
    def test_a_packet_is_its_values_and_keeps_its_text(self, text, values):
        packet = parse_packet(text, 3)
        assert packet == values
        assert packet.text == text.partition(";")[0] + ";\n"
        assert packet.number is None

    @pytest.mark.parametrize("number", [None, 0, 1234, 10 ** 14])
    @pytest.mark.parametrize("commanded", [None, Packet((1.5, -2, 0.25), "1.5:-2:0.25;\n")])
    @pytest.mark.parametrize("periods", [1.0, 1.25])
    def test_number_command_and_periods_are_told_and_read_behind_the_semicolon(self, number, commanded, periods):
        packet = Packet((1, -2, 3), number=number, commanded=commanded)
        packet.periods = periods
        text = packet.told()
        more = (";1.5:-2:0.25;" if commanded else ";" * (periods != 1.0)) + "1.250" * (periods != 1.0)
        assert text == f"1:-2:3;{'' if number is None else number}{more}\n"
        for words in (text, text.strip()):
            again = parse_packet(words, 3)
            assert (again, again.number, again.text) == ((1, -2, 3), number, "1:-2:3;\n")
            assert again.commanded == (commanded and [*commanded])
            assert again.periods == periods

    def test_a_command_of_other_wheels_is_none(self):
        assert parse_packet("1:2:3;5;1:2;\n", 3).commanded is None

    def test_the_longest_packet_is_read_with_all_that_is_told(self):
        command = Packet([-999.999] * 16, format_packet([-999.999] * 16, 3))
        packet = Packet([-9999] * 16, number=10 ** 14, commanded=command)
        assert parse_packet(packet.told(), 16).commanded == [-999.999] * 16


class TestLineSplitter:
    def test_a_line_without_end_is_dropped_up_to_the_next_newline(self):
        splitter = LineSplitter()
        for _ in range(1000):
            assert splitter.feed(b"x" * 100) == []
        assert splitter.feed(b"tail\ngood\n") == [b"good"]
        assert splitter.overlong == 1

    def test_the_longest_line_passes(self):
        splitter = LineSplitter()
        assert splitter.feed(b"x" * LONGEST_LINE + b"\n" + b"y" * (LONGEST_LINE + 1) + b"\n") == [b"x" * LONGEST_LINE]
        assert splitter.overlong == 1
