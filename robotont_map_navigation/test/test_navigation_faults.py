"""Faults on the way to a goal, with the real navigation stack on the simulator; skipped where that is missing."""

import json
import subprocess

import pytest
from navigation_tools import NAVIGATION_PACKAGES, PACKAGE, lacking

pytestmark = pytest.mark.skipif(bool(lacking(*NAVIGATION_PACKAGES)), reason=lacking(*NAVIGATION_PACKAGES) or "-")

POSE_ERROR = 0.12   # [m] of the localization
NOT_MOVED = 0.003   # [m] that the truth may wander while the robot stands


@pytest.mark.parametrize("world", ["room", "maze"])
def test_navigation_comes_back_or_says_what_to_do(world):
    """Nobody waits for ever, goto says how each fault ended, and the robot can be sent again."""
    result = subprocess.run(["/usr/bin/python3", str(PACKAGE / "test" / "fault_run.py"), "--world", world], check=False,
                            text=True, timeout=1500, capture_output=True)
    print(result.stderr)
    assert result.stdout, result.stderr
    found = json.loads(result.stdout.splitlines()[-1])
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
