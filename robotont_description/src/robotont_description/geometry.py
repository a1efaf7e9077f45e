"""The robot's sizes, from its wheel parameters and urdf/sizes.yaml: for the simulator and navigation.

A body of two round plates: the lower one within the wheels, the upper one above them. The model in urdf/ is drawn from
the same two files.
"""

import argparse
import functools
import math
import sys
from pathlib import Path

import rospkg

from robotont_driver.wheel_file import read_wheel_file
from robotont_driver.yaml_file import read_mapping


@functools.lru_cache(maxsize=None)
def sizes():
    """urdf/sizes.yaml as a mapping."""
    return read_mapping(Path(rospkg.RosPack().get_path("robotont_description")) / "urdf" / "sizes.yaml", "sizes")[0]


def wheel_width(radius):
    """[m] of a wheel with that radius [m], along its axle."""
    return sizes()["wheel_width"] * radius


def robot_radius(wheels):
    """[m] of the circle around base_link that holds the plates and every corner of every wheel.

    Rounded up to whole centimetres: 0.15 m for the shipped robot, whose wheels reach to 0.142 m.
    """
    corners = [math.hypot(distance + wheel_width(radius) / 2, radius)
               for distance, radius in zip(wheels.distances, wheels.radii)]
    return math.ceil(max(*corners, upper_plate_radius(wheels)) * 100) / 100


def upper_plate_radius(wheels):
    """[m] of the plate above the wheels."""
    return max(sizes()["plate_radius"], min(wheels.distances))


def lower_plate_radius(wheels):
    """[m] of the plate between the wheels."""
    free = min(wheels.distances) - wheel_width(max(wheels.radii)) / 2 - sizes()["beside_wheels"]
    return max(sizes()["smallest_plate"], free)


def laser_height(wheels):
    """[m] of the frame `laser` above the floor."""
    deck = 2 * max(wheels.radii) + sizes()["above_wheels"] + sizes()["plate_thickness"]
    return deck + sizes()["laser_above_deck"]


def shipped_wheel_file(name="wheel_params.yaml"):
    """Path of a wheel file that robotont_bringup ships. Raises OSError where the package is not installed."""
    try:
        return Path(rospkg.RosPack().get_path("robotont_bringup")) / "config" / name
    except rospkg.ResourceNotFound:
        raise OSError(f"found no package robotont_bringup with a {name}, allowed: the name of a wheel file") from None


def main():
    """Print the radius [m]; exit status 1 and a message when the wheel parameters are wrong."""
    parser = argparse.ArgumentParser(description="Print the radius of the robot's round footprint [m].")
    parser.add_argument("wheel_params", nargs="?", help="wheel_params.yaml [config/wheel_params.yaml]")
    options = parser.parse_args()
    try:
        print(robot_radius(read_wheel_file(options.wheel_params or shipped_wheel_file())[0]))
    except (OSError, ValueError) as error:
        sys.exit(f"robot_radius: {error}")
