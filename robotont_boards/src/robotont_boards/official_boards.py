"""Robotont's boards with the official firmware, made from its grammar byte for byte, traps included.

Each runs on a virtual clock: `receive(data, now)` is one write of the PC, `advance(now)` lets time pass and returns
the bytes that the board has sent meanwhile. The motors are an object with `turn(efforts, seconds)` -> counted
edges. Nothing here uses the driver's code. The fate of commands is recorded: `executed`, `swallowed`, `inversions`.
"""

import math
import re
from collections import deque

import numpy as np

POSITIONS = (math.pi / 3, math.pi, 5 * math.pi / 3)  # [rad] of the wheels, counterclockwise from forward
METRES_PER_EDGE = 2 * math.pi * 0.035 / 64 / 18.75
BYTE = 10 / 115200  # [s] on the line
TIME_OUT = 1.0      # [s] without a command
_NUMBER = re.compile(rb"[ \t\n\r\v\f]*([+-]?(?:nan|inf|(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[+-]?[0-9]+)?))", re.IGNORECASE)

single = np.float32


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
        self.executed = []    # (time, line) of every command that was obeyed
        self.swallowed = []   # (time, line) of every whole line that was not
        self.inversions = 0   # times that of two lines the older won
        self._incoming = deque()
        self._outgoing = []
        self._schedule = []

    def receive(self, data, now):
        """The PC writes."""
        raise NotImplementedError

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


class Robotont2Board(Board):
    """Generation 2 and 2.1 on its ST-LINK port. base_frame: firmware 2.1.3 or newer; distance: 0.127 before 2020.

    Every 10 ms the motors' control, every 20 ms the main loop, every 100 ms a look at the time-out.
    """

    SPEED_LIMIT = 0.3    # [m/s] of each wheel alone
    EFFORT_LIMIT = 0.25
    GAIN, INTEGRAL_TIME, CONTROL_PERIOD = 0.8, 0.05, 0.01
    BUFFER = 254

    def __init__(self, motors, start=0.0, base_frame=True, distance=0.145):
        super().__init__(motors, start)
        self.odometry = OfficialOdometry(distance, math.sin, math.cos)
        self.setpoints = [0.0] * 3
        self.speeds = [0.0] * 3     # [m/s] measured in the newest 10 ms
        self.extra_lines = []       # sent with the next loop: RANGE, POWER of some branches
        self._base_frame = base_frame
        self._distance = distance
        self._stopped = [True] * 3
        self._sums = [0.0] * 3      # of the control errors
        self._buffer = bytearray()
        self._complete = False
        self._commanded_at = start
        self._line_free_at = start  # when the wire to the board is free
        self._send(b"**** MAIN ****\r\n")
        self._every(self.CONTROL_PERIOD, self._control, self.CONTROL_PERIOD)
        self._every(0.1, self._look_at_time, 0.1)
        self._every(0.02, self._loop, 0.003)

    def receive(self, data, now):
        """The PC writes; the wire takes its time for every byte."""
        for byte in data:
            self._line_free_at = max(self._line_free_at, now) + BYTE
            self._incoming.append((self._line_free_at, byte))

    def _send(self, data):
        self._outgoing.append(data)

    def _on_bytes(self, byte):
        self._buffer.append(byte)
        if len(self._buffer) > self.BUFFER:
            self._buffer.clear()
        if byte in b"\r\n" and len(self._buffer) > 3:
            self._complete = True
        if byte == 27:
            for wheel in range(3):
                self._stop(wheel)
            self._buffer.clear()

    def _loop(self):
        if self._complete:
            packet = bytes(self._buffer).partition(b"\0")[0]
            self._buffer.clear()
            self._process(packet)
            self._complete = False
        self.odometry.update(self.speeds)
        for line in self.extra_lines:
            self._send(line)
        self.extra_lines = []
        self._send(self.odometry.line(self._base_frame))

    def _process(self, packet):
        lines = [line for line in re.split(rb"[\r\n]+", packet) if line]
        fields = []
        for field in packet.split(b":")[:6]:
            if not field:
                break
            fields.append(field)
        if not fields or fields[0] not in (b"MS", b"RS"):
            self.swallowed += [(self.now, line) for line in lines if line[:3] in (b"MS:", b"RS:")]
            return
        if len(fields) < 4:
            self.dead = f"undefined behaviour: fields missing in {packet!r}"
            return
        self.executed.append((self.now, lines[0]))
        if len(lines) > 1:  # all but the first
            self.inversions += 1
            self.swallowed += [(self.now, line) for line in lines[1:]]
        numbers = [float(single(atof(field))) for field in fields[1:4]]
        if fields[0] == b"MS":
            for wheel, speed in enumerate(numbers):
                self._set_speed(wheel, speed)
        else:
            vx, vy, turn = numbers
            for wheel, phi in enumerate(POSITIONS):
                speed = math.hypot(vx, vy) * math.sin(math.atan2(vy, vx) - phi) + self._distance * turn
                if abs(speed) < 1e-5:
                    self._stop(wheel)
                else:
                    self._set_speed(wheel, speed)
        self._commanded_at = self.now

    def _set_speed(self, wheel, speed):
        if self._stopped[wheel]:
            self._sums[wheel] = 0.0
            self._stopped[wheel] = False
        self.setpoints[wheel] = clamp(speed, self.SPEED_LIMIT)

    def _stop(self, wheel):
        self._set_speed(wheel, 0.0)
        self._stopped[wheel] = True

    def _look_at_time(self):
        if self.now - self._commanded_at > TIME_OUT:
            for wheel in range(3):
                self._stop(wheel)

    def _control(self):
        efforts = [0.0 if self._stopped[wheel] else self._effort(wheel) for wheel in range(3)]
        counts = self.motors.turn(efforts, self.CONTROL_PERIOD)
        self.speeds = [count * METRES_PER_EDGE / self.CONTROL_PERIOD for count in counts]

    def _effort(self, wheel):
        error = self.setpoints[wheel] - self.speeds[wheel]
        self._sums[wheel] += error
        wanted = self.GAIN * (error + self._sums[wheel] * self.CONTROL_PERIOD / self.INTEGRAL_TIME)
        if abs(wanted) > 1.0:
            self._sums[wheel] -= error
        return clamp(wanted, self.EFFORT_LIMIT)


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


