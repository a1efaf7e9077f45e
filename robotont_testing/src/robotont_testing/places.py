"""Where files of packages lie, in a development space and in an install space alike."""

import os
from pathlib import Path

import rospkg


def package(name):
    """Folder of a ROS package; raises rospkg.ResourceNotFound."""
    return Path(rospkg.RosPack().get_path(name))


def data(name):
    """A data file that several packages' tests share: golden packets, wheel parameters."""
    return package("robotont_testing") / "data" / name


def config(name):
    """A file of the shipped configuration, such as wheel_params.yaml."""
    return package("robotont_bringup") / "config" / name


def launch(name):
    """A shipped launch file, such as robot.launch, or display.launch of robotont_description."""
    folders = [package(owner) / "launch" for owner in ("robotont_bringup", "robotont_description")]
    return next((folder / name for folder in folders if (folder / name).exists()), Path(name))


def program(owner, name):
    """A node or tool of a package; rosrun starts the same file, after half a second of processor time for its search.

    Raises FileNotFoundError.
    """
    for prefix in os.environ.get("CMAKE_PREFIX_PATH", "").split(os.pathsep):
        file = Path(prefix) / "lib" / owner / name
        if os.access(str(file), os.X_OK):
            return file
    raise FileNotFoundError(f"no program {name} of {owner} in CMAKE_PREFIX_PATH={os.environ.get('CMAKE_PREFIX_PATH')}")
