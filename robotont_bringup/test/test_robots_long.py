"""Every ordered pair of launches, one behind the other on one master, in 10 min; test_robots.py tries some."""

import itertools

import pytest
from robots_rig import LAUNCHES, NAMES, Parameters, Rig, assert_same

from robotont_testing.harness import Master

pytestmark = pytest.mark.long
ALL = [*NAMES, "driver_basic", *("simulated " + name for name in NAMES)]


def test_parameters_of_each_launch_behind_each_other_one_are_those_on_a_fresh_master():
    with Master() as master:
        parameters = Parameters(master)
        fresh = {name: parameters.alone(name) for name in LAUNCHES}
        for before, after in itertools.product(LAUNCHES, LAUNCHES):
            if after == "official":  # its own names; docs/from-the-official-stack.md
                continue
            parameters.alone(before)
            assert parameters.load(after) == fresh[after], f"{after} behind {before}"


def each_behind_each(names):
    """A walk in which each name stands once behind each other one."""
    walk = names[:1]
    for turn, name in enumerate(names):
        for other in (*names[1:turn], *(names[:1] if turn else ())):
            walk = [*walk, name, other]
    return walk


def test_each_robot_drives_behind_each_other_one_as_alone():
    walk = each_behind_each(ALL)
    with Master() as master:
        rig, parameters = Rig(master), Parameters(master)
        alone = {name: parameters.forget() or rig.behaviour(name) for name in dict.fromkeys(walk)}
        parameters.forget()
        for turn, name in enumerate(walk):
            found = rig.behaviour(name, between(rig, turn, name))
            assert_same(found, alone[name], f"{name} behind {list(walk[:turn][-1:])}")


def between(rig, turn, name):
    """What happens between start and drive: the page joins, and at every other turn the driver is killed."""
    def happen():
        rig.join()
        if turn % 2 and name in NAMES:
            rig.kill_driver()
    return happen
