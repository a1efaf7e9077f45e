"""What every protocol offers, and what passes through it: lines of bytes, `Packet`s, and readings of the board."""

from collections import Counter
from typing import NamedTuple, Tuple

from robotont_driver.kinematics.wheel_params import counts_in_reach

LONGEST_LINE = 256  # [bytes] without the newline; a longer line is dropped


class PacketError(ValueError):
    """A packet that cannot be used. The `kind` is a short name under which it is counted."""

    def __init__(self, kind, text):
        super().__init__(text)
        self.kind = kind


def format_packet(values, decimals=0):
    r"""The packet `m0:m1:...;\\n` of the values [units], each with so many decimals."""
    # round() may leave a negative zero, which "+ 0.0" makes positive
    return ":".join([f"{round(value, decimals) + 0.0:.{decimals}f}" for value in values]) + ";\n"


class Packet(tuple):
    r"""The values [units] of a packet, one per wheel, and its `text`, `m0:m1:...;\\n`, which writes them.

    `number`: None, or that of its period on the board: it counts periods without a gap, lost ones included, and begins
    anew when the board does. `commanded`: None, or the units that the board was to follow then. `periods`: how many
    it stands for.
    """

    periods = 1.0

    def __new__(cls, values, text=None, number=None, commanded=None):
        """From values; without `text` they are written as whole numbers."""
        packet = super().__new__(cls, values)
        packet.text = format_packet(packet) if text is None else text
        packet.number, packet.commanded = number, commanded
        return packet

    def told(self):
        """Text with number, command and periods behind the semicolon, where a reader of plain packets stops."""
        number = "" if self.number is None else self.number
        command = ";" + self.commanded.text[:-1] if self.commanded else ""
        periods = "" if self.periods == 1.0 else f"{'' if command else ';'}{self.periods:.3f}"
        return f"{self.text[:-1]}{number}{command}{periods}\n"


class Ranges(NamedTuple):
    """Distances [m] that the board's range sensors measured, by sensor."""

    distances: Tuple[float, ...]


class Power(NamedTuple):
    """Of the battery, as the board measured it."""

    voltage: float  # [V]
    current: float  # [A] drawn; NaN: not measured


class ProtocolError(ValueError):
    """A protocol that cannot drive these wheels: what was found and what is allowed."""


class LineSplitter:
    """Cuts a stream of bytes into lines, however the bytes arrive."""

    overlong, rest = 0, b""  # lines that were too long; the beginning of the next one

    def feed(self, data):
        """List of the lines (bytes, without newline) that `data` completes."""
        *ended, rest = (self.rest + data).split(b"\n")
        self.rest = rest[:LONGEST_LINE + 1]  # enough for a line to be too long
        lines = [line for line in ended if len(line) <= LONGEST_LINE]
        self.overlong += len(ended) - len(lines)
        return lines


class Protocol:
    """One kind of board, for one connection: bytes in, `Packet`s out; commands in, bytes out; times [s] are given."""

    name = ""
    pacing = 0.0    # [s] least time from a line's end to the next one's beginning, to the board; 0: none is needed
    hello = b""     # sent once, before the first command
    fastest = 0.0   # [m/s] of a wheel's rim, the most to ask of it; the board may limit each one alone; 0: no limit
    repaired = 0    # packets handed out for periods whose lines were lost
    restarts = 0    # of the board
    doubts = 0      # gaps in which the board may have restarted
    newest_error = ""  # description of the newest line that was not used
    banner = ""     # newest start-up banner of the board
    drives = True   # whether it passes commands on, if nothing is in their way
    tells_rate = False  # whether the board has said at which rate it controls
    obstacle = ""   # why the board must not be driven
    complaint = ""  # a warning about a board that is driven nevertheless
    misfit = ""     # between the robot's wheels and the board: drives only where the robot's folder names the protocol

    def __init__(self, wheels):
        self.wheels = wheels
        self.packets = 0          # handed out
        self.dropped = Counter()  # lines that were not used, by reason
        self.dropped_before = 0   # of these, up to the first packet: any connection may begin within a line
        self.readings = []        # `Ranges` and `Power` that nobody has taken yet
        self._reach = counts_in_reach(wheels)  # [edges] more in one period is taken for an error
        self._splitter = LineSplitter()

    def feed(self, data, now):
        """List of `Packet`, one per PID period, that `data` completes; no data can raise out of it."""
        packets = []
        for line in self._splitter.feed(data):
            try:
                packets += self.read_line(line.decode("ascii").strip("\r"), now)
            except (PacketError, UnicodeDecodeError) as error:
                self.dropped[getattr(error, "kind", "not ascii")] += 1
                self.newest_error = str(error)
        if self._splitter.overlong:
            self.dropped["overlong"] = self._splitter.overlong
        if not self.packets:
            self.dropped_before = sum(self.dropped.values())
        self.packets += len(packets)
        return packets

    def read_line(self, text, now):
        """List of `Packet` that a line completes. Raises PacketError."""
        raise NotImplementedError

    def encode(self, command):
        """Bytes for a command, a `Packet`: its line, if it may go out, behind a question for the board to answer."""
        raise NotImplementedError

    def stop(self):
        """Bytes of the line that stops all wheels."""
        return self.encode(Packet([0] * self.wheels.amount))

    def encode_lights(self, first, colours):
        """List of lines (bytes) that colour the lights `first`, `first` + 1, ...; colours: (r, g, b), 0..255."""
        return []

    def report_board(self):
        """(errors, warnings, values) of the board since the last call; lists of sentences, and values by name."""
        return [], [], {"board": self.banner}

    def check_reach(self, edges):
        """Raise PacketError where a wheel (n) has made more edges in a period than its motor can."""
        if max(map(abs, edges)) > self._reach:
            raise PacketError("reach", f"more than {self._reach} edges in one period")
