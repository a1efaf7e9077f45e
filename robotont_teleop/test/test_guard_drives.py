"""Hands that drive the simulated robot behind the guard: at walls, corners, posts and chair legs, and freely."""

import math
import random

import guarded_drive
import numpy as np
import pytest
import rospy
from guarded_drive import AROUND, CAMERA, LIMITS, SCAN_BOUNDS, SPEEDS, GuardedDrive

from robotont_simulator.world import box, read_world
from robotont_teleop.mux.guard_sensors import SensingGuard
from robotont_testing import places

SIDE = 0.025  # [m] as documented
STOP = (0.0, 0.0, 0.0)


@pytest.mark.parametrize("mass, limit, speed", [(20.0, 1.5, 0.8), (3.6, 1000.0, 1.3)])
def test_a_heavy_robot_and_one_of_high_limits_stop_before_a_wall(mass, limit, speed, monkeypatch):
    wheels = guarded_drive.WHEELS._replace(mass=mass)
    monkeypatch.setattr(guarded_drive, "WHEELS", wheels)
    monkeypatch.setattr(guarded_drive, "LIMITS", LIMITS._replace(linear_acceleration=limit, linear_deceleration=limit))
    monkeypatch.setattr(rospy, "get_param", lambda name, default: limit if "eleration" in name else default)
    drive, sensing = GuardedDrive([box(3.0, 0.0, 0.1, 4.0, 0.0)], (0.0, 0.0, 0.0)), SensingGuard.__new__(SensingGuard)
    sensing.measure(wheels)
    drive.guard._braking = sensing._braking
    drive.drive(STOP, 0.5)
    assert drive.drive((speed, 0.0, 0.0), 6.0) > 0.9 * speed
    assert not drive.touched
    assert drive.nearest > SIDE


@pytest.mark.parametrize("named_by, braking", [("serial_com_node/packets", 0.25), ("robot", 0.25), ("else", 1.5)])
def test_generation_2_which_rolls_out_at_zeros_is_slowed_earlier(named_by, braking, monkeypatch):
    monkeypatch.setattr(rospy, "get_param", lambda name, default: "robotont2" if name == named_by else default)
    sensing = SensingGuard.__new__(SensingGuard)
    sensing.measure(guarded_drive.WHEELS._replace(mass=4.0))
    assert sensing._braking == braking


def obstacle(kind, way, chance):
    """Boxes that stand in a direction [rad] from the origin."""
    distance, ahead = chance.uniform(1.2, 1.6), np.exp(1j * way)
    size = {"pillar": 0.12, "post": 0.08, "leg": 0.02}.get(kind)
    if size:
        at = ahead * complex(distance, chance.uniform(-0.14, 0.14))
        return [box(at.real, at.imag, size, size, chance.uniform(0.0, 3.0))]
    tilts = [chance.uniform(-1.0, 1.0)] if kind == "wall" else chance.uniform(-0.6, 0.6) + np.array([-0.8, 0.8])
    middles = [(distance + 0.05) * ahead * np.exp(1j * tilt) for tilt in tilts]
    return [box(at.real, at.imag, 0.1, 8.0, np.angle(at)) for at in middles]


@pytest.mark.parametrize("drives", [(3, 4, 5, 11, 23), pytest.param(range(600), marks=pytest.mark.long)])
def test_hands_stop_before_walls_corners_posts_and_chair_legs(drives):
    for number in drives:
        chance, speed = random.Random(number), SPEEDS[number % 6]
        sensor = (AROUND, CAMERA, None, AROUND)[number // 4 % 4]
        kind = ("wall", "corner", "post", "leg")[number % 4]
        if sensor is None and kind in ("post", "leg"):
            kind = "pillar"  # what is thinner fits between two cones
        bearing = chance.uniform(-0.15, 0.15) if sensor is CAMERA else chance.uniform(-math.pi, math.pi)
        heading = chance.uniform(-math.pi, math.pi)
        drive = GuardedDrive(obstacle(kind, heading + bearing, chance), (0.0, 0.0, heading), sensor)
        drive.drive(STOP, 0.4)
        fastest = drive.drive((speed * math.cos(bearing), speed * math.sin(bearing), 0.0), 2.5 / speed + 1.0)
        print(number, kind, speed, f"{fastest:.2f} m/s, gap {drive.gap():.3f} m, {drive.guard.held}")
        assert fastest > 0.95 * speed
        assert not drive.touched
        assert SIDE <= drive.nearest <= drive.gap() + 0.005 <= 0.185


@pytest.mark.parametrize(("seed", "minutes", "nearest"), [(5, 0.2, 0.12), (5, 0.2, SCAN_BOUNDS[0]), *(
    pytest.param(seed, 30, SCAN_BOUNDS[0], marks=pytest.mark.long) for seed in (4242, 90210, 5, 77, 31337, 777))])
def test_free_driving_in_the_room_touches_nothing(seed, minutes, nearest):
    """Random hands, also at walls, which slow them."""
    world, chance = read_world(places.config("worlds/room.yaml")), random.Random(seed)
    drive = GuardedDrive(world.solids, world.start, bounds=(nearest, SCAN_BOUNDS[1]))
    drive.drive(STOP, 0.4)
    for _ in range(round(minutes * 30)):
        speed, bearing = chance.choice(SPEEDS), chance.uniform(-math.pi, math.pi)
        twist = speed * math.cos(bearing), speed * math.sin(bearing), chance.choice((0.0, chance.uniform(-1.5, 1.5)))
        drive.drive(twist, 2.0)
    print(f"{minutes} min: {drive.held * 0.02:.1f} s slowed, next {drive.nearest:.3f} m")
    assert not drive.touched
    assert drive.held
