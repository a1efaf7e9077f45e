import contextlib
import itertools
import os
import pty
import re
import resource
import shutil
import subprocess
import threading
import time

import pytest
from link_bench import Ends

from robotont_driver.link import boot_clock, serial_link
from robotont_driver.protocol import connection
from robotont_driver.protocol.protocol import Packet
from robotont_testing.harness import wait_for
from robotont_testing.stand_in_board import Board

REAL_TTY = "/dev/tty63"  # a virtual console that nobody uses: unlike a pseudo-terminal it ends with its last user


@pytest.fixture
def port(tmp_path):
    return str(tmp_path / "board")


def heard(board):
    return [line for _, line in board.heard]


def test_both_ways_alone_and_a_stop_at_the_end(port):
    with Board(port, checked=False) as board, Ends(port) as end:
        wait_for(lambda: len(end.packets) > 3, "packets")
        with Ends(port) as other:
            wait_for(lambda: other.changes, "a report")
        assert "another program holds it open" in other.changes[0]
        end.link.send(Packet((10, 20, -30)))
        wait_for(lambda: (10, 20, -30) in end.packets, "the board's answer")
        assert heard(board) == ["10:20:-30;"]
        end.link.close()
        wait_for(lambda: heard(board) == ["10:20:-30;", "0:0:0;", "0:0:0;"], "the stop")
        assert end.changes == [None]


def test_a_missing_port_is_reported_once_and_opened_when_it_comes(port):
    with Ends(port) as end:
        wait_for(lambda: end.changes, "a report")
        assert port in end.changes[0]
        assert "plugged in" in end.changes[0]
        end.link.send(Packet((1, 2, 3)))
        assert end.link.unsent == 1
        with Board(port) as board:
            wait_for(lambda: end.packets, "packets")
            end.link.send(Packet((4, 5, 6)))
            wait_for(lambda: board.heard, "a command")
            assert heard(board) == ["4:5:6;"]  # what was commanded before is not sent now
            assert len(end.changes) == 2


def test_a_full_line_blocks_nobody_and_the_newest_command_goes_first(port):
    master, slave = pty.openpty()
    os.set_blocking(master, False)
    os.symlink(os.ttyname(slave), port)
    sent, read = [Packet((number, 0, 0)) for number in range(5000)], bytearray()

    def newest():
        with contextlib.suppress(BlockingIOError):
            read.extend(os.read(master, 65536))
        return read.endswith(sent[-1].text.encode())
    with Ends(port) as end:
        wait_for(lambda: end.link.trouble is None, "the port")
        for packet in sent:
            end.link.send(packet)  # nobody reads: this would block for ever
        wait_for(newest, "the newest packet")
    numbers = [int(line.split(b":")[0]) for line in bytes(read).splitlines()]
    assert numbers == sorted(numbers)  # whole packets, none older behind a newer
    assert len(numbers) < 5000
    os.close(slave)
    os.close(master)


def test_what_the_board_was_not_given_is_not_told(port):
    """A motion told, of which the board got a stop, made odom_node blame healthy wheels."""
    with Board(port, checked=False) as board, Ends(port) as end:
        wait_for(lambda: end.packets, "packets")
        end.connections[-1].protocol.obstacle = "another robot's board"
        end.link.send(Packet((10, 10, 10)))
        wait_for(lambda: heard(board) == ["0:0:0;"], "the stop in its place")
        assert end.link.commanded is None
        end.connections[-1].protocol.obstacle = ""
        end.link.send(Packet((20, 20, 20)))
        assert end.link.commanded == (20, 20, 20)


def test_commands_of_other_threads_while_the_port_comes_and_goes(port):
    """Whole lines in their order, none into what is opened next, and a stop behind them all."""
    numbers, ended = itertools.count(1), threading.Event()

    def drive():
        while not ended.is_set():
            end.link.send(Packet((next(numbers), 1, 1)))
            time.sleep(0.001)
    with Board(port, checked=False) as board, Ends(port) as end:
        driver = threading.Thread(target=drive)
        driver.start()
        try:
            for opened in range(1, 11):
                told = len(board.heard)
                wait_for(lambda told=told: len(board.heard) > told + 5, "commands")
                board.unplug()
                wait_for(lambda: end.link.trouble, "the loss")
                board.plug()
                wait_for(lambda opened=opened: end.link.opened > opened, "the next opening")
            told = len(board.heard)
            wait_for(lambda: len(board.heard) > told, "commands at the end")
            end.link.close()
        finally:
            ended.set()
            driver.join()
        wait_for(lambda: heard(board)[-1] == "0:0:0;", "the stop")
    assert not end.failures
    lines = [re.fullmatch(r"(\d+):1:1;", line) for line in heard(board) if line != "0:0:0;"]
    assert all(lines), heard(board)
    order = [int(line.group(1)) for line in lines]
    assert order == sorted(set(order))


def test_silence_sends_stops_until_a_command_comes(port):
    """One may be spoilt, and a board may have no time-out of its own."""
    with Board(port) as board, Ends(port, write_timeout=0.5) as end:
        wait_for(lambda: "0:0:0;" in heard(board), "the stop after opening")
        # again on a machine that has just stood still
        wait_for(lambda: end.link.send(Packet((10, 10, 10))) or "10:10:10;" in heard(board), "the command", period=0.3)
        wait_for(lambda: heard(board)[-2:] == ["0:0:0;"] * 2, "two stops after the command")
        assert end.link.timeouts >= 3


