"""What the tests of this folder share."""

from pathlib import Path

import pytest
from hypothesis import settings

from robotont_driver.wheels import read_wheels
from robotont_testing.robots import ROBOTS

settings.register_profile("shared machine", deadline=None)
settings.load_profile("shared machine")

HERE = Path(__file__).resolve().parent


@pytest.fixture(scope="module", params=ROBOTS.values(), ids=ROBOTS.keys())
def wheels(request):
    """Robots with three, four and five wheels."""
    return read_wheels(request.param)