def fast_sin(angle):
    """The sine of a table of 512 values with linear interpolation, in single precision."""
    turns = single(angle) * single(0.159154943092)
    place = single(512) * (turns - np.floor(turns))
    index = int(place) & 511
    part = single(place - int(place))
    return (single(1) - part) * TABLE[index] + part * TABLE[index + 1]


def fast_cos(angle):
    """The cosine of the same table."""
    turns = single(angle) * single(0.159154943092) + single(0.25)
    place = single(512) * (turns - np.floor(turns))
    index = int(place) & 511
    part = single(place - int(place))
    return (single(1) - part) * TABLE[index] + part * TABLE[index + 1]


class Robotont3Board(Board):
    """Generation 3 on USB: every transfer is a message, output comes in bursts of 1024 bytes."""

    TRANSFER = 64
    BURST = 1024
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
        self._printed = b""
        self._sums, self._duties, self._before = [0.0] * 3, [0.0] * 3, [0.0] * 3
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
            vx, vy, turn = numbers
            speed, turn = min(math.hypot(vx, vy), self.LINEAR_LIMIT), clamp(turn, self.ANGULAR_LIMIT)
            numbers = [speed * math.sin(math.atan2(vy, vx) - phi) + self.DISTANCE * turn for phi in POSITIONS]
        self.setpoints = numbers

    def _loop(self):
        if self._manual is not None:
            self._turn(self._manual)
            self._print(b"EF:%d:%d:%d\r\n" % tuple(self._manual))
            return
        if self.now > self._commanded_at + TIME_OUT:
            self.setpoints = [0.0] * 3
        self._turn([self._duty(wheel) for wheel in range(3)])
        self.odometry.update(self.speeds)
        self._print(self.odometry.line(base_frame=True))
        for line in self.extra_lines:
            self._print(line)
        self.extra_lines = []

    def _duty(self, wheel):
        error = self.setpoints[wheel] - self.speeds[wheel]
        self._sums[wheel] = clamp(self._sums[wheel] + 1000 * self.PERIOD * error, 100)
        change = self.speeds[wheel] - self._before[wheel]
        self._before[wheel] = self.speeds[wheel]
        return clamp(60 * error + self._sums[wheel] - change / self.PERIOD, 100)

    def _turn(self, duties):
        efforts = [duty / 100 if abs(duty) >= self.WEAKEST else 0.0 for duty in duties]
        counts = self.motors.turn(efforts, self.PERIOD)
        self.speeds = [count * METRES_PER_EDGE / self.PERIOD for count in counts]

    def _print(self, data):
        self._printed += data
        while len(self._printed) >= self.BURST:
            self._outgoing.append(self._printed[:self.BURST])
            self._printed = self._printed[self.BURST:]


