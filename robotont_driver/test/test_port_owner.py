import errno
import os
import pty
import select
import termios
from pathlib import Path

import pytest
from link_bench import Ends

from robotont_driver.link import serial_port
from robotont_testing.harness import wait_for
from robotont_testing.port_owners import program

SHELL = """
import os, sys, time
os.setsid()
os.close(os.open(sys.argv[1], os.O_RDWR))  # becomes its controlling terminal
print("ready", flush=True)
time.sleep(100)
"""


@pytest.fixture
def port(tmp_path):
    return tmp_path / "port"


def test_a_port_that_another_users_simulator_has_left_has_its_own_remedy(port):
    master, slave = pty.openpty()
    port.symlink_to(os.ttyname(slave))
    words = serial_port.explain(str(port), PermissionError(13, "Permission denied"))
    os.close(slave)
    os.close(master)
    assert "another user's simulator" in words
    assert "dialout" not in words
    assert "dialout" in serial_port.explain("/dev/ttyACM0", PermissionError(13, "Permission denied"))


def test_the_driver_does_not_touch_the_terminal_of_a_session(port):
    master, slave = pty.openpty()
    settings, name = termios.tcgetattr(slave), os.ttyname(slave)
    port.symlink_to(name)
    assert serial_port.refusal(str(port)) == ""  # nobody's terminal: a stand-in without a marker
    with program(SHELL, name) as shell, Ends(port) as end:
        wait_for(lambda: end.changes, "a report")
        words = f"leads to {name}, the terminal of process {shell.pid}; choose another port, or remove the link"
        assert serial_port.refusal(str(port)) == serial_port.refusal(name) == words
        assert words in end.changes[0]
    assert termios.tcgetattr(slave) == settings  # else a shell would be raw, ...
    assert select.select([master], [], [], 0) == ([], [], [])  # ... with packets in it
    os.close(slave)
    os.close(master)


def test_a_holder_whose_name_the_kernel_has_cut_within_a_letter_is_named(port, monkeypatch):
    comm = Path("/proc/self/comm")
    before = comm.read_bytes()
    with port.open("w") as held:
        comm.write_bytes("robot-übungenä".encode())
        monkeypatch.setattr(serial_port.os, "getpid", lambda: 0)  # this process is another one's
        assert "another program holds it open: process " in serial_port.explain(held.name, OSError(errno.EBUSY, ""))
        assert " (robot-übungen" in serial_port.users_of(held.name)[0]
        monkeypatch.undo()
        comm.write_bytes(before)


def test_an_error_is_explained_without_the_list_of_processes(monkeypatch):
    def listdir(_path):
        raise OSError(errno.EMFILE, "Too many open files")
    monkeypatch.setattr(serial_port.os, "listdir", listdir)
    assert serial_port.explain("port", OSError(errno.EBUSY, "")) == "port: another program holds it open"
