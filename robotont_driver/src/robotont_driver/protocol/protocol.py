"""What every protocol offers, what passes between it and its `Connection`, and the thesis' own, the plainest."""

from collections import Counter
from typing import NamedTuple, Tuple

from robotont_driver.kinematics.wheel_params import counts_in_reach
from robotont_driver.protocol.packet import LineSplitter, Packet, PacketError, parse_packet


class Ranges(NamedTuple):
    """Distances [m] that the board's range sensors measured, by sensor."""

    distances: Tuple[float, ...]


class Power(NamedTuple):
    """State of the battery as the board measured it."""

    voltage: float  # [V]
    current: float  # [A] drawn; NaN: not measured


class ProtocolError(ValueError):
    """A protocol that cannot drive these wheels: what was found and what is allowed."""


class Protocol:
    """The serial protocol of one kind of board, for one connection: bytes in, `Packet`s out; commands in, bytes out.

    Pure: times `now` [s] are the caller's, from any clock that never goes back. A subclass sets the constants and
    defines `read_line` and `encode`.
    """

    name = ""
    pacing = 0.0    # [s] least time between the beginnings of two lines to the board; 0: none is needed
    hello = b""     # sent once, before the first command
    fastest = 0.0   # [m/s] of a wheel's rim, to which the board limits each one alone; 0: it limits none
    repaired = 0    # packets handed out for periods whose lines were lost
    restarts = 0    # of the board
    doubts = 0      # gaps in which the board may have restarted
    newest_error = ""  # description of the newest line that was not used
    banner = ""     # newest start-up banner of the board
    tells_rate = False  # whether the board has said at which rate it controls
    obstacle = ""   # why the board must not be driven
    complaint = ""  # a warning about a board that is driven nevertheless
    misfit = ""     # between the robot's wheels and the board: drives only where the robot's folder names the protocol

    def __init__(self, wheels):
        self.wheels = wheels
        self.packets = 0          # handed out
        self.dropped = Counter()  # lines that were not used, by reason
        self.readings = []        # `Ranges` and `Power` that nobody has taken yet
        self._reach = counts_in_reach(wheels)  # [edges] more in one period is taken for an error
        self._splitter = LineSplitter()

    def feed(self, data, now):
        """List of `Packet`, one per PID period, that `data` completes; no data can raise out of it.

        Lines that are refused are counted in `dropped`, by kind.
        """
        packets = []
        for line in self._splitter.feed(data):
            try:
                packets += self.read_line(line.decode("ascii").strip("\r"), now)
            except PacketError as error:
                self.dropped[error.kind] += 1
                self.newest_error = str(error)
            except UnicodeDecodeError:
                self.dropped["not ascii"] += 1
                self.newest_error = "bytes outside ASCII"
        if self._splitter.overlong:
            self.dropped["overlong"] += self._splitter.overlong
            self._splitter.overlong = 0
        self.packets += len(packets)
        return packets

    def read_line(self, text, now):
        """List of `Packet` that a line completes. Raises PacketError."""
        raise NotImplementedError

    def encode(self, command):
        """Bytes of one line for a command, a `Packet`."""
        raise NotImplementedError

    def stop(self):
        """Bytes of the line that stops all wheels."""
        return self.encode(Packet([0] * self.wheels.amount))

    def encode_lights(self, first, colours):
        """List of lines (bytes) that colour the lights `first`, `first` + 1, ...; colours: (r, g, b), 0..255.

        Empty where the board has no lights.
        """
        return []

    def report_board(self):
        """(errors, warnings, values): what the board reports about itself; lists of sentences, and values by name.

        Call it once per report of the diagnostics: it may contain what is new since the last one.
        """
        return [], [], {"board": self.banner}

    def check_reach(self, edges):
        """Raise PacketError where a wheel (n) has made more edges in a period than its motor can."""
        if max(map(abs, edges)) > self._reach:
            raise PacketError("reach", f"more than {self._reach} edges in one period")


class Plain(Protocol):
    """Plain packets both ways; what stands behind a semicolon is ignored."""

    name = "plain"
    _first = True  # whether no line has come yet

    def read_line(self, text, now):
        """List of `Packet` that the line completes. Raises PacketError."""
        first, self._first = self._first, False
        if not text or text.startswith("#"):
            self.banner = text[1:].strip() or self.banner
            return []
        if first:
            raise PacketError("first line", "the first line may be incomplete")
        counts = parse_packet(text, self.wheels.amount)
        if "." in counts.text:
            raise PacketError("decimals", f"counts with decimals in {text[:40]!r}")
        self.check_reach(counts)
        return [Packet(counts)]  # a number is only this driver's

    def encode(self, command):
        """The packet as it is."""
        return command.text.encode("ascii")
