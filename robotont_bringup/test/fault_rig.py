"""The stack as a robot runs it, on a stand-in board, and what a fault does to it: stop, recovery, counts, words.

`Rig` starts robot.launch and the black box, commands a steady drive and records what the wheels, the topics, the
diagnostics and the log do. `Rig.suffer` applies one fault in mid-drive and returns a `Row` of the table.
"""

import atexit
import contextlib
import math
import os
import subprocess
import threading
import time
from typing import Callable, List, NamedTuple, Optional

import numpy as np
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool

from robotont_testing.harness import wait_for
from robotont_testing.node_test import twist
from robotont_testing.stand_in_board import Board, identity

COMMAND_PERIOD = 0.05  # [s]
SPEED = 0.2            # [m/s] of the steady drive
STANDING = 0.5         # [edges per period] slower wheels stand
FRESH = 0.15           # [s] an odometry that is older has failed
CALM = 1.5             # [s] without a fault before the next begins, and behind each for the diagnostics
BYTE_RATE = 11520      # [bytes/s] of a line of 115200 baud
COUNT = 2 * math.pi / 1200  # [rad] of a wheel per encoder edge
NODES = ("driver_node", "serial_com_node", "odom_node", "cmd_vel_mux")
RUN = "--run_id=faults"  # else of two roslaunch beside a new master each makes one, and the later one gives up
LOG_DISK = "24m"       # size of the disk of logs and black box, which needs 5 MB


class Fault(NamedTuple):
    """What is done, for how long, how it ends, and what is allowed to happen."""

    name: str
    begin: Callable
    end: Optional[Callable] = None  # None: it ends by itself, and the recovery counts from its beginning
    seconds: float = 2.0
    stops: Optional[bool] = None    # whether the robot has to stand meanwhile; None: it may
    within: float = 0.6             # [s] after which it has to stand at the latest
    recovery: float = 1.5           # [s] until it drives and the odometry goes on, at the latest
    loses: bool = False             # whether counts may be lost, if somebody says so
    prepare: Optional[Callable] = None


class Row(NamedTuple):
    """What one fault did. Times in [s]; None where it did not happen."""

    fault: str
    stop: Optional[float]      # from the fault to the first standstill
    recovery: Optional[float]  # from its end until the robot drives and the odometry goes on, for good
    lost: int                  # counts that the board has made and odometry has not, all wheels
    named_by: List[str]        # tasks of the diagnostics that were not OK, logs with warnings

    def __str__(self):
        stop, recovery = ("-" if each is None else f"{each:.2f} s" for each in (self.stop, self.recovery))
        return f"{self.fault:<50} {stop:>8} {recovery:>9} {self.lost:>6}  {', '.join(self.named_by) or '-'}"


HEADING = f"{'fault':<50} {'to stop':>8} {'to recover':>9} {'lost':>5}  named by"


