"""The URDF from the xacro files, with Noetic's xacro or with the one in .build/venv."""

import importlib
import sys
from pathlib import Path

import rospkg
import yaml

from robotont_driver.parameters import ParameterError
from robotont_driver.wheels import read_wheels

XACRO = Path("urdf") / "robotont.urdf.xacro"


def urdf(wheel_params="", prefix="", official="false"):
    """The model as URDF text.

    wheel_params: path of a wheel_params.yaml; empty: the repository's config/wheel_params.yaml.
    prefix: put before the names of all links and joints.
    official: "true" for the chassis of Robotont as delivered, with the official names of frames and joints.
    Raises ParameterError with every fault of the wheel parameters, as the driver's nodes do; OSError
    when there is no such file; ModuleNotFoundError when there is no xacro.
    """
    model = Path(rospkg.RosPack().get_path("robotont_description")) / XACRO
    shipped = "wheel_params_robotont2.yaml" if official == "true" else "wheel_params.yaml"
    path = Path(wheel_params).resolve() if wheel_params else \
        Path(rospkg.RosPack().get_path("robotont_bringup")) / "config" / shipped
    try:
        given = yaml.safe_load(path.read_text())
    except yaml.YAMLError as error:
        raise ParameterError([f"{path}: no YAML: {error}"]) from error
    read_wheels(given if isinstance(given, dict) else {})  # the driver's own check, before anything is drawn
    document = find_xacro().process_file(str(model), mappings={
        "wheel_params": str(path), "prefix": prefix, "official": official})
    return document.toprettyxml(indent="  ")


def find_xacro():
    """The xacro module: from ROS where it has one (Noetic), else from the repository's .build/venv.

    Raises ModuleNotFoundError when there is neither.
    """
    try:
        return importlib.import_module("xacro")
    except ModuleNotFoundError:
        package = Path(rospkg.RosPack().get_path("robotont_description")).resolve()
        for folder in package.parents:
            for venv in folder.glob(".build/venv/lib/python3*/site-packages"):
                sys.path.append(str(venv))  # last: whatever else it holds stands behind the system's
        return importlib.import_module("xacro")


def main():
    """Print the URDF; name:=value arguments as in launch files. Exit status 1 with words when it fails."""
    arguments = dict(argument.split(":=", 1) for argument in sys.argv[1:] if ":=" in argument)
    unknown = [word for word in sys.argv[1:] if word.split(":=")[0] not in ("wheel_params", "prefix", "official")]
    try:
        if unknown:
            raise ParameterError([f"describe: no such argument {' '.join(unknown)}; "
                                  "it knows wheel_params:=FILE, prefix:=TEXT and official:=true"])
        print(urdf(**arguments))
    except ParameterError as error:
        sys.exit("\n".join("wrong parameter " + fault for fault in error.faults))
    except OSError as error:
        sys.exit(f"no wheel parameters: {error}")
    except ModuleNotFoundError as error:
        sys.exit(f"{error}: run ./robotont setup, or on Noetic apt-get install ros-noetic-xacro")
