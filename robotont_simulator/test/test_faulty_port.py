import os

import pytest

from robotont_simulator.faulty_port import Port
from robotont_testing.port_owners import program

OWNER = """
import sys, time
from robotont_simulator.faulty_port import Port
port = Port(sys.argv[1])
port.plug()
print("ready", flush=True)
time.sleep(100)
"""


@pytest.fixture
def simulator(tmp_path):
    """Another simulator's process, whose port is `tmp_path / "port"`."""
    with program(OWNER, tmp_path / "port") as process:
        yield process


def test_the_port_of_a_running_simulator_is_not_taken_that_of_a_killed_one_is(tmp_path, simulator):
    device = os.readlink(str(tmp_path / "port"))
    with pytest.raises(ValueError, match="is in use: end the simulator that has it"):
        Port(str(tmp_path / "port")).plug()
    assert os.readlink(str(tmp_path / "port")) == device
    simulator.kill()
    simulator.wait()
    port = Port(str(tmp_path / "port"))
    port.plug()
    port.unplug()
    assert list(tmp_path.iterdir()) == []


def test_a_link_to_something_else_is_left_alone(tmp_path):
    (tmp_path / "port").symlink_to("/dev/null")
    with pytest.raises(ValueError, match="leads to /dev/null, which is in use"):
        Port(str(tmp_path / "port")).plug()
    assert os.readlink(str(tmp_path / "port")) == "/dev/null"


@pytest.mark.parametrize("name, words", [
    ("missing/port", "no such file or directory"), ("", "no such file"), ("folder", "found something that is no link"),
    ("file", "found something that is no link"), ("file/port", "not a directory"), ("x" * 300, "too long"),
])
def test_a_name_that_no_port_can_have_is_explained(tmp_path, name, words):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match="allowed: ") as raised:
        Port(str(tmp_path / name) if name else "").plug()
    assert words in str(raised.value)
    assert "allowed: " in str(raised.value)
    assert len(os.listdir(str(tmp_path))) == 2


def test_unplugged_and_plugged_in_again(tmp_path):
    (tmp_path / "port").symlink_to("/dev/pts/99999")  # a dangling link is replaced
    port = Port(str(tmp_path / "port"))
    for _ in range(3):
        port.plug()
        assert os.path.exists(port.link)
        port.unplug()
        assert list(tmp_path.iterdir()) == []
