"""What the pytest modules of this folder share: paths, launch files as roslaunch reads them, the navigation stack."""

import json
import subprocess
import xmlrpc.client
from functools import lru_cache
from pathlib import Path
from unittest import mock

import pytest
import rospkg
from roslaunch import loader
from roslaunch.config import load_config_default

from robotont_testing import places
from robotont_testing.harness import Master
from robotont_testing.robots import SHIPPED

PACKAGE = Path(__file__).resolve().parents[1]
ROOT = PACKAGE.parent
NAVIGATION_PACKAGES = ("move_base", "map_server", "dwa_local_planner", "navfn", "clear_costmap_recovery",
                       "amcl", "fake_localization")


def needs(*packages):
    """The mark of tests that are skipped where one of the ROS packages is missing."""
    lacks = set(packages) - set(rospkg.RosPack().list())
    return pytest.mark.skipif(bool(lacks), reason=f"not installed: {', '.join(lacks)} (ros-noetic-navigation)")


def figures_of(program, *arguments, timeout):
    """What a program of this folder prints as JSON on its last line, within `timeout` [s]."""
    result = subprocess.run(["/usr/bin/python3", str(PACKAGE / "test" / program), *arguments], check=False, text=True,
                            timeout=timeout, capture_output=True)
    print(result.stderr)
    assert result.stdout, result.stderr
    return json.loads(result.stdout.splitlines()[-1])


@lru_cache(maxsize=None)
def read_launch(file, *arguments):
    """(nodes, parameters) of a launch file: arguments and values by full name. The navigation stack may be missing."""
    value_of = loader.Loader.param_value
    # only while it reads: other tests of this process want commands run
    with mock.patch.object(loader.Loader, "param_value", lambda *given: "true" if "/require " in (given[-1] or "")
                           else value_of(*given)):
        config = load_config_default([(str(places.launch(file)), list(arguments))], None)
    return ({node.namespace + node.name: node.args for node in config.nodes},
            {name: parameter.value for name, parameter in config.params.items()})


@pytest.fixture(scope="module")
def running():
    """A master on which a robot's parameters stand: call it with other wheel parameters for another robot."""
    with Master() as master:
        server = xmlrpc.client.ServerProxy(master.uri)

        def run(parameters):
            server.setParam("/test", "/", parameters)
            read_launch.cache_clear()
        run(SHIPPED)
        yield run
