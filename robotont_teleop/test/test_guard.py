"""The guard's arithmetic."""

import math

import numpy as np
import pytest
from guarded_drive import AROUND, CAMERA, CONE, LIMITS, RADIUS, SCAN_BOUNDS, SPEEDS, make_guard, place
from hypothesis import given
from hypothesis import strategies as st

from robotont_driver.kinematics.se2 import arc

BOUNDS = (0.12, 4.0)  # [m] of a laser scanner
FAR = np.full(len(AROUND), math.inf)
SIDE, REST, REACTION, READINGS = 0.025, 0.055, 0.1, 7  # as documented
STOP, AHEAD, HAND = (0.0, 0.0, 0.0), (0.8, 0.0, 0.0), 0.8
SLOW = pytest.approx(0.3)  # [m/s], the blind speed
numbers = st.floats(-2.0, 2.0)


def show(guard, ranges, until=100.0, times=READINGS, period=0.1, sensor="laser", where=None, angles=AROUND,
         bounds=BOUNDS):
    """A sensor shows the same again and again, the last time at `until` [s]; returns the guard."""
    for at in until - period * np.arange(times)[::-1]:
        if at - guard._track[-1][0] > 0.9:
            guard.moves(STOP, at)
        guard.see(sensor, where or place(), angles, ranges, bounds, at)
    return guard


def drive_on(guard, twist, since, seconds):
    """The odometry tells of a motion, 50 times per second."""
    guard.moves(STOP, since)
    for tick in range(round(seconds * 50)):
        guard.moves(twist, since + 0.02 * (tick + 1))


def scan_of(*points):
    """Ranges of a scan all around that shows points, x + iy [m]."""
    ranges = FAR.copy()
    for point in points:
        ranges[np.argmin(abs(np.exp(1j * AROUND) - point / abs(point)))] = abs(point)
    return ranges


def guard_before(*points):
    """A guard that has just seen points all around."""
    return show(make_guard(), scan_of(*points), times=2)


def speed_of(guard, twist=AHEAD, now=100.0):
    """[m/s] that it allows."""
    return math.hypot(*guard.limit(twist, now)[:2])


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
    for stopping in np.linspace(0.0, (part * asked) ** 2 / 2 / LIMITS.linear_acceleration, 20):
        x, y, _ = arc(np.multiply(twist, stopping / asked))
        assert abs(point - complex(x, y)) > RADIUS + SIDE - 0.001


@pytest.mark.parametrize("speed", SPEEDS)
def test_the_nearest_at_which_a_speed_is_allowed_is_the_way_to_stand(speed):
    """REST and SIDE away, braking as the driver does, after REACTION."""
    needed = RADIUS + SIDE + REST + speed * REACTION + speed ** 2 / 2 / LIMITS.linear_acceleration
    assert speed_of(guard_before(needed + 0.001), (speed, 0.0, 0.0)) == speed
    assert 0.9 * speed < speed_of(guard_before(needed - 0.001), (speed, 0.0, 0.0)) < speed
    assert guard_before(RADIUS + SIDE + REST).limit((speed, 0.0, 0.0), 100.0) == STOP


def test_away_along_and_on_the_spot_it_moves_as_commanded():
    beside = guard_before(*(complex(x, RADIUS + 0.02) for x in np.linspace(-0.5, 0.5, 41)))
    for twist in ((0.8, 0.0, 0.0), (-0.8, 0.0, 0.0), (0.1, -0.5, 0.0), (0.0, 0.0, 3.0), STOP):
        assert beside.limit(twist, 100.0) == twist
    assert beside.limit((0.1, 0.5, 0.0), 100.0) == STOP
    assert "something on the left, 0.02 m from the robot" in beside.held[1]


@pytest.mark.parametrize(("period", "lasts"), [(0.01, 0.3), (0.1, 0.7), (0.2, 1.4), (1.0, 2.0)])
def test_a_sensor_sees_nothing_any_more_seven_of_its_own_periods_after_its_newest_reading(period, lasts):
    guard = show(make_guard(), FAR, period=period)
    assert guard.report(99.9 + lasts) == (True, "sees all around")
    assert speed_of(guard, now=99.99 + lasts) == HAND
    assert guard.limit((0.8, 0.0, 0.4), 100.01 + lasts) == pytest.approx((0.3, 0.0, 0.15))
    assert guard.report(100.01 + lasts)[1].endswith("where no sensor sees: ahead, on the left, behind, on the right")
    assert speed_of(show(make_guard(), scan_of(0.2), period=period), now=100.01 + lasts) == SLOW


