"""Plain packets, `m0:m1:m2;`: the text on the topics, where more may follow (`Packet.told`); the thesis' protocol."""

import re

from robotont_driver.protocol.protocol import LONGEST_LINE, Packet, PacketError, Protocol

# far more than any motor can make, and few enough digits for every sum and square to stay finite
_NUMBER = r"-?[0-9]{1,7}(?:\.[0-9]{1,9})?"
_NUMBERS = rf"({_NUMBER}(?::{_NUMBER})*);"
_PLAIN = re.compile(rf"{_NUMBERS}(?:([0-9]{{1,15}})?(?:;(?:{_NUMBERS})?([0-9]\.[0-9]{{3}})?)?\n?\Z)?")


def parse_packet(text, wheels):
    """The `Packet` of `wheels` values at the start of a string, with what `Packet.told` has. Raises PacketError."""
    if len(text) > LONGEST_LINE + 1 and ";" not in text[:LONGEST_LINE]:
        raise PacketError("overlong", f"{len(text)} characters, allowed: a line of {LONGEST_LINE}; {text[:40]!r}...")
    match = _PLAIN.match(text)
    fields = match.group(1).split(":") if match else ()
    if len(fields) != wheels:
        raise _explain(text, wheels)
    values, number, commanded, periods = match.groups()
    commanded = commanded.split(":") if commanded else ()
    packet = Packet(map(float, fields), values + ";\n", number and int(number),
                    list(map(float, commanded)) if len(commanded) == wheels else None)
    packet.periods = float(periods or 0.0) or 1.0
    return packet


def _explain(text, wheels):
    """The PacketError for a plain packet that has not `wheels` numbers and a semicolon."""
    body, semicolon, _ = text.partition(";")
    for field in body.split(":") if semicolon else ():
        if not re.fullmatch(_NUMBER, field):
            return PacketError("number", f"{field[:20]!r} is not a number of up to 7 digits, in {text[:40]!r}")
    found = f"{body.count(':') + 1} fields instead of {wheels}" if semicolon else "no semicolon"
    return PacketError("fields", f"{found} in {text[:40]!r}")


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
