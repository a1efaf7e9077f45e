"""Robotont of generation 2 and 2.1 with the official firmware (August 2018 to today): `MS:`, `RS:` and `ODOM:`."""

import re

from robotont_driver.protocol.board_wheels import DISTANCE, PERIOD, BoardWheels
from robotont_driver.protocol.packet import PacketError
from robotont_driver.protocol.pose_feedback import PoseTracker, parse_pose
from robotont_driver.protocol.protocol import LineProtocol, Power, Ranges

BANNER = "**** MAIN ****"
STOP = b"RS:0:0:0\n"
STANDING = 0.0005     # [m/s] slower wheels are stopped
PUSHED = 1.5          # part of the board's limit that a wheel exceeds at most while its lines are lost
LIGHTS_PER_LINE = 20  # the board takes lines of at most 254 bytes
RANGE_SENSORS = 12

_READING = re.compile(r"-?[0-9]{1,9}(?:\.[0-9]{1,9})?")


class Robotont2(LineProtocol):
    """Rim speeds to the board, cumulative poses back.

    The board executes one line per 20 ms, of two that came together the older one; a line of three bytes or fewer, a
    second terminator or a missing field do harm. Hence the pacing, one terminator, and always all fields.
    """

    name = "robotont2"
    pacing = 0.03
    pause = 0.03
    hello = b"\x1b"     # ESC stops the board and clears what a former program may have left in its buffer
    goodbye = b"\x1b"
    fastest = 0.30      # [m/s] the board limits each wheel to this by itself, which would bend the path

    def __init__(self, wheels, distance=DISTANCE):
        """Raises ProtocolError when the board cannot have these wheels. distance [m]: as its firmware has it."""
        super().__init__(wheels)
        self._board_wheels = BoardWheels(wheels, distance)
        usual = PUSHED * self.fastest * PERIOD * self._board_wheels.edges_per_metre
        self._tracker = PoseTracker(self._board_wheels, self._reach, usual)

    @property
    def doubt(self):
        """How the robot's wheels differ from those of the board; empty when they do not."""
        return self._board_wheels.doubt(self.wheels)

    @property
    def complaint(self):
        """The doubt: a warning."""
        return self.doubt

    def connect(self, now):
        """Begin a new connection."""
        super().connect(now)
        self._tracker.forget()
        self.banner = ""

    def feed(self, data, now):
        """List of `Packet` that `data` completes, those of lost lines included."""
        packets = super().feed(data, now)
        self.count(self._tracker)
        if self._tracker.inconsistent:
            self.dropped["inconsistent"] = self._tracker.inconsistent
        return packets

    def read_line(self, text, now):
        """List of `Packet` that the line completes. Raises PacketError."""
        if text.startswith("ODOM:"):
            return self._tracker.update(parse_pose(text), now)
        if text == BANNER:
            self.banner = text
            self._tracker.restart(now)
        elif text.startswith("RANGE:"):
            self._readings.append(Ranges(tuple(reading / 1000 for reading in read_numbers(text, RANGE_SENSORS))))
        elif text.startswith("POWER:"):
            current, voltage = read_numbers(text, 2)
            self._readings.append(Power(voltage, current))
        elif text.startswith("BATSTATE:"):
            motors, computer, _, voltage = read_numbers(text, 4)
            self._readings.append(Power(voltage, motors + computer))
        elif text:
            raise PacketError("unknown", f"neither ODOM nor RANGE, POWER or BATSTATE: {text[:40]!r}")
        return []

    def encode(self, command):
        """`MS:` with the rim speeds, all scaled by one factor to the board's limit; `RS:0:0:0` at rest."""
        speeds = self._board_wheels.board_speeds(command)
        largest = max(map(abs, speeds))
        if largest < STANDING:
            return STOP
        factor = min(1.0, self.fastest / largest)
        return "MS:{:.4f}:{:.4f}:{:.4f}\n".format(*(speed * factor + 0.0 for speed in speeds)).encode()

    def encode_lights(self, first, colours):
        """`LED:` lines, which firmware with lights obeys and other firmware ignores."""
        lines = []
        for start in range(0, len(colours), LIGHTS_PER_LINE):
            values = [str(red << 16 | green << 8 | blue)
                      for red, green, blue in colours[start:start + LIGHTS_PER_LINE]]
            lines.append("LED:{}:{}\n".format(first + start, ":".join(values)).encode())
        return lines


def read_numbers(text, amount):
    """List of the finite floats behind the first colon of a line. Raises PacketError."""
    fields = text.split(":")[1:]
    if len(fields) != amount:
        raise PacketError("fields", f"{len(fields)} fields instead of {amount} in {text[:60]!r}")
    if not all(map(_READING.fullmatch, fields)):
        raise PacketError("number", f"not {amount} numbers in {text[:60]!r}")
    return list(map(float, fields))
