"""A second launch of a robot that runs on the same master is refused, and the first one does not notice."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from xmlrpc.server import SimpleXMLRPCServer

import pytest
from roslaunch.config import load_config_default
from roslaunch.core import RLException

from robotont_bringup import require
from robotont_testing import places
from robotont_testing.harness import START, Master, free_port, suspended, wait_for

REQUIRE = [str(places.program("robotont_bringup", "require")), "robot.launch", "--free", "//driver_node"]

OFFICIAL = places.package("robotont_driver") / "launch"
OTHERS = [places.launch("driver_basic.launch"), places.launch("odometry_from_commands.launch"),
          OFFICIAL / "driver_basic.launch", OFFICIAL / "fake_driver.launch"]


def finished(command, **environment):
    return subprocess.run(command, check=False, text=True, capture_output=True, timeout=START,
                          env={**os.environ, **environment})


def pid_of(master, node="/driver_node"):
    """Process id of a node once it answers."""
    def answer():
        with contextlib.suppress(AssertionError, OSError):
            return master.pid(node)
    return wait_for(answer, node, START)


def test_the_second_launch_is_refused_with_the_name_of_the_first_until_that_was_killed(capfd):
    with Master() as master:
        arguments = ["description:=false", "mux:=false"]
        first = master.launch("robot.launch", *arguments, f"port:={master.folder / 'none'}")
        pid = pid_of(master)
        second = finished(["roslaunch", "-p", master.uri.rpartition(":")[2], str(places.launch("robot.launch")),
                           *arguments, "port:=/dev/nothing"])
        assert second.returncode == 1
        assert f"/driver_node runs already on ROS master {master.uri}: process {pid} on 127.0.0.1" in second.stderr
        assert "Traceback" not in second.stderr
        assert master.pid("/driver_node") == pid
        port = finished(["rosparam", "get", "/serial_com_node/port"]).stdout.strip()
        assert port == str(master.folder / "none"), "the first one's parameters"
        for file in OTHERS:
            with pytest.raises(RLException):
                load_config_default([(str(file), [])], None)
            assert f"{file.name}: /driver_node runs already" in capfd.readouterr().err
        with suspended(pid):
            hung = finished(REQUIRE)
        assert hung.returncode == 1
        assert "it does not answer at http://" in hung.stderr
        os.killpg(first.pid, signal.SIGKILL)
        os.kill(pid, signal.SIGKILL)
        gone = finished(REQUIRE)
        assert (gone.returncode, gone.stdout, gone.stderr) == (0, "true\n", "")


def test_a_second_mux_is_refused_by_each_launch_file_that_starts_one(capfd):
    with Master() as master:
        master.start(places.program("robotont_teleop", "cmd_vel_mux"))
        pid = pid_of(master, "/cmd_vel_mux")
        for file, *arguments in (("teleop.launch", "start_mux:=true"), ("robot.launch", "description:=false")):
            with pytest.raises(RLException):
                load_config_default([(str(places.launch(file)), arguments)], None)
            assert f"{file}: /cmd_vel_mux runs already on ROS master {master.uri}: process {pid} " in \
                capfd.readouterr().err
        for file, argument in (("teleop.launch", "start_mux:=false"), ("robot.launch", "mux:=false")):
            load_config_default([(str(places.launch(file)), [argument])], None)


def test_a_second_page_or_rviz_is_refused_and_that_of_another_robot_is_not(capfd):
    """Each ends all with it, the simulator too: RViz and the page are required."""
    with Master() as master:
        for file, node in (("teleop.launch", "web_teleop_node"), ("rviz.launch", "rviz")):
            load_config_default([(str(places.launch(file)), [])], None)
            master.start(places.program("robotont_teleop", "cmd_vel_mux"), f"__name:={node}")
            pid = pid_of(master, f"/{node}")
            with pytest.raises(RLException):
                load_config_default([(str(places.launch(file)), [])], None)
            assert f"{file}: /{node} runs already on ROS master {master.uri}: process {pid} " in capfd.readouterr().err
            load_config_default([(str(places.launch(file)), ["namespace:=robot1"])], None)
        load_config_default([(str(places.launch("simulation.launch")),
                              ["description:=false", "robots:=2", "teleop:=true", "rviz:=true"])], None)


def test_of_two_launches_at_once_one_is_refused_with_the_name_of_the_other():
    with Master() as master:
        logs = [master.folder / "one", master.folder / "two"]
        launches = [master.launch("robot.launch", "description:=false", "mux:=false", f"port:={master.folder}/none",
                                  log=log) for log in logs]
        wait_for(lambda: any(launch.poll() is not None for launch in launches), "the end of one of them", START)
        refused = 0 if launches[0].poll() is not None else 1
        assert f"process {launches[1 - refused].pid} on " in logs[refused].read_text()
        assert launches[refused].returncode == 1
        pid_of(master)
        assert launches[1 - refused].poll() is None


@pytest.mark.parametrize("given, name", [
    ("//driver_node", "/driver_node"), ("driver_node", "/robot2/driver_node"), ("r1/a_node", "/robot2/r1/a_node")])
def test_the_name_that_is_to_be_free_is_that_which_roslaunch_gives_the_node(given, name, monkeypatch):
    monkeypatch.setenv("ROS_NAMESPACE", "/robot2/")
    monkeypatch.setattr(require, "running", lambda names, _: (names[0], "here"))
    monkeypatch.setattr(sys, "argv", ["require", "a.launch", "--free", given])
    with pytest.raises(SystemExit, match=f"a.launch: {name} runs already"):
        require.main()


@pytest.mark.parametrize("master_uri", ["", "nonsense", "http://127.0.0.1:{port}", "https://127.0.0.1:{port}"])
def test_without_a_master_nothing_runs(master_uri):
    done = finished(REQUIRE, ROS_MASTER_URI=master_uri.format(port=free_port()))
    assert (done.returncode, done.stdout, done.stderr) == (0, "true\n", "")


def test_a_master_that_a_busy_computer_holds_up_is_waited_for():
    with SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False) as master:
        uri = f"http://127.0.0.1:{master.server_address[1]}"
        master.register_function(lambda *_: time.sleep(1.5) or [1, "", uri], "lookupNode")
        master.register_function(lambda *_: [1, "", 7], "getPid")
        threading.Thread(target=master.serve_forever, daemon=True).start()
        assert require.running(["/driver_node"], uri) == ("/driver_node", "process 7 on 127.0.0.1")
        master.shutdown()
