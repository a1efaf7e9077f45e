"""The firmware itself on simulated motors of a lifted robot, at a port."""

import sys
import time

from firmware_tools import DUAL

from robotont_testing.cable import Cable

sys.path.append(str(DUAL))
from dual_tools import Robot
from sim_motor import SimMotor  # noqa: F401 (for the tests)


class RobotAtAPort(Cable):
    """The firmware on these motors in real time at the serial port `link`."""

    def __init__(self, link, *motors):
        super().__init__(str(link))
        self.robot = Robot()
        self.robot.board.motors[:] = motors
        self.due = time.monotonic()

    def hear(self, data, _now):
        self.robot.board.inbox += data

    def turn(self, now):
        if now >= self.due:
            self.due += 0.02
            self.robot.tick(1)
            sent, self.robot.board.sent = self.robot.board.sent, b""
            self.send(sent)
