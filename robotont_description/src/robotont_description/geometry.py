"""The robot's sizes, from its wheel parameters and urdf/sizes.yaml.

A body of two round plates: the lower one within the wheels, the upper one above them. The model in urdf/ is drawn from
the same two files.
"""

import argparse
import functools
import math
import socket
import sys
from pathlib import Path

import rospkg

from robotont_driver.parameters.yaml_file import read_mapping
from robotont_driver.robots.robot_folder import read_robot


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
    corners = [
        math.hypot(distance * abs(math.sin(direction - position)) + wheel_width(radius) / 2,
                   distance * abs(math.cos(direction - position)) + radius)
        for distance, radius, direction, position in zip(
            wheels.distances, wheels.radii, wheels.directions, wheels.positions)]
    return math.ceil(max(*corners, upper_plate_radius(wheels)) * 100) / 100


def upper_plate_radius(wheels):
    """[m] of the plate above the wheels."""
    return max(sizes()["plate_radius"], min(wheels.distances))


def deck_height(wheels):
    """[m] of the upper plate's top above the floor."""
    return 2 * max(wheels.radii) + sizes()["above_wheels"] + sizes()["plate_thickness"]


def laser_height(wheels):
    """[m] of the frame `laser` above the floor."""
    return deck_height(wheels) + sizes()["laser_above_deck"]


def body(wheels):
    """(radius, floor, top) [m]: the cylinder that must not touch anything, and below which the robot drives over it."""
    return robot_radius(wheels), min(wheels.radii) / 2, laser_height(wheels)


def camera_place(wheels):
    """(x, z) [m] of the frame `camera_link` in base_link."""
    return (upper_plate_radius(wheels) - sizes()["camera_behind_edge"],
            deck_height(wheels) + sizes()["camera_above_deck"])


def radius_of(whose):
    """[m] for `robot:=NAME or FOLDER`, or the robot that runs in `namespace:=NAME`. Raises OSError, ValueError."""
    kind, _, name = whose.partition(":=")
    if kind != "namespace":
        return robot_radius(read_robot(name).wheels)
    from robotont_driver.ros.server_parameters import (
        running_wheels,  # here: the simulator needs no ROS for its geometry
    )

    socket.setdefaulttimeout(5.0)  # [s] a master that hangs
    return robot_radius(running_wheels("/" + name.strip("/")))


def main():
    """Print the radius [m]; exit status 1 and a message when the wheel parameters are wrong."""
    parser = argparse.ArgumentParser(description="Print the radius of a robot's round footprint [m].")
    parser.add_argument("whose", nargs="?", default="robot:=",
                        help="robot:=NAME or FOLDER; namespace:=NAME for the robot that runs there [robot:=thesis]")
    try:
        print(radius_of(parser.parse_args().whose))
    except (OSError, ValueError) as error:
        no_master = "" if not isinstance(error, ConnectionError) else ": no robot runs, start robot.launch first"
        sys.exit(f"robot_radius: {error}{no_master}")
