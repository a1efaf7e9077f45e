import re
import subprocess
import sys

import numpy as np
import pytest
import yaml
from nav_msgs.msg import Odometry
from robot_runs import ROOT

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.nodes.odom_node import planar
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_simulator.surroundings import WorldMap
from robotont_simulator.world import RESOLUTION, World, box, draw_map, read_world, write_map
from robotont_testing.robots import SHIPPED

WORLDS = sorted((ROOT / "config" / "worlds").glob("*.yaml"))


@pytest.mark.parametrize("file", WORLDS, ids=lambda file: file.stem)
def test_the_shipped_worlds_leave_room_for_the_robot_at_the_start(file):
    world = read_world(file)
    if world.solids:
        image, origin = draw_map(world)
        column = int((world.start[0] - origin[0]) / RESOLUTION)
        row = image.shape[0] - 1 - int((world.start[1] - origin[1]) / RESOLUTION)
        reach = round(0.25 / RESOLUTION)
        assert np.all(image[row - reach:row + reach + 1, column - reach:column + reach + 1] == 254)


@pytest.mark.parametrize("content, words", [
    ("walls: [[0, 0, 1]]", "walls: found [0, 0, 1], allowed: lists of x1, y1, x2, y2: numbers"),
    ("boxes: [[0, 0, 1, .nan, 0]]", "boxes: found"),
    ("boxes: [[0, 0, -1, 1, 0]]", "sizes > 0"),
    ("start: here", "start: found 'here'"),
    ("wall: []", "found 'wall', allowed: walls, boxes, posts, things, lines, tags, pictures and start"),
    ("posts: [[0, 0]]", "posts: found [0, 0], allowed: lists of x, y, radius"),
    ("posts: [[0, 0, 0]]", "sizes > 0"),
    ("things: [[0, 0, 1, pink]]", "with a colour of black, white, red"),
    ("lines: [[0, 0, 1, 1]]", "lists of x1, y1, x2, y2, colour"),
    ("tags: [[0, 0, 0, 1, 256]]", "sizes > 0, a tag's number 0 to 255"),
    ("pictures: [[0, 0, 0, 1, wr, w]]", "rows of one length, of the letters k w r g b y"),
    ("pictures: [[0, 0, 0, 1, '']]", "rows of one length"),
    ("pictures: [[0, 0, 0, 1, 0.5, wr]]", "rows of one length"),
    ("things: [[0, 0, 1, [1, 0, 0]]]", "with a colour of black, white, red"),
    ("walls: 5", "walls: found 5, allowed: a list of lists of x1, y1, x2, y2"),
    ("boxes: [[0, 0, 1e300, 1, 0]]", "numbers up to 1000"),
    ("walls:\n\t- [0, 0, 1, 1]", "no YAML: "),
    ("walls: " + "[" * 5000, "no YAML: maximum recursion depth"),
], ids=lambda value: repr(value)[:40])
def test_a_wrong_file_is_explained(tmp_path, content, words):
    file = tmp_path / "world.yaml"
    file.write_text(content)
    with pytest.raises(ValueError, match=re.escape(words)) as raised:
        read_world(file)
    assert str(file) in str(raised.value)


@pytest.mark.parametrize("content", ["", "# nothing but a comment\n", "walls:\nboxes: []\n"])
def test_an_empty_file_is_an_empty_world(tmp_path, content):
    file = tmp_path / "world.yaml"
    file.write_text(content)
    assert read_world(file).shapes == ()


