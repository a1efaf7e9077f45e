"""Protocol of this project's firmware: a CRC, a counter and encoder totals behind the semicolon; docs/protocol.md."""

import math
import re

from robotont_driver.protocol.board_status import BoardHealth
from robotont_driver.protocol.checked_packet import CheckedPacket, ForeignPacketError
from robotont_driver.protocol.checksum import add_checksum, has_checksum
from robotont_driver.protocol.lost_packets import LostPackets
from robotont_driver.protocol.packet import PacketError, format_packet
from robotont_driver.protocol.protocol import Power, Protocol

_SEALED = re.compile(r"#.*;[0-9A-F]{4}\Z")
QUESTION = add_checksum("?;")  # asks for the identity, which boards with firmware from 2.0 on send


class Checked(Protocol):
    """Commands carry a CRC; only packets with a valid trailer are read, and those that were lost are recovered.

    `health`: `BoardHealth`, the board's own reports.
    """

    name = "checked"

    def __init__(self, wheels):
        super().__init__(wheels)
        self._lost = LostPackets(self._reach, self.dropped)
        self.health = BoardHealth(wheels.amount, wheels.pid_frequency)
        self._zeros = add_checksum(format_packet([0] * wheels.amount))

    repaired = property(lambda self: self._lost.repaired)
    restarts = property(lambda self: self._lost.restarts)
    doubts = property(lambda self: self._lost.doubts)
    obstacle = property(lambda self: self.health.obstacle)
    tells_rate = property(lambda self: self.health.identity is not None)

    def read_line(self, text, now):
        """List of `Packet` that the line completes. Raises PacketError."""
        if not text:
            return []
        if text.startswith("#"):
            self._read_text(text)
            return []
        try:
            packet = CheckedPacket(text, self.wheels.amount)
        except ForeignPacketError:
            self.health.hear_foreign_packet()
            raise
        self.health.hear_packet(packet.status)
        voltage = self.health.take_voltage()
        if voltage:
            self.readings.append(Power(voltage, math.nan))
        self.check_reach(packet.counts)
        return self._lost.recover(packet, now * self.wheels.pid_frequency)

    def _read_text(self, text):
        """Take a line of text; after a start-up banner the totals start again."""
        if _SEALED.match(text):
            if not has_checksum(text):
                raise PacketError("checksum", f"wrong checksum in {text[:60]!r}")
            text = text[:-5]
        elif self.health.status is not None:  # this board adds a checksum to its text
            raise PacketError("checksum", f"no checksum in {text[:60]!r}")
        if self.health.hear_text(text[1:].strip()):
            self._lost.restart()

    def report_board(self):
        """(errors, warnings, values) of the board's status, identity and notices."""
        return self.health.report()

    def encode(self, command):
        """The packet with its CRC. A board that is unknown, or must not be driven, gets zeros instead."""
        if self.health.wants_identity:
            return QUESTION + self._zeros
        return self._zeros if self.obstacle else add_checksum(command.text)
