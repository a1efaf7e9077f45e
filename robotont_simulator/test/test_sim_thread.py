"""A simulator whose thread has ended by an error."""

import types

import pytest

from robotont_driver.ros.diagnostics import ERROR, OK
from robotont_simulator.simulator_node import SimulatorNode


def test_its_death_is_an_error_in_the_diagnostics():
    node = SimulatorNode.__new__(SimulatorNode)
    node._late_before, node._died = 0, ""
    node._simulation = types.SimpleNamespace(time=1.0)
    node._board = types.SimpleNamespace(pace=types.SimpleNamespace(late=0), run=lambda: None)
    node._run()
    assert node._report()[0] == OK
    node._board.run = lambda: {}[""]
    with pytest.raises(KeyError):
        node._run()
    level, words, _ = node._report()
    assert level == ERROR
    assert "has ended by an error, start it again: KeyError" in words
