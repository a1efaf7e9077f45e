"""The firmware in real time on a pseudo-terminal: `pty_loop.py SRC FD PERIODS WHEELS [WRONG]`, under MicroPython.

FD is the terminal's master side, inherited and non-blocking. Motors are simulated. From the first tick on
the heap is locked.
"""

import sys
import time

import micropython

sys.path.insert(0, sys.argv[1])
sys.path.insert(0, __file__.rsplit("/", 1)[0])

from sim_motor import SimBoard, SimMotor

from robotont_firmware import config
from robotont_firmware.main_loop import Controller

TICK = 1000000 // config.RATE  # [us]


class PtyBoard(SimBoard):
    """A SimBoard in real time; allocates nothing after its construction."""

    def __init__(self, fd, periods, wheels):
        super().__init__([SimMotor() for _ in range(wheels)])
        self.line = open(fd, "r+b")  # noqa: SIM115
        self.ticks_left = periods
        self.next = time.ticks_add(time.ticks_us(), TICK)

    def wait_tick(self):
        wait = time.ticks_diff(self.next, time.ticks_us())
        if wait > 0:
            time.sleep_us(wait)
        self.next = time.ticks_add(self.next, TICK)
        while time.ticks_diff(self.next, time.ticks_us()) <= 0:
            self.next = time.ticks_add(self.next, TICK)
            self.skip += 1
        return SimBoard.wait_tick(self)  # super() would allocate

    def read(self, buffer):
        return self.line.readinto(buffer) or 0

    def write(self, buffer, size):
        self.line.write(buffer, size)


wheels = int(sys.argv[4])
board = PtyBoard(int(sys.argv[2]), int(sys.argv[3]), wheels)
for wheel, wrong in enumerate(sys.argv[5].split(",") if len(sys.argv) > 5 else ()):
    motor = board.motors[wheel]
    if wrong == "backward":
        motor.drive = lambda effort, drive=motor.drive: drive(-effort)
    elif wrong == "unpowered":
        motor.powered = False
controller = Controller(board, config, wheels, "test")
controller.start()
micropython.heap_lock()
controller.run()
micropython.heap_unlock()
