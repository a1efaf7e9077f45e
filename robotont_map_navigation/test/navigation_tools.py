"""What the pytest modules of this folder share: paths, and runs with the navigation stack."""

import json
import subprocess
from pathlib import Path

import pytest
import rospkg

HERE = Path(__file__).resolve().parent
NAVIGATION_PACKAGES = ("move_base", "map_server", "dwa_local_planner", "navfn", "clear_costmap_recovery",
                       "amcl", "fake_localization")


def needs(*packages):
    """The mark of tests that are skipped where one of the ROS packages is missing."""
    lacks = set(packages) - set(rospkg.RosPack().list())
    return pytest.mark.skipif(bool(lacks), reason=f"not installed: {', '.join(lacks)} (ros-noetic-navigation)")


def figures_of(program, *arguments, timeout):
    """What a program of this folder prints as JSON on its last line, within `timeout` [s]."""
    result = subprocess.run(["/usr/bin/python3", str(HERE / program), *arguments], check=False, text=True,
                            timeout=timeout, capture_output=True)
    print(result.stderr)
    assert result.stdout, result.stderr
    return json.loads(result.stdout.splitlines()[-1])
