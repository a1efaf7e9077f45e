"""Reader of wheel_params.yaml that lists all errors in it."""

from robotont_driver.parameters import ParameterError
from robotont_driver.wheels import KEYS, read_wheels
from robotont_driver.yaml_file import read_mapping


def read_wheel_file(path):
    """(`Wheels`, mapping, text) of a wheel_params.yaml.

    Raises ValueError with all errors in it, a line for each, each with the file's name; OSError where
    it cannot be read. Everything that takes a wheel file reads it here.
    """
    given, text = read_mapping(path, "wheel parameters: " + ", ".join(KEYS))
    try:
        return read_wheels(given), given, text
    except ParameterError as error:
        raise ValueError("\n".join(f"{path}: {fault}" for fault in error.faults)) from error
