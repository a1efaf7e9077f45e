"""Faults in mid-drive over the real processes, and the table of what they did: ./robotont test --faults."""

import os
import signal
from typing import Callable, NamedTuple, Optional

import pytest
import rospy
from fault_rig import HEADING, Rig
from std_msgs.msg import Bool, String

from robotont_testing.harness import Master, Processes, wait_for

pytestmark = pytest.mark.faults

STOP = 0.65      # [s] the chain's time-outs, and the sampling of the board's wheels
RECOVERY = 3.0   # [s] for a process that has to start again


class Fault(NamedTuple):
    """What is done, for how long, how it ends, and what is allowed to happen."""

    name: str
    begin: Callable
    end: Callable = lambda rig: None
    seconds: float = 2.0
    stops: Optional[bool] = None  # whether the robot has to stand meanwhile; None: it may
    recovery: float = 1.5         # [s] at most from the end to the next motion
    loses: bool = False           # whether counts may be lost, if somebody says so


def spoil(**rates):
    """Set rates of the line from the board."""
    def begin(rig):
        for name, rate in rates.items():
            setattr(rig.board.line, name, rate)
    return begin


def clean(rig):
    """A line without faults again."""
    spoil(drop=0.0, corrupt=0.0, double=0.0, split=False, hold=0, cut=False)(rig)


def send(node, how):
    """Send a signal to a node."""
    return lambda rig: os.kill(rig.processes.pid("/" + node), how)


def publish(topic, kind, value):
    """Publish one message."""
    def begin(rig):
        publisher = rospy.Publisher(topic, kind, queue_size=1)
        wait_for(publisher.get_num_connections, "the subscriber of " + topic)
        publisher.publish(value)
        publisher.unregister()
    return begin


def replug(rig):
    """The board comes back under the same name and another device."""
    rig.board.plug()


def dead_and_stopped(*nodes):
    """Faults of these nodes, each in a process of its own."""
    return [
        *(Fault(f"{node} killed (-9)", send(node, signal.SIGKILL), seconds=4.0, stops=node != "odom_node",
                recovery=RECOVERY, loses=node != "driver_node") for node in nodes),
        *(Fault(f"{node} stopped (SIGSTOP)", *stop_and_continue(node), stops=node != "odom_node") for node in nodes)]


def stop_and_continue(node):
    """(begin, end) of a node that is stopped; a stopped one cannot be asked for its process id."""
    stopped = []

    def begin(rig):
        stopped.append(rig.processes.pid("/" + node))
        os.kill(stopped[-1], signal.SIGSTOP)
    return begin, lambda _rig: os.kill(stopped.pop(), signal.SIGCONT)


FAULTS = [
    Fault("1 % of the board's bytes corrupted", spoil(corrupt=0.01), clean, stops=False),
    Fault("1 % of the board's bytes dropped", spoil(drop=0.01), clean, stops=False),
    Fault("1 % of the board's bytes doubled", spoil(double=0.01), clean, stops=False),
    Fault("packets held back, eight at once", spoil(hold=7), clean, stops=False),
    Fault("everything from the board lost", spoil(cut=True), clean, stops=False),
    Fault("cable pulled, back as another device", lambda rig: rig.board.unplug(), replug, stops=True),
    Fault("board restarts in mid-drive", lambda rig: rig.board.restart(), seconds=1.0, loses=True),
    *dead_and_stopped("robotont_node"),
    Fault("emergency stop", publish("emergency_stop", Bool, True), publish("emergency_stop", Bool, False), stops=True),
]
FAULTS_OF_THREE = [
    *dead_and_stopped("driver_node", "serial_com_node", "odom_node"),
    Fault("no packets: text on serial_write", publish("serial_write", String, "hello"), stops=None),
]
ROWS = []


@pytest.fixture(scope="module")
def master():
    with Master() as master:
        rospy.init_node("faults", disable_signals=True)
        yield master
    print("\n" + "\n".join([HEADING, *map(str, ROWS)]))


@pytest.fixture(scope="module")
def one_process(master):
    yield from start_rig("composed:=true")


@pytest.fixture(scope="module")
def three_processes(master):
    yield from start_rig("composed:=false")


def start_rig(argument):
    """A Rig that ends with the tests that use it."""
    with Processes() as processes:
        rig = Rig(processes, argument)
        yield rig
        rig.close()


@pytest.mark.parametrize("fault", FAULTS, ids=[fault.name for fault in FAULTS])
def test_a_fault_stops_the_robot_and_goes_by_without_help(one_process, fault):
    suffer(one_process, fault)


@pytest.mark.parametrize("fault", FAULTS_OF_THREE, ids=[fault.name for fault in FAULTS_OF_THREE])
def test_one_of_three_processes_stops_the_robot_and_goes_by_without_help(three_processes, fault):
    suffer(three_processes, fault)


def suffer(rig, fault):
    """Apply a fault, and check what it does."""
    row = rig.suffer(fault)
    ROWS.append(row)
    if fault.stops:
        assert row.stop is not None, row
        assert row.stop <= STOP, row
    if fault.stops is False:
        assert row.stop is None, row
    if row.recovery is not None:
        assert row.recovery <= fault.recovery, row
    assert row.lost == 0 or (fault.loses and row.named_by), row
