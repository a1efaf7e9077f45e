"""The guard: its arithmetic, and hands that drive the simulated robot at walls, corners, posts and chair legs."""

import math
import random

import numpy as np
import pytest
from guarded_drive import AROUND, CAMERA, CONE, LIMITS, RADIUS, GuardedDrive
from hypothesis import given
from hypothesis import strategies as st

from robotont_driver.kinematics.se2 import arc, compose
from robotont_simulator.world import Box, read_world
from robotont_teleop.mux.guard import BEYOND, REACTION, REST, SIDE, STALE, STOP, Guard
from robotont_testing import places

SPEEDS = (0.1, 0.2, 0.3, 0.5, 0.65, 0.8)  # [m/s]
numbers = st.floats(-2.0, 2.0)


def guard_before(*points, blind_speed=0.3):
    """A guard that has just seen points all around."""
    guard = Guard(RADIUS, LIMITS, blind_speed)
    ranges = np.full(len(AROUND), math.inf)
    for point in points:
        ranges[np.argmin(abs(np.exp(1j * AROUND) - point / abs(point)))] = abs(point)
    guard.see("laser", (0.0, 0.0, 0.0), AROUND, ranges, 0.1, 100.0)
    return guard


@given(st.tuples(numbers, numbers, numbers), st.floats(0.2, 1.0), st.floats(-0.25, 0.25))
def test_a_command_is_slowed_and_never_bent_and_the_way_to_the_stop_is_free(twist, way, beside):
    asked = max(1e-3, math.hypot(*twist[:2]))
    x, y, _ = arc(np.multiply(twist, way / asked))
    point = complex(x, y) + beside * complex(-twist[1], twist[0]) / asked
    ray = AROUND[round(math.degrees(np.angle(point))) % 360 - 180]
    point = max(abs(point), RADIUS + SIDE + 0.01) * np.exp(1j * ray)
    limited = guard_before(point).limit(twist, 100.0)
    part = math.hypot(*limited) / math.hypot(*twist) if any(twist) else 1.0
    assert 0.0 <= part <= 1.0
    assert np.allclose(limited, np.multiply(twist, part), rtol=1e-9, atol=1e-12)
    stop = (part * asked) ** 2 / 2 / LIMITS.linear_acceleration + (REST if part else 0.0)
    for stopping in np.linspace(0.0, stop, 20):
        x, y, _ = arc(np.multiply(twist, stopping / asked))
        assert abs(point - complex(x, y)) > RADIUS + SIDE - 0.001


def test_away_along_and_on_the_spot_it_moves_as_commanded():
    beside = guard_before(*(complex(x, RADIUS + 0.02) for x in np.linspace(-0.5, 0.5, 41)))
    for twist in ((0.8, 0.0, 0.0), (-0.8, 0.0, 0.0), (0.1, -0.5, 0.0), (0.0, 0.0, 3.0), STOP):
        assert beside.limit(twist, 100.0) == twist
    assert beside.limit((0.1, 0.5, 0.0), 100.0) == STOP
    assert "something on the left, 0.02 m from the robot" in beside.held[1]


def test_without_sensors_it_does_not_interfere_and_stale_ones_cap():
    guard = Guard(RADIUS, LIMITS, 0.3)
    assert guard.limit((5.0, 0.0, 1.0), 100.0) == (5.0, 0.0, 1.0)
    assert "does not interfere" in guard.report(100.0)
    guard = guard_before()
    assert guard.report(100.0) == "sees all around"
    assert guard.limit((0.8, 0.0, 0.0), 100.0 + STALE - 0.01) == (0.8, 0.0, 0.0)
    assert guard.limit((0.8, 0.0, 0.4), 100.01 + STALE) == pytest.approx((0.3, 0.0, 0.15))
    assert guard.report(101.0) == "no fresh scan or range: at most 0.30 m/s"


def test_blind_directions_are_named_and_capped():
    guard = Guard(RADIUS, LIMITS, 0.2)
    guard.see("camera", (0.1, 0.0, 0.0), CAMERA, np.full(len(CAMERA), math.inf), 0.3, 100.0)
    assert guard.report(100.0).endswith("to the left: 30 to 330")
    for x, y, turn, speed in ((0.8, 0.0, 0.0, 0.8), (0.0, 0.8, 0.0, 0.2), (-0.5, 0.0, 0.0, 0.2), (0.8, 0.2, 0.0, 0.2),
                              (0.8, 0.0, 2.0, 0.2)):
        assert math.hypot(*guard.limit((x, y, turn), 100.0)[:2]) == pytest.approx(speed)


def test_what_leaves_a_cone_may_stand_beside_it_for_three_seconds():
    guard, nearest = Guard(RADIUS, LIMITS, 0.3), 0.04
    for distance, at in ((0.06, 100.0), (math.inf, 100.1)):
        guard.see("range", (0.165, 0.0, 0.0), CONE, np.full(len(CONE), distance), nearest, at, BEYOND)
    assert guard.limit((0.2, 0.0, 0.0), 100.1)[0] < 0.1
    guard.see("range", (0.165, 0.0, 0.0), CONE, np.full(len(CONE), math.inf), nearest, 103.1, BEYOND)
    assert guard.limit((0.2, 0.0, 0.0), 103.1) == (0.2, 0.0, 0.0)


