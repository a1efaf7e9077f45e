"""The thesis' packets, `m0:m1:m2;`, as boards with the thesis' own firmware use them."""

from robotont_driver.protocol.dialects.dialect import LineDialect
from robotont_driver.protocol.packet import PacketError, parse_packet

ECHO = ("the board sends back what it gets: it runs a REPL or another firmware (./robotont flash), or the line is a "
        "loop; nothing of it is published on serial_read")


class Plain(LineDialect):
    """Plain packets both ways; what stands behind a semicolon is ignored.

    Encoders count whole edges, so a packet with decimals is a command that has come back.
    """

    name = "plain"
    _first = True    # whether no line has come yet
    _echoes = False  # whether the newest packet was an echo

    def connect(self, now):
        """Begin a new connection."""
        super().connect(now)
        self.banner, self._first, self._echoes = "", True, False

    @property
    def complaint(self):
        """A warning when the line returns an echo instead of packets; empty otherwise."""
        return ECHO if self._echoes else ""

    def read_line(self, text, now):
        """List of `Packet` that the line completes. Raises PacketError."""
        first, self._first = self._first, False
        if not text or text.startswith("#"):
            self.banner = text[1:].strip() or self.banner
            return []
        if first:
            raise PacketError("first line", "the first line may be incomplete")
        values, semicolon, _ = text.partition(";")
        self._echoes = bool(semicolon) and "." in values
        if self._echoes:
            raise PacketError("decimals", f"counts with decimals in {text[:40]!r}")
        counts = parse_packet(text, self.wheels.amount)
        self.check_reach(counts)
        return [counts]

    def encode(self, command):
        """The packet as it is."""
        return command.text.encode("ascii")
