"""What the pytest modules of this folder share: paths, launch files as roslaunch reads them, the navigation stack."""

import json
import os
import subprocess
import tempfile
import xmlrpc.client
from functools import lru_cache
from pathlib import Path
from typing import Any, Dict, NamedTuple
from unittest import mock

import pytest
import rospkg
from roslaunch import loader, substitution_args
from roslaunch.config import load_config_default

from robotont_testing import places
from robotont_testing.harness import Master
from robotont_testing.robots import SHIPPED

PACKAGE = Path(__file__).resolve().parents[1]
ROOT = PACKAGE.parent
NAVIGATION = ROOT / "config" / "navigation"
NAVIGATION_PACKAGES = ("move_base", "map_server", "dwa_local_planner", "navfn", "clear_costmap_recovery",
                       "amcl", "fake_localization")
SLAM_PACKAGES = ("gmapping", "depthimage_to_laserscan")


def missing(packages):
    """Those of the ROS packages that are not installed."""
    known = rospkg.RosPack().list()
    return [package for package in packages if package not in known]


def needs(*packages):
    """The mark of tests that are skipped where one of the ROS packages is missing."""
    lacks = missing(packages)
    return pytest.mark.skipif(bool(lacks), reason=f"not installed: {', '.join(lacks)} (ros-noetic-navigation)")


def figures_of(program, *arguments, timeout):
    """What a program of this folder prints as JSON on its last line, within `timeout` [s]."""
    result = subprocess.run(["/usr/bin/python3", str(PACKAGE / "test" / program), *arguments], check=False, text=True,
                            timeout=timeout, capture_output=True)
    print(result.stderr)
    assert result.stdout, result.stderr
    return json.loads(result.stdout.splitlines()[-1])


class Launch(NamedTuple):
    """A launch file as roslaunch reads it."""

    nodes: Dict[str, str]        # full name: arguments
    parameters: Dict[str, Any]   # full name: value


PARAM_VALUE = loader.Loader.param_value


@lru_cache(maxsize=None)
def of_command(*given):
    """What a launch file's command prints: a process of its own each time, of which navigation.launch starts nine."""
    return PARAM_VALUE(None, *given)


def param_value(self, *given):
    """roslaunch's own, but for commands; only while read_launch reads: other tests of this process want theirs run."""
    return of_command(*given) if given[-1] else PARAM_VALUE(self, *given)


@lru_cache(maxsize=None)
def read_launch(file, *arguments):
    """Launch of a launch file with arguments; the navigation stack need not be there."""
    before = os.environ["ROS_PACKAGE_PATH"]
    with tempfile.TemporaryDirectory() as folder:
        for name in missing((*NAVIGATION_PACKAGES, *SLAM_PACKAGES)):
            (Path(folder) / name).mkdir()
            (Path(folder) / name / "package.xml").write_text(
                f'<package format="2"><name>{name}</name><version>0.0.0</version><description>none</description>'
                '<maintainer email="none@none.invalid">none</maintainer><license>none</license></package>')
        os.environ["ROS_PACKAGE_PATH"] = f"{before}:{folder}"
        substitution_args._rospack = None  # which keeps what it has once found
        try:
            with mock.patch.object(loader.Loader, "param_value", param_value):
                config = load_config_default([(str(places.launch(file)), list(arguments))], None)
        finally:
            os.environ["ROS_PACKAGE_PATH"] = before
            substitution_args._rospack = None
    own = {name: param.value for name, param in config.params.items()}
    return Launch({node.namespace + node.name: node.args for node in config.nodes}, own)


@pytest.fixture(scope="module")
def running():
    """A master on which a robot's parameters stand: call it with other wheel parameters for another robot."""
    with Master() as master:
        server = xmlrpc.client.ServerProxy(master.uri)

        def run(parameters):
            server.setParam("/test", "/", parameters)
            read_launch.cache_clear()
            of_command.cache_clear()
        run(SHIPPED)
        yield run
