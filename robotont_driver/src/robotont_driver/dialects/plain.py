"""The thesis' packets, `m0:m1:m2;`, as boards with this project's firmware or the thesis' own speak them."""

from robotont_driver.dialects.dialect import Dialect
from robotont_driver.protocol import FeedbackReader


class Plain(Dialect):
    """Plain packets both ways; what stands behind a semicolon is ignored."""

    name = "plain"

    def __init__(self, wheels, reach):
        super().__init__(wheels)
        self._reader = FeedbackReader(wheels.amount, reach, self.name, wheels.pid_frequency)
        self.dropped = self._reader.dropped

    def connect(self, now):
        """Begin a new connection."""
        self._reader.connect()

    def feed(self, data, now):
        """List of count tuples that `data` completes, missed periods included."""
        packets = self._reader.feed(data)
        reader = self._reader
        self.packets, self.repaired, self.restarts = reader.packets, reader.repaired, reader.restarts
        self.banner, self.fault, self.obstacle = reader.banner, reader.fault, reader.obstacle
        return packets

    def report_board(self):
        """(errors, warnings, values) of the board's status, identity and notices."""
        return self._reader.health.report()

    def encode(self, command):
        """The packet as it is, with a CRC where the board is known to read one; see `FeedbackReader.encode`."""
        return self._reader.encode(command.text + "\n")
