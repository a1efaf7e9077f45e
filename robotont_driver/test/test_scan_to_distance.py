import math

import pytest

from robotont_driver.nodes.scan_to_distance import sectors


def test_the_thirds_from_right_to_left():
    right, centre, left = sectors([1.0, 2.0, 3.0, 4.0, 3.5, 3.0], 0.3, 4.0)
    assert (right, centre, left) == ((1.0, 1.5), (3.0, 3.5), (3.0, 3.25))


def test_what_is_too_near_too_far_or_no_number():
    right, centre, left = sectors([-math.inf, 1.0, math.inf, 2.0, math.nan, math.nan], 0.3, 4.0)
    assert right == (0.3, pytest.approx(0.65))
    assert centre == (2.0, 3.0)
    assert left == (4.0, 4.0)


def test_an_empty_scan():
    assert sectors([], 0.3, 4.0) == ((4.0, 4.0),) * 3
