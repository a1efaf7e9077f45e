"""Faults in mid-drive over the real processes, and the table of what they did: ./robotont test --faults."""

import os

import pytest
from fault_rig import HEADING
from fault_table import CLOCK, CLOCKS, FAULTS, MASTER, NODES

pytestmark = pytest.mark.faults
pytest_plugins = ["fault_fixtures"]

ROWS = []


@pytest.fixture(scope="module", autouse=True)
def table():
    yield
    print("\n" + "\n".join([HEADING, *map(str, ROWS)]))


def judge(rig, fault):
    """Suffer a fault, and hold what it did against what it may do."""
    row = rig.suffer(fault)
    ROWS.append(row)
    print("\n" + str(row), flush=True)
    assert fault.stops in (None, row.stop is not None), row
    assert not fault.stops or row.stop <= fault.within, row
    assert (row.recovery or 0.0) <= fault.recovery, row
    assert row.lost == 0 or fault.loses, row
    assert row.named_by or (row.stop is None and not row.lost), row


@pytest.mark.parametrize("fault", [*FAULTS, *NODES], ids=lambda fault: fault.name)
def test_a_fault_stops_the_robot_and_goes_by_without_help(rigs, fault):
    rig = rigs("faults")
    if "disk" in fault.name and not rig.small_disk:
        pytest.skip("only root may make a small disk")
    judge(rig, fault)


@pytest.fixture
def clocks(master):
    """Environment of nodes with a wall clock that is ahead of the true one by the seconds in a file."""
    clock, folder = master.folder / "clock", master.folder / "site"
    if not clock.exists():
        clock.write_text("0")
        folder.mkdir()
        (folder / "sitecustomize.py").write_text(CLOCK.format(file=str(clock)))
    return {"PYTHONPATH": os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])}


@pytest.mark.parametrize("fault", CLOCKS, ids=[fault.name for fault in CLOCKS])
def test_a_clock_that_is_set_stops_nothing(rigs, clocks, fault):
    judge(rigs("clocks", **clocks), fault)


def test_the_master_may_die(rigs):
    """The last one: a new master does not know the nodes."""
    judge(rigs("last"), MASTER)
