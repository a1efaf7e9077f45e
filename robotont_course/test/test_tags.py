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


@in_own_process
def test_on_the_way_to_a_tag_no_other_is_found_and_each_place_is_one():
    """The makers' maze solver took the next message for its tag: a second number, and a place that was no number."""
    lens = Camera(WHEELS, read_world(MAZE), 424, 240, math.pi / 2)
    matrix = np.array([[lens.focal_length, 0, 211.5], [0, lens.focal_length, 119.5], [0, 0, 1]])
    detector = Detector(32, 0.25)
    found = 0
    for x in np.arange(0.6, 3.2, 0.01):
        lens.look((x, 0.6, 0.0))
        seen = detector.find(np.ascontiguousarray(lens.colour()[..., 1]), matrix)
        assert {*seen} <= {1, 2}, (x, seen)
        assert np.isfinite(list(seen.values())).all(), x
        if 1 in seen:
            found += 1
            assert seen[1][1][2] == pytest.approx(3.95 - x - camera_place(WHEELS)[0], rel=0.07), x  # half a pixel
    assert found > 200
