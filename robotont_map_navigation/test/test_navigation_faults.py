"""Faults on the way to a goal, with the real navigation stack on the simulator; skipped where that is missing."""

import json
import subprocess

import pytest
from navigation_tools import NAVIGATION_PACKAGES, PACKAGE, lacking

pytestmark = pytest.mark.skipif(bool(lacking(*NAVIGATION_PACKAGES)), reason=lacking(*NAVIGATION_PACKAGES) or "-")

POSE_ERROR = 0.12   # [m] of the localization
NOT_MOVED = 0.003   # [m] that the truth may wander while the robot stands


def suffer(arguments):
    result = subprocess.run(["/usr/bin/python3", str(PACKAGE / "test" / "fault_run.py"), *arguments], check=False,
                            text=True, timeout=1200, capture_output=True)
    print(result.stderr)
    assert result.stdout, result.stderr
    return json.loads(result.stdout.splitlines()[-1])


@pytest.mark.parametrize("arguments", [[], ["composed:=false"], ["world:=maze"]],
                         ids=["one process", "three processes", "in a corridor"])
def test_nobody_waits_for_ever_and_the_robot_can_be_sent_again(arguments):
    found = suffer(arguments)
    assert found["rows"]
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
    assert sum(found["after_mib"].values()) < 1.1 * sum(found["before_mib"].values()), found
    assert found["after_mib"]["navigation_monitor"] < 45.0
