"""The firmware in real time on a pseudo-terminal: `pty_loop.py SRC FD PERIODS WHEELS [WRONG]`, under MicroPython.

FD is the terminal's master side, inherited and non-blocking. Motors are simulated. From the first tick on
the heap is locked. At the end it prints how many ticks it missed, and by how much 99 % of the periods, from
packet to packet, differ from 20 ms at most: of all periods, and of those between two ticks that the operating
system delivered in time. (A shared processor wakes a program late now and then; the board's never does.)
"""

import sys
import time
from array import array

import micropython

sys.path.insert(0, sys.argv[1])
sys.path.insert(0, __file__.rsplit("/", 1)[0])

from sim_motor import HALF, SimMotor

from robotont_firmware import config
from robotont_firmware.main_loop import Controller

TICK = 1000000 // config.RATE  # [us]
IN_TIME = 300  # [us] a tick that comes later is the operating system's doing


class PtyBoard:
    """The board interface in real time; allocates nothing after its construction."""

    def __init__(self, fd, periods, wheels):
        self.line = open(fd, "r+b")  # noqa: SIM115
        self.left = periods
        self.motors = [SimMotor() for _ in range(wheels)]
        self.next = time.ticks_add(time.ticks_us(), TICK)
        self.late = 0
        self.sent = 0
        self.moments = array("l", [0] * (periods + 1))  # [us] when each packet was written
        self.woken_late = array("l", [0] * (periods + 1))  # [us] how long after its time each tick came

    def wait_tick(self):
        if self.left <= 0:
            return 0
        wait = time.ticks_diff(self.next, time.ticks_us())
        if wait > 0:
            time.sleep_us(wait)
        self.woken_late[self.sent] = time.ticks_diff(time.ticks_us(), self.next)
        periods = 1
        self.next = time.ticks_add(self.next, TICK)
        while time.ticks_diff(self.next, time.ticks_us()) <= 0:
            self.next = time.ticks_add(self.next, TICK)
            periods += 1
        self.late += periods - 1
        self.left -= periods
        for motor in self.motors:
            motor.run(20 * periods)
        return periods

    def counts(self, totals):
        for wheel in range(len(self.motors)):
            totals[wheel] = self.motors[wheel].counted & 0xFFFF

    def drive(self, wheel, effort):
        self.motors[wheel].drive(effort)

    def fault(self, wheel):
        return False

    def read(self, buffer):
        return self.line.readinto(buffer) or 0

    def write(self, buffer, size):
        self.line.write(buffer, size)
        if buffer[0] != 35 and self.sent < len(self.moments):
            self.moments[self.sent] = time.ticks_us()
            self.sent += 1

    def feed(self):
        pass

    def stop(self):
        for motor in self.motors:
            motor.drive(0)


wheels = int(sys.argv[4])
board = PtyBoard(int(sys.argv[2]), int(sys.argv[3]), wheels)
for wheel, wrong in enumerate(sys.argv[5].split(",") if len(sys.argv) > 5 else ()):
    motor = board.motors[wheel]
    if wrong == "backward":
        motor.drive = lambda effort, drive=motor.drive: drive(-effort)
    elif wrong == "unpowered":
        motor.powered = False
    elif wrong == "half":
        motor.encoder = HALF
controller = Controller(board, config, wheels, "test")
controller.start()
micropython.heap_lock()
controller.run()
micropython.heap_unlock()


def p99(values):
    """Return what 99 % of the values do not exceed."""
    values.sort()
    return values[len(values) * 99 // 100]


off, in_time = [], []
for index in range(1, board.sent):
    off.append(abs(time.ticks_diff(board.moments[index], board.moments[index - 1]) - TICK))
    if max(board.woken_late[index], board.woken_late[index - 1]) <= IN_TIME:
        in_time.append(off[-1])
print(f"missed ticks {board.late}")
print(f"p99 {p99(off)} us, of {len(in_time)} periods in time {p99(in_time)} us")
