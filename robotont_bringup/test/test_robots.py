"""What a launch sets replaces all that earlier ones left, whatever their robots were, on one master."""

import re
import shutil
import sys
import xmlrpc.client
from pathlib import Path

import pytest
from roslaunch.config import load_config_default
from roslaunch.core import RLException
from roslaunch.launch import ROSLaunchRunner

from robotont_bringup.check_robot import main, parameter_faults
from robotont_driver.kinematics.wheel_params import KEYS, read_wheels
from robotont_driver.nodes import driver_node, odom_node, serial_com_node
from robotont_driver.robots.robot_folder import read_robot, shipped
from robotont_simulator import simulator_node
from robotont_testing import places
from robotont_testing.harness import Master
from robotont_testing.robots import H_DRIVE, MIRRORED_4, SHIPPED, robot_folder

NAMES = ("thesis", "robotont2", "robotont3", "four_wheels")
ROBOT = ("robot.launch", "description:=false")
LAUNCHES = {
    **{name: (*ROBOT, f"robot:={name}") for name in NAMES},
    **{"simulated " + name: ("simulation.launch", "description:=false", f"robot:={name}") for name in NAMES[1::2]},
    "in one": (*ROBOT, "robot:=robotont2", "composed:=true"),
    "tuned": (*ROBOT, "robot:=robotont2", "publish_tf:=false", "imu:=imu"),
    "driver_basic": ("driver_basic.launch",),
    "commands": ("odometry_from_commands.launch",),
}
BESIDE = {  # sets what may stay: the page joins a robot; the official names are those of a robot of its own
    "page": ("teleop.launch",),
    "official": (places.package("robotont_driver") / "launch" / "driver_basic.launch",),
}
TABLES = {"driver_node": driver_node, "serial_com_node": serial_com_node, "odom_node": odom_node,
          "simulator_node": simulator_node}


def seen(parameters, nodes):
    """What the nodes read of a master's parameters: the wheels, and theirs by node and name, official ones included."""
    found = {"wheels": read_wheels(parameters), "truth": parameters.get("measuredPoint"),
             "robot": parameters.get("robot"), "battery": parameters.get("battery")}
    composed = "robotont_node" in nodes
    for node in {*nodes, *(("driver_node", "serial_com_node", "odom_node") if composed else ())} & set(TABLES):
        own = parameters.get(node, {})
        for parameter in TABLES[node].PARAMETERS:
            place, _, name = parameter.official.partition("/")
            default = parameters.get(place, {}).get(name, parameter.default)
            found[node, parameter.name] = repr(own.get(parameter.name, default))  # nan is not equal to itself
    return found


def test_by_hand_a_robots_parameters_are_checked_too(tmp_path, monkeypatch, capsys):
    for name in NAMES:
        assert parameter_faults(read_robot(name)) == []
    folder = Path(shutil.copytree(str(shipped() / "thesis"), str(tmp_path / "mine")))
    (folder / "driver.yaml").write_text("driver_node: {max_weel_speed: 1.0, cmd_timeout: 9.0}\n")
    monkeypatch.setattr(sys, "argv", ["robot", "--path", f"{folder}/"])
    main()
    assert capsys.readouterr().out == str(folder)  # a launch file's: the nodes say the rest
    monkeypatch.setattr(sys, "argv", ["robot", f"{folder}/"])
    with pytest.raises(SystemExit) as end:
        main()
    said = str(end.value)
    assert "driver.yaml: driver_node: ~max_weel_speed: no such parameter; did you mean ~max_wheel_speed?" in said
    assert "~cmd_timeout: found 9.0, allowed: a finite number from 0.05 to 2 [s]" in said
    monkeypatch.setattr(sys, "argv", ["robot", "four_wheels"])
    main()
    assert capsys.readouterr().out.endswith(
        "four_wheels: 4 wheels, which stand at 315, 45, 135, 225 degrees, 50 Hz, motors that reach 1.64 m/s without "
        "load, no mistake found\n")
    (folder / "driver.yaml").write_text("serial_com_node: {packets: robotont2}\nodom_node: {joint_names: a b}\n")
    assert parameter_faults(read_robot(f"{folder}/"))[0].endswith(
        "odom_node: ~joint_names: found 'a b', allowed: 3 names between blanks")
    (folder / "driver.yaml").write_text("serial_com_node: {port: /dev/robotont}\n")
    assert "~port: robot.launch sets it" in parameter_faults(read_robot(f"{folder}/"))[0]
    four = read_robot("four_wheels")
    four.parameters["serial_com_node"] = {"packets": "robotont2"}
    assert "its board cannot have these wheels" in parameter_faults(four)[0]
    many = four._replace(wheels=four.wheels._replace(edges_per_motor_turn=8192), parameters={})
    assert "38349 edges in one PID period, allowed: up to 32767" in parameter_faults(many)[0]
    (folder / "driver.yaml").write_text("driver_node: {max_wheel_speed: 1.9, diagnostic_period: 0.5}\n")
    monkeypatch.setattr(sys, "argv", ["robot", f"{folder}/"])
    main()
    said = capsys.readouterr().out
    assert "max_wheel_speed: found 1.9, the motors reach 1.83 [m/s]" in said
    assert "no mistake" not in said
    odd = robot_folder(tmp_path / "odd", {**SHIPPED, "encoderEdgesPerMotorRevolution": 11, "motorStallTorque": 5.0})
    monkeypatch.setattr(sys, "argv", ["robot", odd])
    main()
    said = capsys.readouterr().out
    assert "warning: encoderEdgesPerMotorRevolution: found 11, a multiple of 4 where both" in said
    assert "warning: motorNoLoadSpeed, motorStallTorque: a motor of 1227 W;" in said


