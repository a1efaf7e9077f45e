"""Faults on the way to a goal, with the real navigation stack on the simulator; skipped where that is missing."""

import json
import subprocess

import pytest
from navigation_tools import NAVIGATION_PACKAGES, PACKAGE, lacking

pytestmark = pytest.mark.skipif(bool(lacking(*NAVIGATION_PACKAGES)), reason=lacking(*NAVIGATION_PACKAGES) or "-")

POSE_ERROR = 0.12   # [m] of the localization
NOT_MOVED = 0.003   # [m] that the truth may wander while the robot stands


def suffer(*words, timeout):
    """What fault_run.py has found."""
    result = subprocess.run(["/usr/bin/python3", str(PACKAGE / "test" / "fault_run.py"), *words], check=False,
                            text=True, timeout=timeout, capture_output=True)
    print(result.stderr)
    assert result.stdout, result.stderr
    return json.loads(result.stdout.splitlines()[-1])


def check(rows):
    """Each fault: nobody waits for ever, goto says how it ended, and the robot can be sent again."""
    assert rows
    for row in rows:
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


@pytest.mark.parametrize("arguments", ["", "world:=maze"], ids=["in a room", "in a corridor"])
def test_navigation_comes_back_or_says_what_to_do(arguments):
    check(suffer("--arguments", arguments, timeout=1200)["rows"])


@pytest.mark.long
def test_emergency_stops_of_a_minute():
    check(suffer("--long", "--only", "emergency stop", timeout=1500)["rows"])


@pytest.mark.long
def test_ten_goals_after_each_fault():
    faults = ("hand", "emergency stop, topic, 3 s", "cable", "driver_node", "serial_com_node", "cmd_vel_mux", "amcl",
              "map_server", "move_base", "navigation_monitor", "board", "somebody stands in the way",
              "kidnapped by 1 m and 90")
    found = suffer("--arguments", "", "--goals", "10", *(word for name in faults for word in ("--only", name)),
                   timeout=7000)
    assert len(found["rows"]) == len(faults)
    check(found["rows"])
    for row in found["rows"]:
        assert row["statuses"] == [0] * 10, row
        assert max(row["errors_m"]) < POSE_ERROR, row
        assert sum(row["memory_mib"].values()) < 1.1 * sum(found["memory_mib"].values()), (found["memory_mib"], row)
        assert row["memory_mib"]["navigation_monitor"] < 45.0  # [MiB]
