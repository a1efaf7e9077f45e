"""Faults on the way to a goal, with the real navigation stack on the simulator; skipped where that is missing."""

import pytest
from navigation_tools import NAVIGATION_PACKAGES, figures_of, needs

pytestmark = needs(*NAVIGATION_PACKAGES)

POSE_ERROR = 0.12   # [m] of the localization
NOT_MOVED = 0.003   # [m] that the truth may wander while the robot stands


@pytest.mark.parametrize("world", ["room", "maze"])
def test_navigation_comes_back_or_says_what_to_do(world):
    """Nobody waits for ever, goto says how each fault ended, and the robot can be sent again."""
    found = figures_of("fault_run.py", "--world", world, timeout=1500)
    for row in found["rows"]:
        assert row["status"] in row["expected"], row
        assert row["status"] == 0 or row["again"] == 0, row
        assert row["pose_error_m"] < POSE_ERROR, row
        assert row["goal_error_m"] < POSE_ERROR, row
        if row["fault"].startswith("kidnapped"):
            assert "relocalize" in row["words"], row
        if row["fault"].startswith("emergency stop"):
            assert row["stood_s"] < 1.0, row
            assert row["way_after_m"] < NOT_MOVED, row
            assert "cancelled by the emergency stop, pressed by " in row["words"], row
    assert found["rows"]
    assert found["navigation_monitor_mib"] < 45.0
