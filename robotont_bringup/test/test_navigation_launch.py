"""The launch files of navigation, read as roslaunch reads them; nothing is started."""

import re
import subprocess
import sys

import pytest
import yaml

from bringup_tools import (
    NAVIGATION_PACKAGES,
    PACKAGE,
    ROOT,
    SLAM_PACKAGES,
    environment_with_stand_ins,
    lacking,
    parameters,
    roslaunch,
)
from robotont_bringup.require import is_roslaunch, missing, words
from robotont_bringup.size import robot_radius
from robotont_driver.wheels import read_wheels
from robotont_simulator.world import read_world, write_map

FILES = {"navigation.launch": "ros-noetic-navigation", "slam.launch": "ros-noetic-slam-gmapping",
         "camera_scan.launch": "ros-noetic-depthimage-to-laserscan"}
NOISE = ("... logging to", "Checking log directory", "Press Ctrl-C", "Done checking", "\x1b]2;")


@pytest.fixture
def environment(tmp_path):
    return environment_with_stand_ins(tmp_path / "stand_ins")


def said(result):
    """Lines of a run of roslaunch but for those of its start."""
    return [line for line in (result.stdout + result.stderr).splitlines() if line and not line.startswith(NOISE)]


@pytest.mark.parametrize("file", FILES)
def test_a_missing_package_is_one_line_and_no_success(environment, tmp_path, file):
    text = (ROOT / "launch" / file).read_text()
    first = {"navigation.launch": "move_base map_server", "slam.launch": "gmapping\"",
             "camera_scan.launch": "depthimage_to_laserscan\""}[file]
    (tmp_path / file).write_text(text.replace(" " + first, " no_such_package " + first, 1))
    result = roslaunch(environment, tmp_path / file)
    assert said(result) == [f"{file} needs the ROS package no_such_package, which is missing: "
                            f"sudo apt-get install {FILES[file]} (ROS Noetic; Debian itself has none)"]
    assert result.returncode != 0


@pytest.mark.skipif(not lacking(*NAVIGATION_PACKAGES), reason="the navigation stack is installed")
@pytest.mark.parametrize("file", FILES)
def test_where_the_navigation_stack_is_missing_it_is_named(environment, file):
    result = subprocess.run(["roslaunch", "robotont_bringup", file], check=False, text=True, timeout=60,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    last = result.stdout.splitlines()[-1]
    assert result.returncode != 0
    assert last.startswith(f"{file} needs the ROS package")
    assert missing([package for package in (*NAVIGATION_PACKAGES, *SLAM_PACKAGES) if package in last])


def test_whoever_else_reads_launch_files_lives_on():
    """Only the command roslaunch is ended; others get an exception."""
    code = ("import roslaunch.config; "
            "roslaunch.config.load_config_default([], None, ['<launch><param name=\"x\" "
            "command=\"rosrun robotont_bringup require here some_package no_such_package\"/></launch>'])")
    result = subprocess.run([sys.executable, "-c", code], check=False, text=True, timeout=60,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert "here needs the ROS package no_such_package" in result.stderr
    assert "RLException" in result.stderr
    assert result.returncode == 1


def test_words_of_require():
    assert words("a.launch", ["x", "y"], "ros-noetic-z").startswith("a.launch needs the ROS packages x, y, which are")
    assert is_roslaunch(["/usr/bin/python3", "/opt/ros/noetic/bin/roslaunch", "x"])
    assert not is_roslaunch(["/usr/bin/python3", "/usr/bin/rostest", "roslaunch"])
    assert missing(["robotont_bringup", "no_such_package"]) == ["no_such_package"]


@pytest.mark.parametrize("localization, nodes", [
    ("amcl", {"/amcl", "/map_server", "/move_base"}),
    ("fake", {"/fake_localization", "/map_server", "/move_base"}),
    ("none", {"/map_server", "/move_base"}),
])
def test_each_localization_starts_its_nodes(environment, localization, nodes):
    result = roslaunch(environment, "--nodes", ROOT / "launch" / "navigation.launch", f"localization:={localization}")
    assert set(result.stdout.split()) == nodes


def test_sim_starts_the_robot_and_map_none_no_map_server(environment):
    result = roslaunch(environment, "--nodes", ROOT / "launch" / "navigation.launch", "sim:=true", "map:=none")
    nodes = set(result.stdout.split())
    assert nodes >= {"/simulator_node", "/driver_node", "/odom_node", "/robot_state_publisher", "/move_base", "/amcl"}
    assert "/map_server" not in nodes


def test_rviz_shows_the_view_of_navigation(environment):
    result = roslaunch(environment, "--args", "/rviz", ROOT / "launch" / "navigation.launch", "rviz:=true")
    assert "navigation.rviz" in result.stdout
    assert "-f map" in result.stdout


def test_frames_and_topics_of_a_second_robot(environment):
    found = parameters(environment, "navigation.launch", "namespace:=robot2", "frame_prefix:=robot2/")
    assert found["/robot2/amcl/odom_frame_id"] == "robot2/odom"
    assert found["/robot2/amcl/base_frame_id"] == "robot2/base_link"
    assert found["/robot2/amcl/global_frame_id"] == found["/robot2/map_server/frame_id"] == "map"
    assert found["/robot2/move_base/global_costmap/robot_base_frame"] == "robot2/base_link"
    assert found["/robot2/move_base/local_costmap/robot_base_frame"] == "robot2/base_link"
    assert found["/robot2/move_base/local_costmap/global_frame"] == "robot2/odom"
    assert found["/robot2/move_base/global_costmap/global_frame"] == "map"
    assert not [name for name in found if re.match(r"/(move_base|amcl|map_server)", name)]


def test_the_footprint_is_that_of_the_wheels(environment, tmp_path):
    shipped = yaml.safe_load((ROOT / "config" / "wheel_params.yaml").read_text())
    assert robot_radius(read_wheels(shipped)) == 0.15
    large = tmp_path / "large.yaml"
    large.write_text(yaml.safe_dump({**shipped, "wheelDistanceFromCenter": [0.2, 0.3, 0.2], "wheelRadius": 0.06}))
    found = parameters(environment, "navigation.launch", f"wheel_params:={large}")
    # the outer corner of the second wheel: hypot(0.3 + 0.021, 0.06) = 0.3266
    assert found["/move_base/global_costmap/robot_radius"] == found["/move_base/local_costmap/robot_radius"] == 0.33


def test_robot_radius_explains_wrong_wheels(tmp_path):
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("wheelAmount: 2")
    result = subprocess.run([sys.executable, str(PACKAGE / "scripts" / "robot_radius"), str(wrong)], check=False,
                            text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert result.returncode == 1
    assert "wheelAmount: found 2" in result.stderr
    assert "Traceback" not in result.stderr


def test_the_map_of_the_room_is_that_of_the_simulator(environment, tmp_path):
    write_map(read_world(ROOT / "config" / "worlds" / "room.yaml"), tmp_path / "room")
    maps = ROOT / "config" / "maps"
    for name in ("room.yaml", "room.pgm"):
        assert (maps / name).read_bytes() == (tmp_path / name).read_bytes(), \
            "made anew by: rosrun robotont_simulator make_map config/worlds/room.yaml config/maps/room"
    text = (ROOT / "launch" / "navigation.launch").read_text()
    assert '<arg name="map" default="$(dirname)/../config/maps/room.yaml"' in text
    # amcl starts where the simulated robot does
    found = parameters(environment, "navigation.launch")
    start = read_world(ROOT / "config" / "worlds" / "room.yaml").start
    assert tuple(found[f"/amcl/initial_pose_{axis}"] for axis in "xya") == start