@pytest.mark.parametrize("missed", [math.inf, math.nan])
def test_what_every_sixth_scan_shows_is_there(missed):
    leg = scan_of(0.22)
    guard = show(make_guard(), leg)
    show(guard, np.where(np.isfinite(leg), missed, FAR), 100.5, times=5)
    assert guard.limit(AHEAD, 100.6) == STOP


def test_blind_directions_are_named_and_capped():
    guard = show(make_guard(0.2), np.full(len(CAMERA), math.inf), angles=CAMERA, where=place(0.1))
    assert guard.report(100.0)[1] == "by hand at most 0.20 m/s where no sensor sees: on the left, behind, on the right"
    for x, y, turn, speed in ((0.8, 0.0, 0.0, 0.8), (0.0, 0.8, 0.0, 0.2), (-0.5, 0.0, 0.0, 0.2), (0.8, 0.1, 0.0, 0.806),
                              (0.8, 0.2, 0.0, 0.2), (0.8, 0.0, 2.0, 0.2), (0.8, 0.0, -2.0, 0.2)):
        assert speed_of(guard, (x, y, turn)) == pytest.approx(speed, abs=0.001)


def test_what_was_ahead_is_on_the_right_once_the_robot_has_turned_to_the_left():
    guard = show(make_guard(), np.full(len(CAMERA), math.inf), angles=CAMERA)
    drive_on(guard, (0.0, 0.0, 2.5), 100.0, 0.6)
    yaw = guard._track[-1][3]
    assert yaw == pytest.approx(1.5)
    assert speed_of(guard, (0.8 * math.cos(yaw), -0.8 * math.sin(yaw), 0.0), 100.6) == pytest.approx(HAND)
    assert speed_of(guard, now=100.6) == SLOW
    drive_on(guard, STOP, 100.6, 0.9)
    show(guard, np.full(len(CAMERA), math.inf), 101.5, angles=CAMERA)
    assert speed_of(guard, now=101.5) == pytest.approx(HAND)
    assert speed_of(guard, (0.0, -0.8, 0.0), 101.5) == SLOW
    show(guard, scan_of(0.2), 101.6, times=1)
    assert guard.limit(AHEAD, 101.6) == STOP
    assert "ahead, 0.05 m" in guard.held[1]


@pytest.mark.parametrize(("farthest", "speed"), [(0.35, 0.639), (0.5, 0.885), (4.0, 2.211)])
def test_it_drives_so_fast_as_it_can_stop_within_what_a_sensor_sees(farthest, speed):
    guard = show(make_guard(), FAR, bounds=(0.12, farthest))
    assert speed_of(guard, (5.0, 0.0, 0.0)) == pytest.approx(speed, abs=0.005)


def test_what_a_sensor_of_short_range_has_seen_is_behind_once_the_robot_has_moved():
    guard = show(make_guard(), FAR, bounds=(0.12, 0.5), period=0.2)
    drive_on(guard, AHEAD, 100.0, 0.3)
    assert 0.3 < speed_of(guard, now=100.3) < 0.75


@pytest.mark.parametrize("frequency", [10, 50, 200, 500, 1000])
def test_odometry_of_any_rate_tells_where_an_old_reading_was_made(frequency):
    guard = make_guard()
    drive_on(guard, STOP, 97.8, 0.1)
    for tick in range(round(2.1 * frequency)):
        guard.moves(AHEAD, 97.9 + (tick + 1) / frequency)
    for age in (1.6, 1.2, 0.8):
        guard.see("laser", place(), AROUND, scan_of(0.5 + 0.8 * age), BOUNDS, 100.0 - age)
    assert guard.limit(AHEAD, 100.0)[0] == pytest.approx(0.762, abs=0.002)


NO_READING = (0.0, -0.0, math.nan, -1.0, 65535.0, 65.535, 8.19, 0.119, 4.01, 1e-30, 1e30)


