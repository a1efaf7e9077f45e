"""2000 drives with broken encoders and ten hours with healthy wheels, on motors, drivers and loads of every kind."""

import ast
import subprocess
from collections import defaultdict

import pytest
from firmware_tools import DUAL, SRC, tool

pytestmark = pytest.mark.long
PARTS = 10  # processes one after the other


def drives(what, count, seed):
    """What drives.py returns of each."""
    run = subprocess.run(
        [tool("micropython"), str(DUAL / "drives.py"), str(SRC), what, str(count), str(seed)],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=1200, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stdout
    return [ast.literal_eval(line) for line in run.stdout.splitlines()]


def test_2000_broken_encoders():
    rows, outside = defaultdict(list), []
    for part in range(PARTS):
        for profile, name, *row in drives("broken", 200, 1000 + part):
            rows[profile, name].append(row)
            outside += [(profile, name, *row)] if row[-1] else []
    for (profile, name), found in sorted(rows.items()):
        times = sorted(seconds for seconds, *_ in found if seconds is not None)
        parts = [fastest / abs(units) for _, fastest, units, *_ in found if abs(units) >= 29]
        print(f"{profile:11} {name:10} {len(found):4} drives, not found {len(found) - len(times):3}, median "
              f"{times[len(times) // 2] if times else 0:.2f} s, slowest {times[-1] if times else 0:.2f} s, "
              f"from 29 units on at most {max(parts or [0]):.2f} times the command")  # fmt: skip
    print(f"outside of the bounds: {len(outside)} of 2000", *outside, sep="\n")
    assert sum(map(len, rows.values())) == 2000
    assert len(outside) <= 7


def test_ten_hours_with_healthy_wheels():
    found = [drive for part in range(PARTS) for drive in drives("healthy", 61, 2000 + part)]
    hours = sum(periods for _, periods, _ in found) / 50 / 3600
    blamed = [why for wheels, _, why in found if wheels]
    print(f"{len(blamed)} healthy wheels blamed in {hours:.1f} h", *blamed)
    assert hours >= 10
    assert len(blamed) <= 1
