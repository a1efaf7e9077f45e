"""The limits of a robot with drivers that coast are those that its firmware can follow."""

import ast
import subprocess

import yaml
from firmware_tools import DUAL, SRC, tool

from robotont_driver.robots.robot_folder import read_robot
from robotont_testing.places import config


def blamed(acceleration):
    """The loads with which a healthy wheel is blamed at an acceleration [m/s^2] of it."""
    wheels = read_robot("robotont21").wheels
    step = acceleration * 0.02 / wheels.radii[0] * 64 * 18.75 / 6.283185 * 0.02  # [units] each period
    command = [tool("micropython"), str(DUAL / "drives.py"), str(SRC), "starts", str(round(1000 * step)), "1"]
    run = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=120,
                         check=False)
    assert run.returncode == 0, run.stdout
    return ast.literal_eval(run.stdout)


def test_no_healthy_wheel_of_robotont21_is_blamed_as_it_starts():
    """With 1.5 m/s^2 one was, half a second after a start sideways: its drivers coast, and so push less."""
    given = yaml.safe_load(config("robots/robotont21/driver.yaml").read_text())["driver_node"]
    distance = read_robot("robotont21").wheels.levers[0]
    assert blamed(given["max_linear_acceleration"]) == []
    assert blamed(given["max_linear_deceleration"]) == []  # that of a wheel where the direction changes
    assert blamed(given["max_angular_acceleration"] * abs(distance)) == []
    assert blamed(1.5)
