"""Faults in mid-drive over the real processes, and the table of what they did: ./robotont test --faults."""

import os

import pytest
from fault_rig import HEADING
from fault_table import CLOCK, CLOCKS, FAULTS, MASTER, ONE_PROCESS, THREE_PROCESSES

pytestmark = pytest.mark.faults
pytest_plugins = ["fault_fixtures"]

ARRANGEMENTS = {"one process": True, "three processes": False}  # composed or not
ROWS = {arrangement: [] for arrangement in ARRANGEMENTS}


@pytest.fixture(scope="module", autouse=True)
def table():
    yield
    for arrangement, rows in ROWS.items():
        print("\n" + "\n".join([HEADING + ", " + arrangement, *map(str, rows)]))


def judge(rig, fault, arrangement):
    """Suffer a fault, and hold what it did against what it may do."""
    row = rig.suffer(fault)
    ROWS[arrangement].append(row)
    print("\n" + str(row), flush=True)
    assert fault.stops in (None, row.stop is not None), row
    assert not fault.stops or row.stop <= fault.within, row
    assert (row.recovery or 0.0) <= fault.recovery, row
    assert row.lost == 0 or fault.loses, row
    assert row.named_by or (row.stop is None and not row.lost), row


@pytest.mark.parametrize("arrangement, fault", [
    pytest.param(arrangement, fault, id=f"{arrangement}: {fault.name}")
    for arrangement, own in (("one process", ONE_PROCESS), ("three processes", THREE_PROCESSES))
    for fault in (*FAULTS, *own)])
def test_a_fault_stops_the_robot_and_goes_by_without_help(rigs, arrangement, fault):
    rig = rigs(arrangement, ARRANGEMENTS[arrangement])
    if "disk" in fault.name and not rig.small_disk:
        pytest.skip("only root may make a small disk")
    judge(rig, fault, arrangement)


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
@pytest.mark.parametrize("arrangement", ARRANGEMENTS)
def test_a_clock_that_is_set_stops_nothing(rigs, clocks, arrangement, fault):
    rig = rigs("clocks of " + arrangement, ARRANGEMENTS[arrangement], **clocks)
    judge(rig, fault, arrangement)


@pytest.mark.parametrize("arrangement", ARRANGEMENTS)
def test_the_master_may_die(rigs, arrangement):
    """The last ones: a new master does not know the nodes."""
    judge(rigs("last of " + arrangement, ARRANGEMENTS[arrangement]), MASTER, arrangement)
