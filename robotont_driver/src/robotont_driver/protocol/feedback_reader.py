"""Feedback of a board: lines read and checked, plain or with checksums."""

import re
from collections import Counter

from robotont_driver.protocol.board_status import BoardHealth
from robotont_driver.protocol.checksum import add_checksum, has_checksum
from robotont_driver.protocol.line_splitter import LineSplitter, read_lines
from robotont_driver.protocol.lost_packets import LostPackets
from robotont_driver.protocol.packet import CheckedPacket, ForeignPacketError, PacketError, format_packet, parse_packet

_SEALED = re.compile(r"#.*;[0-9A-F]{4}\Z")
QUESTION = add_checksum("?;")  # asks for the identity, which boards with firmware from 2.0 on send


class FeedbackReader:
    """Bytes from the board in, counts (`Packet`) per PID period out; nothing on the line can raise out of it.

    mode: "plain" reads the thesis' packets and ignores everything behind the semicolon; "checked" takes
    only packets with a valid trailer; "auto" takes plain ones until the first valid checked one.
    reach: edges that a motor can make in one period; more means an error. rate: [Hz] packets per second that the
    board should send, compared with its identity. Plain packets with decimals are echoes of commands, for encoders
    count whole edges. `health`: the board's own reports. Counted in `dropped` by kind (`newest_error`: description of
    the newest), `packets`, and those of `lost`: `LostPackets`.
    """

    def __init__(self, wheels, reach, rate, mode="auto"):
        self.wheels = wheels
        self.reach = reach
        self._rate = rate
        self.mode = mode
        self.packets = 0
        self.dropped = Counter()
        self.lost = LostPackets(reach, self.dropped)
        self.newest_error = ""
        self.health = BoardHealth(wheels, rate)
        self.connect()

    def connect(self):
        """Begin a new connection: forget all about the board; its first line may be incomplete."""
        self.checked = self.mode == "checked"
        self.health.connect()
        self._splitter = LineSplitter()
        self._first = True
        self.lost.connect()
        self._now = 0.0  # [periods]

    def feed(self, data, now):
        """List of `Packet`, one per PID period, that `data` completes at `now` [s]; missed periods included."""
        self._now = now * self._rate
        return read_lines(self, self._splitter, data, self._read)

    def _read(self, line):
        first, self._first = self._first, False
        try:
            text = line.rstrip(b"\r").decode("ascii")
        except UnicodeDecodeError:
            raise PacketError("not ascii", "bytes outside ASCII") from None
        if not text:
            return []
        if text.startswith("#"):
            self._read_text(text)
            return []
        if self.mode != "plain":
            try:
                packet = CheckedPacket(text, self.wheels)
            except ForeignPacketError as error:
                self.checked = True
                self.health.hear_foreign_packet(error.wheels)
                raise
            except PacketError:
                if self.checked or not text.endswith(";"):
                    raise
            else:
                return self._read_checked(packet)
        return self._read_plain(text, first)

    def encode(self, packet):
        r"""The bytes to send for a plain command packet that ends with `;\n`, in the form that the board reads.

        A board that has not identified itself yet, or that must not be driven, gets zeros instead of the command.
        """
        if not self.checked:
            return packet.encode("ascii")
        if self.health.wants_identity:
            return QUESTION + add_checksum(format_packet([0] * self.wheels))
        return add_checksum(format_packet([0] * self.wheels) if self.health.obstacle else packet)

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

    def _read_plain(self, text, first):
        if first:
            raise PacketError("first line", "the first line may be incomplete")
        counts = parse_packet(text, self.wheels)
        if not counts.is_whole:
            raise PacketError("decimals", f"counts with decimals in {text[:40]!r}: the board sends back what it gets "
                              "(it runs a REPL or another firmware: ./robotont flash), or the line is a loop")
        self._check_reach(counts)
        return [counts]

    def _read_checked(self, packet):
        self.health.hear_packet(packet.status)
        self._check_reach(packet.counts)
        self.checked = True
        return self.lost.recover(packet, self._now)

    def _check_reach(self, counts):
        if max(map(abs, counts)) > self.reach:
            raise PacketError("reach", f"more than {self.reach} edges in one period")
