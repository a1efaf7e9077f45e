"""Fixtures of the tests with faults, which load this module as a plugin: one ROS master and one rig at a time."""

import pytest
import rospy
from fault_rig import Rig

from robotont_testing.harness import Master


@pytest.fixture(scope="session")
def master():
    """One for all files: rospy can be initialised only once in a process."""
    with Master() as master:
        rospy.init_node("faults", disable_signals=True)
        yield master


@pytest.fixture(scope="module")
def rigs(master):
    """rigs(kind): the rig of that kind, one at a time, for their nodes have the same names."""
    current = {}

    def close():
        for rig in current.values():
            rig.close()
        current.clear()

    def get(kind, **environment):
        if kind not in current:
            close()
            current[kind] = Rig(master, **environment)
        return current[kind]
    yield get
    close()
