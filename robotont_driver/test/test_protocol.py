import json
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robotont_driver.protocol import (
    LONGEST_LINE,
    QUESTION,
    CheckedPacket,
    FeedbackReader,
    LineSplitter,
    Packet,
    PacketError,
    add_checksum,
    crc16,
    format_packet,
    parse_packet,
    spread,
)
from robotont_testing import places
from robotont_testing.stand_in_board import Board, Line

GOLDEN = json.loads(places.data("golden_packets.json").read_text())
REACH = 300


def reader(mode="auto", wheels=3):
    return FeedbackReader(wheels, REACH, mode)


def total(packets):
    return [sum(column) for column in zip(*packets)]


class TestGolden:
    @pytest.mark.parametrize("text, crc", GOLDEN["crc16"])
    def test_crc(self, text, crc):
        assert crc16(text.encode()) == int(crc, 16)

    @pytest.mark.parametrize("vector", GOLDEN["commands"], ids=lambda v: v["plain"].strip())
    def test_commands_are_written_to_the_letter(self, vector):
        plain = format_packet(vector["units"], vector["decimals"])
        assert plain == vector["plain"]
        assert add_checksum(plain).decode() == vector["checked"]

    @pytest.mark.parametrize("vector", GOLDEN["feedback"], ids=lambda v: v["packet"].strip())
    def test_feedback_is_read(self, vector):
        packet = CheckedPacket(vector["packet"].rstrip("\n"), len(vector["counts"]))
        assert list(packet.counts) == vector["counts"]
        assert packet.counter == vector["counter"]
        assert list(packet.totals) == vector["totals"]

    @pytest.mark.parametrize("vector", GOLDEN["feedback_with_status"], ids=lambda v: v["packet"].strip())
    def test_feedback_with_status_is_read(self, vector):
        packet = CheckedPacket(vector["packet"].rstrip("\n"), len(vector["counts"]))
        assert list(packet.counts) == vector["counts"]
        assert packet.counter == vector["counter"]
        assert list(packet.totals) == vector["totals"]
        status = packet.status
        assert [status.flags, status.missed, status.refused] == [vector["flags"], vector["missed"], vector["refused"]]
        assert list(status.wheels) == vector["faults"]

    @pytest.mark.parametrize("vector", GOLDEN["texts"], ids=lambda v: v["words"])
    def test_texts_are_read(self, vector):
        auto = reader()
        assert auto.feed(vector["line"].encode()) == []
        assert list(auto.health.notices) == [vector["words"]]

    def test_the_question_is_golden(self):
        assert QUESTION.decode() == GOLDEN["orders"][0]

    @pytest.mark.parametrize("line", GOLDEN["bad_feedback"])
    def test_bad_feedback_is_refused(self, line):
        checked = reader("checked")
        assert checked.feed(line.encode()) == []
        assert sum(checked.dropped.values()) == 1


class TestPlainPackets:
    @pytest.mark.parametrize("values, decimals, packet", [
        ((-0.001, 0.004, -0.0), 2, "0.00:0.00:0.00;\n"),
        ((-0.4, 0.6, 1.5), 0, "0:1:2;\n"),
        ((1, -2, 3, 4), 0, "1:-2:3:4;\n"),
    ])
    def test_format(self, values, decimals, packet):
        assert format_packet(values, decimals) == packet

    @given(st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=6), st.integers(0, 6))
    def test_what_is_written_is_read(self, values, decimals):
        packet = format_packet(values, decimals)
        assert parse_packet(packet, len(values)) == pytest.approx(values, abs=0.51 * 10 ** -decimals)

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


    @pytest.mark.parametrize("text, values, whole", [
        ("0:10.75:-10.75;\n", (0, 10.75, -10.75), False), ("1:-2:3;", (1, -2, 3), True),
        ("1:2:3;00:0001:0002:0003:0000\n", (1, 2, 3), True), ("0.00:0:0;rest", (0, 0, 0), False),
    ])
    def test_a_packet_is_its_values_and_keeps_its_text(self, text, values, whole):
        packet = parse_packet(text, 3)
        assert packet == values
        assert packet.text == text.partition(";")[0] + ";\n"
        assert packet.is_whole == whole

    def test_counts_become_the_packet_that_writes_them(self):
        assert Packet((1, -2, 3)).text == "1:-2:3;\n"


