"""Robotont with the firmware of June 2018: setpoints and encoders in edges per 10 ms."""

import re

from robotont_driver.protocol.carried_rounding import CarriedRounding
from robotont_driver.protocol.dialects.dialect import DialectError, LineDialect
from robotont_driver.protocol.packet import PacketError, WholeCounts

WHEELS = 3
WINDOW = 0.01     # [s] in which the board counts edges; it reports one of every two windows or more
PERIOD = 0.02     # [s] that the board waits after it has written its lines
BYTE = 10 / 115200  # [s] that it takes to write one byte
FASTEST = 100     # [edges per window] the board's full scale

_COUNTS = r"(-?[0-9]{1,5}):(-?[0-9]{1,5}):(-?[0-9]{1,5})"
_ENCODERS = re.compile("Encoders " + _COUNTS)
_SETPOINTS = re.compile("Setpoints " + _COUNTS)
_TEMPERATURES = re.compile(r"Temperatures (-?[0-9]+\.[0-9]:){2}-?[0-9]+\.[0-9]")


class Robotont2018(LineDialect):
    """Whole numbers only: a decimal point would end a number. There is no time-out on the board.

    Wheels and signs are those of the wheel file, in its order.
    """

    name = "robotont2018"
    pacing = 0.03
    goodbye = b"\x1b"
    pause = 0.03

    def __init__(self, wheels):
        """Raises DialectError when the board cannot have these wheels."""
        super().__init__(wheels)
        if wheels.amount != WHEELS:
            raise DialectError(f"wheelAmount: found {wheels.amount}, allowed: {WHEELS}, for the board has three motors")
        if abs(wheels.pid_frequency * PERIOD - 1) > 1e-6:
            raise DialectError(f"pidControlFrequency: found {wheels.pid_frequency:g}, allowed: {1 / PERIOD:g} [Hz], "
                               "the rate of the board's feedback")
        self._counts = WholeCounts(WHEELS)
        self._rounding = CarriedRounding(WHEELS, 0, hold=1.0)  # its time counts lines: each is held for as long
        self._lines = 0
        self._written = 0            # bytes that the board has written since the newest counts

    def connect(self, now):
        """Begin a new connection."""
        super().connect(now)
        self._written = 0

    def read_line(self, text, now):
        """List of `Packet` that the line completes. Raises PacketError."""
        self._written += len(text) + 2
        match = _ENCODERS.fullmatch(text)
        if match:
            windows = (PERIOD + self._written * BYTE) / WINDOW
            self._written = 0
            edges = [windows * int(field) for field in match.groups()]
            self.check_reach(edges)
            return self._counts.share(edges)
        if text and not is_line(text):
            raise PacketError("unknown", f"neither Encoders nor Setpoints or Temperatures: {text[:40]!r}")
        return []

    def encode(self, command):
        """Setpoints [edges per window], whole numbers, all scaled by one factor to the board's full scale.

        What rounding leaves of a setpoint, up to a tenth of a slow speed, is carried to the next line.
        """
        setpoints = [unit * WINDOW / PERIOD for unit in command]
        factor = min(1.0, FASTEST / max(1.0, *map(abs, setpoints)))
        self._lines += 1
        rounded = self._rounding.round([setpoint * factor for setpoint in setpoints], self._lines)
        return "{:.0f}:{:.0f}:{:.0f}\r".format(*rounded).encode()


def is_line(text):
    """Whether a line is one that this firmware sends."""
    return any(pattern.fullmatch(text) for pattern in (_ENCODERS, _SETPOINTS, _TEMPERATURES))