def test_what_is_remembered_covers_its_neighbours_across_the_end_of_a_round_scan():
    guard, far = Guard(RADIUS, LIMITS, 0.3), np.full(len(AROUND), math.inf)
    guard.see("laser", (0.0, 0.0, 0.0), AROUND, np.where(AROUND > 3.1, 0.31, far), 0.3, 100.0)
    hidden = abs(AROUND) > 3.1
    assert hidden[0]
    guard.see("laser", (0.0, 0.0, 0.0), AROUND, np.where(hidden, -math.inf, far), 0.3, 100.1)
    assert guard.limit((-0.05, -0.25, 0.0), 100.1) == (-0.05, -0.25, 0.0)


def test_what_comes_into_a_narrow_view_from_beside_too_near_to_measure_counts_as_at_the_robot():
    guard, far = Guard(RADIUS, LIMITS, 0.3), np.full(len(CAMERA), math.inf)
    for at, ranges in ((100.0, far), (100.1, np.where(CAMERA > 0.4, -math.inf, far))):
        guard.see("camera", (0.1, 0.0, 0.0), CAMERA, ranges, 0.3, at)
    assert guard.limit((0.2, 0.0, 0.0), 100.1) == STOP
    assert "too near to measure" in guard.held[1]


def obstacle(kind, way, chance):
    """Boxes that stand in a direction [rad] from the origin."""
    distance, ahead = chance.uniform(1.2, 1.6), np.exp(1j * way)
    size = {"pillar": 0.12, "post": 0.08, "leg": 0.02}.get(kind)
    if size:
        at = ahead * complex(distance, chance.uniform(-0.14, 0.14))
        return [Box(at.real, at.imag, size, size, chance.uniform(0.0, 3.0))]
    tilts = [chance.uniform(-1.0, 1.0)] if kind == "wall" else chance.uniform(-0.6, 0.6) + np.array([-0.8, 0.8])
    middles = [(distance + 0.05) * ahead * np.exp(1j * tilt) for tilt in tilts]
    return [Box(at.real, at.imag, 0.1, 8.0, np.angle(at)) for at in middles]


@pytest.mark.parametrize("drives", [(3, 4, 5, 11, 23), pytest.param(range(200), marks=pytest.mark.long)])
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
        assert 0.03 <= drive.nearest <= drive.gap() + 0.005 <= 0.155


def test_a_sensor_that_is_unplugged_in_mid_drive():
    """The robot slows down and stops before the wall that it remembers."""
    drive = GuardedDrive([Box(2.0, 0.0, 0.1, 4.0, 0.0)], (0.0, 0.0, 0.0))
    drive.drive((0.8, 0.0, 0.0), 1.2)
    drive.plugged = False
    drive.drive((0.8, 0.0, 0.0), 0.8)
    assert drive.drive((0.8, 0.0, 0.0), 0.3) < 0.35
    drive.drive((0.8, 0.0, 0.0), 15.0)
    assert not drive.touched
    assert 0.03 <= drive.gap() <= 0.15


@pytest.mark.parametrize("speed", [0.2, 0.5, 0.8])
def test_where_the_robot_comes_to_rest_after_zeros_is_known(speed):
    """What is remembered would else move by the way that it rolls, 0.1 m from 0.8 m/s."""
    drive = GuardedDrive([Box(9.0, 0.0, 0.1, 0.1, 0.0)], (0.0, 0.0, 0.0))
    drive.drive((speed, 0.0, 0.0), 1.5)
    drive.drive(STOP, 1.0)
    assert drive.guard._pose(drive.now)[0] == pytest.approx(drive.simulation.pose()[0], abs=0.01)


def test_what_a_silent_sensor_has_shown_counts_until_the_robot_has_driven_for_long():
    guard, now = guard_before(0.3), 100.0
    for forth, driven in ((0.8, STOP), (-0.1, (-0.1, 0.0, 0.0)), (0.8, (0.3, 0.0, 0.0))):  # held, away, back
        for _ in range(600):  # 12 s
            now += 0.02
            sent = guard.limit((forth, 0.0, 0.0), now)
            guard.sent(sent, now)
        assert sent == pytest.approx(driven)


@pytest.mark.parametrize("minutes", [0.2, pytest.param(30, marks=pytest.mark.long)])
def test_free_driving_in_the_room_has_no_false_stop(minutes):
    """Random hands, also at walls: nothing is touched, and slowed only what could not stop comfortably."""
    world, chance = read_world(places.config("worlds/room.yaml")), random.Random(5)
    drive = GuardedDrive(world.boxes, world.start)
    drive.drive(STOP, 0.4)
    held = false = 0
    def free(pose, twist):
        """Whether the robot can stop comfortably on the way of the twist."""
        speed = math.hypot(*twist[:2])
        needed = speed ** 2 / 2 / LIMITS.linear_acceleration + speed * (REACTION + 0.2) + 0.1
        return all(drive.gap(*compose(pose, arc(np.multiply(twist, way / speed)))) > 0.03
                   for way in np.arange(0.0, needed, 0.02))

    for _ in range(round(minutes * 30)):
        speed, bearing = chance.choice(SPEEDS), chance.uniform(-math.pi, math.pi)
        twist = speed * math.cos(bearing), speed * math.sin(bearing), chance.choice((0.0, chance.uniform(-1.5, 1.5)))
        for _period in range(100):
            before, pose, moving = drive.held, drive.simulation.pose(), drive.simulation.twist()
            drive.drive(twist, 0.02)
            if drive.held > before:
                held += 1
                false += free(pose, twist) and free(pose, moving)
    print(f"{minutes} min: {held * 0.02:.1f} s slowed, {false} periods without a reason, next {drive.nearest:.3f} m")
    assert not drive.touched
    assert held
    assert not false
