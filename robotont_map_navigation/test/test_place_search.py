"""A robot that has looked all around is found, and a place that looks like another one is told."""

import math

import numpy as np
import pytest
from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid
from navigation_messages import ANGLES, CELL, Bus, scan_of, transform, walled

from robotont_driver.kinematics.se2 import between, compose, pose_of
from robotont_map_navigation import relocalize
from robotont_map_navigation.floor_map import FloorMap
from robotont_map_navigation.goal import Status
from robotont_map_navigation.scan_fit import search

CLEARANCE = 0.1
STEPS = np.arange(0.0, 7.0, 0.01)  # [m] of each ray, through the whole room: with less, places in the open look alike


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
        x, y, yaw = between(pose, first.pose)
        assert math.hypot(x, y) < 0.1
        assert abs(math.remainder(yaw, 2 * math.pi)) < 0.05
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
    x, y, yaw = between(pose, first.pose)
    assert math.hypot(x, y) < 0.12
    assert abs(math.remainder(yaw, 2 * math.pi)) < 0.06


class Turning(Bus):
    """A robot, at a pose on a map, that turns as it is told, unless something holds it."""

    base, odometry = "base_link", "odom"

    def __init__(self, monkeypatch, floor_map, pose):
        super().__init__(monkeypatch)
        self.floor_map, self.pose, self.yaw, self.held = floor_map, pose, 1.0, False  # yaw: by its odometry
        monkeypatch.setattr(relocalize, "Frames", lambda: self)
        monkeypatch.setattr(relocalize, "floor_map_of", lambda _: floor_map)

    def sleep(self, seconds):
        super().sleep(seconds)
        commands = self.sent["cmd_vel/navigation"]
        step = 0.0 if self.held or not commands else seconds * commands[-1].angular.z
        self.yaw, self.pose = self.yaw + step, compose(self.pose, (0.0, 0.0, step))
        self.hear("scan", scan_of(np.hypot(*look(self.floor_map, self.pose)[0]), stamp=self.yaw))

    def look_up(self, _frame, _child, stamp):
        return transform("", 0.0, 0.0, stamp).transform

    def robot_in(self, frame):
        return (0.0, 0.0, self.yaw) if frame == self.odometry else None


def test_relocalize_turns_the_robot_once_and_tells_amcl_where_it_is_unless_something_holds_it(monkeypatch):
    floor_map = room((0, 30, 35))
    robot = Turning(monkeypatch, floor_map, compose(floor_map.origin, (1.6, 1.5, 0.3)))
    tool = relocalize.Relocalize()
    robot.hear("map", OccupancyGrid())
    status, words = tool.run()
    assert (status, words[:10]) == (Status.DONE, "found at (")
    assert robot.yaw == pytest.approx(1.0 + 2 * math.pi, abs=0.1)
    told, = robot.sent["initialpose"]
    x, y, yaw = between(robot.pose, pose_of(told.pose.pose))
    assert max(abs(x), abs(y), abs(math.remainder(yaw, 2 * math.pi))) < 0.1
    robot.held = True
    status, words = tool.run()
    assert (status, words[:23]) == (Status.GAVE_UP, "the robot does not turn")
    assert len(robot.sent["initialpose"]) == 1
    assert robot.sent["cmd_vel/navigation"][-1] == Twist()


def test_in_a_room_that_looks_alike_from_both_its_ends_relocalize_tells_amcl_nothing(monkeypatch):
    robot = Turning(monkeypatch, room(), compose(room().origin, (1.0, 1.2, 0.3)))
    tool = relocalize.Relocalize()
    robot.hear("map", OccupancyGrid())
    status, words = tool.run()
    assert (status, "look alike from here" in words) == (Status.LOST, True)
    assert robot.sent["initialpose"] == []