class TestLineSplitter:
    @given(st.binary(max_size=2000), st.lists(st.integers(0, 300), max_size=20))
    def test_lines_do_not_depend_on_how_the_bytes_arrive(self, data, cuts):
        whole = LineSplitter()
        expected = whole.feed(data)
        pieces = LineSplitter()
        lines = []
        for cut in cuts:
            lines += pieces.feed(data[:cut])
            data = data[cut:]
        lines += pieces.feed(data)
        assert lines == expected
        assert pieces.overlong == whole.overlong

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


class Sender:
    """Feedback packets of a board that drives at random."""

    def __init__(self, wheels=3, start=0, seed=1):
        self.board = Board("unused", wheels, start_totals=start)
        self.random = random.Random(seed)
        self.sent = []

    def packet(self, counts=None):
        board = self.board
        counts = counts or [self.random.randint(-200, 200) for _ in range(board.wheels)]
        board.motors.follow(counts)
        self.sent.append(tuple(counts))
        data = board.packet(counts)
        board.counter = (board.counter + 1) % 256
        return data


class TestCheckedFeedback:
    def test_totals_do_not_start_at_zero(self):
        sender, checked = Sender(start=0xFFF0), reader()
        assert checked.feed(sender.packet() + sender.packet()) == sender.sent

    @pytest.mark.parametrize("lost", [1, 2, 7, 100])
    def test_lost_packets_are_made_up_for(self, lost):
        sender, checked = Sender(), reader()
        read = checked.feed(sender.packet())
        for _ in range(lost):
            sender.packet()
        read += checked.feed(sender.packet())
        assert len(read) == len(sender.sent)
        assert total(read) == total(sender.sent)
        assert read[-1] == sender.sent[-1]
        assert checked.repaired == lost
        assert checked.restarts == 0

    def test_a_gap_too_long_to_tell_begins_anew(self):
        sender, checked = Sender(), reader()
        checked.feed(sender.packet())
        for _ in range(200):
            sender.packet()
        assert checked.feed(sender.packet()) == []
        assert checked.feed(sender.packet()) == sender.sent[-2:]
        assert checked.restarts == 1
        assert checked.repaired == 0

    def test_a_restart_is_noticed_and_nothing_is_repaired(self):
        sender, checked = Sender(start=0x4000), reader()
        for _ in range(100):
            checked.feed(sender.packet())
        again = Sender(seed=2)
        read = checked.feed(again.packet()) + checked.feed(again.packet()) + checked.feed(again.packet())
        assert read == again.sent
        assert checked.restarts == 1
        assert checked.repaired == 0

    def test_a_banner_tells_of_a_restart_even_where_counters_happen_to_fit(self):
        sender, checked = Sender(), reader()
        for _ in range(200):
            checked.feed(sender.packet([1, 1, 1]))
        again = Sender()
        read = checked.feed(b"# robotont_firmware 1.0\n" + again.packet([5, 5, 5]))
        assert read == [(5, 5, 5)]
        assert checked.restarts == 1
        assert checked.repaired == 0
        assert checked.banner == "robotont_firmware 1.0"

    def test_a_valid_packet_that_fits_nothing_is_not_believed_alone(self):
        sender, checked = Sender(), reader()
        read = checked.feed(sender.packet())
        stray = Sender(start=0x5000, seed=9)
        read += checked.feed(stray.packet())
        read += checked.feed(sender.packet())
        assert read == sender.sent
        assert checked.dropped == {"inconsistent": 1}
        assert checked.restarts == 0

    def test_totals_that_jump_are_noticed_even_where_the_counter_goes_on(self):
        sender, checked = Sender(), reader()
        read = checked.feed(sender.packet())
        sender.board.offset += 5000
        read += checked.feed(sender.packet())
        assert read == sender.sent[:1]
        read += checked.feed(sender.packet())
        assert read == sender.sent
        assert checked.restarts == 1
        assert checked.repaired == 0

    def test_the_same_packet_twice_counts_once(self):
        sender, checked = Sender(), reader()
        data = sender.packet() + sender.packet()
        packet = sender.packet()
        assert checked.feed(data + packet + packet + sender.packet()) == sender.sent
        assert checked.dropped == {"repeated": 1}

    def test_counts_beyond_the_motors_are_dropped(self):
        sender, checked = Sender(), reader()
        checked.feed(sender.packet())
        assert checked.feed(sender.packet([REACH + 1, 0, 0])) == []
        assert checked.dropped == {"reach": 1}

    def test_the_edges_of_missed_ticks_in_one_packet_are_counted_once(self):
        sender, checked = Sender(), reader()
        checked.feed(sender.packet())
        sender.board.counter += 2  # two ticks missed: the board puts the edges of three periods into one packet
        assert checked.feed(sender.packet([REACH - 1, 1 - REACH, 0]) + sender.packet([9, 9, 9]))[-1] == (9, 9, 9)
        sender.board.counter += 2
        assert checked.feed(sender.packet([2 * REACH, 0, 0])) == [], "more than a motor can make in one period"
        read = checked.feed(sender.packet([5, 5, 5]))
        assert [sum(wheel) for wheel in zip(*read)] == [2 * REACH + 5, 5, 5], "made up for from the totals"
        assert len(read) == 4
        assert checked.restarts == 0

    def test_faults_are_heard_and_forgotten(self):
        checked = reader()
        checked.feed(b"# fault motor 1\n")
        assert checked.fault == "fault motor 1"
        checked.feed(b"# fault cleared\n")
        assert checked.fault == ""

    @pytest.mark.parametrize("kind, wheels", [
        ("corrupt", 3), ("drop", 3), ("double", 3), ("all", 3), ("all", 4), ("all", 5)])
    def test_one_percent_of_bad_bytes_costs_no_count_and_passes_no_wrong_packet(self, kind, wheels):
        sender, checked, line = Sender(wheels, start=12345), reader(wheels=wheels), Line(seed=wheels)
        for fate in ("corrupt", "drop", "double") if kind == "all" else (kind,):
            setattr(line, fate, 0.01)
        read = checked.feed(b"\n" + sender.packet())
        for _ in range(20000):
            for data in line.pass_on(sender.packet()):
                read += checked.feed(data)
        read += checked.feed(b"\n" + sender.packet())
        assert total(read) == total(sender.sent)
        assert len(read) == len(sender.sent)
        assert checked.restarts == 0
        # a packet is passed on as sent, or it is a repaired one
        different = sum(packet != sent for packet, sent in zip(read, sender.sent))
        assert different <= checked.repaired
        assert checked.repaired > 500

    @given(st.data())
    def test_counts_are_conserved_under_any_loss(self, data):
        sender, checked = Sender(), reader()
        read = checked.feed(sender.packet())
        for _ in range(data.draw(st.integers(0, 30))):
            for _ in range(data.draw(st.integers(0, 100))):
                sender.packet()
            read += checked.feed(sender.packet())
        assert total(read) == total(sender.sent)
        assert len(read) == len(sender.sent)

    @given(st.lists(st.integers(-30000, 30000), min_size=1, max_size=5), st.integers(1, 200))
    def test_spread_sums_to_the_counts_and_is_even(self, counts, periods):
        packets = spread(counts, periods)
        assert len(packets) == periods
        assert total(packets) == counts
        for column in zip(*packets):
            assert max(column) - min(column) <= 1

    def test_spread_over_nothing(self):
        assert spread((0, 0, 0), 0) == []


