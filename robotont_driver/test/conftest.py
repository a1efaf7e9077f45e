"""What the tests of this folder share."""

import pytest
from hypothesis import settings

from robotont_driver.kinematics.wheels import read_wheels
from robotont_testing.robots import ROBOTS

settings.register_profile("shared machine", deadline=None)
settings.load_profile("shared machine")


@pytest.fixture(scope="module", params=ROBOTS.values(), ids=ROBOTS.keys())
def wheels(request):
    """Robots with three, four and five wheels."""
    return read_wheels(request.param)
