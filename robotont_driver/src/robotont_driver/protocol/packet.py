"""Packets on the serial line and on the topics: written, read and checked.

A packet is plain (`m0:m1:m2;`) or checked, with a trailer behind the semicolon: docs/protocol.md. On the topic
serial_read its number may stand there.
"""

import re

from robotont_driver.protocol.board_status import BoardStatus
from robotont_driver.protocol.checksum import has_checksum

LONGEST_LINE = 256  # [bytes] without the newline; a longer line is dropped

# far more than any motor can make, and few enough digits for every sum and square to stay finite
_NUMBER = r"-?[0-9]{1,7}(?:\.[0-9]{1,9})?"
_PLAIN = re.compile(rf"({_NUMBER}(?::{_NUMBER})*);(?:([0-9]{{1,15}})\n?\Z)?")

# whole counts, counter, totals, status (from firmware 2.0 on; with at least 3 wheels it is longer than a total), CRC
_CHECKED = re.compile(r"([^;.]*);([0-9A-F]{2})((?::[0-9A-F]{4})+)(?::([0-9A-F]{9,}))?:[0-9A-F]{4}\Z")


class PacketError(ValueError):
    """A packet that cannot be used. The `kind` is a short name under which it is counted."""

    def __init__(self, kind, text):
        super().__init__(text)
        self.kind = kind


class ForeignPacketError(PacketError):
    """A valid checked packet of a board with another number of wheels."""


def format_packet(values, decimals=0, number=None):
    r"""The packet `m0:m1:...;\\n` of the values [units], each with so many decimals; behind `;` its number, if any."""
    # round() may leave a negative zero, which "+ 0.0" makes positive
    fields = ":".join([f"{round(value, decimals) + 0.0:.{decimals}f}" for value in values])
    return f"{fields};\n" if number is None else f"{fields};{number}\n"


class Packet(tuple):
    r"""The values [units] of a packet, one per wheel, and its `text`, `m0:m1:...;\\n`, which writes them.

    `number`: None, or that of its period on the board: it counts periods without a gap, lost ones included, and begins
    anew when the board does. It stands in the text behind the semicolon, where a reader of plain packets stops.
    """

    def __new__(cls, values, text=None, number=None):
        """From values; without `text` they are written as whole numbers."""
        packet = super().__new__(cls, values)
        packet.text = format_packet(packet, 0, number) if text is None else text
        packet.number = number
        return packet


class WholeCounts:
    """Whole counts of wheels out of fractions of edges: what one packet lacks, the next ones contain."""

    def __init__(self, wheels):
        self._rest = [0.0] * wheels  # [edges] that no packet has contained yet

    def share(self, edges, periods=1):
        """List of `Packet` of the `edges` (n numbers), as evenly as may be over so many periods."""
        packets = []
        for _ in range(periods):
            due = [rest + edge / periods for rest, edge in zip(self._rest, edges)]
            packets.append(Packet(map(round, due)))
            self._rest = [edge - count for edge, count in zip(due, packets[-1])]
        return packets


def parse_packet(text, wheels):
    """The `Packet` of `wheels` values at the start of a string, with its number; else anything behind `;` is ignored.

    Raises PacketError when the string is longer than a line, there is no semicolon, a field is not a number (or one
    of too many digits), or there are not `wheels` fields.
    """
    if len(text) > LONGEST_LINE + 1:
        raise PacketError("overlong", f"{len(text)} characters, allowed: a line of {LONGEST_LINE}; {text[:40]!r}...")
    match = _PLAIN.match(text)
    fields = match.group(1).split(":") if match else ()
    if len(fields) != wheels:
        raise _explain(text, wheels)
    number = match.group(2) and int(match.group(2))
    return Packet([float(field) if "." in field else int(field) for field in fields],
                  f"{match.group(1)};{match.group(2) or ''}\n", number)


def _explain(text, wheels):
    """The PacketError for a plain packet that has not `wheels` numbers and a semicolon."""
    body, semicolon, _ = text.partition(";")
    if not semicolon:
        return PacketError("fields", f"no semicolon in {text[:40]!r}")
    for field in body.split(":"):
        if not re.fullmatch(_NUMBER, field):
            return PacketError("number", f"{field[:20]!r} is not a number of up to 7 digits, in {text[:40]!r}")
    return PacketError(
        "fields", "{} fields instead of {} in {!r}".format(body.count(":") + 1, wheels, text[:40]))


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
