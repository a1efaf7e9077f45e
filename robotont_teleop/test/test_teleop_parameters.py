"""config/teleop.yaml names only parameters that exist, with values that are allowed."""

import yaml

from robotont_driver.parameters.parameters import read_parameters
from robotont_teleop.hand import gamepad_teleop, keyboard_teleop
from robotont_teleop.mux import cmd_vel_mux
from robotont_teleop.web import web_teleop_node
from robotont_testing import places

TABLES = {module.__name__.rpartition(".")[2]: module.PARAMETERS
          for module in (cmd_vel_mux, gamepad_teleop, keyboard_teleop, web_teleop_node)}


def test_the_shipped_configuration_is_valid():
    for node, given in yaml.safe_load(places.config("teleop.yaml").read_text()).items():
        assert set(read_parameters(TABLES[node], given)) >= set(given)
