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


def watch(rig, robots, seconds):
    """Ages [s] of all states once a second; prints the page's processor time and memory."""
    ages, (before, _), began = [], memory(rig.page.pid), time.monotonic()
    used = processor_time(rig.page.pid)
    while time.monotonic() - began < seconds:
        seen = rig.view()["robots"]
        assert sum(one["present"] for one in seen) == robots
        ages += [one["age"] for one in seen if one["present"]]
        time.sleep(1.0)
    used = 100 * (processor_time(rig.page.pid) - used) / (time.monotonic() - began)
    age, (after, _) = percentile(ages, 0.99), memory(rig.page.pid)
    print(f"\n{robots} robots, {seconds:g} s: state age p99 {age:.2f} s, router and page {used:.0f} % of a core, "
          f"{before:.0f} -> {after:.0f} MiB")
    assert age <= 1.0
    assert after - before < 10.0


def check_stops(took):
    """[s] of each STOP ALL until the last one."""
    print(f"STOP ALL to the last one, {len(took)} times: median {1000 * percentile(took, 0.5):.0f} ms, p99 "
          f"{1000 * percentile(took, 0.99):.0f} ms")
    assert percentile(took, 0.99) <= 0.5


def test_robots_with_masters_of_their_own():
    """Each: rosmaster, the real driver on a stand-in board, a stand-in for navigation, fleet_node. No MuJoCo."""
    with Rig() as rig:
        rig.start_page()
        robots = [rig.add_robot(f"r{number}") for number in range(ROBOTS)]
        wait_until_driving(rig, *robots)
        nodes = [robot.fleet_node.pid for robot in robots]
        before, used, began = [memory(pid)[0] for pid in nodes], sum(map(processor_time, nodes)), time.monotonic()
        watch(rig, ROBOTS, SECONDS)
        used = 100 * (sum(map(processor_time, nodes)) - used) / (time.monotonic() - began) / ROBOTS
        after = [memory(pid) for pid in nodes]
        grown = max(rss - was for (rss, _), was in zip(after, before))
        print(f"fleet_node: {used:.1f} % of a core, {max(pss for _, pss in after):.0f} MiB PSS, grown by {grown:.1f} "
              "MiB at most")
        took = []
        for _ in range(STOPS):
            wait_until_driving(rig, *robots)
            took.append(stop_time(rig, robots))
            wait_for(lambda: len(rig.stop_state()["stand"]) == ROBOTS, "confirmations", PATIENCE)
            rig.release()
        check_stops(took)
        assert grown < 10.0
