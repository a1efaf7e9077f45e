"""The fleet's configuration for Open-RMF's free_fleet, out of a robot's folder; free of network."""

import math

import yaml

from robotont_description.geometry import robot_radius
from robotont_driver.robots.robot_folder import read_robot, shipped

VICINITY = 0.15            # [m] around the footprint that is kept free of other robots
MASS, INERTIA = 3.0, 0.03  # [kg, kg m2] estimates; free_fleet would compute the battery's drain from them
HEAD = "# Of free_fleet, for {names}: written by ./robotont fleet --free-fleet. docs/fleet.md says what is estimated.\n"


def free_fleet_text(robot, names):
    """YAML for robots of these names, all like `robot` (of config/robots, or a folder). Raises OSError, ValueError."""
    read = read_robot(robot)
    planner = yaml.safe_load((shipped().parent / "navigation" / "dwa_local_planner.yaml").read_text())["DWAPlannerROS"]
    own = read.parameters.get("driver_node", {})
    linear = min(planner["max_vel_trans"], own.get("max_linear_speed") or math.inf)
    angular = min(planner["max_vel_theta"], own.get("max_angular_speed") or math.inf)
    radius = robot_radius(read.wheels)
    fleet = {
        "name": "robotont",
        "limits": {"linear": [linear, planner["acc_lim_trans"]], "angular": [angular, planner["acc_lim_theta"]]},
        "profile": {"footprint": radius, "vicinity": round(radius + VICINITY, 3)}, "reversible": True,
        "battery_system": {"voltage": 14.8, "capacity": 5.0, "charging_current": 2.0},
        "mechanical_system": {"mass": MASS, "moment_of_inertia": INERTIA, "friction_coefficient": 0.22},
        "ambient_system": {"power": 20.0}, "tool_system": {"power": 0.0}, "recharge_threshold": 0.1,
        "recharge_soc": 1.0, "publish_fleet_state": 10.0, "account_for_battery_drain": False,
        "task_capabilities": {"loop": True, "delivery": False}, "finishing_request": "nothing",
        "responsive_wait": True,
        "robots": {name: {"charger": f"{name}_charger", "navigation_stack": 1, "init_timeout_sec": 10,
                          "initial_map": "L1", "map_frame": "map", "robot_frame": "base_link",
                          "maps": {"L1": {"map_url": ""}}} for name in names},
        "robot_state_update_frequency": 10.0}
    return HEAD.format(names=", ".join(names)) + yaml.safe_dump({"rmf_fleet": fleet}, sort_keys=False)
