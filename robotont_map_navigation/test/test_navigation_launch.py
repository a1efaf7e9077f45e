"""The launch files and the parameters of navigation, read as roslaunch reads them; nothing is started."""

import re
import subprocess
from pathlib import Path
from unittest import mock

import pytest
import yaml
from navigation_tools import HERE
from roslaunch import RLException, loader
from roslaunch.config import load_config_default

from robotont_simulator.world import read_world, write_map
from robotont_testing import places
from robotont_testing.harness import Master
from robotont_testing.robots import ROBOTONT2, SHIPPED, robot_folder

KNOWN = {section: set(names) for section, names in yaml.safe_load(
    (HERE / "data" / "navigation_parameters.yaml").read_text()).items()}
LAYERS = {"": "costmap_2d", "/static_layer": "costmap_2d::StaticLayer", "/obstacles": "costmap_2d::ObstacleLayer",
          "/obstacles/scan": "observation source",
          "/obstacles/felt": "observation source", "/inflation": "costmap_2d::InflationLayer"}
READERS = {  # where parameters stand: the section of KNOWN with those that are read there
    "amcl": "amcl", "map_server": "map_server", "fake_localization": "fake_localization",
    "slam_gmapping": "gmapping", "depthimage_to_laserscan": "depthimage_to_laserscan",
    "move_base": "move_base", "move_base/NavfnROS": "navfn/NavfnROS",
    "move_base/DWAPlannerROS": "dwa_local_planner/DWAPlannerROS",
    "move_base/forget_far_obstacles": "clear_costmap_recovery/ClearCostmapRecovery",
    "move_base/forget_all_but_near_obstacles": "clear_costmap_recovery/ClearCostmapRecovery",
    **{f"move_base/{costmap}_costmap{layer}": section for costmap in ("global", "local")
       for layer, section in LAYERS.items()},
}


def read_launch(file, *arguments):
    """(nodes, parameters) of a launch file: arguments and values by full name. The navigation stack may be missing."""
    value_of = loader.Loader.param_value
    # only while it reads: other tests of this process want commands run
    with mock.patch.object(loader.Loader, "param_value", lambda *given: "true" if "/require " in (given[-1] or "")
                           else value_of(*given)):
        config = load_config_default([(str(places.launch(file)), list(arguments))], None)
    return ({node.namespace + node.name: node.args for node in config.nodes},
            {name: parameter.value for name, parameter in config.params.items()})


@pytest.fixture(scope="module", autouse=True)
def running():
    """A master on which a robot's parameters stand: load other wheel parameters for another robot."""
    with Master() as master:
        master.load(SHIPPED)
        yield master


def test_a_missing_package_is_named():
    result = subprocess.run([places.program("robotont_bringup", "require"), "navigation.launch", "--debian",
                             "ros-noetic-navigation", "no_such_package", "rospy", "nor_this"],
                            check=False, text=True, stderr=subprocess.PIPE)
    assert (result.returncode, result.stderr.strip()) == (
        1, "navigation.launch needs the ROS packages no_such_package, nor_this, which are missing: "
        "on Ubuntu 20.04 sudo apt-get install ros-noetic-navigation; elsewhere, where apt has no ros-one-navigation, "
        "build them from source, and source that workspace (for ./robotont: ROBOTONT_UNDERLAY=its devel folder)")


@pytest.mark.parametrize("arguments, localization", [
    ((), {"/amcl"}), (("localization:=fake",), {"/fake_localization"}), (("localization:=none",), set())])
def test_each_localization_starts_its_nodes(arguments, localization):
    nodes, _ = read_launch("navigation.launch", *arguments)
    assert set(nodes) == {*localization, "/map_server", "/move_base", "/navigation_monitor"}


def test_frames_and_topics_of_a_second_robot():
    _, found = read_launch("navigation.launch", "sim:=true", "namespace:=robot2")
    expected = {
        "amcl/odom_frame_id": "robot2/odom", "amcl/base_frame_id": "robot2/base_link", "amcl/global_frame_id": "map",
        "map_server/frame_id": "map", "move_base/global_costmap/global_frame": "map",
        "move_base/global_costmap/robot_base_frame": "robot2/base_link",
        "move_base/local_costmap/robot_base_frame": "robot2/base_link",
        "move_base/local_costmap/global_frame": "robot2/odom",
        "move_base/global_costmap/obstacles/observation_sources": "scan felt",
        "move_base/local_costmap/obstacles/observation_sources": "scan felt"}
    assert {name: found["/robot2/" + name] for name in expected} == expected
    assert not [name for name in found if re.match(r"/(move_base|amcl|map_server)", name)]


@pytest.mark.parametrize("world", ["room", "maze"])
def test_a_world_brings_its_map_and_its_start(tmp_path, world):
    file = places.config(f"worlds/{world}.yaml").resolve()
    write_map(read_world(file), tmp_path / world)
    maps = places.config("maps")
    for name in (f"{world}.yaml", f"{world}.pgm"):
        assert (maps / name).read_bytes() == (tmp_path / name).read_bytes(), \
            f"made anew by: rosrun robotont_simulator make_map config/worlds/{world}.yaml config/maps/{world}"
    nodes, parameters = read_launch("navigation.launch", "sim:=true", f"world:={world}")
    assert Path(nodes["/map_server"].strip("'")).resolve() == (maps / f"{world}.yaml").resolve()
    assert Path(parameters["/simulator_node/world"]).resolve() == file
    # amcl starts where the simulated robot does
    assert tuple(parameters[f"/amcl/initial_pose_{axis}"] for axis in "xya") == read_world(file).start


def test_every_parameter_is_one_that_its_node_reads():
    found = {name.strip("/").rpartition("/") for file, *arguments in (
        ("navigation.launch",), ("navigation.launch", "localization:=fake"), ("slam.launch", "camera:=true"))
        for name in read_launch(file, *arguments)[1]}
    nodes = {place.partition("/")[0] for place in READERS}
    assert nodes <= {place.partition("/")[0] for place, _, _ in found}
    assert [f"{place}/{name}" for place, _, name in found
            if place.partition("/")[0] in nodes and name not in KNOWN.get(READERS.get(place), ())] == []


def test_the_footprint_is_that_of_the_wheels_or_of_the_robot_that_runs(tmp_path, running):
    def footprints(*arguments):
        _, found = read_launch("navigation.launch", *arguments)
        return {found[f"/move_base/{costmap}_costmap/robot_radius"] for costmap in ("global", "local")}
    large = robot_folder(tmp_path, {**SHIPPED, "wheelDistanceFromCenter": [0.2, 0.3, 0.2], "wheelRadius": 0.06})
    # the outer corner of the second wheel: hypot(0.3 + 0.021, 0.06) = 0.3266
    assert footprints("sim:=true", f"robot:={large}") == {0.33}
    assert footprints() == {0.15}
    with pytest.raises(RLException, match="robot_radius"):
        footprints("namespace:=robot2")  # where none runs
    running.load(ROBOTONT2)
    assert footprints() == {0.17}
    running.load(SHIPPED)
