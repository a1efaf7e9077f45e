"""The URDF from the xacro files."""

import sys
from pathlib import Path

import rospkg

from robotont_driver.robots.robot_folder import WHEELS, read_robot

XACRO = Path("urdf") / "robotont.urdf.xacro"
USAGE = "usage: describe [robot:=NAME or FOLDER] [prefix:=robot1/] [official:=true]   prints the URDF"


def urdf(robot="", prefix="", official="false"):
    """The model as a URDF string.

    robot: a name of config/robots, or a folder; empty: the thesis' robot, or with `official` that of generation 2.
    prefix: put before the names of all links and joints.
    official: "true" for the chassis of Robotont as delivered, with the official names of frames and joints.
    Raises ValueError with every fault of the robot's files; OSError where they cannot be read; ModuleNotFoundError when
    there is no xacro.
    """
    model = Path(rospkg.RosPack().get_path("robotont_description")) / XACRO
    found = read_robot(robot or ("robotont2" if official == "true" else ""))  # checked before anything is drawn
    import xacro  # here, so that `main` can explain where it is missing

    document = xacro.process_file(str(model), mappings={
        "wheel_params": str((found.folder / WHEELS).resolve()), "prefix": prefix, "official": official})
    return document.toprettyxml(indent="  ")


def main():
    """Print the URDF; name:=value arguments as in launch files. Exit status 1 and a message when it fails."""
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(USAGE)
        return
    arguments = dict(argument.split(":=", 1) for argument in sys.argv[1:] if ":=" in argument)
    unknown = [word for word in sys.argv[1:] if word.split(":=")[0] not in ("robot", "prefix", "official")]
    try:
        if unknown:
            raise ValueError(f"no such argument {' '.join(unknown)}\n{USAGE}")
        print(urdf(**arguments))
    except (OSError, ValueError) as error:
        sys.exit(f"describe: {error}")
    except ModuleNotFoundError as error:
        sys.exit(f"describe: {error}: ./robotont setup sim, or on Noetic apt-get install ros-noetic-xacro")
