"""What navigation.launch puts on the parameter server, against the names that the navigation stack reads."""

import copy
import re

import pytest
import yaml
from navigation_tools import NAVIGATION, PACKAGE, read_launch, running  # noqa: F401

from robotont_driver.nodes import driver_node
from robotont_driver.parameters.parameters import read_parameters
from robotont_map_navigation import localization_monitor
from robotont_testing import places

pytestmark = pytest.mark.usefixtures("running")
KNOWN = {section: set(names) for section, names in yaml.safe_load(
    (PACKAGE / "test" / "data" / "navigation_parameters.yaml").read_text()).items()}
BLIND_ROTATION = "TrajectoryPlannerROS as RotateRecovery reads it"


def read(file, *arguments):
    """{node: tree of its parameters} of a launch file."""
    return tree(read_launch(file, *arguments).parameters)


def tree(flat):
    """Nested dictionaries of {"/a/b": value}."""
    found = {}
    for name, value in flat.items():
        *above, last = name.strip("/").split("/")
        place = found
        for part in above:
            place = place.setdefault(part, {})
        place[last] = value
    return found


def unknown(section, given, inner=()):
    """Names in `given` that the section does not read, but for those of the inner sections."""
    return [f"{section}: {name}" for name in given if name not in KNOWN[section] and name not in inner]


def unknown_of_costmap(costmap):
    """Names that no costmap and no layer of it reads."""
    types = {plugin["name"]: plugin["type"] for plugin in costmap["plugins"]}
    faults = unknown("costmap_2d", costmap, types)
    for name, kind in types.items():
        layer = costmap.get(name, {})
        sources = layer.get("observation_sources", "").split()
        faults += unknown(kind, layer, sources)
        for source in sources:
            faults += unknown("observation source", layer[source])
    return faults


def unknown_of_move_base(given):
    """Names under ~move_base that nobody reads."""
    behaviors = {behavior["name"]: behavior["type"] for behavior in given["recovery_behaviors"]}
    planners = {given[key].split("/")[1]: given[key] for key in ("base_global_planner", "base_local_planner")}
    costmaps = ("global_costmap", "local_costmap")
    faults = unknown("move_base", given, (*behaviors, *planners, *costmaps, "TrajectoryPlannerROS"))
    for name, kind in {**behaviors, **planners}.items():
        faults += unknown(kind, given.get(name, {}))
    faults += unknown(BLIND_ROTATION, given["TrajectoryPlannerROS"])
    return faults + [fault for costmap in costmaps for fault in unknown_of_costmap(given[costmap])]


def test_every_parameter_is_one_that_its_node_reads():
    given = read("navigation.launch")
    assert unknown_of_move_base(given["move_base"]) == []
    assert unknown("amcl", given["amcl"]) == []
    assert unknown("map_server", given["map_server"]) == []
    assert unknown("fake_localization", read("navigation.launch", "localization:=fake")["fake_localization"]) == []
    mapping = read("slam.launch", "camera:=true")
    assert unknown("gmapping", mapping["slam_gmapping"]) == []
    assert unknown("depthimage_to_laserscan", mapping["depthimage_to_laserscan"]) == []


@pytest.mark.parametrize("path, wrong", [
    (("recovery_behavior_enabled",), "recovery_behaviour_enabled"),
    (("DWAPlannerROS", "vth_samples"), "vtheta_samples"),
    (("DWAPlannerROS", "max_vel_theta"), "max_rot_vel"),
    (("global_costmap", "update_frequency"), "update_frequncy"),
    (("local_costmap", "inflation", "cost_scaling_factor"), "cost_scaling"),
    (("local_costmap", "obstacles", "scan", "obstacle_range"), "obstacle_rage"),
    (("forget_far_obstacles", "reset_distance"), "reset_dist"),
    (("NavfnROS", "default_tolerance"), "tolerance"),
])
def test_a_misspelt_name_is_found(path, wrong):
    given = copy.deepcopy(read("navigation.launch")["move_base"])
    place = given
    for part in path[:-1]:
        place = place[part]
    place[wrong] = place.pop(path[-1])
    assert [fault.rpartition(": ")[2] for fault in unknown_of_move_base(given)] == [wrong]


