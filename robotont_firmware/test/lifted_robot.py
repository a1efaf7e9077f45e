"""The firmware itself on simulated motors of a lifted robot, in no time, or at a port."""

import sys
import time

from firmware_tools import DUAL

from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.tools.tune import Tune, tune
from robotont_firmware import config
from robotont_firmware.main_loop import Controller
from robotont_testing.cable import Cable
from robotont_testing.robots import SHIPPED

sys.path.append(str(DUAL))
from dual_tools import Config
from sim_motor import SimBoard, SimMotor

MOST = 54  # [edges/period]
WHEELS = read_wheels(SHIPPED)


class LiftedRobot:
    """The firmware on simulated motors; a serial line whose `read` lets a period pass."""

    def __init__(self, *motors, settings=None):
        self.motors = motors or [SimMotor() for _ in range(3)]
        self.board = SimBoard(self.motors)
        self.controller = Controller(self.board, settings or Config(), 3, "test")
        self.controller.start()
        self.ticks = 0
        self.fastest = 0  # [edges] that a wheel truly turned in a period
        self.each_tick = lambda: None
        self.key = self.silent = False  # whether a key was hit, whether the cable brings nothing
        self.told = b""  # newest words to the board

    def write(self, data):
        self.told = data
        self.board.inbox += data

    def read(self, _size):
        self.each_tick()
        before = [motor.turned for motor in self.motors]
        self.controller.step(self.board.wait_tick())
        self.ticks += 1
        self.fastest = max(self.fastest, *(abs(motor.turned - turned) for motor, turned in zip(self.motors, before)))
        sent, self.board.sent = self.board.sent, b""
        return b"" if self.silent else sent

    def clock(self):
        return self.ticks / config.RATE

    @property
    def efforts(self):
        return list(self.board._next)

    def tune(self, most=MOST, pressed=lambda: False):
        """(whether there is a proposal, what was printed)."""
        lines = []
        tuned = Tune(self, WHEELS, most, pressed, self.clock)
        tuned.prepare()
        return tune(tuned, 3, config.RATE, most, lines.append), "\n".join(lines)


class RobotAtAPort(Cable):
    """A LiftedRobot in real time at the serial port `link`. `driven`: periods of each order."""

    def __init__(self, link, *motors):
        super().__init__(str(link))
        self.robot = LiftedRobot(*motors)
        self.driven = []
        self.due = time.monotonic()
        self._was = 0

    def hear(self, data, _now):
        self.robot.write(data)

    def turn(self, now):
        if now < self.due:
            return
        self.due += 0.02
        self.send(self.robot.read(0))
        left, was = self.robot.controller._test_left, self._was
        if left > was:
            self.driven.append(0)
        if was > 0 or left > 0:
            self.driven[-1] += 1
        self._was = left
