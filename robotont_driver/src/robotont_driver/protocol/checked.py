"""Protocol of this project's firmware: a CRC, a counter and encoder totals behind the semicolon; docs/protocol.md.

Counts of packets that the line has lost come from the totals around them. Whether the board has restarted, unheard, is
judged by time and by the speeds before and after.
"""

import binascii
import functools
import math
import re

from robotont_driver.protocol.board_status import TIMED_OUT, WAITS_FOR_ZERO, BoardHealth, BoardStatus
from robotont_driver.protocol.protocol import Packet, PacketError, Power, Protocol

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


def check_checksum(line):
    """Raise PacketError where a line's (ASCII) last four characters, hexadecimal digits, are not its checksum."""
    if binascii.crc_hqx(line[:-4].encode("ascii"), 0xFFFF) != int(line[-4:], 16):
        raise PacketError("checksum", f"wrong checksum in {line[:60]!r}")


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
        check_checksum(line)
        self.counter = int(counter, 16)
        self.totals = tuple(map(_hexadecimal, totals.split(":")))
        self.counts = tuple(map(int, self.text.split(":")))
        if len(self.totals) != wheels:
            raise ForeignPacketError("fields", f"{len(self.totals)} totals instead of {wheels} in {line[:60]!r}")
        if len(self.counts) != wheels:
            raise PacketError("fields", f"{len(self.counts)} fields instead of {wheels} in {line[:60]!r}")
        if status and len(status) not in (wheels + 6, wheels + 11):
            raise PacketError("fields", f"not {wheels} faults in {line[:60]!r}")
        self.status = BoardStatus.parse(status, wheels) if status else None

    def missed_since(self, last):
        """(periods modulo 256, least counts per wheel by totals modulo 2^16) between packet `last` and this one."""
        periods = (self.counter - last.counter - 1) % 256
        return periods, [(total - before - count + 0x8000) % 0x10000 - 0x8000
                         for total, before, count in zip(self.totals, last.totals, self.counts)]


DRIFT = 0.02      # part by which our board's period may differ from the nominal one
HELD = 25.0       # [periods] whose packets the link may hold back
JITTER = 2.0      # [periods] by which a packet may come too late after its predecessor
ANY = 256         # [periods] until the counter of the packets begins again
NEGLIGIBLE = 5.0  # [edges] of a wheel's path; a Robotont that turns by 0.5 degrees makes 6
NOISE = 1.0       # [edges per period] by which a speed, out of one packet, may be wrong


class LostPackets:
    """CheckedPackets in, a `Packet` per PID period out, lost periods included, numbered from 0 on; times in periods.

    reach: edges that a motor can make in one period. Counted: `repaired` periods, `restarts` (of the board), `doubts`
    (gaps in which it may have restarted); `dropped["inconsistent"]` packets that nothing confirmed.
    """

    def __init__(self, reach, dropped):
        self._reach = reach
        self._dropped = dropped
        self.repaired = self.restarts = self.doubts = 0
        self._last = self._suspect = None  # newest trusted packet; one that does not continue it: error or restart

    def restart(self):
        """The board has said that it has restarted, with counter and totals."""
        self.restarts += self._last is not None
        self._last = self._suspect = None

    def recover(self, packet, now):
        """List of `Packet` that a CheckedPacket which came at `now` [periods] completes. Raises PacketError."""
        packet.arrival = now
        if self._last is None:
            return [self._trust(packet, 0)]
        if (packet.counter, packet.totals, packet.text) == (self._last.counter, self._last.totals, self._last.text):
            raise PacketError("repeated", "the same packet twice")
        gap = self._gap(self._last, packet)
        if gap and not gap[2]:
            if self._suspect is not None:
                self._dropped["inconsistent"] += 1
            return self._continue(self._last, packet, gap)
        suspect = self._suspect
        if suspect is not None:
            step = self._gap(suspect, packet)
            if step and not step[2]:
                # Two packets agree with each other and not with those before: a restart, or too much was lost.
                self.restarts += 1
                return [self._trust(suspect, 0), *self._continue(suspect, packet, step)]
            self._dropped["inconsistent"] += 1
            self._suspect = None
        # after a time whose counts would not be known anyway, any two packets begin anew
        known = (packet.arrival - self._last.arrival) * (1 + DRIFT) * self._reach < 0x8000
        if packet.counter + 1 > most_between(self._last, packet) and known:
            raise PacketError("inconsistent", "neither the next packet, nor one of a board that has just started")
        self._suspect = packet
        return []

    def _gap(self, last, packet):
        """(lost periods, their counts per wheel, whether the board has surely restarted between, whether it may have).

        None where the board cannot have made the gap in that time, or the motors the way, or they may have made 2^15.
        """
        periods, counts = packet.missed_since(last)
        most = most_between(last, packet)
        if most > ANY:  # the counter may have gone round: as many as fit the speeds before and behind best
            means = [(old + new) / 2 for old, new in zip(last.counts, packet.counts)]
            periods = min([periods, *range(periods + ANY, int(most), ANY)], key=lambda many: sum(
                abs(way - mean * many) for way, mean in zip(counts, means)))
        bound = self._reach * periods
        if periods + 1 > most or bound >= 0x8000 or max(map(abs, counts)) > bound:
            return None
        # the counter begins at 0 with the board: whether all its packets may have been made since `last`
        if not periods or packet.counter + 1 > most or most >= ANY:
            return periods, counts, False, False
        late = periods + 1 < packet.arrival - last.arrival - JITTER  # more time has passed than the lost periods took
        known = NEGLIGIBLE + NOISE * periods
        # by how much the way differs from what the speeds before and behind it make, and may, whenever they changed
        off = [(abs(way - periods * (old + new) / 2), periods * abs(new - old) / 2)
               for way, old, new in zip(counts, last.counts, packet.counts)]
        restarted = late and max(way - may for way, may in off) > known
        return periods, counts, restarted, max(map(abs, counts)) > NEGLIGIBLE if late else max(off)[0] > known

    def _continue(self, last, packet, gap):
        periods, counts, _, doubt = gap
        number = last.number + 1
        newest = self._trust(packet, number + periods)
        if not periods:
            return [newest]
        self.repaired += periods
        self.doubts += doubt
        lost = zip(*(_evenly(count, periods) for count in counts))
        return [*(Packet(share, number=at) for at, share in enumerate(lost, number)), newest]

    def _trust(self, packet, number):
        """The packet is the newest one of the board, with that number; its `Packet`."""
        packet.number, last = number, self._last
        if last is not None and number:
            passed = (packet.arrival - last.arrival) * (1 - DRIFT)
            packet.late = max(0.0, last.late + passed - (number - last.number))
        self._last, self._suspect = packet, None
        return Packet(packet.counts, packet.text + ";\n", number)


