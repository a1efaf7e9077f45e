"""How a sensor lies, from the quaternion of its mounting."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from robotont_description.mounted import rotation_of, seen_from_above


@pytest.mark.parametrize(("roll", "pitch", "yaw", "seen"), [
    (0.0, 0.0, 0.5, [0.7, 0.3]), (math.pi, 0.0, 0.5, [0.3, 0.7]), (0.0, math.pi, 0.5, [0.3 - math.pi, 0.7 - math.pi])])
def test_a_scanner_that_hangs_is_mirrored(roll, pitch, yaw, seen):
    half = [(math.cos(angle / 2), math.sin(angle / 2)) for angle in (roll, pitch, yaw)]
    (cr, sr), (cp, sp), (cy, sy) = half
    rotation = rotation_of(SimpleNamespace(
        x=sr * cp * cy - cr * sp * sy, y=cr * sp * cy + sr * cp * sy, z=cr * cp * sy - sr * sp * cy,
        w=cr * cp * cy + sr * sp * sy))
    assert np.allclose(rotation @ rotation.T, np.eye(3))
    angles, shares = seen_from_above(rotation, np.array([0.2, -0.2]))
    assert np.allclose(np.cos(angles - seen), 1.0, atol=1e-12)
    assert np.allclose(shares, 1.0)


def test_rays_of_a_scanner_that_tilts_are_shorter_on_the_floor():
    rotation = rotation_of(SimpleNamespace(x=0.0, y=math.sin(0.3), z=0.0, w=math.cos(0.3)))
    angles, shares = seen_from_above(rotation, np.array([0.0, math.pi / 2]))
    assert np.allclose(angles, [0.0, math.pi / 2])
    assert np.allclose(shares, [math.cos(0.6), 1.0])
