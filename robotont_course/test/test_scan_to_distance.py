import math

import numpy as np
import pytest

from robotont_course.scan_to_distance import sectors


@pytest.mark.parametrize("ranges, right, centre, left", [
    ([1.0, 2.0, 3.0, 4.0, 3.5, 3.0], (1.0, 1.5), (3.0, 3.5), (3.0, 3.25)),
    ([-math.inf, 1.0, math.inf, 2.0, math.nan, math.nan], (0.3, 0.65), (2.0, 3.0), (4.0, 4.0)),
    ([], (4.0, 4.0), (4.0, 4.0), (4.0, 4.0)),
], ids=["from right to left", "too near, too far, no number", "empty"])
def test_the_thirds_of_a_scan(ranges, right, centre, left):
    assert np.array(sectors(ranges, 0.3, 4.0)) == pytest.approx(np.array([right, centre, left]))