class Robotont2018Board(Board):
    """The firmware of June 2018. Unit: edges per 10 ms. There is no time-out; the loop lasts 20 ms and its writing."""

    FULL_SCALE = 100
    GAIN, INTEGRAL_TIME, CONTROL_PERIOD = 0.5, 0.25, 0.01
    BUFFER = 254
    _COMMAND = re.compile(rb"\s*([+-]?\d+)(?::\s*([+-]?\d+)(?::\s*([+-]?\d+))?)?")

    def __init__(self, motors, start=0.0):
        super().__init__(motors, start)
        self.setpoints = [0] * 3
        self.counts = [0] * 3
        self._stopped = [True] * 3
        self._sums = [0.0] * 3
        self._buffer = bytearray()
        self._line_free_at = start
        self._loops = 0
        self._every(self.CONTROL_PERIOD, self._control, self.CONTROL_PERIOD)
        self._every(0.02, self._loop, 0.003)

    def receive(self, data, now):
        """The PC writes; the wire takes its time for every byte."""
        for byte in data:
            self._line_free_at = max(self._line_free_at, now) + BYTE
            self._incoming.append((self._line_free_at, byte))

    def _on_bytes(self, byte):
        self._buffer.append(byte)
        if len(self._buffer) > self.BUFFER:
            self._buffer.clear()
        if byte == 13:
            match = self._COMMAND.match(bytes(self._buffer))
            for wheel, field in enumerate(match.groups() if match else ()):
                if field is not None:
                    self.setpoints[wheel] = int(field)
            self.executed.append((self.now, bytes(self._buffer).strip()))
            self._stopped = [False] * 3
            self._buffer.clear()
        if byte == 27:
            self.setpoints = [0] * 3
            self._stopped = [True] * 3
            self._sums = [0.0] * 3
            self._buffer.clear()

    def _control(self):
        efforts = [0.0 if self._stopped[wheel] else self._effort(wheel) for wheel in range(3)]
        self.counts = self.motors.turn(efforts, self.CONTROL_PERIOD)

    def _effort(self, wheel):
        error = (self.setpoints[wheel] - self.counts[wheel]) / self.FULL_SCALE
        self._sums[wheel] += error
        return clamp(self.GAIN * (error + self._sums[wheel] * self.CONTROL_PERIOD / self.INTEGRAL_TIME), 1.0)

    def _loop(self):
        text = b"Temperatures 21.5:21.5:22.0\r\n" if self._loops % 10 == 0 else b""
        self._loops += 1
        text += b"Setpoints %d:%d:%d\r\n" % tuple(self.setpoints)
        text += b"Encoders %d:%d:%d\r\n\r\n" % tuple(self.counts)
        self._outgoing.append(text)
        self._schedule[1][0] += len(text) * BYTE  # writing takes the processor


BOARDS = {"robotont2": Robotont2Board, "robotont3": Robotont3Board, "robotont2018": Robotont2018Board}