def test_what_was_commanded_while_the_machine_was_suspended_is_not_sent_but_a_stop_is(port, monkeypatch):
    with Board(port) as board, Ends(port) as end:
        wait_for(lambda: end.packets, "packets")
        monkeypatch.setattr(serial_link, "boot_time", lambda: boot_clock.boot_time() + 3600.0)  # an hour is gone
        end.link.send(Packet((10, 10, 10)))
        assert end.link.outdated == 1
        end.link.send(Packet((0, 0, 0)))
        wait_for(lambda: {*heard(board)} == {"0:0:0;"}, "the stop")
        wait_for(lambda: end.link.send(Packet((20, 20, 20))) or "20:20:20;" in heard(board), "the command", period=0.05)
        assert "10:10:10;" not in heard(board)


@pytest.mark.parametrize("place, error", [
    ("feed", ValueError("gone")), ("on_packet", KeyError("gone")), ("on_packet", OSError("gone")),
    ("connect", OSError("gone")), ("on_change", OSError("gone")), ("on_change", ValueError("gone"))])
def test_an_error_of_this_program_is_reported_and_the_port_is_opened_anew(port, place, error):
    with Board(port) as board, Ends(port) as end:
        wait_for(lambda: end.packets, "packets")
        part = end.connections[-1] if place == "feed" else end
        works = getattr(part, place)

        def fail(*_):
            setattr(part, place, works)
            raise error
        setattr(part, place, fail)
        if place in ("connect", "on_change"):
            board.unplug()
            board.plug()
        wait_for(lambda: end.failures and end.link.trouble is None, "the new opening")
        end.packets.clear()
        wait_for(lambda: end.packets, "packets again")
        assert len(end.failures) == 1
        assert error in (end.failures[0], end.failures[0].__cause__)
        if place not in ("connect", "on_change"):  # else the port was lost before
            assert f"{port}: a fault of this program, " in end.changes[-2]
            assert f"{type(error).__name__}: {error}" in end.changes[-2]
        assert len(end.connections) == 2


def test_another_reader_takes_bytes_and_ends_nothing(port):
    """What the system calls an empty read is no lost port: only what it calls gone is."""
    with Board(port) as board, Ends(port, packets="checked") as end, open(port, "rb", buffering=0) as thief:
        os.set_blocking(thief.fileno(), False)
        stolen = 0

        def steal():
            nonlocal stolen
            with contextlib.suppress(BlockingIOError):
                stolen += bool(thief.read(4096))
            return stolen >= 20 and len(end.packets) >= 40
        wait_for(steal, "packets for both", period=0.001)
        assert end.changes == [None]
        assert [packet.number for packet in end.packets] == list(range(len(end.packets))), "none is lost"
        board.unplug()
        wait_for(lambda: len(end.changes) == 2, "the loss")


def test_a_board_that_falls_silent_is_opened_again_once_and_its_numbers_begin_anew(port, monkeypatch):
    monkeypatch.setattr(connection, "SILENCE", 0.3)
    with Board(port) as board, Ends(port, packets="checked") as end:
        wait_for(lambda: len(end.packets) > 3, "packets")
        board.line.cut = True
        wait_for(lambda: len(end.connections) == 2, "another opening")
        assert "no packet for" in end.changes[1]
        assert end.connections[0].state(time.monotonic()) == connection.CLOSED
        told = len(board.reported)
        wait_for(lambda: len(board.reported) > told + 50, "a second")
        assert (len(end.connections), end.link.trouble) == (2, None), "a board that never spoke is waited for"
        end.packets.clear()
        board.line.cut = False
        wait_for(lambda: end.packets, "packets")
        assert end.packets[0].number == 0
        assert end.connections[1].protocol.dropped == {}


def test_more_than_a_thousand_open_files_are_no_trouble(port):
    few, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(few, min(4000, most)), most))
    files = [os.open("/dev/null", os.O_RDONLY) for _ in range(1100)]
    try:
        with Board(port) as board, Ends(port) as end:
            wait_for(lambda: end.packets, "packets")
            end.link.send(Packet((1, 2, 3)))
            wait_for(lambda: "1:2:3;" in heard(board), "the command")
            assert end.changes == [None]
    finally:
        for file in files:
            os.close(file)


@pytest.mark.skipif(not (os.geteuid() == 0 and shutil.which("setpriv") and os.path.exists(REAL_TTY)),
                    reason="needs root, setpriv and a virtual console")
def test_programs_that_ignore_locks_cannot_open_a_real_port():
    def dump():
        """What a program like cat gets, without the privilege to ignore the mark."""
        return subprocess.run(["setpriv", "--bounding-set=-sys_admin", "timeout", "0.2", "cat", REAL_TTY], check=False,
                              stderr=subprocess.PIPE, stdin=subprocess.DEVNULL).stderr.decode()
    assert dump() == ""
    with Ends(REAL_TTY) as end:
        wait_for(lambda: end.link.trouble is None, "the port")
        assert "busy" in dump()
    assert dump() == ""
    with subprocess.Popen(["sleep", "100"], stdin=open(REAL_TTY, "rb")) as reader, Ends(REAL_TTY) as end:
        wait_for(lambda: end.changes, "a report")
        reader.kill()
        assert f"another program holds it open: process {reader.pid} (sleep)" in end.changes[0]
        wait_for(lambda: end.link.trouble is None, "the port")
