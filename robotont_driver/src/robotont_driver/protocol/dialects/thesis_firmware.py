"""The thesis' packets, `m0:m1:m2;`, as boards with the thesis' own firmware use them."""

from robotont_driver.protocol.dialects.dialect import LineDialect
from robotont_driver.protocol.dialects.echo import EchoWatch
from robotont_driver.protocol.packet import PacketError, parse_packet

ECHO = ("the board sends back what it gets: it runs a REPL or another firmware (./robotont flash), or the line is a "
        "loop; nothing is published on serial_read")


class Plain(LineDialect):
    """Plain packets both ways; what stands behind a semicolon is ignored."""

    name = "plain"

    def __init__(self, wheels):
        super().__init__(wheels)
        self._echo = EchoWatch()
        self._first = True  # whether no line has come yet

    def connect(self, now):
        """Begin a new connection."""
        super().connect(now)
        self._echo.connect()
        self.banner, self._first = "", True

    @property
    def complaint(self):
        """A warning when the line returns an echo instead of packets; empty otherwise."""
        return ECHO if self._echo.echoing else ""

    def feed(self, data, now):
        """List of `Packet` that `data` completes; none from a board that sends an echo."""
        packets = super().feed(data, now)
        self._echo.received(data)
        return [] if self._echo.echoing else packets

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
        return [counts]

    def encode(self, command):
        """The packet as it is."""
        line = command.text.encode("ascii")
        self._echo.sent(line)
        return line
