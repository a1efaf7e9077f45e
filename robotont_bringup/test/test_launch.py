"""What cannot start is told once; a Ctrl-C while a program loads is silent."""

import os
import re
import socket
import subprocess
import sys

import pytest
from test_help import PROGRAMS

from robotont_bringup import launch
from robotont_testing.harness import START, free_port
from robotont_testing.places import launch as launch_file

LAUNCH_FILES = {  # launch file: words of the last line of the log; whether the exit status is 1
    '<param name="robot" command="$(find robotont_bringup)/robot --path robotont4"/>':
        ("robot: found 'robotont4', allowed: four_wheels,", True),
    "<node/>": ("robotont: ", True),
    '<node name="driver" pkg="robotont_driver" type="driver_node" output="screen" required="true"/>': ("", True),
    '<node ns="/robot1/" name="driver" pkg="robotont_driver" type="driver_node" required="true"/>': ("", True),
    '<node name="bye" pkg="robotont_driver" type="which_robot" args="-h" required="true"/>': ("", False),  # as RViz
}


@pytest.mark.skipif("ROBOTONT_WITHOUT_TF2" in os.environ, reason="PyPI's rospkg does not find Debian's rosout")
@pytest.mark.parametrize("content", LAUNCH_FILES, ids=["refused", "no node", "died", "died in a namespace", "finished"])
def test_what_cannot_start_is_told_once_and_in_the_exit_status(content, tmp_path):
    words, fails = LAUNCH_FILES[content]
    file = tmp_path / "a.launch"
    file.write_text(f"<launch>{content}</launch>")
    result = subprocess.run([sys.executable, launch.__file__, str(file)], check=False, text=True, timeout=2 * START,
                            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                            env={**os.environ, "ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}"})
    assert result.returncode == fails, result.stderr
    assert words in (result.stderr.strip().splitlines() or [""])[-1]
    assert "RLException" not in result.stderr


def test_ctrl_c_while_a_program_loads_is_silent(tmp_path):
    """By the first import of each; one of them shows what it does."""
    for program in (file for file in PROGRAMS if "firmware" not in str(file)):
        assert re.search("^(import|from) .*", program.read_text(), re.MULTILINE)[0].startswith(
            "import robotont_driver.rospy_repairs.quiet_interrupt "), program
    (tmp_path / "rospy.py").write_text("raise KeyboardInterrupt")
    path = os.pathsep.join([str(tmp_path), *sys.path])
    result = subprocess.run([sys.executable, str(PROGRAMS[0].parents[2] / "robotont_driver/scripts/odom_node")],
                            check=False, text=True, capture_output=True, env={**os.environ, "PYTHONPATH": path})
    assert (result.returncode, result.stderr) == (-2, "")


def test_no_program_ends_at_a_letter_that_its_terminal_lacks():
    code = "import robotont_driver.rospy_repairs.quiet_interrupt; print('30\\xb0 \\udcff')"
    done = subprocess.run([sys.executable, "-c", code], check=False, text=True, capture_output=True,
                          env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert (done.stdout, done.stderr) == ("30\\xb0 \\udcff\n", "")


@pytest.mark.parametrize("world, name, installed, words", [
    ("room", "", ["move_base"], "navigation.launch localization:=fake map:=none'"),
    ("colors", "robot1", ["move_base"], "localization:=fake map:=none namespace:=robot1'"),
    ("empty", "", ["move_base"], ""), ("line", "", ["move_base"], ""), ("room", "", [], "")])
def test_how_to_navigate_is_told_where_one_can(world, name, installed, words, monkeypatch):
    monkeypatch.setattr(launch.rospkg.RosPack, "list", lambda _self: installed)
    found = launch.navigation_step({"world": world}, name)
    assert ("cmd_vel:=cmd_vel'" in launch.navigation_step({"world": world, "mux": "false"}, name)) == bool(words)
    assert words in found
    assert bool(found) == bool(words)
    assert "page's map" not in found, "no page runs"
    assert ("page's map" in launch.navigation_step({"world": world, "teleop": "true"}, name)) == bool(words)


@pytest.mark.parametrize("name", ["robot", "description", "navigation", "camera_scan", "gamepad", "robot_localization",
                                  "fleet", "recorder"])
def test_what_dies_is_started_again(name):
    """Of launch files that robots run for long; the page ends its launch, slam would begin a new map."""
    for node in re.findall(r"<node [^>]*>", launch_file(f"{name}.launch").read_text()):
        assert 'respawn="true"' in node, node


@pytest.mark.parametrize("given, address", [([], "127.0.0.1"), (["address:=0.0.0.0"], "127.0.0.1"),
                                            (["address:=127.0.0.7"], "127.0.0.7")])
def test_the_page_is_told_where_it_is_served(given, address, monkeypatch, capsys):
    monkeypatch.setattr(launch.subprocess, "call", lambda *_args, **_keywords: 0)
    with socket.create_server((address, 0)) as server:
        port = server.getsockname()[1]
        launch.show_next_steps(["teleop:=true", f"web_port:={port}", *given])
    assert f"browser: http://{address}:{port}/\n" in capsys.readouterr().out


@pytest.mark.parametrize("given, drives", [
    ([], True), (["mux:=false"], False), (["mux:=false", "start_mux:=true"], True)])
def test_keys_and_page_are_told_where_a_mux_hears_them(given, drives, monkeypatch, capsys):
    monkeypatch.setattr(launch.subprocess, "call", lambda *_args, **_keywords: 0)
    with socket.create_server(("127.0.0.1", 0)) as server:
        launch.show_next_steps(["teleop:=true", f"web_port:={server.getsockname()[1]}", *given])
    told = capsys.readouterr().out
    assert [words in told for words in ("robotont keys", "Drive it in a browser")] == [drives, drives]
    assert "rostopic pub" in told
    assert "{" not in told.replace("{linear: {x: 0.2}, angular: {z: 0.5}}", "")
