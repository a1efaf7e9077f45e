import math

import numpy as np
import pytest
from geometry_msgs.msg import Quaternion, Transform
from navigation_messages import ranges_in_box, scan_of, walled

from robotont_map_navigation.floor_map import FloorMap
from robotont_map_navigation.readings import rays_of
from robotont_map_navigation.scan_fit import fit, fit_nearby

MAP = FloorMap(walled(40, 80), 0.05, (-1.0, -1.0, 0.0))
BOX = -0.95, 2.95, -0.95, 0.95  # [m] the walls' inner faces
LEVEL = Transform(rotation=Quaternion(w=1.0))


POSE = (0.3, 0.2, 0.7)
SEEN = ranges_in_box(POSE, *BOX)


def rays(ranges, sees=5.0, sensor=LEVEL):
    return rays_of(scan_of(ranges, sees), sensor)


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


def test_a_sensor_that_hangs_upside_down_and_one_that_is_turned():
    (x, y), _ = rays(SEEN)
    hanging, _ = rays(SEEN, sensor=Transform(rotation=Quaternion(x=1.0)))
    np.testing.assert_allclose(hanging, (x, -y), atol=1e-9)
    turned, _ = rays(SEEN, sensor=Transform(rotation=Quaternion(z=math.sqrt(0.5), w=math.sqrt(0.5))))
    np.testing.assert_allclose(turned, (-y, x), atol=1e-9)


@pytest.mark.parametrize("off", [(0.1, 0.05, 0.1), (-0.08, -0.1, -0.08)])
def test_a_pose_that_is_nearly_right_explains_what_is_seen_from_a_place_at_a_wall(off):
    """From there few rays end at a wall: along the wall a small angle is a long way."""
    pose = (2.75, -0.75, -1.2)
    explained, through_walls = fit_nearby(MAP, np.add(pose, off), rays(ranges_in_box(pose, *BOX)), 0.2)
    assert explained > 0.9
    assert through_walls < 0.1
