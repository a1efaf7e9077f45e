import contextlib
import os
import pty

import pytest

from robotont_driver.protocol import FeedbackReader, add_checksum, format_packet
from robotont_driver.serial_link import SerialLink, explain
from robotont_testing.harness import wait_for
from robotont_testing.stand_in_board import Board

STOP = b"0:0:0;\n"


class Ends:
    """A link under test with all that it reports."""

    def __init__(self, port, **options):
        self.reader = FeedbackReader(3, 300)
        self.packets = []
        self.changes = []
        self.link = SerialLink(
            str(port), 115200, lambda data: self.packets.extend(self.reader.feed(data)), self.changes.append,
            lambda: STOP, **{"write_timeout": 30.0, "retry_period": 0.05, **options})
        self.link.start()


@pytest.fixture
def port(tmp_path):
    return tmp_path / "board"


@pytest.fixture
def ends(port):
    made = []

    def make(**options):
        made.append(Ends(port, **options))
        return made[-1]
    yield make
    for end in made:
        end.link.close(STOP)


def heard(board):
    return [line for _, line in board.heard]


def test_both_ways(port, ends):
    with Board(str(port)) as board:
        end = ends()
        wait_for(lambda: len(end.packets) > 3, "packets")
        end.link.send(b"10:20:-30;\n")
        wait_for(lambda: (10, 20, -30) in end.packets, "the board's answer")
        assert heard(board) == ["10:20:-30;"]
        assert end.changes == [None]


def test_a_missing_port_is_told_once_and_opened_when_it_comes(port, ends):
    end = ends()
    wait_for(lambda: end.changes, "a report")
    assert str(port) in end.changes[0]
    assert "plugged in" in end.changes[0]
    end.link.send(b"1:2:3;\n")
    assert end.link.unsent == 1
    with Board(str(port)) as board:
        wait_for(lambda: end.packets, "packets")
        end.link.send(b"4:5:6;\n")
        wait_for(lambda: board.heard, "a command")
        assert heard(board) == ["4:5:6;"]  # what was commanded before is not sent now
        assert len(end.changes) == 2


def test_a_port_that_vanishes_and_comes_back(port, ends):
    with Board(str(port)) as board:
        end = ends()
        for round_trip in range(1, 4):
            wait_for(lambda: end.link.trouble is None and end.packets, "packets")
            board.unplug()
            wait_for(lambda: end.link.trouble, "the loss to be noticed")
            end.packets.clear()
            board.plug()
            wait_for(lambda: end.packets, "packets after replugging")
            assert end.link.opened == round_trip + 1
        assert [change is None for change in end.changes] == [True, False] * 3 + [True]


def test_another_program_cannot_open_the_port_as_well(port, ends):
    with Board(str(port)):
        end = ends()
        wait_for(lambda: end.packets, "packets")
        other = ends()
        wait_for(lambda: other.changes, "a report")
        assert "another program holds it open" in other.changes[0]


def test_a_port_that_is_no_serial_port(port, ends):
    port.write_text("not a terminal")
    end = ends()
    wait_for(lambda: end.changes, "a report")
    assert str(port) in end.changes[0]


@pytest.mark.parametrize("error, advice", [
    (OSError(13, "could not open port x: [Errno 13] Permission denied"), "dialout"),
    (OSError(2, "could not open port x: [Errno 2] No such file"), "plugged in"),
    (OSError(11, "Could not exclusively lock port x: [Errno 11]"), "another program holds it open"),
    (OSError(5, "Input/output error"), "still plugged in"),
])
def test_each_trouble_comes_with_advice(error, advice):
    assert advice in explain("/dev/ttyACM0", error)
    assert explain("/dev/ttyACM0", error).startswith("/dev/ttyACM0: ")


def test_a_full_line_blocks_nobody_and_the_newest_command_goes_first(port, ends):
    master, slave = pty.openpty()
    os.set_blocking(master, False)
    os.symlink(os.ttyname(slave), str(port))
    end = ends()
    wait_for(lambda: end.link.trouble is None, "the port")
    sent = [add_checksum(format_packet([number, 0, 0])) for number in range(5000)]
    for packet in sent:
        end.link.send(packet)  # nobody reads: this would block for ever
    assert end.link.replaced > 1000
    read = bytearray()

    def newest():
        with contextlib.suppress(BlockingIOError):
            read.extend(os.read(master, 65536))
        return read.endswith(sent[-1])
    wait_for(newest, "the newest packet")
    numbers = [int(line.split(b":")[0]) for line in bytes(read).splitlines()]
    assert numbers == sorted(numbers)  # whole packets, none older behind a newer
    assert len(numbers) < 5000
    os.close(slave)
    os.close(master)


def test_what_a_lost_port_did_not_take_is_not_sent_to_the_next(port, ends):
    master, slave = pty.openpty()
    os.symlink(os.ttyname(slave), str(port))
    end = ends()
    wait_for(lambda: end.link.trouble is None, "the port")
    wait_for(lambda: end.link.send(b"1:1:1;\n") or end.link.replaced, "a full line", period=0)
    os.unlink(str(port))
    os.close(slave)
    os.close(master)
    wait_for(lambda: end.link.trouble, "the loss to be noticed")
    with Board(str(port)) as board:
        wait_for(lambda: end.packets, "packets")
        end.link.send(b"2:2:2;\n")
        wait_for(lambda: board.heard, "a command")
        assert heard(board) == ["2:2:2;"]


def test_silence_sends_one_stop_packet(port, ends):
    with Board(str(port)) as board:
        end = ends(write_timeout=0.1)
        wait_for(lambda: heard(board) == ["0:0:0;"], "the stop after opening")
        end.link.send(b"10:10:10;\n")
        wait_for(lambda: heard(board)[1:] == ["10:10:10;", "0:0:0;"], "the stop after the command")
        told = len(board.reported)
        wait_for(lambda: len(board.reported) > told + 15, "a while")
        assert len(board.heard) == 3
        assert end.link.timeouts == 2


def test_the_last_packet_goes_out_on_closing(port, ends):
    with Board(str(port)) as board:
        end = ends()
        wait_for(lambda: end.packets, "packets")
        end.link.send(b"10:10:10;\n")
        end.link.close(STOP)
        wait_for(lambda: heard(board) == ["10:10:10;", "0:0:0;"], "the stop")


def test_bytes_split_and_merged_arrive_whole(port, ends):
    with Board(str(port), period=0.005) as board:
        end = ends()
        wait_for(lambda: end.packets, "packets")
        board.line.split = True
        board.line.hold = 5
        end.link.send(b"3:-7:11;\n")
        wait_for(lambda: end.packets.count((3, -7, 11)) > 20, "packets")
        assert not end.reader.dropped
        assert end.reader.repaired == 0
