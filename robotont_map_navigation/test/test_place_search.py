"""How well a scan fits the map; a robot that has looked all around is found, and places that look alike are told."""

import math

import numpy as np
import pytest
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Twist
from nav_msgs.msg import OccupancyGrid
from navigation_messages import ANGLES, CELL, TimedBus, ranges_in_box, scan_of, walled

from robotont_driver.kinematics.se2 import between, compose, pose_of
from robotont_map_navigation import relocalize
from robotont_map_navigation.floor_map import FloorMap
from robotont_map_navigation.goal import Status
from robotont_map_navigation.readings import rays_of
from robotont_map_navigation.scan_fit import Found, fit, fit_nearby, search
from robotont_testing.bus import transform

MAP = FloorMap(walled(40, 80), CELL, (-1.0, -1.0, 0.0))
BOX = -0.95, 2.95, -0.95, 0.95  # [m] the walls' inner faces of MAP
POSE = (0.3, 0.2, 0.7)
SEEN = ranges_in_box(POSE, *BOX)
LEVEL = Quaternion(w=1.0)
CLEARANCE = 0.1
STEPS = np.arange(0.0, 7.0, 0.01)  # [m] of each ray, through the whole room: with less, places in the open look alike


def assert_near(found, pose, metres, angle):
    x, y, yaw = between(pose, found)
    assert math.hypot(x, y) < metres
    assert abs(math.remainder(yaw, 2 * math.pi)) < angle


def rays(ranges, sees=5.0, rotation=LEVEL):
    return rays_of(scan_of(ranges, sees), TransformStamped(transform=Transform(rotation=rotation)))


def but(rays, ranges):
    """What is seen, but for some rays."""
    seen = SEEN.copy()
    seen[rays] = ranges
    return seen


@pytest.mark.parametrize("seen, sees, expected", [
    (SEEN, 5.0, (1.0, 0.0)),
    (np.minimum(SEEN, 0.4), 5.0, (0.0, 0.0)),
    (but(slice(39), np.tile([math.nan, 0.01, 5.0], 13)), 5.0, (1.0, 0.0)),
    (but(slice(None, None, 3), math.inf), 5.0, (2 / 3, 1 / 3)),
    (np.full(90, math.inf), 0.5, (1.0, 0.0)),
], ids=["the walls", "an obstacle that fills the view", "rays that show nothing", "nothing where the map has a wall",
        "nothing as far as the sensor sees"])
def test_shares_at_the_true_pose(seen, sees, expected):
    assert fit(MAP, POSE, rays(seen, sees), 0.1, 0.1) == pytest.approx(expected)


def test_too_few_rays_prove_nothing():
    assert fit_nearby(MAP, POSE, rays(but(slice(9, None), math.nan)), 0.1) is None


def test_rays_that_end_where_the_map_knows_nothing_prove_nothing():
    cells = MAP.cells.copy()
    cells[:, 50:] = -1
    half, none = FloorMap(cells, CELL, MAP.origin), FloorMap(np.full_like(cells, -1), CELL, MAP.origin)
    assert fit_nearby(none, POSE, rays(SEEN), 0.1) is None
    assert fit_nearby(half, POSE, rays(SEEN), 0.1) == pytest.approx((1.0, 0.0))
    assert fit_nearby(FloorMap(MAP.cells[:, :50], CELL, MAP.origin), POSE, rays(SEEN), 0.1) == pytest.approx((1.0, 0.0))
    through = fit_nearby(half, POSE, rays(np.minimum(SEEN + 0.5, 5.0)), 0.1).through_walls
    assert through > 0.3, "a wall that is known is seen through"


def test_a_sensor_that_hangs_upside_down_and_one_that_is_turned():
    (x, y), _ = rays(SEEN)
    hanging, _ = rays(SEEN, rotation=Quaternion(x=1.0))
    np.testing.assert_allclose(hanging, (x, -y), atol=1e-9)
    turned, _ = rays(SEEN, rotation=Quaternion(z=math.sqrt(0.5), w=math.sqrt(0.5)))
    np.testing.assert_allclose(turned, (-y, x), atol=1e-9)


@pytest.mark.parametrize("off", [(0.08, 0.05, 0.08), (-0.08, -0.1, -0.08)])
def test_a_pose_that_is_nearly_right_explains_what_is_seen_from_a_place_at_a_wall(off):
    """From there few rays end at a wall: along the wall a small angle is a long way."""
    pose = (2.75, -0.75, -1.2)
    explained, through_walls = fit_nearby(MAP, np.add(pose, off), rays(ranges_in_box(pose, *BOX)), 0.2)
    assert explained > 0.9
    assert through_walls < 0.1


def room(*walls):
    """A FloorMap of a room of 5 m x 4 m, turned by 0.4 rad; walls: (first row, last row, column) of cells inside it."""
    cells = walled(82, 102)
    for first, last, column in walls:
        cells[first:last, column] = 100
    return FloorMap(cells, CELL, (-1.0, 2.0, 0.4))


def look(floor_map, pose):
    """(ends 2 x N, free 2 x 0) of a scanner all around at a pose."""
    ways = np.array((np.cos(ANGLES), np.sin(ANGLES)))
    x, y, _ = compose(pose, (*(ways[:, :, None] * STEPS), 0.0))
    return ways * STEPS[floor_map.are_near_walls((x, y), 0.01).argmax(axis=1)], np.zeros((2, 0))