def most_between(last, packet):
    """How many periods may lie between two packets, the latter's included."""
    return (packet.arrival - last.arrival) * (1 + DRIFT) + HELD + last.late


def _evenly(count, periods):
    """List of whole numbers, as equal as may be, whose sum is `count`."""
    return [count * (at + 1) // periods - count * at // periods for at in range(periods)]


BATTERY_PERIOD = 1.0  # [s] between readings, which are in each packet
_SEALED = re.compile(r"#.*;[0-9A-F]{4}\Z")
QUESTION = add_checksum("?;")  # asks for the identity, which boards with firmware from 2.0 on send


class Checked(Protocol):
    """Commands carry a CRC; only packets with a valid trailer are read, and those that were lost are recovered."""

    name = "checked"

    def __init__(self, wheels):
        super().__init__(wheels)
        self._amount = wheels.amount
        self._lost = LostPackets(self._reach, self.dropped)
        self.health = BoardHealth(wheels.amount, wheels.pid_frequency)
        self.report_board = self.health.report
        self._measured = -math.inf  # [s] when the newest reading of the battery was made

    repaired = property(lambda self: self._lost.repaired)
    restarts = property(lambda self: self._lost.restarts)
    doubts = property(lambda self: self._lost.doubts)
    drives = property(lambda self: bool(self.packets) and not self.health.wants_identity)

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
            self.health.wants_identity = self.health.identity is None  # which has the number
            raise
        if not packet.status:
            self.health.wants_identity = False  # of firmware before 2.0, which has none
        elif packet.status is not self.health.status:
            self.health.hear_status(packet.status)
        if packet.status and packet.status.voltage and now >= self._measured + BATTERY_PERIOD:
            self._measured = now
            self.readings.append(Power(packet.status.voltage, math.nan))
        self.check_reach(packet.counts)
        return self._lost.recover(packet, now * self.wheels.pid_frequency)

    def _read_text(self, text):
        """Take a line of text; after a start-up banner the totals start again."""
        if _SEALED.match(text):
            check_checksum(text)
            text = text[:-5]
        elif self.health.status is not None:  # this board adds a checksum to its text
            raise PacketError("checksum", f"no checksum in {text[:60]!r}")
        if self.health.hear_text(text[1:].strip()):
            self._lost.restart()
        self.obstacle, self.tells_rate = self.health.obstacle, self.health.identity is not None

    def encode(self, command):
        """The packet with its CRC; but for zeros none to a board that has sent none or is unknown, which is asked."""
        unknown = self.health.wants_identity
        packet = b"" if any(command) and (unknown or not self.packets) else add_checksum(command.text)
        return QUESTION + packet if unknown else packet

    def stop(self):
        """Empty where the board stops by itself; to one that waits for zeros only whoever commands sends them."""
        stands = self.health.status and self.health.status.flags & (TIMED_OUT | WAITS_FOR_ZERO)
        return b"" if stands else super().stop()
