"""The faults that `Rig.suffer` applies in mid-drive, and what each of them may do to the robot."""

import math
import os
import signal
import sys
import time

import rospy
from fault_rig import Fault, fill
from geometry_msgs.msg import Twist
from std_msgs.msg import String

from robotont_testing.harness import suspend, wait_for

RESPAWN = 3.0    # [s] for a process that has to start again
CLOCK = """
import time
true, true_ns = time.time, time.time_ns
def offset():
    with open({file!r}) as file:
        return int(file.read() or 0)
time.time = lambda: true() + offset()
time.time_ns = lambda: true_ns() + offset() * 10 ** 9
"""  # libfaketime fails with Python's sleep (clock_nanosleep: invalid argument)
MALFORMED = (
    "", ";", "hello", "1:2;", "1:2:3:4;", "nan:0:0;", "inf:0:0;", "1e9:0:0;", "--1:0:0;", "1:2:3", "1:2:3\n4:5:6;",
    "9" * 5000 + ":0:0;", "\u00e9:0:0;", "\x00" * 300)
GARBAGE = (
    b"\n", b"\r\n", b"#\n", b"x" * 5000 + b"\n", bytes(range(256)) * 4 + b"\n", b"1:2;\n", b"99999:0:0;\n",
    b"1:2:3;00:0001:0002:0003:0000\n", b"ODOM:nan:nan:nan:nan:nan:nan\r\n", b"**** MAIN ****\r\n", b"1:1:1;\n",
    b"# fault motor 1\n", b"# robotont_firmware 9\n")
FLOOD = """
import sys, time, rospy
from geometry_msgs.msg import Twist
rospy.init_node("flood", anonymous=True)
publishers = [rospy.Publisher(topic, Twist, queue_size=1, tcp_nodelay=True) for topic in ("cmd_vel", "cmd_vel/default")]
message = Twist()
message.linear.x = 0.2
begun, number = time.monotonic(), 0
while not rospy.is_shutdown():
    for publisher in publishers:
        publisher.publish(message)
    number += 1
    time.sleep(max(0.0, begun + number / 5000.0 - time.monotonic()))
"""


def spoil(**rates):
    """Set faults of the line, both ways."""
    def begin(rig):
        for name, rate in rates.items():
            setattr(rig.board.line, name, rate)
            setattr(rig.board.commands, name, rate)
    return begin


def clean(rig):
    spoil(drop=0.0, corrupt=0.0, double=0.0, hold=0, cut=False, delay=0.0)(rig)


def deaf(rig):
    rig.board.line.cut = True


def stall(rig):
    """Nothing gets through the port either way, nothing is lost."""
    rig.board.stalled = True
    rig.board.line.hold = 10 ** 9


def flow(rig):
    """All that has waited gets through at once."""
    rig.board.stalled = False
    rig.board.line.hold = 0


def unplug(rig):
    """Pull the cable; the device's name is used by another one before the board comes back."""
    rig.device = os.readlink(rig.board.link)
    rig.board.unplug()
    rig.others = [os.openpty()]
    while not any(os.ttyname(slave) == rig.device for _, slave in rig.others):
        rig.others.append(os.openpty())
        time.sleep(0.05)


def replug(rig):
    """The board comes back behind the same link."""
    rig.board.plug()
    assert os.readlink(rig.board.link) != rig.device
    for end in sum(rig.others, ()):
        os.close(end)


def kill(node):
    return lambda rig: os.kill(rig.processes.pid("/" + node), signal.SIGKILL)


def back(node):
    return lambda rig: wait_for(lambda: rig.pid(node), node + " again", timeout=10.0)


def stop(node):
    def begin(rig):
        rig.stopped[node] = rig.processes.pid("/" + node)
        suspend(rig.stopped[node])
    return begin


def go_on(node):
    return lambda rig: os.kill(rig.stopped.pop(node), signal.SIGCONT)


def publish(topic, kind, *values):
    def begin(rig):
        publisher = rospy.Publisher(topic, kind, queue_size=100)
        wait_for(publisher.get_num_connections, "the subscriber of " + topic)
        for value in values:
            publisher.publish(value)
            time.sleep(0.01)
        publisher.unregister()
    return begin


def twists():
    """What no robot on a floor can do."""
    for field in ("linear.x", "linear.y", "linear.z", "angular.x", "angular.y", "angular.z"):
        for value in (math.nan, math.inf, -math.inf, 1e308, *([1.0] if field in ("linear.z", "angular.x") else [])):
            message = Twist()
            vector, axis = field.split(".")
            setattr(getattr(message, vector), axis, value)
            yield message


