"""The thesis' packets, `m0:m1:m2;`, as boards with this project's firmware or the thesis' own use them."""

import math
from operator import attrgetter

from robotont_driver.protocol.dialects.dialect import Dialect, Power
from robotont_driver.protocol.feedback_reader import FeedbackReader


def _of_reader(name):
    """An attribute that the FeedbackReader, or a part of it, holds."""
    find = attrgetter("_reader." + name)
    return property(lambda dialect: find(dialect))


class Plain(Dialect):
    """Plain packets both ways; what stands behind a semicolon is ignored."""

    name = "plain"
    packets = _of_reader("packets")
    repaired = _of_reader("lost.repaired")
    restarts = _of_reader("lost.restarts")
    doubts = _of_reader("lost.doubts")
    newest_error = _of_reader("newest_error")
    banner = _of_reader("health.banner")
    fault = _of_reader("health.fault")
    obstacle = _of_reader("health.obstacle")

    def __init__(self, wheels, reach):
        super().__init__(wheels)
        self._reader = FeedbackReader(wheels.amount, reach, wheels.pid_frequency, self.name)
        self.dropped = self._reader.dropped

    def connect(self, now):
        """Begin a new connection."""
        self._reader.connect()

    def feed(self, data, now):
        """List of `Packet` that `data` completes, missed periods included."""
        reader = self._reader
        packets = reader.feed(data, now)
        voltage = reader.health.take_voltage()
        if voltage:
            self._readings = [Power(voltage, math.nan)]
        return packets

    def report_board(self):
        """(errors, warnings, values) of the board's status, identity and notices."""
        return self._reader.health.report()

    def encode(self, command):
        """The packet as it is, with a CRC where the board reads one; see `FeedbackReader.encode`."""
        return self._reader.encode(command.text)
