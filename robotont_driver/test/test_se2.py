"""SE(2) against matrices: scipy's matrix exponential, and products of homogeneous transformations."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from robotont_driver.kinematics import se2

LENGTH = st.floats(-10.0, 10.0)
ANGLE = st.floats(-7.0, 7.0)
POSE = st.tuples(LENGTH, LENGTH, ANGLE)


def matrix(pose):
    """3 x 3 homogeneous transformation of a pose."""
    x, y, yaw = pose
    return np.array(((math.cos(yaw), -math.sin(yaw), x), (math.sin(yaw), math.cos(yaw), y), (0.0, 0.0, 1.0)))


@given(POSE, POSE)
def test_between_undoes_compose(start, displacement):
    assert se2.between(start, se2.compose(start, displacement)) == pytest.approx(displacement, abs=1e-12)


@given(POSE)
def test_arc_is_the_matrix_exponential(motion):
    x, y, turn = motion
    generator = np.array(((0.0, -turn, x), (turn, 0.0, y), (0.0, 0.0, 0.0)))
    assert matrix(se2.arc(motion)) == pytest.approx(expm(generator), abs=1e-10)


def test_path_is_one_arc_after_the_other():
    motions = np.random.default_rng(2).uniform(-1, 1, (40, 3))
    pose = (0.0, 0.0, 0.0)
    for reached, motion in zip(se2.path(motions), motions):
        pose = se2.compose(pose, se2.arc(motion.tolist()))
        assert reached == pytest.approx(pose, abs=1e-12)


@given(st.floats(-math.pi, math.pi), st.sampled_from((1.0, -1.0)))
def test_yaw_of_a_quaternion_and_of_its_negative(yaw, sign):
    quaternion = SimpleNamespace(x=0.0, y=0.0, z=sign * math.sin(yaw / 2), w=sign * math.cos(yaw / 2))
    assert math.remainder(se2.yaw_of(quaternion) - yaw, 2 * math.pi) == pytest.approx(0.0, abs=1e-12)
    assert abs(se2.yaw_of(quaternion)) <= math.pi


@given(st.floats(-1e4, 1e4))
def test_wrap_keeps_the_angle_modulo_full_turns(angle):
    for wrapped in (se2.wrap(angle), se2.wrap(np.array([angle]))[0]):
        assert abs(wrapped) <= math.pi + 1e-12
        assert math.remainder(wrapped - angle, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)


@given(POSE, ANGLE)
def test_an_arc_seen_from_a_frame_in_which_it_starts_turned(motion, heading):
    _, _, turn = se2.arc(motion)
    expected = se2.compose((0.0, 0.0, heading), se2.arc(motion))
    assert se2.arc(motion, heading) == pytest.approx((*expected[:2], turn), abs=1e-9)
