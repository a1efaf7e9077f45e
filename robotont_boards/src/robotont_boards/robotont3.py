"""Generation 3."""

import math
import re

import numpy as np

from robotont_boards.virtual_board import (
    POSITIONS,
    TIME_OUT,
    Board,
    OfficialOdometry,
    as_float,
    atof,
    clamp,
    single,
)

# As C has them, half in single precision
PHIS = (*POSITIONS[:2], as_float(single(5) / single(3)) * math.pi)
METRES_PER_EDGE = as_float(single(2) / single(64) / single(18.75)) * math.pi * as_float(0.035)


class TransferBuffer:
    """USB transfers of generation 3: the buffer is never cleared, and a message may hold stale bytes."""

    def __init__(self):
        self.data = bytearray(4096)
        self._length = 0
        self._complete = False  # for ever after the first end of a line

    def message(self, transfer):
        """Whether the transfer makes `data` a message."""
        self.data[self._length:self._length + len(transfer)] = transfer
        self._length += len(transfer)
        self._complete = self._complete or b"\n" in transfer or b"\r" in transfer
        if self._complete:
            self._length = 0
        return self._complete

    def tokens(self, start, separators):
        """C's strtok, once per string of separators; None where there is no token left."""
        found = []
        for separator in separators:
            while start is not None and self.data[start] in separator:
                start += 1
            if start is None or not self.data[start]:
                found.append(None)
                start = None
                continue
            end = start
            while self.data[end] and self.data[end] not in separator:
                end += 1
            found.append(bytes(self.data[start:end]))
            start = end + 1 if self.data[end] else None
            self.data[end] = 0
        return found


TABLE = np.sin(2 * np.pi * np.arange(513) / 512).astype(single)


def fast_sin(angle, shift=0.0):
    """The sine of a table of 512 values with linear interpolation, in single precision; shift: [turns]."""
    turns = single(angle) * single(0.159154943092) + single(shift)
    place = single(512) * (turns - np.floor(turns))
    index = int(place) & 511
    part = single(place - int(place))
    return (single(1) - part) * TABLE[index] + part * TABLE[index + 1]


def fast_cos(angle):
    """The cosine of the same table."""
    return fast_sin(angle, 0.25)


