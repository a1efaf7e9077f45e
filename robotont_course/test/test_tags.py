import math
import os
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "egl")  # before mujoco

import numpy as np
import pytest

from robotont_description.geometry import camera_place
from robotont_driver.robots.robot_folder import read_robot
from robotont_simulator.camera_node import Camera
from robotont_simulator.world import read_world
from robotont_testing.harness import in_own_process

pytest.importorskip("cv2.aruco", reason="needs OpenCV: python3-opencv")

from robotont_course.tags_node import Detector  # noqa: E402

MAZE = Path(__file__).resolve().parents[2] / "config" / "worlds" / "tags.yaml"
WHEELS = read_robot().wheels


@in_own_process
def test_a_tag_is_found_where_it_is():
    lens = Camera(WHEELS, read_world(MAZE), 1280, 720, math.pi / 2)
    matrix = np.array([[lens.focal_length, 0, 639.5], [0, lens.focal_length, 359.5], [0, 0, 1]])
    for distance, side, allowed in ((1.0, 0.1, 0.01), (2.0, -0.2, 0.03), (3.0, 0.0, 0.06)):
        lens.look((3.95 - distance - camera_place(WHEELS)[0], 0.6 + side, 0.0))
        grey = np.ascontiguousarray(lens.colour()[..., 1])
        _, place = Detector(32, 0.25).find(grey, matrix)[1]
        error = np.linalg.norm(place - (side, camera_place(WHEELS)[1] - 0.2, distance))
        assert error < allowed, (distance, error)
