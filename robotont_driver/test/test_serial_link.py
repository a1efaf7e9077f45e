import contextlib
import os
import pty
import shutil
import subprocess
import time

import pytest

from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.link.serial_link import SerialLink
from robotont_driver.protocol.checksum import add_checksum
from robotont_driver.protocol.dialects.own_firmware import Checked
from robotont_driver.protocol.packet import format_packet
from robotont_driver.timing.starvation import StallWatch
from robotont_testing.harness import wait_for
from robotont_testing.robots import SHIPPED
from robotont_testing.stand_in_board import Board

STOP = b"0:0:0;\n"
REAL_TTY = "/dev/tty63"  # a virtual console that nobody uses: unlike a pseudo-terminal it ends with its last user


class Ends:
    """A link under test with all that it reports."""

    def __init__(self, port, baudrate=115200, **options):
        self.reader = Checked(read_wheels(SHIPPED))
        self.packets = []
        self.changes = []
        self.failures = []
        self.link = SerialLink(
            str(port), baudrate, self.received, self.changes.append, lambda: STOP, self.failures.append,
            **{"write_timeout": 30.0, "retry_period": 0.05, **options})
        self.link.start()

    def received(self, data):
        self.packets.extend(self.reader.feed(data, time.monotonic()))


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


def test_both_ways_alone_and_a_stop_at_the_end(port, ends):
    with Board(str(port)) as board:
        end = ends()
        wait_for(lambda: len(end.packets) > 3, "packets")
        other = ends()
        wait_for(lambda: other.changes, "a report")
        assert "another program holds it open" in other.changes[0]
        end.link.send(b"10:20:-30;\n")
        wait_for(lambda: (10, 20, -30) in end.packets, "the board's answer")
        assert heard(board) == ["10:20:-30;"]
        end.link.close(STOP)
        wait_for(lambda: heard(board) == ["10:20:-30;", "0:0:0;"], "the stop")
        assert end.changes == [None]


def test_a_missing_port_is_reported_once_and_opened_when_it_comes(port, ends):
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


def test_a_full_line_blocks_nobody_and_the_newest_command_goes_first(port, ends):
    master, slave = pty.openpty()
    os.set_blocking(master, False)
    os.symlink(os.ttyname(slave), str(port))
    end = ends()
    wait_for(lambda: end.link.trouble is None, "the port")
    sent = [add_checksum(format_packet([number, 0, 0])) for number in range(5000)]
    for packet in sent:
        end.link.send(packet)  # nobody reads: this would block for ever
    assert end.link.writer.outbox.replaced > 1000
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


def test_silence_sends_one_stop_packet(port, ends):
    with Board(str(port)) as board:
        end = ends(write_timeout=0.5)
        wait_for(lambda: heard(board) == ["0:0:0;"], "the stop after opening")
        # again on a machine that has just stood still
        wait_for(lambda: end.link.send(b"10:10:10;\n") or "10:10:10;" in heard(board), "the command", period=0.3)
        wait_for(lambda: heard(board)[-1] == "0:0:0;", "the stop after the command")
        before = len(board.reported)
        wait_for(lambda: len(board.reported) > before + 15, "a while")
        assert heard(board).count("0:0:0;") == end.link.timeouts == 2


@pytest.mark.timed
def test_what_was_commanded_while_the_process_was_stopped_is_not_sent(port, ends):
    with Board(str(port)) as board:
        end = ends(write_timeout=0.4)
        wait_for(lambda: end.packets, "packets")
        stopped = time.monotonic() - 3.0
        end.link.stalls = StallWatch(0.2, stopped)  # as if this process had done nothing for 3 s
        end.link.send(b"10:10:10;\n")
        assert end.link.outdated == 1
        begun = time.monotonic()
        end.link.stalls = StallWatch(0.2, begun - 0.3)
        end.link.send(b"20:20:20;\n")  # old, but not too old: for the rest of its time
        wait_for(lambda: "20:20:20;" in heard(board), "the command")
        wait_for(lambda: heard(board)[-1] == "0:0:0;", "the stop")
        assert time.monotonic() - begun < 0.35
        assert "10:10:10;" not in heard(board)


def test_an_error_in_a_callback_is_reported_and_ends_nothing(port, ends):
    with Board(str(port)):
        end = ends()
        wait_for(lambda: end.packets, "packets")
        for error in (KeyError("gone"), OSError(5, "not the port's")):
            def fail(*_, error=error):
                raise error
            end.reader.feed, working = fail, end.reader.feed
            wait_for(lambda error=error: error in end.failures, "the report")
            end.reader.feed = working
            end.packets.clear()
            wait_for(lambda: end.packets, "packets again")
        assert end.link.failures == len(end.failures) >= 2
        assert "not the port's" in end.link.failure
        assert end.changes == [None]  # the port has been open all the time


@pytest.mark.skipif(not (os.geteuid() == 0 and shutil.which("setpriv") and os.path.exists(REAL_TTY)),
                    reason="needs root, setpriv and a virtual console")
def test_programs_that_ignore_locks_cannot_open_a_real_port():
    def dump():
        """What a program like cat gets, without the privilege to ignore the mark."""
        return subprocess.run(["setpriv", "--bounding-set=-sys_admin", "timeout", "0.2", "cat", REAL_TTY], check=False,
                              stderr=subprocess.PIPE, stdin=subprocess.DEVNULL).stderr.decode()
    assert dump() == ""
    end = Ends(REAL_TTY)
    wait_for(lambda: end.link.trouble is None, "the port")
    assert "busy" in dump()
    end.link.close(STOP)
    assert dump() == ""
    with subprocess.Popen(["sleep", "100"], stdin=open(REAL_TTY, "rb")) as reader:
        end = Ends(REAL_TTY)
        wait_for(lambda: end.changes, "a report")
        reader.kill()
    assert f"another program holds it open: process {reader.pid} (sleep)" in end.changes[0]
    wait_for(lambda: end.link.trouble is None, "the port")
    end.link.close(STOP)
