"""The stack as a robot runs it, on a stand-in board, and what a fault does to it: stop, recovery, counts, words.

`Rig` starts robot.launch, commands a steady drive and records what the wheels, the topics and the diagnostics do.
`Rig.suffer` applies one fault in mid-drive and returns a `Row` of the table.
"""

import threading
import time
from typing import List, NamedTuple, Optional

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from robotont_testing.harness import wait_for
from robotont_testing.node_test import twist
from robotont_testing.stand_in_board import Board

COMMAND_PERIOD = 0.05  # [s]
SPEED = 0.2            # [m/s] of the steady drive
STANDING = 0.5         # [edges per period] slower wheels stand


class Row(NamedTuple):
    """What one fault did. Times in [s]; None where it did not happen."""

    fault: str
    stop: Optional[float]      # from the fault to the first standstill, while it lasted
    recovery: Optional[float]  # from its end to the first motion again
    lost: int                  # counts that the board made and nobody read, all wheels
    named_by: List[str]        # tasks of the diagnostics that were not OK meanwhile

    def __str__(self):
        stop, recovery = ("-" if each is None else f"{each:.2f} s" for each in (self.stop, self.recovery))
        return f"{self.fault:<44} {stop:>8} {recovery:>9} {self.lost:>6}  {', '.join(self.named_by) or '-'}"


HEADING = f"{'fault':<44} {'stop':>8} {'recovery':>9} {'lost':>6}  named by"


class Rig:
    """robot.launch on a stand-in board, beside the master of `processes`."""

    def __init__(self, processes, *arguments):
        self.processes = processes
        self.board = Board(str(processes.folder / "board"))
        self.board.on_period = self._on_period
        self.log = processes.folder / "launch.log"
        self.read = [0, 0, 0]        # sum of all counts on serial_read
        self.odom = None
        self._moving = []            # (time, whether the wheels turn), at each change
        self._turned = [0.0, 0.0, 0.0]
        self._named = set()
        self._speed = 0.0
        self.board.plug()
        self.launch = processes.launch(
            "robot.launch", f"port:={self.board.link}", "description:=false", *arguments, log=self.log)
        rospy.Subscriber("serial_read", String, self._on_counts, tcp_nodelay=True)
        rospy.Subscriber("odom", Odometry, lambda message: setattr(self, "odom", message), tcp_nodelay=True)
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics)
        self._command = rospy.Publisher("cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
        self._ended = threading.Event()
        self._commander = threading.Thread(target=self._drive, daemon=True)
        self._commander.start()

    def _on_period(self, turned):
        moving = max(abs(now - before) for now, before in zip(turned, self._turned)) > STANDING
        self._turned = list(turned)
        if not self._moving or self._moving[-1][1] != moving:
            self._moving.append((time.monotonic(), moving))

    def _on_counts(self, message):
        for wheel, count in enumerate(message.data.rstrip(";\n").split(":")):
            self.read[wheel] += int(count)

    def _on_diagnostics(self, message):
        self._named.update(status.name for status in message.status if status.level > 0)

    def _drive(self):
        while not self._ended.wait(COMMAND_PERIOD):
            self._command.publish(twist(self._speed))

    @property
    def moving(self):
        """Whether the board's wheels turn now."""
        return bool(self._moving) and self._moving[-1][1]

    def drive(self):
        """Drive steadily, from now on."""
        self._speed = SPEED
        wait_for(lambda: self.moving, "a driving robot", timeout=30.0)

    def rest(self):
        """Command zero, and wait until the wheels stand and every count has been read."""
        self._speed = 0.0
        wait_for(lambda: not self.moving, "a robot at rest")

    def lost(self):
        """Counts that the board has made and nobody has read, all wheels; call it at rest."""
        total = sum(abs(made - read) for made, read in zip(self.board.motors.counted, self.read))
        self.read = list(self.board.motors.counted)  # each fault answers for its own
        return total

    def settled(self):
        """Wait until what is read does not change any more."""
        newest = None
        while newest != self.read:
            newest = list(self.read)
            odom = self.odom
            wait_for(lambda odom=odom: self.odom is not odom, "odometry after a fault", timeout=30.0)
            time.sleep(0.1)

    def suffer(self, fault):
        """`Row` of a fault in mid-drive: fault.begin(rig), fault.seconds, fault.end(rig)."""
        self.drive()
        self._named.clear()
        begun = time.monotonic()
        fault.begin(self)
        wait_for(lambda: time.monotonic() - begun > fault.seconds, "the fault's duration", timeout=fault.seconds + 5)
        stops = [at - begun for at, moving in self._moving if at > begun and not moving]
        ended = time.monotonic()
        fault.end(self)
        wait_for(lambda: self.moving, f"motion after {fault.name}", timeout=30.0)
        starts = [at - ended for at, moving in self._moving if at > ended and moving]
        wait_for(lambda: time.monotonic() - ended > 1.5, "the diagnostics")
        self.rest()
        self.settled()
        return Row(fault.name, stops[0] if stops else None, starts[0] if starts else None, self.lost(),
                   sorted(self._named))

    def close(self):
        """End the stack and the board."""
        self._ended.set()
        self._commander.join()
        self.processes.stop(self.launch)
        self.board.__exit__()
