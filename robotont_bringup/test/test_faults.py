"""Faults in mid-drive over the real processes, and the table of what they did: ./robotont test --faults."""

import os

import pytest
from fault_rig import HEADING
from fault_table import CLOCK, CLOCKS, COMPOSED, FAULTS, MASTER

pytestmark = pytest.mark.faults
pytest_plugins = ["fault_fixtures"]

ROWS = []


@pytest.fixture(scope="module", autouse=True)
def table():
    """All rows, printed at the end."""
    yield
    print("\n" + "\n".join([HEADING, *map(str, ROWS)]))


def judge(rig, fault):
    """Suffer a fault, and hold what it did against what it may do."""
    row = rig.suffer(fault)
    ROWS.append(row)
    print("\n" + str(row), flush=True)
    if fault.stops:
        assert row.stop is not None, row
        assert row.stop <= fault.within, row
    if fault.stops is False:
        assert row.stop is None, row
    if row.recovery is not None:
        assert row.recovery <= fault.recovery, row
    assert row.lost == 0 or (fault.loses and row.named_by), row


@pytest.fixture
def rig(rigs):
    return rigs.get("plain")


@pytest.mark.parametrize("fault", FAULTS, ids=[fault.name for fault in FAULTS])
def test_a_fault_stops_the_robot_and_goes_by_without_help(rig, fault):
    if "disk" in fault.name and not rig.small_disk:
        pytest.skip("only root may make a small disk")
    judge(rig, fault)


@pytest.fixture
def clock_rig(rigs, master):
    """All nodes with a wall clock that is ahead of the true one by the seconds in a file."""
    clock, folder = master.folder / "clock", master.folder / "site"
    if not clock.exists():
        clock.write_text("0")
        folder.mkdir()
        (folder / "sitecustomize.py").write_text(CLOCK.format(file=str(clock)))
    return rigs.get("clock", PYTHONPATH=os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")]))


@pytest.mark.parametrize("fault", CLOCKS, ids=[fault.name for fault in CLOCKS])
def test_a_clock_that_is_set_stops_nothing(clock_rig, fault):
    judge(clock_rig, fault)


@pytest.mark.parametrize("fault", COMPOSED, ids=[fault.name for fault in COMPOSED])
def test_faults_of_the_three_nodes_in_one_process(rigs, fault):
    judge(rigs.get("composed", composed=True), fault)


def test_the_master_may_die(rigs):
    """The last one: a new master does not know the nodes."""
    judge(rigs.get("last"), MASTER)
