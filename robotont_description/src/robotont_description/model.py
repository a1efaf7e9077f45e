"""The URDF from the xacro files."""

import sys
from pathlib import Path

import rospkg

from robotont_description.geometry import shipped_wheel_file
from robotont_driver.wheel_file import read_wheel_file

XACRO = Path("urdf") / "robotont.urdf.xacro"
USAGE = "usage: describe [wheel_params:=FILE] [prefix:=robot1/] [official:=true]   prints the URDF"


def urdf(wheel_params="", prefix="", official="false"):
    """The model as a URDF string.

    wheel_params: path of a wheel_params.yaml; empty: the repository's config/wheel_params.yaml.
    prefix: put before the names of all links and joints.
    official: "true" for the chassis of Robotont as delivered, with the official names of frames and joints.
    Raises ValueError with every fault of the wheel file; OSError where it cannot be read; ModuleNotFoundError when
    there is no xacro.
    """
    model = Path(rospkg.RosPack().get_path("robotont_description")) / XACRO
    shipped = "wheel_params_robotont2.yaml" if official == "true" else "wheel_params.yaml"
    path = Path(wheel_params or shipped_wheel_file(shipped)).resolve()
    read_wheel_file(path)  # the driver's own check, before anything is drawn
    import xacro  # here, so that `main` can explain where it is missing

    document = xacro.process_file(str(model), mappings={
        "wheel_params": str(path), "prefix": prefix, "official": official})
    return document.toprettyxml(indent="  ")


def main():
    """Print the URDF; name:=value arguments as in launch files. Exit status 1 and a message when it fails."""
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(USAGE)
        return
    arguments = dict(argument.split(":=", 1) for argument in sys.argv[1:] if ":=" in argument)
    unknown = [word for word in sys.argv[1:] if word.split(":=")[0] not in ("wheel_params", "prefix", "official")]
    try:
        if unknown:
            raise ValueError(f"no such argument {' '.join(unknown)}\n{USAGE}")
        print(urdf(**arguments))
    except (OSError, ValueError) as error:
        sys.exit(f"describe: {error}")
    except ModuleNotFoundError as error:
        sys.exit(f"describe: {error}: use ./robotont shell, or on Noetic apt-get install ros-noetic-xacro")
