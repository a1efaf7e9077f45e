"""What the tests of this folder share."""

import sys
from pathlib import Path

import pytest
import yaml
from hypothesis import settings

settings.register_profile("shared machine", deadline=None)
settings.load_profile("shared machine")

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "src")]

from robotont_driver.wheels import THESIS_KEYS, read_wheels  # noqa: E402

SHIPPED = yaml.safe_load((HERE.parents[1] / "config" / "wheel_params.yaml").read_text())
BARE = {key: SHIPPED[key] for key in THESIS_KEYS}
UNEVEN_4 = {**SHIPPED, "wheelAmount": 4, "wheelRads": [0.1, 1.4, 3.3, 5.0],
            "wheelDistanceFromCenter": [0.11, 0.13, 0.12, 0.15]}
UNEVEN_5 = {**BARE, "wheelAmount": 5, "wheelRads": [0.3, 1.2, 2.9, 3.6, 5.5],
            "wheelRadius": [0.035, 0.036, 0.034, 0.035, 0.05]}


@pytest.fixture(scope="module", params=[SHIPPED, BARE, UNEVEN_4, UNEVEN_5],
                ids=["shipped", "bare", "uneven4", "uneven5"])
def wheels(request):
    """Robots with three, four and five wheels."""
    return read_wheels(request.param)
