"""A PC and one of Robotont's boards on a virtual clock: commands, pacing, noise, odometry, without ROS or a port."""

import math
import random

from robotont_boards import BOARDS
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.link.outbox import Outbox
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_driver.protocol.dialects import make_dialect
from robotont_driver.protocol.packet import format_packet, parse_packet
from robotont_testing.dc_motors import Motors
from robotont_testing.robots import ROBOTONT2

REPEAT = 0.05  # [s] after which driver_node repeats a command
STEP = 0.001   # [s]
SQUARE = ((0.2, 0, 0), (0, 0.2, 0), (-0.2, 0, 0), (0, -0.2, 0))  # twists, [m/s]


def official_wheels(**keys):
    """`Wheels` of the robot robotont2."""
    return read_wheels({**ROBOTONT2, **keys})


def command_of(wheels, twist):
    """A twist as a `Packet`, rounded to six decimals."""
    units = Kinematics(wheels).units_of_twist(twist)
    return parse_packet(format_packet(units, 6), 3)


def turning_circle(seconds=12.0, speed=0.15, turns=1, rate=50):
    """Twists, one per command at `rate`, along a circle in the room while the robot turns the other way."""
    turn = 2 * math.pi * turns / seconds
    for step in range(round(seconds * rate)):
        angle = 2 * turn * step / rate
        yield speed * math.cos(angle), speed * math.sin(angle), -turn


class Bench:
    """One PC, one board. `pass_on(data)` may spoil what the board sends."""

    def __init__(self, name="robotont2", packets=None, wheels=None, **board):
        self.wheels = wheels or official_wheels()
        self.kinematics = Kinematics(self.wheels)
        self.motors = Motors()
        self.board = BOARDS[name](self.motors, **board)
        self.dialect = make_dialect(packets or name, self.wheels)
        self.dialect.connect(0.0)
        self.odometry = WheelOdometry(self.kinematics, 0.02, 0.005)
        self.outbox = Outbox()
        self.outbox.pacing = self.dialect.pacing
        self.pass_on = lambda data: data
        self.now = 0.0
        self.counts = []
        self.sent = []   # (time, line)
        self.commanded = None
        self._repeat_at = math.inf
        self.outbox.hurry(self.dialect.hello, self.dialect.pause)

    def command(self, twist):
        """A command as driver_node and serial_com_node would pass it on."""
        units = self.kinematics.units_of_twist(twist)
        self.commanded = parse_packet(format_packet(units, 2), self.wheels.amount)
        self._send()

    def _send(self):
        self._repeat_at = self.now + REPEAT
        line = self.dialect.encode(self.commanded)
        if line:
            self.outbox.put(line)

    def fall_silent(self):
        """No command is repeated any more."""
        self._repeat_at = math.inf

    def run(self, seconds, step=STEP):
        """Let time pass."""
        for _ in range(round(seconds / step)):
            self.now += step
            if self.now >= self._repeat_at:
                self._send()
            line = self.outbox.take(self.now)
            if line:
                self.sent.append((self.now, line))
                self.board.receive(line, self.now)
            self.hear(self.board.advance(self.now))

    def hear(self, data):
        """Bytes from the board, as the line passes them on."""
        data = self.pass_on(data)
        if data:
            for counts in self.dialect.feed(data, self.now):
                self.counts.append(counts)
                self.odometry.update(counts, 0.0)

    def hold(self, twist, seconds):
        """Command one twist for a time."""
        self.command(twist)
        self.run(seconds)

    def pose(self):
        """(x, y, yaw) of the odometry."""
        pose = self.odometry.pose
        return pose.x, pose.y, pose.yaw

    def board_pose(self):
        """The same of the board's own odometry."""
        return [float(value) for value in self.board.odometry.pose]

    def settle(self, seconds=1.5):
        """Stop and let every line arrive."""
        self.hold((0.0, 0.0, 0.0), seconds)


class LineNoise:
    """Loses a share of whole lines, replaces a share of bytes."""

    def __init__(self, lines=0.0, bytes_=0.0, seed=1):
        self._lines, self._bytes = lines, bytes_
        self._random = random.Random(seed)
        self._rest = b""

    def __call__(self, data):
        """What is left of `data`."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        kept = b"".join(line + b"\n" for line in lines if self._random.random() >= self._lines)
        return bytes(self._random.randrange(256) if self._random.random() < self._bytes else byte for byte in kept)


def assert_near(found, wanted, metres, radians):
    """Two poses (x, y, yaw) are that close to each other."""
    error = math.hypot(found[0] - wanted[0], found[1] - wanted[1])
    assert error <= metres, (found, wanted, error)
    assert abs(math.remainder(found[2] - wanted[2], 2 * math.pi)) <= radians, (found, wanted)
