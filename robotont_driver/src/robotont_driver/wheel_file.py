"""A wheel_params.yaml: read, and written anew with other values in the old lines, so that order and comments stay."""

import re

import yaml

from robotont_driver.parameters import ParameterError
from robotont_driver.wheels import KEYS, read_wheels
from robotont_driver.yaml_file import read_mapping


def read_wheel_file(path):
    """(`Wheels`, mapping, text) of a wheel_params.yaml.

    Raises ValueError with all that is wrong with it, a line for each fault, each with the file's name; OSError where
    it cannot be read. Everything that takes a wheel file reads it here.
    """
    given, text = read_mapping(path, "wheel parameters: " + ", ".join(KEYS))
    try:
        return read_wheels(given), given, text
    except ParameterError as error:
        raise ValueError("\n".join(f"{path}: {fault}" for fault in error.faults)) from error


def with_values(text, parameters, note):
    """`text` of a wheel_params.yaml with the values of `parameters` in it and a comment `note` on top.

    Only keys whose value has changed are touched. A value that stands over several lines is put on one. Raises
    ValueError where that cannot be done line by line (braces, anchors).
    """
    old = yaml.safe_load(text)
    changed = {key: rounded(value) for key, value in parameters.items() if old.get(key) != value}
    new = text if text.endswith("\n") else text + "\n"
    for key, value in changed.items():
        # the value: to the comment or the end of the line; then lines that only go on with it
        found = re.search(rf"^({key}:[ \t]*)[^#\n]*?([ \t]*#[^\n]*)?\n(?:[ \t]+[^\n]*\n|- [^\n]*\n)*", new, re.M)
        if found:
            comment = found[2] or ""
            apart = " " if comment.startswith("#") else ""
            new = f"{new[:found.start()]}{found[1]}{value}{apart}{comment}\n{new[found.end():]}"
    if yaml.safe_load(new) != {**old, **changed}:
        raise ValueError(f"found no simple line of each of {', '.join(changed)}, allowed: KEY: VALUE")
    return "".join(f"# {line}\n" for line in note.splitlines()) + new


def rounded(value):
    """A number or list of numbers to a tenth of a micrometre or microradian."""
    return [rounded(item) for item in value] if isinstance(value, (list, tuple)) else round(value, 7)
