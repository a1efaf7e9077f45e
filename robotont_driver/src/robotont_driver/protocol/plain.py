"""The thesis' packets, `m0:m1:m2;`, as boards with the thesis' own firmware use them."""

from robotont_driver.protocol.packet import Packet, PacketError, parse_packet
from robotont_driver.protocol.protocol import Protocol


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
