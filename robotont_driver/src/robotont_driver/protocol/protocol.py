"""Packets on the serial line: written, read, checked, and repaired where the line lost some.

See docs/protocol.md. A command is plain (`m0:m1:m2;`) or checked (with a CRC behind the semicolon);
so is the feedback of the board, whose checked trailer also contains a counter and the encoder totals.
"""

import binascii
import math
import re
from collections import Counter
from typing import NamedTuple, Tuple

from robotont_driver.protocol.board_status import BoardHealth, BoardStatus
from robotont_driver.protocol.restarts import ANY, Arrival, doubt_about

LONGEST_LINE = 256  # [bytes] without the newline; a longer line is dropped

# far more than any motor can make, and few enough digits for every sum and square to stay finite
_NUMBER = r"-?[0-9]{1,7}(?:\.[0-9]{1,9})?"
_PLAIN = re.compile(rf"({_NUMBER}(?::{_NUMBER})*);")
# counts, counter, totals, status (from firmware 2.0 on; with at least 3 wheels it is longer than a total), CRC
_CHECKED = re.compile(r"([^;]*);([0-9A-F]{2})((?::[0-9A-F]{4})+)(?::([0-9A-F]{9,}))?:([0-9A-F]{4})\Z")
_SEALED = re.compile(r"#.*;[0-9A-F]{4}\Z")


class PacketError(ValueError):
    """A packet that cannot be used. The `kind` is a short name under which it is counted."""

    def __init__(self, kind, text):
        super().__init__(text)
        self.kind = kind


class ForeignPacketError(PacketError):
    """A valid checked packet of a board with another number of `wheels`."""

    def __init__(self, wheels, text):
        super().__init__("fields", text)
        self.wheels = wheels


def packet_form(wheels, decimals):
    r"""A format for the %-operator and that many values: `%.2f:%.2f:%.2f;\\n`."""
    return ":".join([f"%.{decimals}f"] * wheels) + ";\n"


def crc16(data):
    """CRC-16/CCITT-FALSE of bytes: polynomial 0x1021, initial value 0xFFFF, not reflected."""
    return binascii.crc_hqx(data, 0xFFFF)


def format_packet(values, decimals=0):
    r"""The plain packet `m0:m1:...;\\n` of the values [units], each with that many decimals."""
    # round() may leave a negative zero, which "+ 0.0" makes positive
    return ":".join([f"{round(value, decimals) + 0.0:.{decimals}f}" for value in values]) + ";\n"


def add_checksum(packet):
    r"""The checked form, as bytes, of a plain command packet that ends with `;\\n`."""
    body = packet.rstrip("\n").encode("ascii")
    return body + b"%04X\n" % crc16(body)


QUESTION = add_checksum("?;")  # asks for the identity, which boards with firmware from 2.0 on send


class Packet(tuple):
    r"""The values [units] of a plain packet, one per wheel, and its `text`, `m0:m1:...;\\n`, which writes them.

    `doubt`: None, or a `Packet` of the edges by which the path of each wheel up to here may be wrong; not in `text`.
    """

    doubt = None

    def __new__(cls, values, text=None):
        """From values; without `text` they are written as whole numbers."""
        packet = super().__new__(cls, values)
        packet.text = format_packet(packet) if text is None else text
        return packet

    def doubted(self, edges):
        """The same `Packet` with a doubt: n floats, or none for no doubt."""
        if edges:
            self.doubt = Packet(math.ceil(abs(edge)) for edge in edges)
        return self

    @property
    def is_whole(self):
        """Whether all values are written without decimals."""
        return "." not in self.text


def parse_packet(text, wheels):
    """The `Packet` of `wheels` values at the start of a string; anything behind `;` is ignored.

    Raises PacketError when the string is longer than a line, there is no semicolon, a field is not a number (or one
    of too many digits), or there are not `wheels` fields.
    """
    if len(text) > LONGEST_LINE + 1:
        raise PacketError("overlong", f"{len(text)} characters, allowed: a line of {LONGEST_LINE}; {text[:40]!r}...")
    match = _PLAIN.match(text)
    fields = match.group(1).split(":") if match else ()
    if len(fields) != wheels:
        raise _explain(text, wheels)
    return Packet([float(field) if "." in field else int(field) for field in fields], match.group() + "\n")


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
        self._skipping = False  # in a line that was too long, up to its end

    def feed(self, data):
        """List of the lines (bytes, without newline) that `data` completes."""
        *ended, self._rest = (self._rest + data).split(b"\n")
        lines = []
        for line in ended:
            if self._skipping:
                self._skipping = False
            elif len(line) > LONGEST_LINE:
                self.overlong += 1
            else:
                lines.append(line)
        if len(self._rest) > LONGEST_LINE:
            if not self._skipping:
                self._skipping = True
                self.overlong += 1
            self._rest = b""
        return lines


class CheckedPacket:
    """Feedback with a valid CRC: `counts` per wheel, packet `counter`, encoder `totals` modulo 2^16.

    `status`: the board's BoardStatus; None from firmware before 2.0. `arrival`: its reader's `Arrival`.
    """

    arrival = None

    def __init__(self, line, wheels):
        """From a line without newline. Raises PacketError."""
        match = _CHECKED.match(line)
        if not match:
            raise PacketError("trailer", f"no valid trailer in {line[:60]!r}")
        counts, counter, totals, status, checksum = match.groups()
        if crc16(line[:-4].encode("ascii")) != int(checksum, 16):
            raise PacketError("checksum", f"wrong checksum in {line[:60]!r}")
        self.counter = int(counter, 16)
        self.totals = tuple([int(total, 16) for total in totals.split(":")[1:]])
        self.status = BoardStatus.parse(status) if status else None
        if len(self.totals) != wheels:
            found = len(self.totals)
            raise ForeignPacketError(found, f"{found} totals instead of {wheels} in {line[:60]!r}")
        self.counts = parse_packet(counts + ";", wheels)
        if not self.counts.is_whole or (status and len(self.status.wheels) != wheels):
            raise PacketError("fields", f"not {wheels} whole counts and faults in {line[:60]!r}")

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
