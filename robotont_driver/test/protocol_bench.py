"""A PC and one of Robotont's boards on a virtual clock: commands, pacing, noise, odometry, without ROS or a port."""

import math

from robotont_boards import BOARDS
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.link.serial_link import Outbox
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_driver.protocol.connection import KINDS
from robotont_driver.protocol.plain import parse_packet
from robotont_driver.protocol.protocol import format_packet
from robotont_testing.dc_motors import Motors
from robotont_testing.robots import ROBOTONT2

REPEAT = 0.05  # [s] after which driver_node repeats a command
STEP = 0.001   # [s]


def official_wheels(**keys):
    """`Wheels` of the robot robotont2."""
    return read_wheels({**ROBOTONT2, **keys})


def command_of(wheels, twist, decimals=6):
    """A twist as a `Packet`."""
    return parse_packet(format_packet(Kinematics(wheels).units_of_twist(twist), decimals), wheels.amount)


class Bench:
    """One PC, one board. `pass_on(data)` may spoil what the board sends."""

    def __init__(self, name="robotont2", motors=None, make=None, **board):
        self.wheels = official_wheels()
        self.motors = motors or Motors()
        self.board = (make or BOARDS[name])(self.motors, **board)
        self.protocol = KINDS[name](self.wheels)
        self.odometry = WheelOdometry(Kinematics(self.wheels), 0.02, 0.005)
        self.outbox = Outbox()
        self.outbox.pacing = self.protocol.pacing
        self.pass_on = lambda data: data
        self.arrival = lambda now: now  # [s] when what the board sends now is read
        self.now = 0.0
        self.counts, self.twists = [], []
        self.sent = []   # (time, line)
        self.commanded = None
        self._repeat_at = math.inf
        self.outbox.put(self.protocol.hello)

    def command(self, twist):
        """A command as driver_node and serial_com_node would pass it on."""
        self.commanded = command_of(self.wheels, twist, 2)
        self._repeat_at = self.now

    def run(self, seconds):
        """Let time pass."""
        for _ in range(round(seconds / STEP)):
            if self.now >= self._repeat_at:
                self._repeat_at = self.now + REPEAT
                line = self.protocol.encode(self.commanded)
                if line:
                    self.outbox.put(line)
            self.now += STEP
            line = self.outbox.take(self.now)
            if line:
                self.sent.append((self.now, line))
                self.board.receive(line, self.now)
            data = self.pass_on(self.board.advance(self.now))
            if data:
                for counts in self.protocol.feed(data, self.arrival(self.now)):
                    self.counts.append(counts)
                    self.odometry.update(counts, 0.0, periods=counts.periods)
                    self.twists.append(self.odometry.twist)

    def hold(self, twist, seconds):
        """Command one twist for a time."""
        self.command(twist)
        self.run(seconds)

    def fall_silent(self):
        """The PC sends no more."""
        self._repeat_at = math.inf
