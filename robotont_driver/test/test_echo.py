from unittest.mock import MagicMock

import pytest
from dialect_bench import official_wheels

from robotont_driver.protocol.checksum import add_checksum
from robotont_driver.protocol.dialects import make_dialect
from robotont_driver.protocol.dialects.echo import EchoWatch
from robotont_driver.protocol.packet import WholeCounts, format_packet, parse_packet


def commands(number, decimals=2):
    """Packets that are each another one than the one before."""
    return [format_packet([10 + step % 7, -step % 5, 0.25 * step], decimals) for step in range(number)]


@pytest.mark.parametrize("decimals", [0, 2])
@pytest.mark.parametrize("pieces", [7, 1000])
@pytest.mark.parametrize("prompt", [b"", b">>> "])
def test_an_echo_is_recognised(decimals, pieces, prompt):
    watch = EchoWatch()
    for packet in commands(12, decimals):
        line = packet.encode()
        watch.sent(line)
        back = prompt + line.rstrip() + b"\r\n" + (b"SyntaxError: invalid syntax\r\n" if prompt else b"")
        for at in range(0, len(back), pieces):
            watch.received(back[at:at + pieces])
    assert watch.echoing


@pytest.mark.parametrize("line", [b"0.00:0.00:0.00;\n", add_checksum("5:5:5;\n")])
def test_an_echo_of_the_same_command_all_the_time_is_recognised_where_no_counts_can_look_so(line):
    watch = EchoWatch()
    for _ in range(4):
        assert not watch.echoing
        watch.sent(line)
        watch.received(line)
    assert watch.echoing


def test_plain_packets_are_published_until_they_are_an_echo():
    dialect = make_dialect("plain", official_wheels())
    dialect.feed(b"\n", 0.0)
    packets = [dialect.feed(dialect.encode(parse_packet(packet, 3)), 0.0) for packet in commands(12, 0)]
    assert packets[0] == [(10, 0, 0)]
    assert packets[-1] == []
    assert "sends back what it gets" in dialect.complaint
    dialect.connect(0.0)
    assert dialect.complaint == "", "of another board"


def test_counts_that_are_as_commanded_are_no_echo():
    """Ideal motors at a constant speed, whole units, a packet for each command: the worst case."""
    watch, motors = EchoWatch(), WholeCounts(3)
    for _ in range(100):
        watch.sent(b"0:0:0;\n")
        watch.received(b"0:0:0;\n")
        assert not watch.echoing, "a robot at rest"
    for _ in range(500):
        watch.sent(b"19:0:-19;\n")
        watch.received(motors.share((19, 0, -19))[0].text.encode())
        assert not watch.echoing


def test_an_echo_that_ends_is_forgotten():
    watch = EchoWatch()
    for packet in commands(10):
        watch.sent(packet.encode())
        watch.received(packet.encode())
    assert watch.echoing
    watch.received(b"3:3:3;\n")
    assert not watch.echoing


def test_commands_that_push_an_echoed_one_out_meanwhile_are_no_fault():
    """The link's thread sends while the other one looks for the line that has come back."""
    watch = EchoWatch()
    watch._sent = MagicMock(**{"__iter__.return_value": [b"1:2:3;"], "popleft.side_effect": IndexError})
    watch.received(b"1:2:3;\n")
    assert not watch.echoing
