"""Feedback that lost bytes or packets: what is dropped, what is repaired, which modes take what."""

import pytest
from feedback_bench import REACH, Sender, reader, total
from hypothesis import given
from hypothesis import strategies as st

SPOILT = b"1:2:3;00:0001:0002:0003:0000\n"


def state(checked):
    return checked.lost.restarts, checked.lost.repaired, dict(checked.dropped)


def test_a_banner_shows_a_restart_even_where_counters_happen_to_fit():
    sender, checked = Sender(), reader()
    for _ in range(200):
        checked.feed(sender.packet([1, 1, 1]))
    for restarts in (1, 2):
        assert checked.feed(b"# robotont_firmware 1.0\n" + Sender().packet([5, 5, 5])) == [(5, 5, 5)]
        assert state(checked) == (restarts, 0, {})
    assert checked.health.banner == "robotont_firmware 1.0"


def test_a_valid_packet_that_fits_nothing_is_not_believed_alone():
    sender, checked = Sender(), reader()
    read = checked.feed(sender.packet() + Sender(start=0x5000, seed=9).packet()) + checked.feed(sender.packet())
    assert read == sender.sent
    assert state(checked) == (0, 0, {"inconsistent": 1})


def test_the_same_packet_twice_counts_once_and_more_than_the_motors_make_not_at_all():
    sender, checked = Sender(), reader()
    packet = sender.packet()
    assert checked.feed(packet + packet + sender.packet()) == sender.sent
    assert checked.feed(sender.packet([REACH + 1, 0, 0])) == []
    assert state(checked) == (0, 0, {"repeated": 1, "reach": 1})


@given(st.lists(st.integers(0, 100), max_size=30))
def test_counts_are_conserved_under_any_loss(losses):
    sender, checked = Sender(start=0xFFF0), reader()
    read = checked.feed(sender.packet())
    for lost in losses:
        for _ in range(lost):
            sender.packet()
        read += checked.feed(sender.packet())
        assert read[-1] == sender.sent[-1]
    assert (total(read), len(read)) == (total(sender.sent), len(sender.sent))
    assert state(checked) == (0, sum(losses), {})


@pytest.mark.parametrize("mode, data, packets, dropped", [
    ("auto", SPOILT, [], {"checksum": 1}),  # no plain one
    ("plain", SPOILT + b"4:5:6;\n", [(1, 2, 3), (4, 5, 6)], {}),  # what stands behind the semicolon is ignored
    ("checked", b"1:2:3;\n", [], {"trailer": 1}),
    ("plain", b"1:2.5:3;\n1:2:3.0;\n1:2:3;\n", [(1, 2, 3)], {"decimals": 2}),  # are no counts
    ("auto", b"\xff\n", [], {"not ascii": 1}),
    ("auto", (b"1" * 5000 + b"\n1:2:3;\r\n") * 2, [(1, 2, 3)] * 2, {"overlong": 2}),
])
def test_what_the_modes_take(mode, data, packets, dropped):
    one = reader(mode)
    lines = (b"\n" + data).splitlines(keepends=True)
    assert [packet for line in lines for packet in one.feed(line)] == packets
    assert state(one) == (0, 0, dropped)
    assert bool(one.newest_error) == bool(set(dropped) - {"overlong"})
    assert one.packets == len(packets)


def test_auto_takes_plain_packets_until_a_checked_one_comes_and_decides_anew_with_each_connection():
    auto, sender = reader(), Sender()
    for _ in range(2):
        assert auto.feed(b"2:2:3;\n1:2:3;\n") == [(1, 2, 3)], "the first line may lack its head"
        assert not auto.checked
        auto.feed(sender.packet())
        assert auto.checked
        assert auto.feed(b"1:2:3;\n") == []
        auto.connect()
    assert auto.dropped == {"first line": 2, "trailer": 2}
