"""Maps and scans for pages, whatever a node publishes."""

import math

import numpy as np
import pytest
from guarded_drive import place
from sensor_msgs.msg import LaserScan
from web_client import room

from robotont_teleop.web.page_pictures import SECTORS, map_picture, nearest, scan_points


def test_a_map_keeps_its_number_over_a_restart_and_another_one_has_another():
    """So that an open page keeps no old map."""
    first, *others = (map_picture(one)[1]["number"] for one in (room(), room(), room(x=1.0), room(resolution=0.25)))
    assert [number == first for number in others] == [True, False, False]


@pytest.mark.parametrize("wrong", [{"resolution": math.nan}, {"resolution": 0.0}, {"width": 0}, {"height": 13}])
def test_what_is_no_map_is_refused(wrong):
    with pytest.raises(ValueError, match="resolution|cells"):
        map_picture(room(**wrong))


def test_a_scan_without_a_largest_range_is_shown_and_one_without_angles_or_a_tilted_one_is_not():
    scan = LaserScan(angle_increment=0.5, range_min=0.1, range_max=math.inf, ranges=[1.0, math.inf, math.nan, 2.0, 0.0])
    for roll, side in ((0.0, 1.0), (math.pi, -1.0)):
        assert scan_points(scan, place(0.1, 0.2, roll=roll)) == [
            [1.1, 0.2], pytest.approx([0.1 + 2 * math.cos(1.5), 0.2 + side * 2 * math.sin(1.5)], abs=0.01)]
    scan.ranges = [1.0] * 541
    assert 90 < len(scan_points(scan, place())) <= 180
    for roll, drawn in ((0.1, True), (0.3, False), (math.pi / 2, False), (math.pi - 0.3, False)):
        assert bool(scan_points(scan, place(roll=roll))) == drawn
    scan.angle_min = math.nan
    assert scan_points(scan, place()) == []


def test_what_is_near_is_told_from_the_rim_with_what_no_sensor_sees():
    body, flat = (0.15, 0.02, 0.2), np.eye(3)
    angles = np.linspace(-0.6, 0.6, 13)
    ranges = np.array([np.inf] * 6 + [0.5] + [np.inf] * 5 + [np.nan])
    cable = np.zeros(1), np.array([0.05]), (0.02, 1.0)  # looks at the robot itself
    scanner = (flat, (0.1, 0.0, 0.15)), angles, ranges, (0.1, 4.0)
    gaps = nearest([scanner, ((flat, (-0.1, 0.0, 0.1)), *cable)], body)
    assert (gaps[0], gaps[1], gaps[-1]) == (0.45, 2.0, 2.0)
    assert gaps[4:-4] == [None] * (SECTORS - 8)
    assert nearest([], body) == [None] * SECTORS
