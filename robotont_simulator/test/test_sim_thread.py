"""A simulator whose thread has ended by an error."""

import threading
import types

import pytest

from robotont_driver.ros.diagnostics import ERROR, OK
from robotont_simulator.simulator_node import SimulatorNode


def test_its_death_is_an_error_in_the_diagnostics():
    node = SimulatorNode.__new__(SimulatorNode)
    node._late, node._late_before, node._died, node._stopping = 0, 0, "", threading.Event()
    node._simulation = types.SimpleNamespace(time=1.0)
    node._advance = node._stopping.set
    node._run()
    assert node._report()[0] == OK
    node._stopping.clear()
    node._advance = lambda: {}[""]
    with pytest.raises(KeyError):
        node._run()
    level, words, _ = node._report()
    assert level == ERROR
    assert "has ended by an error, start it again: KeyError" in words
