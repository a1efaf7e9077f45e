"""What comes to where the robot drives is told from what stands there; scans by the distance from shapes."""

import math
import random

import numpy as np
import pytest
import rospy
from navigation_messages import Monitor, scan_of
from sensor_msgs import point_cloud2

from robotont_driver.kinematics.se2 import compose
from robotont_map_navigation.giving_way import GAP, NEAR, STAYS, MovingThings
from robotont_map_navigation.readings import needed_radius
from robotont_simulator.world import shapes
from robotont_testing.node_test import twist

PERIOD = 0.1  # [s] of a scan
CAMERA, ALL_AROUND = np.linspace(-0.515, 0.515, 128), np.linspace(-math.pi, math.pi, 360, endpoint=False)
FURNITURE = [shape for kind, *entry in (
    ("walls", 0.0, 0.0, 6.0, 0.0), ("walls", 6.0, 0.0, 6.0, 6.0), ("walls", 6.0, 6.0, 0.0, 6.0),
    ("walls", 0.0, 6.0, 0.0, 0.0), ("walls", 3.0, 0.0, 3.0, 2.0), ("boxes", 1.5, 4.0, 0.6, 0.4, 0.4),
    ("posts", 4.5, 3.5, 0.03), ("posts", 2.0, 2.5, 0.05)) for shape in shapes(kind, entry)]


def ranges_among(solids, pose, angles):
    """[m] that a scanner at a pose (x, y, yaw) sees at angles [rad] among Shapes, by the distance from the nearest."""
    ways = np.array((np.cos(angles + pose[2]), np.sin(angles + pose[2])))
    ranges = np.full(len(angles), 0.02)
    for _ in range(60):
        x, y = np.array(pose[:2])[:, None] + ranges * ways
        ranges += np.clip(np.min([each.distance(x, y) for each in solids], axis=0), 0.0, None)
    return ranges


def told(start, drives, thing=None, angles=CAMERA, seconds=4.0, way=0.0, seed=1):
    """[m] between robot and thing, when something was told to come; a robot that drives, and thing(time) at (x, y)."""
    noise, things, found, pose = np.random.default_rng(seed), MovingThings(), [], start
    for number in range(round(seconds / PERIOD)):
        now = number * PERIOD
        there = shapes("posts", [*thing(now), 0.15]) if thing else []
        ranges = ranges_among(FURNITURE + there, pose, angles) + noise.normal(0.0, 0.01, len(angles))
        shown = angles + pose[2] + noise.normal(0.0, 0.01)  # by tf, a little beside the truth
        ends, free = np.minimum(ranges, 4.0) * (np.cos(shown), np.sin(shown)), ranges >= 4.0
        ahead = None if way is None else pose[2] + way
        if things.come(pose[:2], ends[:, ~free & (ranges > 0.3)], ends[:, free], ahead, now):
            found.append(math.dist(pose[:2], thing(now)) if thing else 0.0)
        pose = compose(pose, tuple(PERIOD * speed for speed in drives))
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


def test_a_clock_that_is_set_back_ends_no_giving_way():
    things, nothing, point = MovingThings(), np.zeros((2, 0)), np.full((2, 5), 0.4)
    found = [things.come((0.0, 0.0), point * share, nothing, math.pi / 4, now) for now, share in (
        (5000.0, 1.0), (5000.1, 1.0), (5000.2, 1.0), (4.0, 1.0), (4.4, 0.5), (4.4, 0.5))]
    assert found == [False] * 5 + [True]


def test_navigation_stands_while_something_comes_for_10_s_at_most_until_it_has_been_away_for_3_s(monkeypatch):
    """As a curtain in the wind, which would hold a goal for ever. The lower one of two scanners sees what stands."""
    monitor, times = Monitor(monkeypatch), []
    monitor.stand(0.0, 0.0, 0.0)
    monitor.places["low_laser"] = monitor.places["laser"]
    stands = monitor.sent["navigation/stand"]
    while monitor.now < 120.0:
        monitor.sleep(PERIOD / 2)
        comes = (102.0 < monitor.now < 114.0 or monitor.now > 117.5) and monitor.now % 1.2 < 0.6
        monitor.hear("cmd_vel", twist(0.2))
        for frame, seen in ("laser", 0.7 if comes else 3.0), ("low_laser", 0.8):
            monitor.hear("scan", scan_of(np.full(101, seen), stamp=rospy.Time.now(), frame=frame))
        times += [monitor.now] * (len(stands) - len(times))
    first, *_, last = (now for now in times if now < 117.0)
    assert 102.0 < first < 103.5
    assert 8.0 < last - first < 10.0
    assert times[-1] > 118.0
    lots = {one.data for one in stands}
    assert len(lots) == 2, "one for each"
    assert 0.0 < min(lots) < max(lots) <= 2.0, "what cmd_vel_mux takes"


@pytest.mark.parametrize("rays, looked_at", [(101, 101), (640, 160)])
def test_of_a_cameras_rays_as_many_are_looked_at_as_show_who_comes(monkeypatch, rays, looked_at):
    """Each is compared with each of the view before."""
    monitor, counts = Monitor(monkeypatch), []
    monitor.stand(0.0, 0.0, 0.0)
    monkeypatch.setattr(MovingThings, "come", lambda _, place, ends, *others: counts.append(ends.shape[1]))
    monitor.hear("cmd_vel", twist(0.2))
    scan = scan_of(np.full(rays, 0.8), stamp=rospy.Time.now(), frame="laser")
    scan.angle_increment = 1.03 / rays
    monitor.hear("scan", scan)
    assert counts == [looked_at]


@pytest.mark.parametrize("nearest, reading, aside, late, there", [
    (0.4, -math.inf, 0.0, 0.0, True), (0.4, math.nan, 0.0, 0.0, True), (0.4, 0.0, 0.0, 0.0, True),
    (0.4, math.inf, 0.0, 0.0, False), (0.4, 0.5, 0.0, 0.0, False), (0.8, math.nan, 0.0, 0.0, False),
    (None, math.nan, 0.0, 0.0, False), (0.4, math.nan, 0.5, 0.0, False), (0.4, math.nan, 0.0, STAYS, False)])
def test_who_comes_nearer_than_the_scanner_measures_is_told_to_the_costmaps(
        monkeypatch, nearest, reading, aside, late, there):
    """Else he still stands where it saw him last, for a plan, which leads through his feet."""
    monitor, bearings = Monitor(monkeypatch), set()
    monitor.stand(0.0, 0.0, 0.0)
    angles = scan_of([]).angle_min + scan_of([]).angle_increment * np.arange(90)
    for distance in (*(max(nearest, 1.4 - 0.1 * step) for step in range(12)), reading) if nearest else [reading] * 12:
        last = distance is reading
        monitor.sleep(PERIOD + late * last)
        monitor.stand(0.0, aside * last, 0.0)  # driven on, beside him
        monitor.hear("cmd_vel", twist(0.2))
        scan = scan_of(np.where(abs(angles) < 0.3, distance, 2.0), stamp=rospy.Time.now())
        scan.range_min = 0.3
        monitor.hear("scan", scan)
    radius = needed_radius()
    for cloud in monitor.sent["navigation/felt"]:
        points = list(point_cloud2.read_points(cloud))
        bearings |= {round(math.atan2(y, x), 1) for x, y, _ in points}
        for x, y, height in points:  # no motion leans on what may stand at the robot's edge; plans begin outside of it
            assert math.hypot(x, y) - radius == pytest.approx(0.0 if height < 0.1 else 0.06 + GAP, abs=1e-6)
    assert bearings == ({-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3} if there else set())
