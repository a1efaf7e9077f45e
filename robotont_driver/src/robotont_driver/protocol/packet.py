"""Plain packets, `m0:m1:m2;`: the text on the topics, and on the serial line of the thesis' firmware.

Behind the semicolon, where a reader of plain packets stops, its number may stand on the topic serial_read. And what
both kinds of packets need on the wire: lines out of bytes, and the checksum.
"""

import binascii
import re

LONGEST_LINE = 256  # [bytes] without the newline; a longer line is dropped

# far more than any motor can make, and few enough digits for every sum and square to stay finite
_NUMBER = r"-?[0-9]{1,7}(?:\.[0-9]{1,9})?"
_PLAIN = re.compile(rf"({_NUMBER}(?::{_NUMBER})*);(?:([0-9]{{1,15}})\n?\Z)?")


class PacketError(ValueError):
    """A packet that cannot be used. The `kind` is a short name under which it is counted."""

    def __init__(self, kind, text):
        super().__init__(text)
        self.kind = kind


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


class LineSplitter:
    """Cuts a stream of bytes into lines, however the bytes arrive."""

    def __init__(self):
        self.overlong = 0
        self._rest = b""

    def feed(self, data):
        """List of the lines (bytes, without newline) that `data` completes."""
        *ended, rest = (self._rest + data).split(b"\n")
        self._rest = rest[:LONGEST_LINE + 1]  # enough for a line to be too long
        lines = [line for line in ended if len(line) <= LONGEST_LINE]
        self.overlong += len(ended) - len(lines)
        return lines


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
