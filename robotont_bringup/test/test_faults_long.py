"""The same fault again and again, and a bad line for long: nothing grows, no count is lost."""

import os
import time
from pathlib import Path

import pytest
from fault_rig import NODES
from fault_table import clean, kill, spoil

from robotont_testing.harness import wait_for

pytestmark = [pytest.mark.faults, pytest.mark.long]
pytest_plugins = ["fault_fixtures"]

WARMING = 10  # rounds: the master keeps a connection to a node from each of its threads, and they come one by one
ROUNDS_OF_CABLE, ROUNDS_OF_KILLS = 100, 50
SURELY = 0.2  # [s] of driving that end a round
LARGEST_GROWTH = 3000  # [kB] of a node's memory over all rounds


def resources(rig):
    """{node: (threads, descriptors, memory [kB])}."""
    found = {}
    for node in NODES:
        folder = Path(f"/proc/{rig.processes.pid('/' + node)}")
        status = dict(line.split(":", 1) for line in (folder / "status").read_text().splitlines())
        found[node] = int(status["Threads"]), len(os.listdir(folder / "fd")), int(status["VmRSS"].split()[0])
    return found


def check_resources(rig, before):
    """No node has more threads, descriptors or memory than before."""
    def same():
        return all(now[0] <= threads and now[1] <= files and now[2] < memory + LARGEST_GROWTH
                   for (threads, files, memory), now in zip(before.values(), resources(rig).values()))
    print(f"\nthreads, descriptors, memory [kB]: {before} -> {resources(rig)}")
    wait_for(same, "the same resources", timeout=30.0, period=1.0)


def hold_out(rig, rounds, fault):
    """Many rounds of a fault, each until the robot drives again; resources are the same before and after."""
    rig.drive()
    for number in range(WARMING + rounds):
        if number == WARMING:
            before = resources(rig)
        fault(rig)
        wait_for(lambda: rig.well(SURELY), f"a driving robot after round {number}", timeout=30.0)
    rig.drive()
    check_resources(rig, before)


def test_a_hundred_pulled_cables_cost_nothing(rigs):
    def pull(rig):
        rig.board.unplug()
        wait_for(lambda: not rig.moving, "a standing robot")
        rig.board.plug()
    hold_out(rigs("cables"), ROUNDS_OF_CABLE, pull)


@pytest.mark.parametrize("node", NODES)
def test_fifty_killed_nodes_cost_nothing(rigs, node):
    def end(rig):
        pid = rig.pid(node)
        kill(node)(rig)
        wait_for(lambda: not rig.well(0.0), "the fault")
        wait_for(lambda: rig.pid(node) not in (pid, None), "another process", timeout=30.0, period=0.2)
    hold_out(rigs("kills"), ROUNDS_OF_KILLS, end)


@pytest.mark.skipif("ROBOTONT_SOAK" not in os.environ, reason="takes as long as ROBOTONT_SOAK says [s], e.g. 1800")
def test_soak(rigs):
    """A long drive on a line that corrupts one byte in a thousand: every count arrives, and nothing grows."""
    rig = rigs("soak")
    rig.drive()
    spoil(corrupt=0.001)(rig)
    wait_for(lambda: rig.well(20.0), "a warm robot", timeout=60.0)
    before = resources(rig)
    end = time.monotonic() + float(os.environ["ROBOTONT_SOAK"])
    while time.monotonic() < end:
        time.sleep(min(60.0, end - time.monotonic() + 0.1))
        wait_for(lambda: rig.well(1.0), "a driving robot")
    clean(rig)
    rig.rest()
    assert rig.lost() == 0
    check_resources(rig, before)
