"""Every number that a user may set has bounds: without them a slip of the pen drives on, or takes the machine down."""

import importlib

import pytest

NODES = {
    "robotont_driver": ("driver_node", "odom_node", "robotont_node", "serial_com_node"),
    "robotont_operations": ("recorder_node",),
    "robotont_simulator": ("simulator_node",),
    "robotont_teleop": ("cmd_vel_mux", "gamepad_teleop", "keyboard_teleop", "web_teleop_node"),
}
TABLES = [f"{package}.{node}" for package, nodes in NODES.items() for node in nodes]


@pytest.mark.parametrize("module", TABLES)
def test_every_number_has_bounds(module):
    for parameter in importlib.import_module(module).PARAMETERS:
        if parameter.is_numeric:
            assert None not in (parameter.minimum, parameter.maximum), parameter.name
            assert parameter.default != parameter.default or parameter.accepts(parameter.default), parameter.name
            assert not parameter.accepts(type(parameter.default)(1e10)), parameter.name
