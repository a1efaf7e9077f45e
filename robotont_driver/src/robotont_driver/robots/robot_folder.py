"""Robots: folders with wheel_params.yaml and driver.yaml. `robot:=` names one in config/robots, or gives its path."""

import re
from pathlib import Path
from typing import Mapping, NamedTuple

import rospkg

from robotont_driver.kinematics.wheel_params import KEYS, Wheels, read_wheels
from robotont_driver.parameters.parameters import ParameterError, fault, nearest
from robotont_driver.parameters.yaml_file import read_mapping
from robotont_driver.robots.battery import read_pack

_RATIO = re.compile(r"^ *(\w+) *: *([0-9]+(?::[0-9.]+)+)", re.MULTILINE)  # YAML reads 1:30 as 90, in base 60


def read_wheel_file(path):
    """(`Wheels`, mapping, text) of a wheel_params.yaml.

    Raises ValueError with all errors in it, a line for each, each with the file's name; OSError where
    it cannot be read. Everything that takes a wheel file reads it here.
    """
    given, text = read_mapping(path, "wheel parameters: " + ", ".join(KEYS))
    faults = [f"{key}: found {found}, allowed: a number, such as {found.rpartition(':')[2]}"
              for key, found in _RATIO.findall(text)]
    faults += [fault(str(key), given[key], f"no such key, only {', '.join(KEYS)}" + nearest(str(key), KEYS))
               for key in given if key not in KEYS]
    try:
        wheels = read_wheels(given)
    except ParameterError as error:
        faults += error.faults
    if faults:
        raise ValueError("\n".join(f"{path}: {words}" for words in faults))
    return wheels, given, text


DEFAULT = "thesis"
WHEELS, PARAMETERS = "wheel_params.yaml", "driver.yaml"
NODES = ("driver_node", "serial_com_node", "odom_node", "robotont_node")  # whose parameters a robot may have
BATTERY = "battery"  # ... and its pack


class Robot(NamedTuple):
    """A checked robot."""

    folder: Path
    wheels: Wheels
    given: Mapping       # contents of its wheel_params.yaml
    text: str            # of that file
    parameters: Mapping  # by node and name, of its driver.yaml

    @property
    def packets(self):
        """Protocol that its board must speak; "auto" for any."""
        return self.parameters.get("serial_com_node", {}).get("packets", "auto")


def shipped():
    """Folder of the robots that robotont_bringup ships. Raises OSError where the package is not installed."""
    try:
        return Path(rospkg.RosPack().get_path("robotont_bringup")) / "config" / "robots"
    except rospkg.ResourceNotFound:
        raise OSError("found no package robotont_bringup with robots, allowed: the folder of a robot") from None


def robot_folder(robot=""):
    """Path of a robot's folder. robot: a name, or a path with a slash in it; empty: thesis. Raises OSError."""
    if "/" in str(robot):
        folder, others = Path(robot), "a folder with wheel_params.yaml and driver.yaml"
    else:
        folder = shipped() / (str(robot) or DEFAULT)
        others = ", ".join(sorted(path.name for path in shipped().iterdir())) + ", or a folder (with a / in its name)"
    if not folder.is_dir():
        raise OSError(fault("robot", str(robot), others + ": docs/robots.md"))
    return folder


def read_robot(robot=""):
    """The `Robot` of a name or folder. Raises OSError without one, ValueError with all faults of its files."""
    folder = robot_folder(robot)
    faults = []
    try:
        wheels, given, text = read_wheel_file(folder / WHEELS)
    except (OSError, ValueError) as error:
        faults.append(str(error))
    try:
        parameters = read_mapping(folder / PARAMETERS, "parameters by node and name")[0]
        known = (*NODES, BATTERY)
        faults += [f"{folder / PARAMETERS}: " + fault(name, value, "parameters of " + ", ".join(known))
                   for name, value in parameters.items() if name not in known or not isinstance(value, dict)]
        read_pack(parameters.get(BATTERY))
    except (OSError, ValueError) as error:
        faults.append(str(error))
    if faults:
        raise ValueError("\n".join(faults))
    return Robot(folder, wheels, given, text, parameters)
