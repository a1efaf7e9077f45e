"""What the pytest modules of this folder share: paths, launch files as roslaunch reads them, the navigation stack."""

import os
import subprocess
import sys
from pathlib import Path

import yaml

PACKAGE = Path(__file__).resolve().parents[1]
ROOT = PACKAGE.parent
NAVIGATION = ROOT / "config" / "navigation"
sys.path[:0] = [str(ROOT / package / "src") for package in ("robotont_bringup", "robotont_driver", "robotont_simulator")]

NAVIGATION_PACKAGES = ("move_base", "map_server", "dwa_local_planner", "navfn", "clear_costmap_recovery",
                       "rotate_recovery", "amcl", "fake_localization")
SLAM_PACKAGES = ("gmapping", "depthimage_to_laserscan")

from robotont_bringup.require import missing  # noqa: E402


def lacking(*packages):
    """Why a test that needs ROS packages is skipped; empty when all are there."""
    lacks = missing(packages)
    return f"not installed: {', '.join(lacks)} (ros-noetic-navigation, ros-noetic-slam-gmapping)" if lacks else ""


def environment_with_stand_ins(folder):
    """An environment with the navigation stack, or with empty packages of its names in `folder` to read launch files."""
    for name in missing((*NAVIGATION_PACKAGES, *SLAM_PACKAGES)):
        (Path(folder) / name).mkdir(parents=True)
        (Path(folder) / name / "package.xml").write_text(
            f'<package format="2"><name>{name}</name><version>0.0.0</version><description>none</description>'
            '<maintainer email="none@none.invalid">none</maintainer><license>none</license></package>')
    return {**os.environ, "ROS_PACKAGE_PATH": f"{os.environ['ROS_PACKAGE_PATH']}:{folder}"}


def roslaunch(environment, *words):
    """A finished run of roslaunch with all that it said."""
    return subprocess.run(["roslaunch", *map(str, words)], env={**environment, "ROS_IP": "127.0.0.1"}, check=False, text=True,
                          timeout=60, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def parameters(environment, file, *arguments):
    """All parameters that a launch file sets, by their full names."""
    result = roslaunch(environment, "--dump-params", str(ROOT / "launch" / file), *arguments)
    assert result.returncode == 0, result.stderr
    return yaml.safe_load(result.stdout)