@pytest.mark.parametrize("before", [False, True])
@pytest.mark.parametrize("least, value", [
    *((0.12, value) for value in NO_READING), (0.0, 0.0), (0.0, -0.0), (0.0, -1.0), (-2.0, 0.0), (-2.0, -1.0)])
def test_no_reading_is_not_free(least, value, before):
    """At once where nothing was read before; else when the newest reading has become old."""
    guard = make_guard()
    if before:
        assert speed_of(show(guard, FAR, where=place(0.2))) == HAND
    show(guard, np.full(len(AROUND), value), 100.8, where=place(0.2), bounds=(least, 4.0))
    assert speed_of(guard, now=100.81) == SLOW
    assert guard.held is None


@pytest.mark.parametrize("roll", [0.0, math.pi])
@pytest.mark.parametrize("pitch", [0.0, 0.3, -0.3])
def test_a_sensor_that_stands_hangs_or_tilts_brakes_the_right_side(roll, pitch):
    """A wall on the left, the floor below, the ceiling above it."""
    where = place(0.0, 0.0, 0.4, 0.2, roll, pitch)
    rays = np.dot(where[0], (np.cos(AROUND), np.sin(AROUND), 0.0 * AROUND)) + 1e-9
    hits = np.array([0.26 / rays[1], (0.0 - 0.2) / rays[2], (0.3 - 0.2) / rays[2]])
    ranges = np.where(hits > 0.0, hits, math.inf).min(axis=0)
    guard = show(make_guard(), np.where(ranges > BOUNDS[1], math.inf, ranges), where=where)
    assert speed_of(guard, (0.0, 0.8, 0.0)) < 0.2
    assert "on the left, 0.11 m" in guard.held[1]
    for free in ((0.0, -0.5, 0.0), (0.5, 0.0, 0.0), (-0.5, 0.0, 0.0)):
        assert speed_of(guard, free) == pytest.approx(0.4, abs=0.101) if pitch else 0.5  # blind where it rises


def test_what_is_level_with_a_sensor_counts_wherever_it_is_told_to_be():
    """The official robot tells that its range sensors are on the floor."""
    for height in (0.0, 0.5):
        guard = show(make_guard(), scan_of(0.24), where=place(height=height, pitch=0.05))
        assert speed_of(guard) < 0.1
        assert speed_of(guard, (-0.8, 0.0, 0.0)) > 0.5
    passes_below = show(make_guard(), scan_of(0.25), where=place(height=0.2, pitch=-math.atan2(0.07, 0.24)))
    assert speed_of(passes_below) == SLOW
    assert passes_below.held is None


@pytest.mark.parametrize("named", [
    {"where": place(pitch=math.pi / 2)}, {"where": place(pitch=-math.pi / 2)}, {"bounds": (0.5, 0.1)},
    {"bounds": (math.nan, 1.0)}, {"bounds": (0.02, 0.1)}, {"angles": np.zeros(0)}, {"angles": np.full(9, math.nan)}])
def test_a_sensor_that_cannot_be_used_is_refused(named):
    with pytest.raises(ValueError, match="no rays, no range, or it looks only at"):
        show(make_guard(), 0.3, **{"angles": CONE, **named})


@pytest.mark.parametrize(("frequency", "age"), [(40, 0.5), (10, 0.8), (10, 1.9)])
def test_a_reading_that_is_late_counts_from_when_it_came(frequency, age):
    """The wall is 3 m ahead of where the robot begins; a hand drives towards it."""
    guard, place_of, way, speed = make_guard(), {}, 0.0, 0.0
    for tick in range(1000):
        now = 100.0 + tick * 0.02
        way += speed * 0.02
        place_of[tick] = way
        guard.moves((speed, 0.0, 0.0), now)
        made = tick - round(age / 0.02)
        if made >= 0 and tick % max(1, round(50 / frequency)) == 0:
            guard.see("laser", place(), AROUND, scan_of(3.0 - place_of[made]), BOUNDS, now - age)
        speed = speed_of(guard, (0.5, 0.0, 0.0), now) if tick > 150 else 0.0
    assert 0.05 < 3.0 - way - RADIUS < 0.15
    assert "0.08 m" in guard.held[1]


