"""Wheel parameters of the robots that the tests build: the shipped files, the bare seven keys, uneven wheels."""

import math
from pathlib import Path

import yaml

from robotont_testing.places import data

WHEEL_PARAMS = data("wheel_params.yaml")
ROBOTONT2_PARAMS = data("robotont2.yaml")
SHIPPED = yaml.safe_load(WHEEL_PARAMS.read_text())
ROBOTONT2 = yaml.safe_load(ROBOTONT2_PARAMS.read_text())
BARE = yaml.safe_load(data("bare_wheel_params.yaml").read_text())
UNEVEN_4 = {**SHIPPED, "wheelAmount": 4, "wheelRads": [0.1, 1.4, 3.3, 5.0],
            "wheelDistanceFromCenter": [0.11, 0.13, 0.12, 0.15]}
UNEVEN_5 = {**BARE, "wheelAmount": 5, "wheelRads": [0.3, 1.2, 2.9, 3.6, 5.5],
            "wheelRadius": [0.035, 0.036, 0.034, 0.035, 0.05], "referenceDirection": 0.4}
MIRRORED_4 = {**UNEVEN_4, "wheelRads": [0.1, 1.4 + math.pi, 3.3, 5.0],
              "positiveRotation": ["clockwise", "counterclockwise", "clockwise", "clockwise"]}
H_DRIVE = {**BARE, "wheelAmount": 5, "wheelRads": [0.0, 0.0, 0.0, 0.0, math.pi / 2],
           "wheelPositionRads": [1.0, -1.0, 2.2, -2.2, 3.0], "wheelDistanceFromCenter": [0.2, 0.2, 0.18, 0.18, 0.05]}
ROBOTS = {"shipped": SHIPPED, "bare": BARE, "uneven4": UNEVEN_4, "uneven5": UNEVEN_5, "mirrored4": MIRRORED_4,
          "h_drive": H_DRIVE}


def robot_folder(folder, parameters, **nodes):
    """Path of a new folder for `robot:=`, with these wheel parameters; nodes: parameters of its driver.yaml."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "wheel_params.yaml").write_text(yaml.safe_dump(parameters))
    (folder / "driver.yaml").write_text(yaml.safe_dump(nodes))
    return str(folder)
