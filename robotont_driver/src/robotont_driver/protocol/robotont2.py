"""Robotont of generation 2 and 2.1 with the official firmware: `MS:`, `RS:` and `ODOM:`."""

import re

from robotont_driver.protocol.board_wheels import DISTANCE, PERIOD, BoardWheels
from robotont_driver.protocol.packet import Packet, PacketError, format_packet
from robotont_driver.protocol.pose_feedback import PoseTracker, parse_pose
from robotont_driver.protocol.protocol import Power, Protocol, Ranges

BANNER = "**** MAIN ****"
STOP = b"RS:0:0:0\n"
STANDING = 0.0005     # [m/s] slower wheels are stopped
PUSHED = 1.5          # part of the board's limit that a wheel exceeds at most while its lines are lost
SLOWED = 0.99         # part of a command's speed from which on it counts as followed
DECIMALS = 3          # of edges
LIGHTS_PER_LINE = 20  # the board takes lines of at most 254 bytes
RANGE_SENSORS = 12
STRANGE = 50          # lines in a row that moved against their own twist: firmware before February 2020
OLD = ("firmware of August 2018 to February 2020: its poses are short by 11 to 24 %, and the speeds between are not "
       "sent; flash the makers' 2.1.3 (robot:=robotont2) or this project's (robot:=robotont21, docs/firmware.md)")

_READING = re.compile(r"-?[0-9]{1,9}(?:\.[0-9]{1,9})?")
_DEBUG = re.compile(r"Setpoint [012], |Speed\[[012]\]: |MOTOR [012]: |(Fault|Temp|Effort|Current\[[012]\]): ")


class Robotont2(Protocol):
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
        self._tracker = PoseTracker(self._board_wheels, usual, self.period_length)
        self.misfit = self._board_wheels.misfit(wheels)
        self._slows = False  # whether the newest command was faster than the board

    repaired = property(lambda self: self._tracker.repaired)
    restarts = property(lambda self: self._tracker.restarts)
    doubts = property(lambda self: self._tracker.doubts)

    @property
    def complaint(self):
        """Wheels that differ from the board's, or commands that it cannot follow."""
        slow = (f"commands are faster than the board, which limits each wheel to {self.fastest:g} m/s: all wheels are "
                f"slowed down alike (driver_node: max_wheel_speed: {self.fastest:g} in the robot's driver.yaml)")
        return self.misfit or (slow if self._slows else "")

    def period_length(self, edges, elapsed):
        """By what a period of the board was longer than it says."""
        return 1.0

    def read_line(self, text, now):
        """List of `Packet` that the line completes. Raises PacketError."""
        if text.startswith("ODOM:"):
            return self._read_pose(parse_pose(text), now)
        if text == BANNER:
            self.banner = text
            self._tracker.restart(now)
        elif text.startswith("RANGE:"):
            self.readings.append(Ranges(tuple(reading / 1000 for reading in read_numbers(text, RANGE_SENSORS))))
        elif text.startswith("POWER:"):
            current, voltage = read_numbers(text, 2)
            self.readings.append(Power(voltage, current))
        elif text.startswith("BATSTATE:"):
            motors, computer, _, voltage = read_numbers(text, 4)
            self.readings.append(Power(voltage, motors + computer))
        elif is_debug(text):
            self.obstacle = OLD
        elif text:
            raise PacketError("unknown", f"neither ODOM nor RANGE, POWER or BATSTATE: {text[:40]!r}")
        return []

    def _read_pose(self, line, now):
        self.check_reach([self._board_wheels.most_edges(line.vx * PERIOD, line.vy * PERIOD, line.turn * PERIOD)])
        edges = self._tracker.update(line, now)
        if self._tracker.strange >= STRANGE:
            self.obstacle = OLD
        if self._tracker.inconsistent:
            self.dropped["inconsistent"] = self._tracker.inconsistent
        return [rounded(each) for each in edges]

    def encode(self, command):
        """`MS:` with the rim speeds, all scaled by one factor to the board's limit; `RS:0:0:0` at rest."""
        speeds = self._board_wheels.board_speeds(command)
        largest = max(map(abs, speeds))
        factor = min(1.0, self.fastest / max(largest, STANDING))
        self._slows = factor < SLOWED
        if largest < STANDING or self.obstacle:
            return STOP
        return "MS:{:.4f}:{:.4f}:{:.4f}\n".format(*(speed * factor + 0.0 for speed in speeds)).encode()

    def encode_lights(self, first, colours):
        """`LED:` lines, which firmware with lights obeys and other firmware ignores."""
        lines = []
        for start in range(0, len(colours), LIGHTS_PER_LINE):
            values = [str(red << 16 | green << 8 | blue)
                      for red, green, blue in colours[start:start + LIGHTS_PER_LINE]]
            lines.append("LED:{}:{}\n".format(first + start, ":".join(values)).encode())
        return lines


def is_debug(text):
    """Whether a line is one that only firmware before February 2020 sends."""
    return bool(_DEBUG.match(text))


def rounded(edges):
    """The `Packet` of edges (floats)."""
    text = format_packet(edges, DECIMALS)
    return Packet([round(edge, DECIMALS) for edge in edges], text)


def read_numbers(text, amount):
    """List of the finite floats behind the first colon of a line. Raises PacketError."""
    fields = text.split(":")[1:]
    if len(fields) != amount:
        raise PacketError("fields", f"{len(fields)} fields instead of {amount} in {text[:60]!r}")
    if not all(map(_READING.fullmatch, fields)):
        raise PacketError("number", f"not {amount} numbers in {text[:60]!r}")
    return list(map(float, fields))
