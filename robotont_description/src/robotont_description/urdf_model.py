"""The URDF from the xacro files."""

import sys
import tempfile
from pathlib import Path

import rospkg
import yaml

from robotont_driver.parameters.argument_parser import ArgumentParser
from robotont_driver.robots.robot_folder import read_robot

XACRO = Path("urdf") / "robotont.urdf.xacro"


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

    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:  # numbers only: xacro knows no deg(45)
        wheels = found.wheels
        file.write(yaml.safe_dump({
            "wheelAmount": wheels.amount, "wheelRads": [*wheels.directions], "wheelPositionRads": [*wheels.positions],
            "wheelDistanceFromCenter": [*wheels.distances], "wheelRadius": [*wheels.radii]}))
        file.flush()
        document = xacro.process_file(str(model), mappings={
            "wheel_params": file.name, "prefix": prefix, "official": official})
    return document.toprettyxml(indent="  ")


def main():
    """Print the URDF; exit status 1 and a message when it fails."""
    parser = ArgumentParser(prog="describe", description="Print the URDF; used by launch files.")
    parser.add_argument("--robot", default="", metavar="NAME or FOLDER", help="[thesis; with --official robotont2]")
    parser.add_argument("--prefix", default="", help="before the names of all links and joints, e.g. robot1/")
    parser.add_argument("--official", choices=("true", "false"), default="false",
                        help="true: the chassis of Robotont as delivered, with its names of frames and joints")
    given = parser.parse_args()
    try:
        print(urdf(**vars(given)))
    except (OSError, ValueError) as error:
        sys.exit(f"describe: {error}")
    except ModuleNotFoundError as error:
        sys.exit(f"describe: {error}: ./robotont setup sim and roslaunch in ./robotont shell, or on Noetic apt-get "
                 "install ros-noetic-xacro; robot.launch does without, with description:=false")
