"""Reader of wheel_params.yaml that lists all errors in it."""

import re

from robotont_driver.kinematics.wheel_params import KEYS, read_wheels
from robotont_driver.parameters.parameters import ParameterError, fault, nearest
from robotont_driver.parameters.yaml_file import read_mapping

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
