import pytest
import yaml

from conftest import HERE
from robotont_driver.driver_node import PARAMETERS as DRIVER
from robotont_driver.odom_node import PARAMETERS as ODOM
from robotont_driver.dialects import NAMES
from robotont_driver.parameters import ParameterError, read_parameters
from robotont_driver.serial_com_node import PARAMETERS as SERIAL_COM

TABLES = {"driver_node": DRIVER, "serial_com_node": SERIAL_COM, "odom_node": ODOM}


def test_defaults_are_used_and_have_the_right_type():
    values = read_parameters(SERIAL_COM, {})
    assert values == {parameter.name: parameter.default for parameter in SERIAL_COM}


def test_a_whole_number_serves_as_a_number():
    value = read_parameters(DRIVER, {"cmd_timeout": 1})["cmd_timeout"]
    assert value == 1.0
    assert isinstance(value, float)


@pytest.mark.parametrize("table, name, value, allowed", [
    (DRIVER, "cmd_timeout", -1.0, "a finite number >= 0.05 [s]"),
    (DRIVER, "cmd_timeout", "0.5", "a finite number >= 0.05 [s]"),
    (DRIVER, "cmd_timeout", float("nan"), "a finite number >= 0.05 [s]"),
    (DRIVER, "command_decimals", 1.5, "a whole number >= 0"),
    (DRIVER, "command_decimals", True, "a whole number >= 0"),
    (SERIAL_COM, "packets", "checksum", "one of " + ", ".join(NAMES)),
    (SERIAL_COM, "packets", [], "one of " + ", ".join(NAMES)),
    (SERIAL_COM, "port", 5, "a text"),
    (ODOM, "publish_tf", "yes", "true or false"),
    (ODOM, "publish_tf", 1, "true or false"),
])
def test_a_wrong_value_is_named(table, name, value, allowed):
    with pytest.raises(ParameterError) as raised:
        read_parameters(table, {name: value})
    assert raised.value.faults == [f"~{name}: found {value!r}, allowed: {allowed}"]


def test_a_misspelt_name_is_not_silently_ignored():
    with pytest.raises(ParameterError, match="~cmd_timout: no such parameter; did you mean ~cmd_timeout?"):
        read_parameters(DRIVER, {"cmd_timout": 1.0})


def test_all_faults_come_together():
    with pytest.raises(ParameterError) as raised:
        read_parameters(DRIVER, {"publish_rate": 0, "cmd_timeout": 0, "x": 0})
    assert len(raised.value.faults) == 3


def test_the_shipped_file_is_valid():
    shipped = yaml.safe_load((HERE.parents[1] / "config" / "driver.yaml").read_text())
    assert set(shipped) == set(TABLES)
    for node, given in shipped.items():
        read_parameters(TABLES[node], given)
