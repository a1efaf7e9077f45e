import contextlib
import os
import pty
import select
import signal
import termios
import time

import pytest

from robotont_driver.link import port_owner
from robotont_driver.link.serial_link import SerialLink
from robotont_testing.harness import wait_for
from robotont_testing.port_owners import given_away, program

OWNER = """
import os, sys, time
from robotont_driver.link import port_owner
master, slave = os.openpty()
os.symlink(os.ttyname(slave), sys.argv[1])
port_owner.sign(sys.argv[1], os.ttyname(slave))
os.close(slave)
print("ready", flush=True)
time.sleep(100)
"""


@pytest.fixture
def owner(tmp_path):
    """A process with a signed link, `tmp_path / "port"`."""
    with program(OWNER, tmp_path / "port") as process:
        yield process


@contextlib.contextmanager
def shell_on(slave):
    """A process whose controlling terminal is this pseudo-terminal, as a shell in a new window."""
    pid = os.fork()
    if pid == 0:
        try:
            os.setsid()
            os.close(os.open(os.ttyname(slave), os.O_RDWR))
            time.sleep(100)
        finally:
            os._exit(0)
    try:
        wait_for(lambda: port_owner.session_of(os.ttyname(slave)), "the shell")
        yield pid
    finally:
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)


@contextlib.contextmanager
def driver(port):
    """What the driver's link to a port reports: None for an open port, else the trouble."""
    changes = []
    link = SerialLink(str(port), 115200, received=print, changed=changes.append, stop_packet=lambda: b"0:0:0;\n",
                      failed=print)
    link.start()
    try:
        yield changes
    finally:
        link.close(b"0:0:0;\n")


def test_the_port_of_a_living_owner_may_be_opened_that_of_a_killed_one_not_whoever_has_it_now(tmp_path, owner):
    assert port_owner.read_owner(tmp_path / "port").lives
    assert port_owner.refusal(str(tmp_path / "port")) == ""
    device = os.readlink(str(tmp_path / "port"))
    owner.kill()
    wait_for(lambda: not port_owner.read_owner(tmp_path / "port").lives, "the end of a zombie")
    owner.wait()
    with given_away(device), driver(tmp_path / "port") as changes:
        wait_for(lambda: changes, "a report")
        assert f"{tmp_path / 'port'}: left behind by process {owner.pid}" in str(changes)
        assert f"left behind by process {owner.pid}" in port_owner.refusal(str(tmp_path / "port"))


def test_the_driver_does_not_touch_the_terminal_of_a_session(tmp_path):
    master, slave = pty.openpty()
    settings, name, link = termios.tcgetattr(slave), os.ttyname(slave), tmp_path / "port"
    link.symlink_to(name)
    assert port_owner.refusal(str(link)) == ""  # nobody's terminal: a stand-in without a marker
    with shell_on(slave) as pid, driver(link) as changes:
        wait_for(lambda: changes, "a report")
        words = f"leads to {name}, the terminal of process {pid}; choose another port, or remove the link"
        assert port_owner.refusal(str(link)) == port_owner.refusal(name) == words
        assert words in str(changes)
    assert termios.tcgetattr(slave) == settings  # else a shell would be raw, ...
    assert select.select([master], [], [], 0) == ([], [], [])  # ... with packets in it
    os.close(slave)
    os.close(master)
