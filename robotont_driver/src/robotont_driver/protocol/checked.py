"""Packets with a CRC, a counter and encoder totals behind the semicolon; see docs/protocol.md."""

import math
import re

from robotont_driver.protocol.board_status import BoardHealth
from robotont_driver.protocol.checksum import add_checksum, has_checksum
from robotont_driver.protocol.lost_packets import LostPackets
from robotont_driver.protocol.packet import CheckedPacket, ForeignPacketError, PacketError, format_packet
from robotont_driver.protocol.protocol import LineProtocol, Power

_SEALED = re.compile(r"#.*;[0-9A-F]{4}\Z")
QUESTION = add_checksum("?;")  # asks for the identity, which boards with firmware from 2.0 on send


class Checked(LineProtocol):
    """Commands carry a CRC; only packets with a valid trailer are read, and those that were lost are recovered.

    `health`: `BoardHealth`, the board's own reports. `lost`: `LostPackets`.
    """

    name = "checked"

    def __init__(self, wheels):
        super().__init__(wheels)
        self.lost = LostPackets(self._reach, self.dropped)
        self.health = BoardHealth(wheels.amount, wheels.pid_frequency)

    @property
    def obstacle(self):
        """Why the board must not be driven."""
        return self.health.obstacle

    def connect(self, now):
        """Begin a new connection."""
        super().connect(now)
        self.health.connect()
        self.lost.connect()

    def feed(self, data, now):
        """List of `Packet` that `data` completes, missed periods included."""
        packets = super().feed(data, now)
        self.count(self.lost)
        voltage = self.health.take_voltage()
        if voltage:
            self._readings = [Power(voltage, math.nan)]
        return packets

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
        self.check_reach(packet.counts)
        return self.lost.recover(packet, now * self.wheels.pid_frequency)

    def _read_text(self, text):
        """Take a line of text; after a start-up banner the totals start again."""
        if _SEALED.match(text):
            if not has_checksum(text):
                raise PacketError("checksum", f"wrong checksum in {text[:60]!r}")
            text = text[:-5]
        elif self.health.status is not None:  # this board adds a checksum to its text
            raise PacketError("checksum", f"no checksum in {text[:60]!r}")
        if self.health.hear_text(text[1:].strip()):
            self.lost.restart()

    def report_board(self):
        """(errors, warnings, values) of the board's status, identity and notices."""
        return self.health.report()

    def encode(self, command):
        """The packet with its CRC. A board that is unknown, or must not be driven, gets zeros instead."""
        zeros = add_checksum(format_packet([0] * self.wheels.amount))
        if self.health.wants_identity:
            return QUESTION + zeros
        return zeros if self.obstacle else add_checksum(command.text)
