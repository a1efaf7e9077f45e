"""What stands in a world and is painted there, as the physics, the laser, the map and the camera have it."""

import math
import os
import subprocess
import sys

os.environ.setdefault("MUJOCO_GL", "egl")  # before mujoco

import numpy as np
import pytest
from robot_runs import ROOT

from robotont_description.geometry import camera_place, robot_radius
from robotont_driver.robots.robot_folder import read_robot
from robotont_simulator import camera_node as camera
from robotont_simulator.simulation import Simulation
from robotont_simulator.world import RESOLUTION, draw_map, read_world, tag
from robotont_testing.harness import in_own_process
from robotont_testing.simulated_wheels import touches

WHEELS = read_robot().wheels


def world_of(folder, text):
    file = folder / "world.yaml"
    file.write_text(text)
    return read_world(file)


@pytest.mark.parametrize("number, rows", [  # read off ar_track_alvar's own sheets, Markers_0_to_8.png and _9_to_17
    (0, ["wwkww", "wwkww", "wkwkw", "wwwww", "wwwww"]),
    (1, ["wwkww", "wwkww", "wkwkw", "kkwwk", "wwwkw"]),
    (4, ["wwkww", "wwkww", "wkwkw", "kwwwk", "kwwwk"]),
    (6, ["wwkww", "wwkww", "wkwkw", "kkwww", "kkwww"]),
])
def test_tags_are_those_of_alvar(number, rows):
    assert [row[2:7] for row in tag(number)[2:7]] == rows
    assert all(set(row[:2] + row[7:]) == {"k"} for row in tag(number))


def test_posts_and_things_are_touched_seen_and_mapped_and_paint_is_neither(tmp_path):
    world = world_of(tmp_path, "posts: [[1.0, 0.0, 0.05]]\nthings: [[0.0, 1.0, 0.1, red]]\n"
                               "lines: [[0, 0, 0, 0.9, red]]\ntags: [[-1.0, 0.0, 0.0, 0.2, 3]]")
    simulation = Simulation(WHEELS, world)
    scan = simulation.scan(np.array([0.0, math.pi / 2, math.pi]), 0.3, 4.0)
    assert scan == pytest.approx([0.95, 0.9, math.inf], abs=1e-3)
    image, origin = draw_map(world)
    row, column = image.shape[0] - 1 - int((0.0 - origin[1]) / RESOLUTION), int((0.96 - origin[0]) / RESOLUTION)
    assert image[row, column] == 0
    simulation.carry(1.0 - 0.2 + 0.002, 0.0, 0.0)
    simulation.step()
    assert touches(simulation)


def test_the_depth_is_noisy_by_its_square_and_has_holes():
    depth = np.full((200, 200), 1.0, np.float32)
    depth[:, 50:100], depth[:, 100:150], depth[:, 150:] = 3.0, 0.29, 11.0
    found = camera.measured(depth, np.random.default_rng(1))
    assert found[:, :49].std() == pytest.approx(1000 * camera.NOISE, rel=0.1)
    assert found[:, 52:98].std() == pytest.approx(9000 * camera.NOISE, rel=0.1)
    assert not found[:, 49:51].any()  # the edge
    assert not found[:, 100:].any()   # too near, and too far


@in_own_process
def test_the_camera_sees_colours_distances_and_the_line():
    world = read_world(ROOT / "config" / "worlds" / "colors.yaml")
    lens = camera.Camera(WHEELS, world, 424, 240, math.pi / 2)
    red = next(shape for shape in world.shapes if shape.colour[0] > 2 * max(shape.colour[1:]))
    lens.look((0.0, 0.0, math.atan2(red.y, red.x)))
    picture, depth = lens.colour().astype(int), lens.depth()
    assert picture.shape == (240, 424, 3)
    middle = picture[120, 212]
    assert middle[0] > max(100, 3 * max(middle[1:])), middle
    true = 1000 * (math.hypot(red.x, red.y) - red.length / 2 - camera_place(WHEELS)[0])
    assert abs(depth[118:122, 210:214].mean() - true) < 10, (depth[120, 212], true)
    lens.put(0, -0.5, 0.6)
    lens.look((0.0, 0.0, math.atan2(red.y, red.x)))  # a visitor beside it
    assert (lens.colour() != picture).any()


@in_own_process
def test_the_camera_sees_another_robot_where_it_is():
    world = read_world(ROOT / "config" / "worlds" / "empty.yaml")._replace(others=(2,))
    lens = camera.Camera(WHEELS, world, 64, 48, 1.57)
    lens.put(1, 1.0, 0.0)
    lens.look((0.0, 0.0, 0.0))
    assert lens.depth()[24, 32] == pytest.approx(1000 * (1.0 - robot_radius(WHEELS) - camera_place(WHEELS)[0]), abs=15)
    lens.put(1, 0.0, 1.0)
    lens.look((0.0, 0.0, 0.0))
    assert not 500 < lens.depth()[24, 32] < 1000


def test_without_egl_the_camera_takes_osmesa_and_what_is_missing_is_named(tmp_path):
    def started(**environment):
        return subprocess.run([sys.executable, str(ROOT / "robotont_simulator" / "scripts" / "camera_node"), "-h"],
                              env={**os.environ, **environment}, capture_output=True, text=True, check=False)
    assert started(MUJOCO_EGL_DEVICE_ID="99", MUJOCO_GL="egl").stdout.startswith("usage:")
    (tmp_path / "PIL.py").write_text("raise ImportError('no PIL')")
    lacking = started(MUJOCO_GL="egl", PYTHONPATH=f"{tmp_path}:{os.environ['PYTHONPATH']}")
    assert lacking.returncode == 1
    assert "no PIL: ./robotont setup sim camera" in lacking.stderr
