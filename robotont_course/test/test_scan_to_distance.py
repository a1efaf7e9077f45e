import math

import numpy as np
import pytest
from sensor_msgs.msg import LaserScan

from robotont_course.scan_to_distance import from_the_right, sectors


@pytest.mark.parametrize("ranges, right, centre, left", [
    ([1.0, 2.0, 3.0, 4.0, 3.5, 3.0], (1.0, 1.5), (3.0, 3.5), (3.0, 3.25)),
    ([-math.inf, 1.0, math.inf, 2.0, math.nan, math.nan], (0.3, 0.65), (2.0, 3.0), (4.0, 4.0)),
    ([], (4.0, 4.0), (4.0, 4.0), (4.0, 4.0)),
], ids=["from right to left", "too near, too far, no number", "empty"])
def test_the_thirds_of_a_scan(ranges, right, centre, left):
    assert np.array(sectors(ranges, 0.3, 4.0)) == pytest.approx(np.array([right, centre, left]))


@pytest.mark.parametrize("first, step", [(-1.5, 0.5), (1.5, -0.5), (2 * math.pi - 1.5, 0.5), (1.5 - 2 * math.pi, -0.5)])
def test_whichever_way_a_scanner_turns_its_rays_come_from_the_right(first, step):
    ranges = [10.0 + first + number * step for number in range(7)]
    rays = from_the_right(LaserScan(angle_min=first, angle_increment=step, ranges=ranges))
    assert [angle for angle, _ in rays] == pytest.approx([-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5])
    assert [math.remainder(distance - 10.0, 2 * math.pi) for _, distance in rays] == pytest.approx(
        [angle for angle, _ in rays])
