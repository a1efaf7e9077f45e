"""docs/teleop.md names every parameter as the nodes have it, and config/teleop.yaml only what exists."""

from pathlib import Path

import pytest
import yaml

from robotont_driver.parameters.parameters import markdown_rows, read_parameters
from robotont_teleop import cmd_vel_mux, gamepad_teleop, keyboard_teleop, web_teleop_node
from robotont_testing import places

TABLES = {module.__name__.rpartition(".")[2]: module.PARAMETERS
          for module in (cmd_vel_mux, gamepad_teleop, keyboard_teleop, web_teleop_node)}
DOCS = Path(__file__).resolve().parents[2] / "docs" / "teleop.md"


@pytest.mark.parametrize("row", [row for table in TABLES.values() for row in markdown_rows(table)])
def test_every_parameter_is_in_the_docs(row):
    assert row in DOCS.read_text()


def test_the_shipped_configuration_is_valid():
    for node, given in yaml.safe_load(places.config("teleop.yaml").read_text()).items():
        assert set(read_parameters(TABLES[node], given)) >= set(given)