class Rig:
    """robot.launch and recorder.launch on a stand-in board, beside the master of `processes`."""

    def __init__(self, processes, **environment):
        self.processes = processes
        self.board = Board(str(processes.folder / "board"), identity=identity())
        self.board.byte_rate = BYTE_RATE
        self.board.on_period = self._on_period
        self._ends = contextlib.ExitStack()
        atexit.register(self._ends.close)  # after a Ctrl-C in the middle
        self.disk = processes.folder / "disk"
        self.disk.mkdir(exist_ok=True)
        self.small_disk = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=" + LOG_DISK, "tmpfs", str(self.disk)],
                                         check=False, stderr=subprocess.DEVNULL).returncode == 0
        if self.small_disk:
            self._ends.callback(subprocess.run, ["umount", "--lazy", str(self.disk)], check=False)
        self._ends.callback(self.board.close)
        self.log = processes.folder / "launch.log"
        self._odom = np.zeros(3, int)     # [edges] of each wheel, as odometry has them
        self._odom_at = 0.0          # [s] when it said so
        self._missing = np.zeros(3, int)  # [edges] that it has lost already
        self._states = [(0.0, False, False)]  # (time, whether the wheels turn, and all is well), at each change
        self._turned = np.zeros(3)
        self._levels = {}
        self._named = set()
        self.speed = 0.0             # [m/s] that is commanded; None: nothing is
        self.stopped = {}            # process ids of nodes that do not answer, by name
        self.board.plug()
        environment["ROS_LOG_DIR"] = str(self.disk)
        for launch in (
                processes.launch("robot.launch", f"port:={self.board.link}", "description:=false", RUN, log=self.log,
                                 **environment),
                processes.launch("recorder.launch", f"folder:={self.disk / 'black_box'}", RUN,
                                 log=processes.folder / "recorder.log", **environment)):
            self._ends.callback(processes.stop, launch)
        self._command = rospy.Publisher("cmd_vel/default", Twist, queue_size=1, tcp_nodelay=True)
        self.button = rospy.Publisher("emergency_stop", Bool, queue_size=1, tcp_nodelay=True)
        for topic in (self._command, self.button,
                      rospy.Subscriber("joint_states", JointState, self._on_joints, tcp_nodelay=True),
                      rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics),
                      rospy.Subscriber("/rosout", Log, self._on_log)):
            self._ends.callback(topic.unregister)
        self._ended = threading.Event()
        commander = threading.Thread(target=self._drive, daemon=True)
        commander.start()
        self._ends.callback(commander.join)
        self._ends.callback(self._ended.set)
        wait_for(lambda: self._odom_at, "odometry", timeout=30.0)  # counts from before it belong to no fault
        wait_for(lambda: self.board.heard, "commands", timeout=30.0)
        wait_for(lambda: any((self.disk / "black_box").glob("*/*")), "the black box", timeout=30.0)

    def _on_period(self, turned):
        now = time.monotonic()
        moving = bool(np.abs(turned - self._turned).max() > STANDING)
        self._turned = np.array(turned)
        well = moving and now - self._odom_at < FRESH
        if self._states[-1][1:] != (moving, well):
            self._states.append((now, moving, well))

    def _on_joints(self, message):
        self._odom = np.rint(np.array(message.position) / COUNT).astype(int)
        self._odom_at = time.monotonic()

    def _on_diagnostics(self, message):
        for status in message.status:
            self._levels[status.name] = status.level
            if status.level > 0:
                self._named.add(status.name)

    def _on_log(self, message):
        if message.level >= Log.WARN:
            self._named.add("log of " + message.name.strip("/"))

    def _drive(self):
        while not self._ended.wait(COMMAND_PERIOD):
            if self.speed is not None:
                self._command.publish(twist(self.speed))

    @property
    def moving(self):
        return self._states[-1][1]

    def pid(self, node):
        try:
            return self.processes.pid("/" + node)
        except OSError:
            return None

    def well(self, seconds):
        """Whether the robot has driven with an odometry for so long."""
        at, _, well = self._states[-1]
        return well and time.monotonic() - at > seconds

    def drive(self):
        """Drive steadily and without complaints, from now on."""
        self.speed = SPEED
        wait_for(lambda: self.well(CALM), "a driving robot", timeout=30.0)
        wait_for(lambda: not any(self._levels.values()),
                 f"calm diagnostics, {sorted(name for name, level in self._levels.items() if level)}", timeout=30.0)

    def rest(self):
        """Command zero, and wait until the wheels stand and every count has been read."""
        self.speed = 0.0
        wait_for(lambda: not self.moving, "a robot at rest")
        with contextlib.suppress(AssertionError):  # else they are lost
            wait_for(lambda: not self._lost().any(), "all counts", timeout=1.5)

    def _lost(self):
        return self.board.motors.counted - self._odom - self._missing

    def lost(self):
        """Counts that the board has made and odometry has not, all wheels, since the last call; call it at rest."""
        lost = self._lost()
        self._missing += lost  # each fault answers for its own
        return int(np.abs(lost).sum())

    def suffer(self, fault):
        """`Row` of a fault in mid-drive."""
        self.drive()
        if fault.prepare:
            fault.prepare(self)
        self._named.clear()
        deaths = self._deaths()
        begun = time.monotonic()
        fault.begin(self)
        wait_for(lambda: time.monotonic() - begun > fault.seconds, "the fault's duration", timeout=fault.seconds + 5)
        ended = begun
        if fault.end:
            ended = time.monotonic()
            fault.end(self)
        wait_for(lambda: self.well(CALM), f"recovery from {fault.name}", timeout=30.0)
        changes = [state for state in self._states if state[0] > begun]
        stops = [at - begun for at, moving, _ in changes if not moving]
        recovery = max(0.0, changes[-1][0] - ended) if changes else None
        self.rest()
        named = sorted(self._named) + ["roslaunch"] * (self._deaths() > deaths)
        return Row(fault.name, stops[0] if stops else None, recovery, self.lost(), named)

    def _deaths(self):
        return self.log.read_text(errors="replace").count("has died")

    def close(self):
        self._ends.close()


def fill(disk):
    with contextlib.suppress(OSError), open(str(disk / "filler"), "wb", buffering=0) as file:
        while True:
            file.write(bytes(4096 if os.statvfs(str(disk)).f_bavail > 4 else 64))
