"""Robots: folders with wheel_params.yaml and driver.yaml. `robot:=` names one in config/robots, or gives its path."""

import os
from pathlib import Path
from typing import Mapping, NamedTuple

import rospkg

from robotont_driver.kinematics.wheel_params import KEYS, Wheels, read_wheels
from robotont_driver.parameters.parameters import ParameterError, fault, nearest
from robotont_driver.parameters.yaml_file import read_mapping
from robotont_driver.robots.battery import read_pack


def read_wheel_file(path):
    """(`Wheels`, mapping, text) of a wheel_params.yaml. Raises ValueError, a line for each error, and OSError."""
    given, text = read_mapping(path, "wheel parameters: " + ", ".join(KEYS))
    faults = [fault(str(key), given[key], f"no such key, only {', '.join(KEYS)}" + nearest(str(key), KEYS))
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
    if not os.path.isdir(str(folder)):  # False where Path's raises, as for a name that is too long
        hint = "; for ~ write $HOME: no shell reads it behind :=" if str(robot).startswith("~") else ""
        raise OSError(fault("robot", str(robot), others + ": docs/robots.md" + hint))
    return folder


def read_robot(robot=""):
    """The `Robot` of a name or folder. Raises OSError without one, ValueError with all faults of its files."""
    folder = robot_folder(robot)
    found, faults = [folder], []
    for file, read in ((WHEELS, read_wheel_file), (PARAMETERS, _read_parameters)):
        try:
            found += read(folder / file)
        except OSError as error:
            faults.append(f"{error.filename}: {error.strerror}" if error.strerror else str(error))
        except ValueError as error:
            faults.append(str(error))
    if faults:
        raise ValueError("\n".join(faults))
    return Robot(*found)


def _read_parameters(path):
    """(mapping,) of a driver.yaml. Raises ValueError, OSError."""
    parameters, known = read_mapping(path, "parameters by node and name")[0], (*NODES, BATTERY)
    faults = [fault(name, value, "parameters of " + ", ".join(known))
              for name, value in parameters.items() if name not in known or not isinstance(value, dict)]
    try:
        read_pack(parameters.get(BATTERY))
    except ParameterError as error:
        faults += error.faults
    if faults:
        raise ValueError("\n".join(f"{path}: {words}" for words in faults))
    return (parameters,)
