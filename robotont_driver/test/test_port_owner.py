import os
import pty
import select
import termios

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
