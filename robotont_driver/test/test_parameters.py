import shutil

import pytest

from robotont_driver.nodes.driver_node import PARAMETERS as DRIVER
from robotont_driver.nodes.odom_node import PARAMETERS as ODOM
from robotont_driver.nodes.odom_node import OdomNode
from robotont_driver.nodes.serial_com_node import PARAMETERS as SERIAL_COM
from robotont_driver.parameters.parameters import ParameterError, read_parameters, shown
from robotont_driver.robots.robot_folder import read_robot, shipped
from robotont_driver.ros.server_parameters import COMMON_PARAMETERS

TIMEOUT = "a finite number from 0.05 to 2 [s]: for so long the robot drives on when its commander dies"
DECIMALS = "a whole number from 0 to 3: with more, the packets of many wheels do not fit into a line"
TABLES = {"driver_node": DRIVER, "serial_com_node": SERIAL_COM, "odom_node": ODOM,
          "every node": COMMON_PARAMETERS}


def test_a_whole_number_serves_as_a_number():
    value = read_parameters(DRIVER, {"cmd_timeout": 1})["cmd_timeout"]
    assert value == 1.0
    assert isinstance(value, float)


@pytest.mark.parametrize("table, name, value, allowed", [
    (DRIVER, "cmd_timeout", -1.0, TIMEOUT),
    (DRIVER, "cmd_timeout", "0.5", TIMEOUT + "; '0.5' is a text to YAML, write 0.5"),
    (DRIVER, "cmd_timeout", float("nan"), TIMEOUT),
    (DRIVER, "cmd_timeout", 500, TIMEOUT),  # milliseconds
    (DRIVER, "cmd_timeout", 10 ** 400, TIMEOUT),
    (DRIVER, "command_decimals", 1.5, DECIMALS),
    (DRIVER, "command_decimals", 60, DECIMALS),
    (DRIVER, "command_decimals", True, DECIMALS),
    (SERIAL_COM, "packets", "checksum", "one of auto, plain, checked, robotont2, robotont3"),
    (SERIAL_COM, "packets", [], "one of auto, plain, checked, robotont2, robotont3"),
    (SERIAL_COM, "port", 5, "a string"),
    (ODOM, "publish_tf", "yes", "true or false"),
    (ODOM, "publish_tf", 1, "true or false"),
])
def test_a_wrong_value_is_named(table, name, value, allowed):
    with pytest.raises(ParameterError) as raised:
        read_parameters(table, {name: value})
    assert raised.value.faults == [f"~{name}: found {shown(value)}, allowed: {allowed}"]


def test_what_was_found_is_shown_in_a_few_words():
    assert 3 < len(shown({"a": ["b" * 10 ** 6]})) < 300


def test_packets_are_repeated_twice_within_the_time_out_of_the_next_node():
    slowest, = (one.minimum for one in DRIVER if one.name == "publish_rate")
    shortest, = (one.minimum for one in SERIAL_COM if one.name == "write_timeout")
    assert slowest * shortest >= 2


def test_frames_of_one_name_are_refused():
    with pytest.raises(ParameterError, match="two different names"):
        OdomNode("odom_node", None, read_parameters(ODOM, {"odom_frame": "base_link"}), None)


def test_all_faults_come_together():
    with pytest.raises(ParameterError) as raised:
        read_parameters(DRIVER, {"publish_rate": 0, "cmd_timeout": 0, "x": 0})
    assert len(raised.value.faults) == 3


@pytest.mark.parametrize("name", [folder.name for folder in shipped().iterdir()])
def test_the_shipped_robots_are_valid(name, tmp_path):
    """So are their copies, by `cp -r`."""
    shutil.copytree(str(shipped() / name), str(tmp_path / name), symlinks=True)
    given = read_robot(tmp_path / name).parameters
    for node in {*given} - {"battery"}:
        read_parameters(TABLES[node], given[node])


def test_what_is_wrong_with_a_folder_is_told_with_its_place(tmp_path):
    for file in (shipped() / "robotont2").iterdir():
        shutil.copy(str(file), str(tmp_path))
    (tmp_path / "driver.yaml").write_text("battery: {}")
    for robot, words in ((tmp_path, f"{tmp_path}/driver.yaml: battery: found {{}}, allowed: "),
                         (tmp_path / "none", "none', allowed: a folder with wheel_params.yaml and driver.yaml"),
                         ("~/robot", "; for ~ write $HOME: no shell reads it behind :="),
                         ("./" + 5000 * "x", ", allowed: a folder with")):
        with pytest.raises((OSError, ValueError)) as raised:
            read_robot(robot)
        assert words in str(raised.value)
    (tmp_path / "driver.yaml").unlink()
    with pytest.raises(ValueError, match=f"^{tmp_path}/driver.yaml: No such file or directory$"):
        read_robot(tmp_path)