def test_every_name_that_has_no_good_default_is_set():
    """Defaults of the stack that do not fit this robot: they must be overwritten, not forgotten."""
    given = read("navigation.launch")
    planner = given["move_base"]["DWAPlannerROS"]
    left_out = {"cheat_factor", "global_frame_id", "sum_scores"}  # only of the debugging cloud; how scores are added
    assert KNOWN["dwa_local_planner/DWAPlannerROS"] - set(planner) == left_out
    assert given["move_base"]["base_local_planner"] == "dwa_local_planner/DWAPlannerROS"
    assert given["move_base"]["recovery_behavior_enabled"] is True


def test_the_local_costmap_is_little_wider_than_dwa_looks_ahead():
    """With the footprint, and half a cell by which the robot is off the middle. costmap_2d reads whole metres."""
    given = read("navigation.launch")["move_base"]
    planner, costmap = given["DWAPlannerROS"], given["local_costmap"]
    footprint = costmap["robot_radius"] * (1 + planner["max_scaling_factor"]) + costmap["footprint_padding"]
    reach = planner["sim_time"] * planner["max_vel_trans"] + footprint + costmap["resolution"] / 2
    for side in ("width", "height"):
        assert type(costmap[side]) is int
        assert reach < costmap[side] / 2 < 1.1 * reach


def test_the_map_gives_way_to_the_robot_by_updates_only():
    """What the scan has found free takes no wall away; own_place does, of which the costmaps must hear."""
    given = read("navigation.launch")["move_base"]
    for costmap in (given["global_costmap"], given["local_costmap"]):
        assert costmap["obstacles"]["combination_method"] == 1
        assert costmap["static_layer"]["subscribe_to_updates"] is True
        assert costmap["static_layer"]["map_topic"] == "map"


def test_the_base_may_strafe_as_fast_as_it_drives():
    planner = read("navigation.launch")["move_base"]["DWAPlannerROS"]
    assert planner["max_vel_y"] == -planner["min_vel_y"] == planner["max_vel_x"] == -planner["min_vel_x"] > 0
    assert planner["vy_samples"] > 1
    assert read("navigation.launch")["amcl"]["odom_model_type"] == "omni-corrected"


def test_the_limits_fit_the_driver():
    given, robot = read("navigation.launch")["move_base"], read("robot.launch", "description:=false")
    defaults = {parameter.name: parameter.default for parameter in driver_node.PARAMETERS}
    assert defaults["cmd_timeout"] > 1.0 / given["controller_frequency"]
    assert given["DWAPlannerROS"]["max_vel_trans"] < robot["driver_node"]["max_wheel_speed"]
    for mine, other in (("acc_lim_theta", "acc_lim_theta"), ("min_in_place_vel_theta", "min_vel_theta")):
        assert given["TrajectoryPlannerROS"][mine] == given["DWAPlannerROS"][other]


def test_amcl_never_divides_by_a_rate_of_zero():
    amcl = read("navigation.launch")["amcl"]
    assert amcl["save_pose_rate"] != 0
    assert amcl["gui_publish_rate"] != 0


def test_localization_monitor_takes_its_shipped_parameters():
    given = read("navigation.launch")["localization_monitor"]
    assert set(read_parameters(localization_monitor.PARAMETERS, given)) == set(given)


def test_every_number_has_a_comment():
    for file in sorted(NAVIGATION.glob("*.yaml")):
        lines = file.read_text().splitlines()
        numbers = [line for line in lines if re.match(r"\s*\w+: -?[\d.]+", line)]
        assert numbers
        assert [line for line in numbers if "  # " not in line] == [], file


def test_every_file_is_loaded():
    text = "".join(places.launch(file).read_text()
                   for file in ("navigation.launch", "slam.launch", "camera_scan.launch"))
    for file in NAVIGATION.glob("*.yaml"):
        assert f"/config/navigation/{file.name}" in text