class TestModes:
    def test_auto_takes_plain_packets_until_a_checked_one_comes(self):
        auto, sender = reader(), Sender()
        assert auto.feed(b"\n1:2:3;\n") == [(1, 2, 3)]
        assert not auto.checked
        auto.feed(sender.packet())
        assert auto.checked
        assert auto.feed(b"1:2:3;\n") == []
        assert auto.dropped == {"trailer": 1}

    def test_a_new_connection_decides_anew(self):
        auto = reader()
        auto.feed(Sender().packet())
        auto.connect()
        assert not auto.checked
        assert auto.feed(b"\n1:2:3;\n") == [(1, 2, 3)]

    def test_auto_takes_no_broken_checked_packet_for_a_plain_one(self):
        auto = reader()
        assert auto.feed(b"\n1:2:3;00:0001:0002:0003:0000\n") == []
        assert auto.dropped == {"checksum": 1}

    def test_plain_ignores_what_stands_behind_the_semicolon(self):
        plain = reader("plain")
        assert plain.feed(b"\n1:2:3;00:0001:0002:0003:0000\n4:5:6;\n") == [(1, 2, 3), (4, 5, 6)]

    def test_checked_never_takes_a_plain_packet(self):
        assert reader("checked").feed(b"\n1:2:3;\n") == []

    def test_decimals_are_no_counts_unless_asked_for(self):
        strict = reader("plain")
        assert strict.feed(b"\n1:2.5:3;\n1:2:3.0;\n1:2:3;\n") == [(1, 2, 3)]
        assert strict.dropped == {"decimals": 2}
        lenient = FeedbackReader(3, REACH, "plain", decimals=True)
        assert [packet.text for packet in lenient.feed(b"\n0:10.75:-10.75;\n")] == ["0:10.75:-10.75;\n"]

    @pytest.mark.parametrize("mode", ["plain", "auto"])
    def test_numbers_without_end_are_dropped(self, mode):
        plain = reader(mode)
        for digits in (8, 250, 310, 5000):
            assert plain.feed(b"\n" + b"1" * digits + b".0:0:0;\n" + b"-" + b"9" * digits + b":0:0;\n") == []
        assert plain.feed(b"1:2:3;\n") == [(1, 2, 3)]

    def test_the_first_line_may_lack_its_head(self):
        for mode in ("plain", "auto"):
            plain = reader(mode)
            assert plain.feed(b"2:2:3;\n1:2:3;\r\n") == [(1, 2, 3)]
            assert plain.dropped == {"first line": 1}


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
        auto = FeedbackReader(3, REACH, "auto", 50.0)
        auto.feed(modern_packet("000000000") + sealed("identity " + WHO.format(wheels, rate)))
        assert words in auto.obstacle
        assert auto.encode("5:5:5;\n") == add_checksum("0:0:0;\n")

    def test_two_packets_of_another_robot_tell_its_wheels(self):
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


class TestAnyBytes:
    @given(st.lists(st.binary(max_size=400)), st.sampled_from(["auto", "plain", "checked"]))
    def test_nothing_raises(self, pieces, mode):
        any_reader = reader(mode)
        for piece in pieces:
            for packet in any_reader.feed(piece):
                assert len(packet) == 3
                assert max(map(abs, packet)) <= REACH

    @given(st.text(alphabet="0123456789-.:;#ABCDEF \n\r", max_size=500), st.sampled_from(["auto", "plain", "checked"]))
    def test_nothing_that_looks_like_packets_raises(self, text, mode):
        any_reader = reader(mode)
        packets = any_reader.feed(text.encode())
        assert any_reader.packets == len(packets)

    def test_garbage_before_the_first_packet(self):
        sender, auto = Sender(), reader()
        garbage = bytes(random.Random(3).randrange(256) for _ in range(5000))
        auto.feed(garbage + b"\n")
        assert auto.feed(sender.packet() + sender.packet())[-2:] == sender.sent
        assert sum(auto.dropped.values()) > 0
