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


class Rigs:
    """One rig at a time, for their nodes have the same names."""

    def __init__(self, master):
        self._master = master
        self._kind = self._rig = None

    def get(self, kind, composed=False, **environment):
        if kind != self._kind:
            self.close()
            self._kind, self._rig = kind, Rig(self._master, composed, **environment)
        return self._rig

    def close(self):
        if self._rig:
            self._rig.close()
        self._kind = self._rig = None


@pytest.fixture(scope="module")
def rigs(master):
    rigs = Rigs(master)
    yield rigs
    rigs.close()