def test_a_file_that_is_not_there_is_named_from_the_root_on(tmp_path, monkeypatch):
    """roslaunch starts nodes in a folder of its own: there a relative path leads elsewhere."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=f"found no file {tmp_path}/my_world.yaml, allowed: "):
        read_world("./my_world.yaml")


def test_the_map_shows_the_walls_where_the_laser_meets_them(tmp_path):
    file = write_map(read_world(ROOT / "config" / "worlds" / "room.yaml"), tmp_path / "room")
    description = yaml.safe_load(file.read_text())
    data = (tmp_path / description["image"]).read_bytes()
    header, size, _, pixels = data.split(b"\n", 3)
    assert header == b"P5"
    width, height = map(int, size.split())
    image = np.frombuffer(pixels, np.uint8).reshape(height, width)

    def at(x, y):
        column = int((x - description["origin"][0]) / description["resolution"])
        return image[height - 1 - int((y - description["origin"][1]) / description["resolution"]), column]
    # faces of the outer walls, of a wall within, of a box; what lies behind them; where the robot can get
    assert at(0.05, 5.0) == at(9.95, 5.0) == at(3.95, 2.0) == at(4.05, 2.0) == at(7.1, 2.5) == at(7.9, 2.5) == 0
    assert at(-0.1, 5.0) == at(10.1, 5.0) == at(4.0, 2.0) == at(7.5, 2.5) == at(5.0, 5.3) == 205
    assert at(1.0, 1.0) == at(8.0, 8.0) == at(4.0, 4.0) == at(0.1, 5.0) == at(3.9, 2.0) == 254
    # and so map_server takes them
    occupied = [(255 - pixel) / 255 for pixel in (0, 205, 254)]
    assert occupied[0] > description["occupied_thresh"] > occupied[1] > description["free_thresh"] > occupied[2]


@pytest.mark.parametrize("off", [0.0, 0.011, 0.024, 0.026, 0.04, 0.049])
def test_a_wall_is_the_cell_that_its_face_is_in(off):
    """Else the whole room is larger on the map, by half a cell at each side, and amcl's pose with it."""
    faces = 0.5 + off, 3.0 + off
    walls = box(faces[0] - 0.5, 2.0, 1.0, 9.0, 0.0), box(faces[1] + 0.5, 2.0, 1.0, 9.0, 0.0)
    image, origin = draw_map(World((*walls, box(2.0, -2.5, 9.0, 0.1, 0.0), box(2.0, 6.5, 9.0, 0.1, 0.0)),
                                   (2.0, 2.0, 0.0)))
    row = image[image.shape[0] // 2]
    occupied = origin[0] + RESOLUTION * (np.flatnonzero(row == 0) + 0.5)
    assert occupied == pytest.approx(faces, abs=0.01251)


def test_a_start_within_a_wall_has_no_map():
    world = read_world(ROOT / "config" / "worlds" / "room.yaml")
    with pytest.raises(ValueError, match="the start \\(7.5, 2.5\\) is in a wall or a thing"):
        draw_map(world._replace(start=(7.5, 2.5, 0.0)))


def test_make_map_from_the_command_line(tmp_path):
    script = ROOT / "robotont_simulator" / "scripts" / "make_map"
    result = subprocess.run([sys.executable, str(script), str(ROOT / "config" / "worlds" / "maze.yaml"),
                             str(tmp_path / "maze")], stdout=subprocess.PIPE, text=True, check=True)
    assert result.stdout.strip() == str(tmp_path / "maze.yaml")


@pytest.mark.parametrize("seed", range(5))
def test_what_is_thinner_than_a_cell_is_on_the_map(seed):
    generator = np.random.default_rng(seed)
    x, y, yaw = generator.uniform(1.0, 3.0), generator.uniform(1.0, 3.0), generator.uniform(-3.0, 3.0)
    post = box(x, y, 0.03, 0.03, yaw)
    walls = [box(2.0, 0.0, 4.0, 0.1, 0.0), box(2.0, 4.0, 4.0, 0.1, 0.0)]
    (with_post, origin), (without, _) = (draw_map(World((*walls, *more), (0.5, 0.5, 0.0))) for more in ([post], []))
    rows, columns = np.nonzero(with_post != without)
    assert rows.size
    places = origin + (np.array([columns, with_post.shape[0] - 1 - rows]).T + 0.5) * RESOLUTION
    assert np.hypot(*(places - (x, y)).T).max() < 0.05


def test_make_map_does_not_write_over_a_world(tmp_path):
    world = tmp_path / "office.yaml"
    world.write_text("walls: [[0, 0, 4, 0], [0, 3, 4, 3]]\nstart: [1, 1, 0]\n")
    before = world.read_text()
    with pytest.raises(ValueError, match="is there and make_map has not written it"):
        write_map(read_world(world), tmp_path / "office")
    assert world.read_text() == before
    assert not (tmp_path / "office.pgm").exists()
    write_map(read_world(world), tmp_path / "office_map")
    write_map(read_world(world), tmp_path / "office_map")  # a map is drawn anew


@pytest.mark.parametrize("there", ["room.yaml", "room.pgm"])
def test_make_map_does_not_write_over_a_map_of_a_real_room(tmp_path, there):
    (tmp_path / there).write_text("image: room.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
    with pytest.raises(ValueError, match=f"{there} is there and make_map has not written it"):
        write_map(read_world(ROOT / "config" / "worlds" / "room.yaml"), tmp_path / "room")
    assert [(one.name, one.read_text()[:6]) for one in tmp_path.iterdir()] == [(there, "image:")]


def test_a_map_that_needs_gigabytes_is_refused():
    with pytest.raises(ValueError, match=r"found a map of 8004\d x 8004\d pixels, allowed: "):
        draw_map(World((box(-1000.0, -1000.0, 0.1, 0.1, 0.0), box(1000.0, 1000.0, 0.1, 0.1, 0.0)), (0.0, 0.0, 0.0)))


@pytest.mark.parametrize("seed", range(20))
def test_a_reset_of_the_odometry_is_told_from_all_other_motion(seed):
    random = np.random.default_rng(seed)
    odometry = WheelOdometry(Kinematics(read_wheels(SHIPPED)), 0.01, 0.012)
    world_map, starts, made = WorldMap.__new__(WorldMap), [], 0
    world_map._newest, world_map._start, world_map._send_start = None, (0.0, 0.0, 0.0), starts.append

    def hear():
        message = Odometry()
        message.pose.covariance = planar(odometry.pose_covariance)
        world_map._on_odometry(message)
        assert len(starts) == made
    hear()
    for _ in range(10):
        counts = random.integers(-60, 60, 3)
        for _ in range(random.integers(3, 200)):  # also to and fro, and through the origin
            odometry.update(counts.tolist(), 0.01)
            hear()
        if random.random() < 0.5:
            odometry.pose.reset()
            odometry.update([0, 1, 0], 0.01)
            made += 1
            hear()