class Robotont3Board(Board):
    """Generation 3 on USB: every transfer is a message; every tenth loop draws its display.

    Speeds are measured over the true time between two loops, but the pose moves by them times 0.02 s.
    """

    TRANSFER = 64
    DRAWING = 10, 0.025   # every how many loops, and [s] that it takes
    LINEAR_LIMIT, ANGULAR_LIMIT, DISTANCE = 0.4, 1.0, 0.145
    PERIOD = 0.02
    WEAKEST = 10  # [%] duty below which a motor is off
    LIGHTS = 60
    MODES = 8       # in which the firmware animates the lights; in any other they stand

    def __init__(self, motors, start=0.0, lights=False):
        """lights: as on the branches that have them; `shown` holds their colours 0xRRGGBB."""
        super().__init__(motors, start)
        self.shown = [0] * self.LIGHTS if lights else None
        self.lights_mode = 0
        self.odometry = OfficialOdometry(self.DISTANCE, fast_sin, fast_cos)
        self.setpoints = [0.0] * 3
        self.speeds = [0.0] * 3
        self.extra_lines = []
        self._buffer = TransferBuffer()
        self._manual = None         # [%] duties of a DC command
        self._commanded_at = start
        self._sums, self._before = [0.0] * 3, [0.0] * 3
        self._duties = [0.0] * 3
        self._loops = 1
        self._looped_at = start
        self._every(self.PERIOD, self._loop, self.PERIOD)

    def receive(self, data, now):
        """The PC writes; one write is one transfer, or several of 64 bytes."""
        for begin in range(0, len(data), self.TRANSFER):
            self._incoming.append((now, data[begin:begin + self.TRANSFER]))

    def _on_bytes(self, transfer):
        if not self._buffer.message(transfer):
            return
        name = bytes(self._buffer.data[:2])
        lines = [line for line in re.split(rb"[\r\n]+", transfer) if line]
        if name == b"OR":
            self.odometry.reset()
        elif name in (b"RS", b"MS", b"DC"):
            tokens = self._buffer.tokens(3, (b":", b":", b"\r\n"))
            if None in tokens:
                self.dead = f"hard fault: fields missing in {transfer!r}"
                return
            self._obey(name, list(map(atof, tokens)))
            self.executed.append((self.now, lines[0] if lines else b""))
            if len(lines) > 1:
                self.inversions += 1
                self.swallowed += [(self.now, line) for line in lines[1:]]
        elif name == b"LM" and self.shown is not None:
            self.lights_mode = int(atof(self._buffer.tokens(3, (b":", b":", b":", b"\r\n"))[0]))
        elif name == b"LS" and self.shown is not None:
            self._show()
        else:
            self.swallowed += [(self.now, line) for line in lines if line[:3] in (b"MS:", b"RS:")]

    def _show(self):
        first, last, *colours = self._buffer.tokens(3, (b":",) * (2 + self.LIGHTS))
        first, last = int(atof(first)), int(atof(last))
        self.shown = [0] * self.LIGHTS
        colour = 0
        for light, token in zip(range(first, last + 1), colours):
            colour = colour if token is None else int(atof(token))
            self.shown[light] = colour

    def _obey(self, name, numbers):
        if name == b"DC":
            self._manual = [int(number) for number in numbers]
            return
        self._manual = None
        self._commanded_at = self.now
        if name == b"RS":
            vx, vy, turn = map(as_float, numbers)
            speed = clamp(as_float(math.hypot(vx, vy)), as_float(self.LINEAR_LIMIT))
            way, turn = as_float(math.atan2(vy, vx)), clamp(turn, self.ANGULAR_LIMIT)
            numbers = [speed * math.sin(way - phi) + as_float(self.DISTANCE) * turn for phi in PHIS]
        self.setpoints = list(map(as_float, numbers))

    def _loop(self):
        self._loops += 1
        if self._loops % self.DRAWING[0] == 0:
            self._schedule[0][0] = self.now + self.DRAWING[1]
        elapsed, self._looped_at = round(self.now - self._looped_at, 3), self.now
        if self._manual is not None:
            self._turn(self._manual, elapsed)
            self._outgoing.append(b"EF:%d:%d:%d\r\n" % tuple(self._manual))
            return
        if self.now > self._commanded_at + TIME_OUT:
            self.setpoints = [0.0] * 3
        self._turn([self._duty(wheel) for wheel in range(3)], elapsed)
        self.odometry.update(self.speeds)
        self._outgoing += [self.odometry.line(base_frame=True), *self.extra_lines]
        self.extra_lines = []

    def _duty(self, wheel):
        """Comparisons as in C: what is not a number stays so, in the sum too, until a reboot."""
        error = self.setpoints[wheel] - self.speeds[wheel]
        self._sums[wheel] = within(self._sums[wheel] + 20 * error, 100)
        change = self.speeds[wheel] - self._before[wheel]
        self._before[wheel] = self.speeds[wheel]
        return within(60 * error + (self._sums[wheel] - 50 * change), 100)

    def _turn(self, duties, elapsed):
        """The motors have turned with the duties of the loop before, in whole percent."""
        efforts = [int(duty) / 100 if abs(duty) >= self.WEAKEST else 0.0 for duty in self._duties]
        self._duties = duties
        seconds = as_float(elapsed)
        self.speeds = [count * METRES_PER_EDGE / seconds for count in self.motors.turn(efforts, elapsed)]


def within(value, limit):
    """The value within +-limit; NaN stays."""
    return limit if value > limit else -limit if value < -limit else value
