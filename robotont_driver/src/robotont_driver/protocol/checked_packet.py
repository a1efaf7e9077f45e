"""Feedback with a CRC: `m0:m1:...;SS:E0E0:E1E1:...:STATUS:CCCC`, see docs/protocol.md."""

import re

from robotont_driver.protocol.board_status import BoardStatus
from robotont_driver.protocol.checksum import has_checksum
from robotont_driver.protocol.packet import PacketError, parse_packet

# whole counts, counter, totals, status (from firmware 2.0 on; with at least 3 wheels it is longer than a total), CRC
_CHECKED = re.compile(r"([^;.]*);([0-9A-F]{2})((?::[0-9A-F]{4})+)(?::([0-9A-F]{9,}))?:[0-9A-F]{4}\Z")


class ForeignPacketError(PacketError):
    """A valid checked packet of a board with another number of wheels."""


class CheckedPacket:
    """Feedback with a valid CRC: `counts` per wheel, packet `counter`, encoder `totals` modulo 2^16.

    `status`: the board's BoardStatus; None from firmware before 2.0. Its reader's: `arrival`, an `Arrival`, and
    `number`, which goes on where the counter begins again.
    """

    arrival = number = None

    def __init__(self, line, wheels):
        """From a line without newline. Raises PacketError."""
        match = _CHECKED.match(line)
        if not match:
            raise PacketError("trailer", f"no valid trailer in {line[:60]!r}")
        counts, counter, totals, status = match.groups()
        if not has_checksum(line):
            raise PacketError("checksum", f"wrong checksum in {line[:60]!r}")
        self.counter = int(counter, 16)
        self.totals = tuple([int(total, 16) for total in totals.split(":")[1:]])
        if len(self.totals) != wheels:
            found = len(self.totals)
            raise ForeignPacketError("fields", f"{found} totals instead of {wheels} in {line[:60]!r}")
        self.counts = parse_packet(counts + ";", wheels)
        if status and len(status) not in (wheels + 6, wheels + 11):
            raise PacketError("fields", f"not {wheels} faults in {line[:60]!r}")
        self.status = BoardStatus.parse(status, wheels) if status else None

    def missed_since(self, last):
        """(periods, counts per wheel) that the board sent after packet `last` and before this one.

        Totals are known modulo 2^16, so the counts are those of the smallest magnitude.
        """
        periods = (self.counter - last.counter - 1) % 256
        counts = [
            (total - before - count + 0x8000) % 0x10000 - 0x8000
            for total, before, count in zip(self.totals, last.totals, self.counts)
        ]
        return periods, counts

    def repeats(self, other):
        """Whether both are the same packet."""
        return self.counter == other.counter and self.totals == other.totals and self.counts == other.counts
