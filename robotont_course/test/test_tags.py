import itertools
import math
import os
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "egl")  # before mujoco

import numpy as np
import pytest

from robotont_description.geometry import camera_place
from robotont_driver.kinematics import se2
from robotont_driver.robots.robot_folder import read_robot
from robotont_simulator.camera_node import Camera
from robotont_simulator.world import PAINT, PICTURE_HEIGHT, World, read_world, shapes
from robotont_testing.harness import in_own_process

cv2 = pytest.importorskip("cv2")
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
def test_a_tag_turns_as_it_is_turned():
    """Straight from 3 m three degrees are a sixth of a pixel: all the tag's edges tell, in a picture of 16 samples."""
    lens = Camera(WHEELS, World(tuple(shapes("tags", [0.0, 0.0, math.pi, 0.2, 3]))), 1280, 720, math.pi / 2, 16)
    matrix = np.array([[lens.focal_length, 0, 639.5], [0, lens.focal_length, 359.5], [0, 0, 1]])
    detector = Detector(32, 0.2)
    for distance, straight in itertools.product((1.0, 2.0, 3.0), (0, 45)):
        for turned, side in ((-9.4, -0.15), (5.5, 0.05), (8.2, 0.2)):
            yaw = math.radians(straight + turned)
            lens.look(se2.compose((0.0, 0.0, yaw), (-distance - camera_place(WHEELS)[0], side * distance, 0.0)))
            rotation, place = detector.find(np.ascontiguousarray(lens.colour()[..., 1]), matrix)[3]
            normal = np.array([-math.sin(yaw), 0.0, -math.cos(yaw)])
            found = cv2.Rodrigues(rotation)[0][:, 2]
            assert math.degrees(math.acos(min(1.0, found @ normal))) < 3.0, (distance, straight + turned)
            middle = PAINT * normal + (side * distance, camera_place(WHEELS)[1] - PICTURE_HEIGHT, distance)
            assert np.linalg.norm(place - middle) < {1.0: 0.01, 2.0: 0.03, 3.0: 0.06}[distance], (distance, yaw)
    assert lens.depth().shape == (720, 1280)


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
