"""What cannot start has the last word, and a Ctrl-C while a program loads is silent."""

import os
import re
import signal
import subprocess
import sys

import pytest
from test_help import PROGRAMS

from robotont_bringup import launch
from robotont_testing.harness import START, free_port, wait_for

LAUNCH_FILES = {  # words of the last line: a launch file
    "robot: found 'robotont4', allowed: four_wheels,":
        '<param name="robot" command="$(find robotont_driver)/robot robotont4"/>',
    "robotont: wrong parameter wheelAmount and its kin: found none in /":
        '<node name="driver" pkg="robotont_driver" type="driver_node" output="screen" required="true"/>',
    "robotont: the_simulator was killed; start it all again":
        '<node name="the_simulator" pkg="robotont_driver" type="which_robot" required="true" '
        'launch-prefix="bash -c \'kill -9 $$\'"/>',
    "": '<node name="bye" pkg="robotont_driver" type="which_robot" args="-h" required="true"/>',  # as RViz
}


@pytest.mark.skipif("ROBOTONT_WITHOUT_TF2" in os.environ, reason="PyPI's rospkg does not find Debian's rosout")
@pytest.mark.parametrize("words", LAUNCH_FILES, ids=["refused", "died", "killed", "finished"])
def test_the_reason_is_the_last_line(words, tmp_path):
    file = tmp_path / "a.launch"
    file.write_text(f"<launch>{LAUNCH_FILES[words]}</launch>")
    result = subprocess.run([sys.executable, launch.__file__, str(file)], check=False, text=True, timeout=2 * START,
                            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                            env={**os.environ, "ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}"})
    assert result.returncode == (1 if words else 0), result.stderr
    assert words in result.stderr.strip().splitlines()[-1]
    assert "RLException" not in result.stderr


def test_ctrl_c_while_roslaunch_waits_for_its_master(tmp_path):
    file, log, master = tmp_path / "a.launch", tmp_path / "log", tmp_path / "rosmaster"
    file.write_text("<launch/>")
    master.write_text("#!/bin/sh\nexec sleep 1000\n")
    master.chmod(0o755)
    with log.open("w") as output, subprocess.Popen(
            [sys.executable, launch.__file__, str(file)], stdout=output, stderr=output,
            env={**os.environ, "ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}", "PYTHONUNBUFFERED": "1",
                 "PATH": f"{tmp_path}:{os.environ['PATH']}"}) as process:
        wait_for(lambda: "process[master]" in log.read_text(), "its master", START)
        process.send_signal(signal.SIGINT)
    assert "RLException" not in log.read_text()


def test_ctrl_c_while_a_program_loads_is_silent(tmp_path):
    """By the first import of each; one of them shows what it does."""
    for program in (file for file in PROGRAMS if "firmware" not in str(file)):
        assert re.search("^(import|from) .*", program.read_text(), re.MULTILINE)[0].startswith(
            "import robotont_driver.tools.ctrl_c "), program
    (tmp_path / "rospy.py").write_text("raise KeyboardInterrupt")
    path = os.pathsep.join([str(tmp_path), *sys.path])
    result = subprocess.run([sys.executable, str(PROGRAMS[0].parents[2] / "robotont_driver/scripts/odom_node")],
                            check=False, text=True, capture_output=True, env={**os.environ, "PYTHONPATH": path})
    assert (result.returncode, result.stderr) == (-2, "")


@pytest.mark.parametrize("world, installed, words", [
    ("room", ["move_base"], "navigation.launch localization:=fake world:=room'"),
    ("empty", ["move_base"], ""), ("room", [], "")])
def test_how_to_navigate_is_told_where_one_can(world, installed, words, monkeypatch):
    monkeypatch.setattr(launch.rospkg.RosPack, "list", lambda _self: installed)
    found = launch.navigation_step({"world": world})
    assert words in found
    assert bool(found) == bool(words)


def test_tracebacks_of_a_ctrl_c_are_dropped_and_others_are_not(tmp_path):
    """Of ROS' own programs, too, such as rosversion, which roslaunch runs as it starts."""
    for name, text in (("interrupted", "def f():\n    raise KeyboardInterrupt\n\nf()\n"), ("wrong", "1 / 0\n")):
        (tmp_path / f"{name}.py").write_text(text)
    program = f"""
import os
from robotont_bringup.launch import Errors
errors = Errors()
os.system("cd {tmp_path}; python3 interrupted.py; python3 wrong.py")
errors.close()
"""
    result = subprocess.run([sys.executable, "-c", program], check=True, text=True, stderr=subprocess.PIPE)
    assert "KeyboardInterrupt" not in result.stderr
    assert result.stderr.startswith("Traceback")
    assert result.stderr.endswith("ZeroDivisionError: division by zero\n")
