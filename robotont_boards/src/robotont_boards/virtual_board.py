"""What the boards have in common: a virtual clock, C's numbers, and the odometry of generations 2 and 3."""

import math
import re
from collections import deque

import numpy as np

POSITIONS = (math.pi / 3, math.pi, 5 * math.pi / 3)  # [rad] of the wheels, counterclockwise from forward
BYTE = 10 / 115200  # [s] on the line
TIME_OUT = 1.0      # [s] without a command
_NUMBER = re.compile(rb"[ \t\n\r\v\f]*([+-]?(?:nan|inf|(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[+-]?[0-9]+)?))", re.IGNORECASE)

single = np.float32


def as_float(number):
    """What C's float keeps of a number."""
    return float(single(number))


def atof(text):
    """C's atof of bytes."""
    match = _NUMBER.match(text)
    return float(match.group(1)) if match else 0.0


def clamp(value, limit):
    """As C++ has it with std::min and std::max, where NaN becomes the upper limit."""
    value = value if value < limit else limit
    return value if value > -limit else -limit


class Board:
    """A board's clock: `schedule` holds [due, period, action]; bytes wait in `_incoming` until their time."""

    def __init__(self, motors, start=0.0):
        self.motors = motors
        self.now = start
        self.dead = ""        # cause of the processor's halt
        self.executed = []    # (time, line) of every command to the motors that was obeyed
        self.swallowed = []   # (time, line) of lines that were not
        self.inversions = 0   # times that of two lines the older won
        self._incoming = deque()
        self._outgoing = []
        self._line_free_at = start  # when the wire to the board is free
        self._schedule = []

    def receive(self, data, now):
        """The PC writes; the wire takes its time for every byte."""
        for byte in data:
            self._line_free_at = max(self._line_free_at, now) + BYTE
            self._incoming.append((self._line_free_at, byte))

    def advance(self, now):
        """Let time pass; bytes that the board has sent."""
        while not self.dead:
            due = min(entry[0] for entry in self._schedule)
            if self._incoming and self._incoming[0][0] <= min(due, now):
                at, data = self._incoming.popleft()
                self.now = max(self.now, at)
                self._on_bytes(data)
            elif due <= now:
                entry = next(entry for entry in self._schedule if entry[0] == due)
                self.now = due
                entry[0] += entry[1]
                entry[2]()
            else:
                break
        self.now = max(self.now, now)
        sent, self._outgoing = b"".join(self._outgoing), []
        return sent

    @property
    def next_event(self):
        """[s] when something will happen by itself."""
        return min(entry[0] for entry in self._schedule)

    def _on_bytes(self, data):
        raise NotImplementedError

    def _every(self, period, action, first):
        self._schedule.append([self.now + first, period, action])


class OfficialOdometry:
    """The board's own odometry in single precision: the newest speed times 0.02 s, turned by the yaw before."""

    def __init__(self, distance, sin, cos):
        matrix = [(-math.sin(phi), math.cos(phi), distance) for phi in POSITIONS]
        self._inverse = np.linalg.inv(np.array(matrix)).astype(single)
        self._sin, self._cos = sin, cos
        self.summed = [0.0] * 3  # [m] path of each rim, as far as the board has summed it
        self.reset()

    def reset(self):
        """Back to the origin."""
        self.pose = np.zeros(3, single)
        self.base_twist = np.zeros(3, single)
        self.odom_twist = np.zeros(3, single)

    def update(self, speeds):
        """Speeds [m/s] of the rims."""
        self.summed = [path + speed * 0.02 for path, speed in zip(self.summed, speeds)]
        self.base_twist = self._inverse @ np.array(speeds, single)
        sin, cos = single(self._sin(self.pose[2])), single(self._cos(self.pose[2]))
        vx, vy, turn = self.base_twist
        self.odom_twist = np.array((cos * vx - sin * vy, sin * vx + cos * vy, turn), single)
        self.pose = self.pose + self.odom_twist * single(0.02)

    def line(self, base_frame):
        """The feedback, with the linear speed in the robot's frame or in the odometry frame."""
        twist = self.base_twist if base_frame else self.odom_twist
        return b"ODOM:%f:%f:%f:%f:%f:%f\r\n" % tuple(map(float, (*self.pose, *twist)))
