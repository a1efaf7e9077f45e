"""20 robots with masters of their own for minutes: all there, states young, STOP at once, no memory grows."""

import os
import time
from pathlib import Path

import pytest
from fleet_rig import PATIENCE, Rig, memory, stop_time, wait_until_driving

from robotont_fleet.zenoh_setup import zenoh
from robotont_testing.figures import percentile
from robotont_testing.harness import wait_for

pytestmark = [pytest.mark.skipif(zenoh is None, reason="no zenoh on this system"), pytest.mark.long]
SECONDS = float(os.environ.get("ROBOTONT_FLEET_SECONDS", "600"))
ROBOTS = int(os.environ.get("ROBOTONT_FLEET_ROBOTS", "20"))
STOPS = int(os.environ.get("ROBOTONT_FLEET_STOPS", "20"))


def processor_time(pid):
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def test_robots_with_masters_of_their_own():
    """Each: rosmaster, the real driver on a stand-in board, a stand-in for navigation, fleet_node. No MuJoCo."""
    with Rig() as rig:
        rig.start_page()
        robots = [rig.add_robot(f"r{number}") for number in range(ROBOTS)]
        wait_until_driving(rig, *robots)
        pids = [rig.page.pid, *(robot.fleet_node.pid for robot in robots)]  # the page's first
        before, used, began = [memory(pid)[0] for pid in pids], [*map(processor_time, pids)], time.monotonic()
        ages, took = [], []
        while time.monotonic() - began < SECONDS:
            seen = rig.view()["robots"]
            assert sum(one["present"] for one in seen) == ROBOTS
            ages += [one["age"] for one in seen if one["present"]]
            time.sleep(1.0)
        share = 100 / (time.monotonic() - began)
        page, *nodes = (share * (processor_time(pid) - was) for pid, was in zip(pids, used))
        after = [memory(pid) for pid in pids]
        grown = [rss - was for (rss, _), was in zip(after, before)]
        for _ in range(STOPS):
            wait_until_driving(rig, *robots)
            took.append(stop_time(rig, robots))
            wait_for(lambda: len(rig.stop_state()["stand"]) == ROBOTS, "confirmations", PATIENCE)
            rig.release()
    print(f"\n{ROBOTS} robots, {SECONDS:g} s: state age p99 {percentile(ages, 0.99):.2f} s",
          f"router and page {page:.0f} % of a core, grown by {grown[0]:.1f} MiB",
          f"fleet_node {sum(nodes) / ROBOTS:.1f} % of a core, {max(pss for _, pss in after[1:]):.0f} MiB PSS, grown by "
          f"{max(grown[1:]):.1f} MiB at most",
          f"STOP ALL to the last one, {STOPS} times: median {1000 * percentile(took, 0.5):.0f} ms, p99 "
          f"{1000 * percentile(took, 0.99):.0f} ms", sep="\n")
    assert percentile(ages, 0.99) <= 1.0
    assert percentile(took, 0.99) <= 0.5
    assert max(grown) < 10.0
