"""The launch files of navigation, read as roslaunch reads them; nothing is started."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from navigation_tools import NAVIGATION_PACKAGES, ROOT, missing, read_launch, roslaunch, running  # noqa: F401
from roslaunch import RLException

from robotont_description.geometry import robot_radius
from robotont_driver.kinematics.wheels import read_wheels
from robotont_map_navigation import map_file
from robotont_simulator.world import read_world, write_map
from robotont_testing.robots import ROBOTONT2, SHIPPED, robot_folder

pytestmark = pytest.mark.usefixtures("running")
FILES = {"navigation.launch": [name for name in NAVIGATION_PACKAGES if name != "fake_localization"],
         "slam.launch": ["gmapping"], "camera_scan.launch": ["depthimage_to_laserscan"]}
NOISE = ("... logging to", "Checking log directory", "Press Ctrl-C", "Done checking", "\x1b]2;")


def lines(result):
    """Lines of a run of roslaunch but for those of its start."""
    return [line for line in result.stdout.splitlines() if line and not line.startswith(NOISE)]


@pytest.mark.parametrize("file", FILES)
def test_a_missing_package_is_named_in_the_first_line(tmp_path, file):
    """The shipped file where the stack is missing; else a copy that asks for one more package."""
    path, lacks = ROOT / "launch" / file, missing(FILES[file])
    if not lacks:
        lacks = ["no_such_package"]
        before, require, after = path.read_text().partition("/require ")
        path = tmp_path / file
        path.write_text(before + require + after.replace(FILES[file][0], f"no_such_package {FILES[file][0]}", 1))
    result = roslaunch(path)
    assert re.fullmatch(rf"{file} needs the ROS packages? {', '.join(lacks)}, which (is|are) missing: "
                        r"sudo apt-get install ros-noetic-\S+ \(ROS Noetic; Debian itself has none\)", lines(result)[0])
    assert "returned with code [1]" in lines(result)[1]  # and roslaunch's own words, with no traceback
    assert not any(line.startswith("Traceback") for line in lines(result))
    assert result.returncode != 0


@pytest.mark.parametrize("localization, nodes", [
    ("amcl", {"/amcl", "/localization_monitor", "/map_server", "/move_base", "/own_place", "/unblock"}),
    ("fake", {"/fake_localization", "/localization_monitor", "/map_server", "/move_base", "/own_place", "/unblock"}),
    ("none", {"/localization_monitor", "/map_server", "/move_base", "/own_place", "/unblock"}),
])
def test_each_localization_starts_its_nodes(localization, nodes):
    assert set(read_launch("navigation.launch", f"localization:={localization}").nodes) == nodes


def test_sim_starts_the_robot_and_map_none_no_map_server():
    nodes = set(read_launch("navigation.launch", "sim:=true", "map:=none").nodes)
    assert nodes >= {"/simulator_node", "/robotont_node", "/robot_state_publisher", "/move_base", "/amcl"}
    assert "/map_server" not in nodes


def test_rviz_shows_the_view_of_navigation():
    arguments = read_launch("navigation.launch", "sim:=true", "rviz:=true").nodes["/rviz"]
    assert "navigation.rviz" in arguments
    assert "-f map" in arguments


def test_frames_and_topics_of_a_second_robot():
    found = read_launch("navigation.launch", "sim:=true", "namespace:=robot2").parameters
    assert found["/robot2/amcl/odom_frame_id"] == "robot2/odom"
    assert found["/robot2/amcl/base_frame_id"] == "robot2/base_link"
    assert found["/robot2/amcl/global_frame_id"] == found["/robot2/map_server/frame_id"] == "map"
    assert found["/robot2/move_base/global_costmap/robot_base_frame"] == "robot2/base_link"
    assert found["/robot2/move_base/local_costmap/robot_base_frame"] == "robot2/base_link"
    assert found["/robot2/move_base/local_costmap/global_frame"] == "robot2/odom"
    assert found["/robot2/move_base/global_costmap/global_frame"] == "map"
    assert not [name for name in found if re.match(r"/(move_base|amcl|map_server)", name)]


def test_the_footprint_is_that_of_the_wheels(tmp_path):
    assert robot_radius(read_wheels(SHIPPED)) == 0.15
    large = robot_folder(tmp_path, {**SHIPPED, "wheelDistanceFromCenter": [0.2, 0.3, 0.2], "wheelRadius": 0.06})
    found = read_launch("navigation.launch", "sim:=true", f"robot:={large}").parameters
    # the outer corner of the second wheel: hypot(0.3 + 0.021, 0.06) = 0.3266
    assert found["/move_base/global_costmap/robot_radius"] == found["/move_base/local_costmap/robot_radius"] == 0.33


def test_the_footprint_is_that_of_the_robot_that_runs(running):  # noqa: F811
    def footprint():
        return read_launch("navigation.launch").parameters["/move_base/global_costmap/robot_radius"]
    running(ROBOTONT2)
    assert footprint() == 0.17
    running(SHIPPED)
    assert footprint() == 0.15
    with pytest.raises(RLException, match="robot_radius"):
        read_launch("navigation.launch", "namespace:=robot2")  # where none runs


def test_robot_radius_explains_wrong_wheels(tmp_path):
    wrong = robot_folder(tmp_path, {"wheelAmount": 2})
    script = ROOT / "robotont_description" / "scripts" / "robot_radius"
    result = subprocess.run([sys.executable, str(script), "robot:=" + wrong], check=False, text=True,
                            capture_output=True)
    assert result.returncode == 1
    assert "wheelAmount: found 2" in result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize("world", ["room", "maze"])
def test_a_world_brings_its_map_and_its_start(tmp_path, world):
    file = ROOT / "config" / "worlds" / f"{world}.yaml"
    write_map(read_world(file), tmp_path / world)
    maps = ROOT / "config" / "maps"
    for name in (f"{world}.yaml", f"{world}.pgm"):
        assert (maps / name).read_bytes() == (tmp_path / name).read_bytes(), \
            f"made anew by: rosrun robotont_simulator make_map config/worlds/{world}.yaml config/maps/{world}"
    launch = read_launch("navigation.launch", "sim:=true", f"world:={world}")
    assert Path(launch.nodes["/map_server"].strip("'")).resolve() == (maps / f"{world}.yaml").resolve()
    assert Path(launch.parameters["/simulator_node/world"]).resolve() == file
    # amcl starts where the simulated robot does
    assert tuple(launch.parameters[f"/amcl/initial_pose_{axis}"] for axis in "xya") == read_world(file).start


def test_a_world_without_a_map_is_refused():
    words = map_file.fault(ROOT / "config" / "maps" / "empty.yaml")
    assert words.startswith(f"no map {ROOT}/config/maps/empty.yaml. Beside it are: maze, room. A world of the ")
    with pytest.raises(RLException, match="map_is_there"):
        read_launch("navigation.launch", "sim:=true", "world:=empty")
    assert "/map_server" not in read_launch("navigation.launch", "sim:=true", "world:=empty", "map:=none").nodes


@pytest.mark.parametrize("text, words", [
    ("image: no.pgm\nresolution: 0.05\norigin: [0, 0, 0]", "its image {folder}/no.pgm is missing"),
    ("walls: []", "no image, resolution, origin: not a map of map_server"),
    ("- 1", "allowed: image, resolution and origin"),
])
def test_a_file_that_is_no_map_is_named(tmp_path, text, words):
    file = tmp_path / "map.yaml"
    file.write_text(text)
    found = map_file.fault(file)
    assert found.startswith(str(file))
    assert words.format(folder=tmp_path) in found


def test_what_dies_is_started_again():
    text = (ROOT / "launch" / "navigation.launch").read_text()
    for node in re.findall(r"<node [^>]*>", text):
        assert 'respawn="true"' in node, node
