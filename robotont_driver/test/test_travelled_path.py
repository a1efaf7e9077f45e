import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robotont_driver.nodes.travelled_path import Sample, Trail, distance

PERIOD = 0.02  # [s] between odometry messages


def drive(trail, steps, start=0, speed=1.0):
    """Straight ahead, one message per PERIOD; the number of changes of the path."""
    return sum(trail.add(Sample(step * PERIOD, step * PERIOD * speed, 0.0, 0.0, speed))
               for step in range(start, start + steps))


def test_the_first_pose_is_kept_at_once():
    trail = Trail(10, 0.05)
    assert trail.add(Sample(0.0, 1.0, 2.0, 0.5, 0.0))
    assert [pose[1:4] for pose in trail.poses] == [(1.0, 2.0, 0.5)]


def test_a_robot_at_rest_leaves_one_pose():
    trail = Trail(10, 0.05)
    assert drive(trail, 1000, speed=0.0) == 1


def test_poses_are_the_given_distance_apart():
    trail = Trail(1000, 0.05)
    drive(trail, 501)  # 10 m; 3 steps of 2 cm reach 5 cm
    assert len(trail.poses) == 167
    gaps = [distance(one, other) for one, other in zip(trail.poses, list(trail.poses)[1:])]
    assert gaps == pytest.approx([0.06] * 166)


def test_the_oldest_poses_go_first():
    trail = Trail(20, 0.05)
    drive(trail, 1000)
    assert len(trail.poses) == 20
    assert trail.poses[-1].x == pytest.approx(999 * PERIOD, abs=0.05)
    assert trail.poses[0].x == pytest.approx(trail.poses[-1].x - 19 * 0.06)


@pytest.mark.parametrize("back", [0.2, 1.0, 19.0])
def test_a_reset_of_the_odometry_starts_the_path_anew(back):
    trail = Trail(1000, 0.05)
    drive(trail, 1000)
    newest = Sample(1000 * PERIOD, 1000 * PERIOD - back, 0.0, 0.0, 1.0)
    assert trail.add(newest)
    assert list(trail.poses) == [newest]


@pytest.mark.parametrize("speed", [0.0, 1.0])
def test_a_bag_played_again_starts_the_path_anew(speed):
    trail = Trail(1000, 0.05)
    drive(trail, 100)
    trail.add(Sample(2.0, 1.98, 0.0, 0.0, 0.0))
    assert trail.add(Sample(0.0, 1.98, 0.0, 0.0, speed))
    assert len(trail.poses) == 1


@pytest.mark.parametrize("lost", [1, 10, 49])
def test_lost_messages_do_not_break_the_path(lost):
    trail = Trail(1000, 0.05)
    drive(trail, 100, speed=1.5)
    drive(trail, 100, start=100 + lost, speed=1.5)
    assert trail.poses[0].x == 0.0


def test_a_full_stop_and_a_start_do_not_break_the_path():
    """The speed of the message that brings the step may be zero: the robot stopped within the period."""
    trail = Trail(1000, 0.05)
    drive(trail, 100, speed=1.5)
    assert not trail.add(Sample(100 * PERIOD, 99.5 * PERIOD * 1.5, 0.0, 0.0, 0.0))
    assert trail.poses[0].x == 0.0


finite = st.floats(-1e3, 1e3)
samples = st.builds(Sample, st.floats(0, 1e6), finite, finite, st.floats(-math.pi, math.pi), st.floats(0, 2))


@settings(deadline=None)
@given(st.lists(samples, max_size=50), st.integers(1, 10), st.floats(0.001, 10.0))
def test_whatever_comes_the_path_is_bounded_and_spaced(many, max_poses, min_distance):
    trail = Trail(max_poses, min_distance)
    for sample in many:
        trail.add(sample)
        assert len(trail.poses) <= max_poses
        assert all(distance(one, other) >= min_distance
                   for one, other in zip(trail.poses, list(trail.poses)[1:]))
