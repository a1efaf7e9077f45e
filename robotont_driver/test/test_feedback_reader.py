"""Feedback that lost bytes or packets: what is dropped, what is repaired, which modes take what."""

import random

import pytest
from feedback_bench import REACH, Sender, reader, total
from hypothesis import given
from hypothesis import strategies as st

from robotont_testing.stand_in_board import Line


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

    def test_after_too_long_a_gap_it_begins_anew(self):
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

    def test_a_banner_shows_a_restart_even_where_counters_happen_to_fit(self):
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

    def test_decimals_are_no_counts(self):
        strict = reader("plain")
        assert strict.feed(b"\n1:2.5:3;\n1:2:3.0;\n1:2:3;\n") == [(1, 2, 3)]
        assert strict.dropped == {"decimals": 2}

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
