"""A second launch of a robot that runs on the same master is refused, and the first one does not notice."""

import contextlib
import os
import signal
import subprocess

import pytest

from robotont_testing import places
from robotont_testing.harness import START, Master, free_port, suspended, wait_for
from robotont_testing.stand_in_board import Board


def launch_again(master, *arguments):
    command = ["roslaunch", "-p", master.uri.rpartition(":")[2], str(places.launch("robot.launch"))]
    return subprocess.run([*command, "description:=false", *arguments], check=False, text=True, capture_output=True,
                          timeout=START)


def pid_of(master):
    """Process id of /robotont_node once it answers."""
    def answer():
        with contextlib.suppress(AssertionError, OSError):
            return master.pid("/robotont_node")
    return wait_for(answer, "robotont_node", START)


@pytest.fixture(name="master")
def _master():
    with Master() as master:
        yield master


@pytest.mark.parametrize("arguments", [(), ("composed:=false", "mux:=false", "port:=/dev/nothing")])
def test_the_second_launch_is_refused_with_the_name_of_the_first(master, arguments):
    with Board(str(master.folder / "board")) as board:
        master.launch("robot.launch", f"port:={board.link}", "description:=false")
        pid = pid_of(master)
        second = launch_again(master, *arguments)
        assert second.returncode == 1
        assert f"/robotont_node runs already on ROS master {master.uri}: process {pid} on 127.0.0.1" in second.stderr
        assert "Traceback" not in second.stderr
        assert master.pid("/robotont_node") == pid
        port = subprocess.run(["rosparam", "get", "/serial_com_node/port"], check=True, text=True, capture_output=True)
        assert port.stdout.strip() == board.link, "the first one's parameters"


def test_a_robot_that_hangs_is_one_and_one_that_was_killed_is_none(master):
    first = master.launch("robot.launch", "description:=false", f"port:={master.folder / 'none'}")
    pid = pid_of(master)
    require = [str(places.program("robotont_bringup", "require")), "robot.launch", "--free", "//robotont_node"]
    with suspended(pid):
        done = subprocess.run(require, check=False, text=True, capture_output=True, timeout=20)
    assert done.returncode == 1
    assert "it does not answer at http://" in done.stderr
    os.killpg(first.pid, signal.SIGKILL)
    os.kill(pid, signal.SIGKILL)
    master.launch("robot.launch", "description:=false", f"port:={master.folder / 'none'}")
    wait_for(lambda: pid_of(master) != pid, "the new robot", START)


@pytest.mark.parametrize("master_uri", ["", "nonsense", "http://127.0.0.1:{port}", "https://127.0.0.1:{port}"])
def test_without_a_master_nothing_runs(master_uri):
    require = [str(places.program("robotont_bringup", "require")), "robot.launch", "--free", "/robotont_node"]
    environment = {**os.environ, "ROS_MASTER_URI": master_uri.format(port=free_port())}
    done = subprocess.run(require, check=False, text=True, capture_output=True, timeout=20, env=environment)
    assert (done.returncode, done.stdout, done.stderr) == (0, "true\n", "")
