"""Protocol of this project's firmware: a CRC, a counter and encoder totals behind the semicolon; docs/protocol.md."""

import binascii
import functools
import math
import re

from robotont_driver.protocol.board_status import TIMED_OUT, WAITS_FOR_ZERO, BoardHealth, BoardStatus
from robotont_driver.protocol.lost_packets import LostPackets
from robotont_driver.protocol.protocol import PacketError, Power, Protocol

# counts, counter, totals, status (from firmware 2.0 on; with at least 3 wheels it is longer than a total), CRC
_CHECKED = re.compile(r"(-?[0-9]{1,7}(?::-?[0-9]{1,7})*);([0-9A-F]{2}):([0-9A-F]{4}(?::[0-9A-F]{4})+)"
                      r"(?::([0-9A-F]{9,}))?:[0-9A-F]{4}\Z")
_hexadecimal = functools.partial(int, base=16)


def crc16(data):
    """CRC-16/CCITT-FALSE of bytes: polynomial 0x1021, initial value 0xFFFF, not reflected."""
    return binascii.crc_hqx(data, 0xFFFF)


def add_checksum(packet):
    r"""The checked form, as bytes, of a plain command packet that ends with `;\\n`."""
    body = packet.rstrip("\n").encode("ascii")
    return body + b"%04X\n" % crc16(body)


def has_checksum(line):
    """Whether the last four characters of a line (ASCII, without newline), hexadecimal digits, are its checksum."""
    return binascii.crc_hqx(line[:-4].encode("ascii"), 0xFFFF) == int(line[-4:], 16)


class ForeignPacketError(PacketError):
    """A valid checked packet of a board with another number of wheels."""


class CheckedPacket:
    """Feedback with a valid CRC: `counts` per wheel, also as `text`, packet `counter`, encoder `totals` modulo 2^16.

    `status`: the board's BoardStatus; None from firmware before 2.0. Its reader's: `arrival` [periods], by how many it
    came `late` at least, and `number`, which goes on where the counter begins again.
    """

    arrival = number = None
    late = 0.0

    def __init__(self, line, wheels):
        """From a line without newline. Raises PacketError."""
        match = _CHECKED.match(line)
        if not match:
            raise PacketError("trailer", f"no valid trailer in {line[:60]!r}")
        self.text, counter, totals, status = match.groups()
        if not has_checksum(line):
            raise PacketError("checksum", f"wrong checksum in {line[:60]!r}")
        self.counter = int(counter, 16)
        self.totals = tuple(map(_hexadecimal, totals.split(":")))
        self.counts = tuple(map(int, self.text.split(":")))
        if len(self.totals) != wheels:
            found = len(self.totals)
            raise ForeignPacketError("fields", f"{found} totals instead of {wheels} in {line[:60]!r}")
        if len(self.counts) != wheels:
            raise PacketError("fields", f"{len(self.counts)} fields instead of {wheels} in {line[:60]!r}")
        if status and len(status) not in (wheels + 6, wheels + 11):
            raise PacketError("fields", f"not {wheels} faults in {line[:60]!r}")
        self.status = BoardStatus.parse(status, wheels) if status else None

    def missed_since(self, last):
        """(periods modulo 256, counts per wheel) that the board sent after packet `last` and before this one.

        Totals are known modulo 2^16, so the counts are those of the smallest magnitude.
        """
        periods = (self.counter - last.counter - 1) % 256
        counts = [
            (total - before - count + 0x8000) % 0x10000 - 0x8000
            for total, before, count in zip(self.totals, last.totals, self.counts)
        ]
        return periods, counts


BATTERY_PERIOD = 1.0  # [s] between readings, which are in each packet
_SEALED = re.compile(r"#.*;[0-9A-F]{4}\Z")
QUESTION = add_checksum("?;")  # asks for the identity, which boards with firmware from 2.0 on send


class Checked(Protocol):
    """Commands carry a CRC; only packets with a valid trailer are read, and those that were lost are recovered.

    `health`: `BoardHealth`, the board's own reports.
    """

    name = "checked"

    def __init__(self, wheels):
        super().__init__(wheels)
        self._amount = wheels.amount
        self._lost = LostPackets(self._reach, self.dropped)
        self.health = BoardHealth(wheels.amount, wheels.pid_frequency)
        self._measured = -math.inf  # [s] when the newest reading of the battery was made

    repaired = property(lambda self: self._lost.repaired)
    restarts = property(lambda self: self._lost.restarts)
    doubts = property(lambda self: self._lost.doubts)
    obstacle = property(lambda self: self.health.obstacle)
    drives = property(lambda self: bool(self.packets) and not self.health.wants_identity)
    tells_rate = property(lambda self: self.health.identity is not None)

    def read_line(self, text, now):
        """List of `Packet` that the line completes. Raises PacketError."""
        if not text:
            return []
        if text.startswith("#"):
            self._read_text(text)
            return []
        try:
            packet = CheckedPacket(text, self._amount)
        except ForeignPacketError:
            self.health.foreign = True  # it is asked for its identity, which has the number
            raise
        self.health.foreign = False
        if packet.status is not self.health.status:
            self.health.hear_status(packet.status)
        if packet.status and packet.status.voltage and now >= self._measured + BATTERY_PERIOD:
            self._measured = now
            self.readings.append(Power(packet.status.voltage, math.nan))
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
        """The packet with its CRC; but for zeros none to a board that has sent none or is unknown, which is asked."""
        unknown = self.health.wants_identity
        packet = b"" if any(command) and (unknown or not self.packets) else add_checksum(command.text)
        return QUESTION + packet if unknown else packet

    def stop(self):
        """Empty where the board stops by itself; to one that waits for zeros only whoever commands sends them."""
        stands = self.health.status and self.health.status.flags & (TIMED_OUT | WAITS_FOR_ZERO)
        return b"" if stands else super().stop()
