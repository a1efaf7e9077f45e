"""Counts of packets that the line has lost: recovered from the encoder totals of the packets around them.

A packet that does not continue the one before is dropped, or held where the board may have restarted. Whether it has,
unheard, is judged by time and by the speeds before and after. Times are in periods of the board.
"""

from robotont_driver.protocol.protocol import Packet, PacketError

DRIFT = 0.02      # part by which our board's period may differ from the nominal one
HELD = 25.0       # [periods] whose packets the link may hold back
JITTER = 2.0      # [periods] by which a packet may come too late after its predecessor
ANY = 256         # [periods] until the counter of the packets begins again
NEGLIGIBLE = 5.0  # [edges] of a wheel's path; a Robotont that turns by 0.5 degrees makes 6
NOISE = 1.0       # [edges per period] by which a speed, out of one packet, may be wrong


class LostPackets:
    """CheckedPackets in, a `Packet` per PID period out, lost periods included, numbered from 0 on.

    reach: edges that a motor can make in one period. Counted: `repaired` periods, `restarts` (of the board), `doubts`
    (gaps in which it may have restarted); `dropped["inconsistent"]` packets that nothing confirmed.
    """

    def __init__(self, reach, dropped):
        self._reach = reach
        self._dropped = dropped
        self.repaired = self.restarts = self.doubts = 0
        self._last = None          # newest trusted packet
        self._suspect = None       # a packet that does not continue `_last`: an error, or a restart

    def restart(self):
        """The board has said that it has restarted, with counter and totals."""
        self.restarts += self._last is not None
        self._last = self._suspect = None

    def recover(self, packet, now):
        """List of `Packet` that a CheckedPacket which came at `now` [periods] completes. Raises PacketError."""
        packet.arrival = now
        if self._last is None:
            return [self._trust(packet, 0)]
        if (packet.counter, packet.totals, packet.counts) == (
                self._last.counter, self._last.totals, self._last.counts):
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
                # Two packets agree with each other and not with those before: the board has restarted.
                self.restarts += 1
                return [self._trust(suspect, 0), *self._continue(suspect, packet, step)]
            self._dropped["inconsistent"] += 1
            self._suspect = None
        if packet.counter + 1 > most_between(self._last, packet):
            raise PacketError("inconsistent", "neither the next packet, nor one of a board that has just started")
        self._suspect = packet
        return []

    def _gap(self, last, packet):
        """(lost periods, their counts per wheel, whether the board has surely restarted between, whether it may have).

        None where the board cannot have made the gap in that time, or the motors the way; or where they may have made
        2^15 edges: the totals modulo 2^16 do not determine how many.
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
