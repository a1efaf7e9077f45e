"""2000 drives with broken encoders and ten hours with healthy wheels, on motors, drivers and loads of every kind."""

import re
import subprocess
import sys
from collections import defaultdict

import pytest
from firmware_tools import DUAL, SRC, tool

pytestmark = pytest.mark.long
PARTS = 10  # processes one after the other


def drive(what, count, seed):
    run = subprocess.run(
        [tool("micropython"), str(DUAL / "drives.py"), str(SRC), what, str(count), str(seed)],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=1200, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stdout
    return run.stdout


def test_2000_broken_encoders(monkeypatch):
    monkeypatch.syspath_prepend(str(SRC))
    monkeypatch.syspath_prepend(str(DUAL))
    import drives
    import suite_drives

    configs = {config.PROFILE: config for config, _, _ in drives.PROFILES}
    rows, outside = defaultdict(list), []
    for part in range(PARTS):
        for line in drive("broken", 200, 1000 + part).split():
            name, seconds, fastest, units, wrong, profile, driving = line.replace("_", " ").split(";")
            drive_found = (name, None if seconds == "None" else float(seconds), float(fastest), int(units),
                           wrong == "True", configs[profile], int(driving))  # fmt: skip
            outside += filter(None, [suite_drives.fault_of(*drive_found)])
            rows[profile, name].append(drive_found)
    for (profile, name), found in sorted(rows.items()):
        times = sorted(row[1] for row in found if row[1] is not None)
        parts = [row[2] / abs(row[3]) for row in found if abs(row[3]) >= 29]
        print(f"{profile:11} {name:10} {len(found):4} drives, not found {len(found) - len(times):3}, median "
              f"{times[len(times) // 2] if times else 0:.2f} s, slowest {times[-1] if times else 0:.2f} s, "
              f"from 29 units on at most {max(parts or [0]):.2f} times the command")  # fmt: skip
    print(f"outside of the bounds: {len(outside)} of 2000", *outside, sep="\n")
    assert sum(map(len, rows.values())) == 2000
    lossy = [one for one in outside if any(name in one for name in suite_drives.UNEVEN)]
    assert len(lossy) <= 6
    assert len(outside) - len(lossy) <= 7


def test_ten_hours_with_healthy_wheels():
    hours = blamed = 0
    for part in range(PARTS):
        output = drive("healthy", 61, 2000 + part)
        print(output.strip(), file=sys.stderr)
        found = re.search(r"hours ([0-9.]+) blamed (\d+)", output)
        hours, blamed = hours + float(found.group(1)), blamed + int(found.group(2))
    print(f"{blamed} healthy wheels blamed in {hours:.1f} h")
    assert hours >= 10
    assert blamed <= 1