@pytest.mark.nightly
def test_parameters_of_each_launch_behind_all_others_are_those_on_a_fresh_master(tmp_path):
    """Forward and backward, so that each stands before and behind each other one. Nothing is started."""
    every_key = robot_folder(tmp_path / "every_key", {
        **H_DRIVE, "referenceDirection": 0.3, "motorNoLoadSpeed": 300.0, "motorStallTorque": 0.1,
        "motorRotorInertia": 1e-5, "robotMass": 9.0, "measuredPoint": [0.1, 0.0]})
    assert set(read_robot(every_key).given) >= set(KEYS) - {"positiveRotation"}
    signs = robot_folder(tmp_path / "signs", MIRRORED_4)
    LAUNCHES.update(every_key=(*ROBOT, f"robot:={every_key}"), signs=(*ROBOT, f"robot:={signs}"))
    with Master() as master:
        server = xmlrpc.client.ServerProxy(master.uri)
        configurations = {name: load_config_default([(str(places.launch(file)), arguments)], None)
                          for name, (file, *arguments) in {**LAUNCHES, **BESIDE}.items()}

        def load(name):
            configured = configurations[name]
            configured.master.uri = master.uri
            ROSLaunchRunner("test", configured)._load_parameters()

        def read(name):
            return seen(server.getParam("/test", "/")[2], {node.name for node in configurations[name].nodes})

        def alone(name):
            for key in set(server.getParam("/test", "/")[2]) - {"run_id"}:
                server.deleteParam("/test", "/" + key)
            load(name)
            return read(name)
        fresh = {name: alone(name) for name in LAUNCHES}
        load("official")
        for name in (*LAUNCHES, *reversed(list(LAUNCHES))):
            load(name)
            load("page")
            assert read(name) == fresh[name], name


@pytest.mark.parametrize("namespace, space, frame", [("/", "/outer/", "odom"), ("r1", "/outer/r1/", "r1/odom")])
def test_robot_launch_in_a_group_lands_in_it(namespace, space, frame, tmp_path):
    file = tmp_path / "group.launch"
    file.write_text(f"""<launch><group ns="outer"><include file="{places.launch('robot.launch')}">
      <arg name="namespace" value="{namespace}"/></include></group></launch>""")
    found = load_config_default([(str(file), [])], None)
    assert {node.namespace for node in found.nodes} == {space}
    assert found.params[space + "odom_node/odom_frame"].value == frame
    own = {name for name in found.params if not name.startswith("/ros")} - {"/outer/robot_is_free"}
    assert not [name for name in own if not name.startswith(space)]


def test_a_port_in_a_robots_folder_does_not_lead_the_simulator_to_the_real_robot(tmp_path):
    folder = Path(shutil.copytree(str(shipped() / "thesis"), str(tmp_path / "mine")))
    (folder / "driver.yaml").write_text("serial_com_node: {port: /dev/robotont, baudrate: 57600}\n"
                                        "odom_node: {publish_tf: false}\n")
    arguments = [f"robot:={folder}/", "description:=false"]
    found = load_config_default([(str(places.launch("simulation.launch")), arguments)], None).params
    assert found["/serial_com_node/port"].value == found["/simulator_node/port"].value
    assert found["/serial_com_node/baudrate"].value == 57600
    assert found["/odom_node/publish_tf"].value is True


@pytest.mark.parametrize("arguments, space", [([], "/"), (["namespace:=r1"], "/r1/")])
def test_fleet_launch_is_of_the_robot_in_its_namespace(arguments, space):
    found = load_config_default([(str(places.launch("fleet.launch")), [*arguments, "router:=tcp/a:1"])], None)
    assert [node.namespace + node.name for node in found.nodes] == [space + "fleet_node"]
    assert found.params[space + "fleet_node/router"].value == "tcp/a:1"


def test_what_a_launch_file_wants_to_be_free_is_in_its_namespace():
    for file in places.launch("robot.launch").parent.glob("*.launch"):
        free = re.search(r'--free\s+([^"]*)', file.read_text())
        assert not free or all(re.match(r"'?\$\(arg namespace\)/|\w+$", name)
                               for name in re.findall(r"'[^']*'|(?:\$\([^)]*\)|\S)+", free[1])), file


@pytest.mark.parametrize("namespace", ["robotont-7", "/a/7b", "röbot", "a b"])
def test_a_namespace_that_ros_refuses_is_refused_before_anything_starts(namespace, capfd):
    with pytest.raises(RLException):
        load_config_default([(str(places.launch("robot.launch")), ["namespace:=" + namespace])], None)
    words = f"robot.launch: namespace: found '/{namespace.lstrip('/')}', allowed: letters, digits"
    assert words in capfd.readouterr().err


def test_the_page_about_robots_has_every_robot():
    page = (Path(__file__).resolve().parents[2] / "docs" / "robots.md").read_text()
    assert all(f"`{folder.name}`" in page for folder in shipped().iterdir())