@pytest.mark.parametrize("inside", [(1.6, 1.5, 0.3), (4.2, 0.6, -2.8), (0.6, 3.4, 1.5)])
def test_a_robot_in_a_room_with_a_wall_in_it_is_found_whatever_wrong_pose_is_believed(inside):
    floor_map = room((0, 30, 35))
    pose = compose(floor_map.origin, inside)
    seen = look(floor_map, pose)
    for believed in (None, compose(pose, (1.0, 0.5, 2.0))):
        first, *others = search(floor_map, seen, CLEARANCE, believed)
        assert_near(first.pose, pose, 0.1, 0.05)
        assert first.share > 0.9
        assert all(first.share - other.share > 0.05 for other in others)


def test_a_right_pose_is_not_given_up_for_a_cupboard_that_has_moved():
    """To the opposite corner, where the map fits better with the robot at the opposite place."""
    floor_map, truth = room((1, 10, 35)), room((72, 81, 66))
    pose = compose(floor_map.origin, (1.6, 1.5, 0.3))
    seen = look(truth, pose)
    moved, *_ = search(floor_map, seen, CLEARANCE)
    assert math.dist(pose[:2], moved.pose[:2]) > 1.0
    first, *_ = search(floor_map, seen, CLEARANCE, believed=compose(pose, (0.1, 0.0, 0.1)))
    assert_near(first.pose, pose, 0.12, 0.06)


class Turning(TimedBus):
    """A robot, at a place inside a room, that turns as it is told, unless something holds it; and relocalize."""

    base, odometry = "base_link", "odom"

    def __init__(self, monkeypatch, floor_map, inside):
        super().__init__(monkeypatch)
        self.floor_map, self.pose = floor_map, compose(floor_map.origin, inside)
        self.yaw, self.held, self.amcl = 1.0, False, True  # yaw: by its odometry
        monkeypatch.setattr(relocalize, "Frames", lambda: self)
        monkeypatch.setattr(relocalize, "floor_map_of", lambda _: floor_map)
        self.run = relocalize.Relocalize().run
        self.hear("map", OccupancyGrid())
        self.hear("cmd_vel/driven_by", relocalize.String())

    def sleep(self, seconds):
        super().sleep(seconds)
        commands = self.sent["cmd_vel/navigation"]
        step = 0.0 if self.held or not commands else seconds * commands[-1].angular.z
        self.yaw, self.pose = self.yaw + step, compose(self.pose, (0.0, 0.0, step))
        self.hear("scan", scan_of(np.hypot(*look(self.floor_map, self.pose)[0]), stamp=self.yaw))

    def look_up(self, _frame, _child, stamp):
        return transform("", "", yaw=stamp)

    def robot_in(self, frame):
        told = [pose_of(message.pose.pose) for message in self.sent["initialpose"] if self.amcl]
        return (0.0, 0.0, self.yaw) if frame == self.odometry else told[-1] if told else None


def test_relocalize_turns_the_robot_once_and_tells_amcl_where_it_is_unless_something_holds_it(monkeypatch):
    robot = Turning(monkeypatch, room((0, 30, 35)), (1.6, 1.5, 0.3))
    status, words = robot.run()
    assert (status, words[:10]) == (Status.DONE, "found at (")
    assert robot.yaw == pytest.approx(1.0 + 2 * math.pi, abs=0.1)
    told, = robot.sent["initialpose"]
    assert_near(pose_of(told.pose.pose), robot.pose, 0.1, 0.1)
    robot.held = True
    status, words = robot.run()
    assert (status, words[:23]) == (Status.GAVE_UP, "the robot does not turn")
    assert len(robot.sent["initialpose"]) == 1
    assert robot.sent["cmd_vel/navigation"][-1] == Twist()


def test_a_place_that_was_found_is_told_as_such_only_when_amcl_has_taken_it(monkeypatch):
    """navigation_monitor, and what records, hear the pose as well."""
    robot = Turning(monkeypatch, room((0, 30, 35)), (1.6, 1.5, 0.3))
    robot.amcl = False
    status, words = robot.run()
    assert (status, "is amcl alive?" in words) == (Status.NOT_THERE, True)


def test_in_a_room_that_looks_alike_from_both_its_ends_relocalize_tells_amcl_nothing(monkeypatch):
    robot = Turning(monkeypatch, room(), (1.0, 1.2, 0.3))
    status, words = robot.run()
    assert (status, "look alike from here" in words, robot.sent["initialpose"]) == (Status.LOST, True, [])


def test_a_believed_place_that_fits_badly_hides_no_two_better_ones_that_look_alike(monkeypatch):
    robot, places = Turning(monkeypatch, room(), (1.0, 1.2, 0.3)), [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0)]
    monkeypatch.setattr(relocalize, "search", lambda *_: list(map(Found, places, (0.66, 0.80, 0.79))))
    monkeypatch.setattr(robot, "robot_in", lambda frame: (0.0, 0.0, robot.yaw * (frame == robot.odometry)))
    status, words = robot.run()
    assert (status, words[:35], robot.sent["initialpose"]) == (Status.LOST, "(1.00, 0.00, 0.00) and (2.00, 0.00,", [])
