"""config/teleop.yaml names only parameters of this package's nodes that exist, with values that are allowed."""

import yaml

from robotont_driver.parameters.parameters import read_parameters
from robotont_teleop.hand import joy_watch, keyboard_teleop
from robotont_teleop.mux import cmd_vel_mux
from robotont_teleop.web import web_teleop_node
from robotont_testing import places

TABLES = {module.__name__.rpartition(".")[2]: module.PARAMETERS
          for module in (cmd_vel_mux, joy_watch, keyboard_teleop, web_teleop_node)}


def test_the_shipped_configuration_is_valid():
    configuration = yaml.safe_load(places.config("teleop.yaml").read_text())
    assert set(configuration) - set(TABLES) == {"joy_node", "teleop_twist_joy"}
    for node, given in configuration.items():
        if node not in TABLES:
            continue
        assert set(read_parameters(TABLES[node], given)) >= set(given)