def test_without_odometry_near_its_stamps_a_reading_cannot_be_used():
    guard = make_guard()
    for at in (100.0, 105.0):
        with pytest.raises(ValueError, match="no odometry within 2 s of its stamps"):
            guard.see("laser", place(), AROUND, FAR, BOUNDS, at)
        guard.moves(STOP, 102.5)


@pytest.mark.parametrize("axis", [0, 2])
@pytest.mark.parametrize("nonsense", [math.nan, math.inf, -1e300])
def test_odometry_that_no_robot_can_make_moves_no_place(nonsense, axis):
    guard = guard_before(0.5)
    guard.moves(np.where(np.arange(3) == axis, nonsense, 0.0), 100.01)
    show(guard, scan_of(0.5), 100.5)
    assert speed_of(guard, now=100.5) == pytest.approx(speed_of(guard_before(0.5)))
    assert 0.0 < speed_of(guard, now=100.5) < HAND


def test_what_is_within_the_footprint_is_the_robot_and_hides_what_is_behind():
    post = np.where(abs(AROUND) < 0.03, 0.14, FAR)
    assert speed_of(show(make_guard(), post)) == HAND
    assert speed_of(show(make_guard(), np.where(abs(AROUND) < 0.3, 0.14, FAR))) == SLOW
    assert show(make_guard(), np.where(abs(AROUND) < 0.03, 0.16, FAR)).limit(AHEAD, 100.0) == STOP


def test_a_ray_that_has_measured_and_says_too_near_holds_and_one_that_never_has_looks_at_the_robot():
    too_near = np.where(abs(AROUND) < 0.3, -math.inf, FAR)
    post = show(make_guard(), too_near, bounds=SCAN_BOUNDS)
    assert speed_of(post) == SLOW
    assert speed_of(show(post, too_near, 200.0, bounds=SCAN_BOUNDS), now=200.0) == SLOW
    came = show(show(make_guard(), FAR, bounds=SCAN_BOUNDS), too_near, 101.0, bounds=SCAN_BOUNDS)
    assert came.limit(AHEAD, 101.0) == STOP
    assert "something ahead, 0.15 m" in came.held[1]
    assert came.limit((-0.5, 0.0, 0.0), 101.0) == (-0.5, 0.0, 0.0)


def test_it_stops_before_what_a_sensor_is_about_to_be_too_near_to_measure():
    for where, nearest, stands in ((place(), 0.3, 0.325), (place(0.1), 0.45, 0.575), (place(), 0.12, 0.23)):
        for distance, free in ((stands - 0.005, False), (stands + 0.05, True)):
            guard = show(make_guard(), scan_of(distance - where[1][0]), where=where, bounds=(nearest, 4.0))
            assert (speed_of(guard, (0.1, 0.0, 0.0)) > 0.0) == free
            assert guard.limit((-0.1, 0.0, 0.0), 100.0) == (-0.1, 0.0, 0.0)


def test_no_small_circle_leads_into_what_is_too_near_to_be_measured():
    guard = show(make_guard(), scan_of(0.3), bounds=SCAN_BOUNDS)
    for turn in (-2.0, 2.0):
        assert guard.limit((0.1, 0.0, turn), 100.0) == STOP
        assert guard.limit((-0.1, 0.0, turn), 100.0) == (-0.1, 0.0, turn)


def test_beside_a_wall_it_may_get_a_little_nearer_but_not_again_and_again():
    for gap, free in ((0.02, True), (0.015, True), (0.01, False)):
        wall = show(make_guard(), np.where(AROUND > 0.1, (RADIUS + gap) / np.sin(AROUND + 1e-9), math.inf))
        assert (speed_of(wall, (0.3, 0.002, 0.0)) > 0.0) == free, gap
        assert speed_of(wall, (0.3, 0.0, 0.0)) == 0.3
        assert speed_of(wall, (0.3, 0.05, 0.0)) == 0.0


def test_who_turns_back_before_a_wall_is_stopped_first():
    guard = make_guard()
    drive_on(guard, AHEAD, 99.0, 1.0)
    assert guard.limit((0.0, 0.5, 0.0), 100.0) == (0.0, 0.5, 0.0)
    show(guard, scan_of(0.3), 100.0, period=0.001)
    assert guard.limit((0.0, 0.5, 0.0), 100.0) == STOP