def flood(rig):
    """Commands at 5 kHz, until `calm`: to the mux, where the rig's commander has the input, and to driver_node."""
    heard = len(rig.board.heard)
    rig.flood = rig.processes.start(sys.executable, "-c", FLOOD)
    wait_for(lambda: len(rig.board.heard) > heard + 500, "the flood on the line", timeout=10.0)  # 25 s without it


def calm(rig):
    rig.processes.stop(rig.flood)


def release(rig):
    """Release the emergency stop; whoever commands has to stop once before he drives again."""
    rig.speed = 0.0
    rig.button.publish(False)
    wait_for(lambda: time.sleep(0.3) is None, "some zeros")
    rig.drive()


def empty(rig):
    (rig.disk / "filler").unlink()


def set_clock(seconds):
    """Set the nodes' wall clock by so much from the true one."""
    return lambda rig: (rig.processes.folder / "clock").write_text(str(seconds))


def emergency_stop(name, prepare=None, before=lambda rig: None):
    """The button is pressed in mid-drive, and released, after before(rig)."""
    return Fault(name, lambda rig: rig.button.publish(True), lambda rig: (before(rig), release(rig)), 1.0, stops=True,
                 within=0.1, prepare=prepare, recovery=5.0)


FAULTS = [  # of line, board, senders and computer: whatever the arrangement of the nodes
    Fault("1 % of the bytes corrupted, both ways", spoil(corrupt=0.01), clean, 4.0, stops=False),
    Fault("1 % of the bytes dropped, both ways", spoil(drop=0.01), clean, 4.0, stops=False),
    Fault("1 % of the bytes doubled, both ways", spoil(double=0.01), clean, 4.0, stops=False),
    Fault("all bytes 0.2 s late, both ways", spoil(delay=0.2), clean, stops=False),
    Fault("packets held back, eight at once", spoil(hold=7), clean, stops=False),
    Fault("everything from the board lost", deaf, clean, stops=False),
    Fault("everything lost, both ways", spoil(cut=True), clean, stops=True),
    Fault("port stalled, both ways", stall, flow, stops=True),
    Fault("cable pulled, back as another device", unplug, replug, stops=True, recovery=2.0, loses=True),
    Fault("board restarts in mid-drive", lambda rig: rig.board.restart(), seconds=1.0, loses=True),
    Fault("5 kHz of commands", flood, calm, stops=False),
    emergency_stop("emergency stop behind 5 kHz of commands", flood, calm),
    emergency_stop("emergency stop"),
    Fault("malformed packets on serial_write", publish("serial_write", String, *MALFORMED), stops=False),
    Fault("malformed packets on serial_read", publish("serial_read", String, *MALFORMED), stops=False),
    Fault("malformed lines from the board", lambda rig: [rig.board.say(line) for line in GARBAGE], stops=False),
    Fault("impossible commands on cmd_vel/default", publish("cmd_vel/default", Twist, *twists())),
    Fault("impossible commands on cmd_vel", publish("cmd_vel", Twist, *twists()), recovery=2.5),
    Fault("disk full", lambda rig: fill(rig.disk), empty, 4.0, stops=False),
    Fault("recorder_node killed (-9)", kill("recorder_node"), back("recorder_node"), stops=False),
    Fault("recorder_node stopped (SIGSTOP), goes on (SIGCONT)", stop("recorder_node"), go_on("recorder_node"),
          stops=False),
]


def node_faults(node, stops=True, loses=False):
    """A node of the robot dies, and does not answer."""
    return [
        Fault(f"{node} killed (-9)", kill(node), seconds=4.0, stops=stops, recovery=RESPAWN, loses=loses),
        Fault(f"{node} stopped (SIGSTOP), goes on (SIGCONT)", stop(node), go_on(node), stops=stops),
    ]


def killed_on_a_full_disk(node):
    """A node dies, and its successor finds no room for its log."""
    return Fault(f"{node} killed (-9) on a full disk", kill(node), empty, 6.0, stops=True,
                 prepare=lambda rig: fill(rig.disk), loses=node == "serial_com_node")


NODES = [
    *node_faults("driver_node"), *node_faults("serial_com_node", loses=True), *node_faults("cmd_vel_mux"),
    *node_faults("odom_node", stops=False, loses=True), killed_on_a_full_disk("driver_node")]
MASTER = Fault("master killed (-9), a new one started", lambda rig: rig.processes.stop_master(),
               lambda rig: rig.processes.start_master(), 3.0, stops=False)
CLOCKS = [
    Fault(f"wall clock {way}", set_clock(seconds), set_clock(0), stops=False)
    for way, seconds in (("1 h forward, and back", 3600), ("1 h back, and forward", -3600), ("1 s back", -1))]
