"""Feedback of a board: read, checked, and repaired where the line lost some."""

import re
from collections import Counter
from typing import NamedTuple, Tuple

from robotont_driver.protocol.board_status import BoardHealth
from robotont_driver.protocol.line_splitter import LineSplitter
from robotont_driver.protocol.packet import (
    CheckedPacket,
    ForeignPacketError,
    Packet,
    PacketError,
    add_checksum,
    crc16,
    format_packet,
    parse_packet,
)
from robotont_driver.protocol.restarts import ANY, Arrival, doubt_about

_SEALED = re.compile(r"#.*;[0-9A-F]{4}\Z")
QUESTION = add_checksum("?;")  # asks for the identity, which boards with firmware from 2.0 on send


class FeedbackReader:
    """Bytes from the board in, counts (`Packet`) per PID period out; nothing on the line can raise out of it.

    mode: "plain" reads the thesis' packets and ignores everything behind the semicolon; "checked" takes
    only packets with a valid trailer; "auto" takes plain ones until the first valid checked one.
    reach: edges that a motor can make in one period; more means an error. rate: [Hz] packets per second that the
    board should send, compared with its identity. Plain packets with decimals are echoes of commands, for encoders
    count whole edges. `health`: the board's own reports. Counted in `dropped` by kind (`newest_error`: description of
    the newest), `packets`, `repaired` (periods), `restarts` (of the board), `doubts` (gaps in which it may have
    restarted).
    """

    def __init__(self, wheels, reach, rate, mode="auto"):
        self.wheels = wheels
        self.reach = reach
        self._rate = rate
        self.mode = mode
        self.packets = 0
        self.repaired = 0
        self.restarts = 0
        self.doubts = 0
        self.dropped = Counter()
        self.newest_error = ""
        self.health = BoardHealth(wheels, rate)
        self.connect()

    def connect(self):
        """Begin a new connection: forget all about the board; its first line may be incomplete."""
        self.checked = self.mode == "checked"
        self.health.connect()
        self._splitter = LineSplitter()
        self._first = True
        self._last = None      # newest trusted checked packet
        self._suspect = None   # a checked packet that does not continue `_last`: an error, or a restart
        self._suspicion = ()   # doubt [edges] that a restart at `_suspect` leaves
        self._now = 0.0        # [periods]

    def feed(self, data, now):
        """List of `Packet`, one per PID period, that `data` completes at `now` [s]; missed periods included."""
        self._now = now * self._rate
        packets = []
        overlong = self._splitter.overlong
        for line in self._splitter.feed(data):
            try:
                packets += self._read(line.rstrip(b"\r"))
            except PacketError as error:
                self.dropped[error.kind] += 1
                self.newest_error = str(error)
            self._first = False
        if self._splitter.overlong > overlong:
            self.dropped["overlong"] += self._splitter.overlong - overlong
        self.packets += len(packets)
        return packets

    def _read(self, line):
        try:
            text = line.decode("ascii")
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
        return self._read_plain(text)

    @property
    def fault(self):
        """Description of what has stopped the motors, as the board reports it; empty when nothing has."""
        return self.health.fault

    @property
    def obstacle(self):
        """Why the board must not be driven; empty when it may."""
        return self.health.obstacle

    @property
    def banner(self):
        """The board's newest start-up banner."""
        return self.health.banner

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
            if crc16(text[:-4].encode("ascii")) != int(text[-4:], 16):
                raise PacketError("checksum", f"wrong checksum in {text[:60]!r}")
            text = text[:-5]
        elif self.health.status is not None:  # this board adds a checksum to its text
            raise PacketError("checksum", f"no checksum in {text[:60]!r}")
        if self.health.hear_text(text[1:].strip()):
            self.restarts += self._last is not None
            self._last = self._suspect = None

    def _read_plain(self, text):
        if self._first:
            raise PacketError("first line", "the first line may be incomplete")
        counts = parse_packet(text, self.wheels)
        if not counts.is_whole:
            raise PacketError("decimals", f"counts with decimals in {text[:40]!r}")
        self._check_reach(counts)
        return [counts]

    def _read_checked(self, packet):
        self.health.hear_packet(packet.status)
        self._check_reach(packet.counts)
        self.checked = True
        if self._last is None:
            packet.arrival = Arrival(self._now)
            self._last = packet
            return [packet.counts]
        if packet.repeats(self._last):
            raise PacketError("repeated", "the same packet twice")
        gap = self._gap(self._last, packet)
        if gap is not None and not gap.restarted:
            if self._suspect is not None:
                self.dropped["inconsistent"] += 1
            return self._continue(self._last, packet, gap)
        suspect, suspicion = self._suspect, self._suspicion
        if suspect is not None:
            step = self._gap(suspect, packet)
            if step is not None and not step.restarted:
                # Two packets agree with each other and not with those before: the board has restarted.
                self.restarts += 1
                self.doubts += bool(suspicion)
                return [suspect.counts.doubted(suspicion), *self._continue(suspect, packet, step)]
            self.dropped["inconsistent"] += 1
        packet.arrival = self._last.arrival.next(self._now, 1)
        self._suspect, self._suspicion = packet, gap.doubt if gap else ()
        return []

    def _check_reach(self, counts):
        if max(map(abs, counts)) > self.reach:
            raise PacketError("reach", f"more than {self.reach} edges in one period")

    def _gap(self, last, packet):
        """`_Gap` between the two packets; None where time or motors cannot have made it.

        Beyond 2^15 edges the totals modulo 2^16 no longer determine how many are missing.
        """
        periods, counts = packet.missed_since(last)
        bound = self.reach * periods
        most = last.arrival.most(self._now)
        if periods + 1 > most or bound >= 0x8000 or max(map(abs, counts)) > bound:
            return None
        # the counter begins at 0 with the board: whether all its packets may have been made since `last`
        if periods and packet.counter + 1 <= most < ANY:
            doubt = doubt_about(counts, periods, self._now - last.arrival.at, last.counts, packet.counts)
            if doubt:
                return _Gap(periods, counts, doubt.edges, doubt.late and doubt.unexplained > 0)
        return _Gap(periods, counts, (), False)

    def _continue(self, last, packet, gap):
        periods, counts, doubt, _ = gap
        packet.arrival = last.arrival.next(self._now, periods + 1)
        self._last = packet
        self._suspect = None
        if not periods:
            return [packet.counts]
        self.repaired += periods
        self.doubts += bool(doubt)
        return [*spread(counts, periods), packet.counts.doubted(doubt)]


class _Gap(NamedTuple):
    """Between two packets."""

    periods: int             # whose packets are missing
    counts: Tuple[int, ...]  # per wheel, in these
    doubt: Tuple[float, ...]  # [edges] as in a `Packet`
    restarted: bool          # whether a restart is likelier than these counts


def spread(counts, periods):
    """`counts` (ints, one per wheel) as evenly as whole numbers allow over `periods`: a list of `Packet`.

    The sums over the list are the counts.
    """
    return [
        Packet(count * (period + 1) // periods - count * period // periods for count in counts)
        for period in range(periods)
    ]
