"""What comes to where the robot drives is told from what stands there; scans by the distance from shapes."""

import math
import random
from types import SimpleNamespace

import numpy as np
import pytest
import rospy
from geometry_msgs.msg import Quaternion, Transform, Twist, Vector3
from sensor_msgs.msg import LaserScan

from robotont_driver.kinematics.se2 import compose
from robotont_map_navigation import giving_way
from robotont_map_navigation.giving_way import NEAR, GivesWay, MovingThings
from robotont_simulator.world import shapes

PERIOD = 0.1  # [s] of a scan
CAMERA, ALL_AROUND = np.linspace(-0.515, 0.515, 128), np.linspace(-math.pi, math.pi, 360, endpoint=False)
FURNITURE = [shape for kind, *entry in (
    ("walls", 0.0, 0.0, 6.0, 0.0), ("walls", 6.0, 0.0, 6.0, 6.0), ("walls", 6.0, 6.0, 0.0, 6.0),
    ("walls", 0.0, 6.0, 0.0, 0.0), ("walls", 3.0, 0.0, 3.0, 2.0), ("boxes", 1.5, 4.0, 0.6, 0.4, 0.4),
    ("posts", 4.5, 3.5, 0.03), ("posts", 2.0, 2.5, 0.05)) for shape in shapes(kind, entry)]


def scan(pose, things, angles, noise):
    """(ends, free) of rays in the axes of the room, from a pose; things: (x, y, radius)."""
    ways = np.array((np.cos(angles + pose[2]), np.sin(angles + pose[2])))
    ranges = np.full(len(angles), 0.02)
    for _ in range(60):
        x, y = np.array(pose[:2])[:, None] + ranges * ways
        ranges += np.clip(np.min([*(each.distance(x, y) for each in FURNITURE), *(
            np.hypot(x - thing[0], y - thing[1]) - thing[2] for thing in things)], axis=0), 0.0, None)
    ranges += noise.normal(0.0, 0.01, len(ranges))
    return (ranges * ways)[:, (ranges > 0.3) & (ranges < 4.0)], (4.0 * ways)[:, ranges >= 4.0]


def told(start, twist, thing=None, angles=CAMERA, seconds=4.0, way=0.0, seed=1):
    """[m] between robot and thing, when something was told to come; a robot with a twist, and thing(time) at (x, y)."""
    noise, things, found, pose = np.random.default_rng(seed), MovingThings(), [], start
    chance = random.Random(seed)
    for number in range(round(seconds / PERIOD)):
        now = number * PERIOD
        there = [(*thing(now), 0.15)] if thing else []
        shown = compose(pose, (0.0, 0.0, chance.gauss(0.0, 0.01)))  # by tf, a little beside the truth
        ends, free = scan(pose, there, angles, noise)
        if things.come(shown[:2], ends, free, None if way is None else pose[2] + way, now):
            found.append(math.dist(pose[:2], there[0][:2]) if there else 0.0)
        pose = compose(pose, tuple(PERIOD * speed for speed in twist))
    return found


@pytest.mark.parametrize("angles", [CAMERA, ALL_AROUND])
def test_what_stands_does_not_come_however_the_robot_drives(angles):
    chance = random.Random(7)
    for seed in range(6):
        start = chance.uniform(0.7, 2.3), chance.uniform(4.6, 5.3), chance.uniform(-3.0, 3.0)
        assert told(start, (chance.uniform(0.0, 0.4), 0.0, chance.uniform(-1.0, 1.0)), angles=angles, seconds=2.0,
                    seed=seed) == []
        assert told(start, (0.0, 0.0, 1.0), lambda _: (3.2, 4.5), angles, seed=seed) == []


@pytest.mark.parametrize("angles", [CAMERA, ALL_AROUND])
@pytest.mark.parametrize("speed", [0.4, 0.7, 1.2])
def test_who_crosses_or_comes_head_on_is_told_before_he_is_there(angles, speed):
    start, drives = (0.5, 5.2, 0.0), (0.3, 0.0, 0.0)
    across = told(start, drives, lambda now: (1.6, 6.0 - speed * now), angles)
    head_on = told(start, drives, lambda now: (4.5 - speed * now, 5.2), angles, seconds=6.0)
    assert max(across) > 0.5
    assert max(head_on) > 0.8 * NEAR


def test_who_walks_ahead_or_beside_the_way_does_not_come():
    start = (1.0, 5.2, 0.0)
    assert told(start, (0.3, 0.0, 0.0), lambda now: (1.6 + 0.6 * now, 5.2)) == []
    assert told(start, (0.3, 0.0, 0.0), lambda now: (0.4, 4.0 + 0.5 * now), ALL_AROUND) == []
    assert told(start, (0.3, 0.0, 0.0), lambda now: (2.4 - 0.5 * now, 5.2), ALL_AROUND, way=math.pi) == []
    assert told(start, (0.0, 0.0, 0.5), lambda now: (2.4 - 0.5 * now, 5.2), ALL_AROUND, way=None) == []


def test_scans_that_show_nothing_or_come_late_tell_nothing():
    things, nothing = MovingThings(), np.zeros((2, 0))
    point = np.full((2, 5), 0.4)
    assert not any(things.come((0.0, 0.0), *each, 0.0, now) for now, each in (
        (0.0, (nothing, nothing)), (0.4, (point, nothing)), (2.0, (nothing, point * 5)), (4.0, (point, nothing))))
    assert not things.come((0.0, 0.0), point / 2, nothing, math.pi / 4, 4.4)
    assert things.come((0.0, 0.0), point / 2, nothing, math.pi / 4, 4.4)


def test_what_comes_for_longer_than_10_s_stops_nothing_until_it_has_been_away_for_3_s(monkeypatch):
    """As a curtain in the wind, which would hold a goal for ever."""
    clock, stands, hear, here = [100.0], [], {}, Transform(Vector3(), Quaternion(0.0, 0.0, 0.0, 1.0))
    frames = SimpleNamespace(odometry="odom", base="base_link", look_up=lambda *_: here)
    monkeypatch.setattr(rospy, "Publisher", lambda *_, **__: SimpleNamespace(
        publish=lambda wait: stands.append((clock[0], wait))))
    monkeypatch.setattr(rospy, "Subscriber", lambda topic, _, callback, **__: hear.update({topic: callback}))
    monkeypatch.setattr(giving_way.time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(MovingThings, "come", lambda *_: clock[0] < 112.0 or clock[0] > 115.5)
    GivesWay(frames)
    while clock[0] < 117.0:
        hear["cmd_vel"](Twist(linear=Vector3(0.2, 0.0, 0.0)))
        hear["scan"](LaserScan())
        clock[0] += PERIOD
    times, waits = zip(*stands)
    assert max(time for time in times if time < 113.0) == pytest.approx(110.0, abs=2 * PERIOD)
    assert min(time for time in times if time > 113.0) == pytest.approx(115.5, abs=2 * PERIOD)
    assert len(set(waits)) == 2, "one lot for each"
