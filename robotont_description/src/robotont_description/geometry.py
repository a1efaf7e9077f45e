"""The robot's size on the floor, from its wheel parameters."""

import argparse
import math
import sys
from pathlib import Path

import rospkg
import yaml

from robotont_driver.parameters import ParameterError
from robotont_driver.wheels import read_wheels

WHEEL_WIDTH = 0.7  # of a wheel over its radius, as in urdf/wheel.xacro: 25 mm to 35 mm
PLATE = 0.125      # [m] radius of the upper plate


def robot_radius(wheels):
    """[m] of the circle around base_link that holds the plate and every corner of every wheel.

    Rounded up to whole centimetres: 0.15 m for the shipped robot, whose wheels reach to 0.142 m.
    """
    corners = [math.hypot(distance + WHEEL_WIDTH * radius / 2, radius)
               for distance, radius in zip(wheels.distances, wheels.radii)]
    return math.ceil(max(*corners, PLATE) * 100) / 100


def main():
    """Print the radius [m]; exit status 1 with words when the wheel parameters are wrong."""
    parser = argparse.ArgumentParser(description="Print the radius of the robot's round footprint [m].")
    parser.add_argument("wheel_params", nargs="?", help="wheel_params.yaml [config/wheel_params.yaml]")
    options = parser.parse_args()
    file = options.wheel_params or Path(rospkg.RosPack().get_path("robotont_bringup")) / "config" / "wheel_params.yaml"
    try:
        given = yaml.safe_load(Path(str(file)).read_text())
        print(robot_radius(read_wheels(given if isinstance(given, dict) else {})))
    except ParameterError as error:
        sys.exit("\n".join("robot_radius: wrong parameter " + fault for fault in error.faults))
    except (OSError, yaml.YAMLError) as error:
        sys.exit(f"robot_radius: no wheel parameters: {error}")
