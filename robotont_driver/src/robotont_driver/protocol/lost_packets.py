"""Counts of packets that the line has lost: recovered from the encoder totals of the packets around them.

A packet that does not continue the one before is held until the next: an error, or the board has restarted.
"""

from typing import NamedTuple, Tuple

from robotont_driver.protocol.packet import PacketError, WholeCounts
from robotont_driver.protocol.restarts import ANY, Arrival, doubt_about


class LostPackets:
    """Checked packets in, counts (`Packet`) per PID period out, lost periods included.

    reach: edges that a motor can make in one period. Counted: `repaired` periods, `restarts` (of the board), `doubts`
    (gaps in which it may have restarted); `dropped["inconsistent"]` packets that nothing confirmed.
    """

    def __init__(self, reach, dropped):
        self._reach = reach
        self._dropped = dropped
        self.repaired = 0
        self.restarts = 0
        self.doubts = 0
        self.connect()

    def connect(self):
        """Begin a new connection: forget all about the board."""
        self._last = None      # newest trusted packet
        self._suspect = None   # a packet that does not continue `_last`: an error, or a restart
        self._suspicion = ()   # doubt [edges] that a restart at `_suspect` leaves

    def restart(self):
        """The board has said that it has restarted, with counter and totals."""
        self.restarts += self._last is not None
        self._last = self._suspect = None

    def recover(self, packet, now):
        """List of `Packet` that a CheckedPacket which came at `now` [periods] completes. Raises PacketError."""
        if self._last is None:
            packet.arrival = Arrival(now)
            self._last = packet
            return [packet.counts]
        if packet.repeats(self._last):
            raise PacketError("repeated", "the same packet twice")
        gap = self._gap(self._last, packet, now)
        if gap is not None and not gap.restarted:
            if self._suspect is not None:
                self._dropped["inconsistent"] += 1
            return self._continue(self._last, packet, gap, now)
        suspect, suspicion = self._suspect, self._suspicion
        if suspect is not None:
            step = self._gap(suspect, packet, now)
            if step is not None and not step.restarted:
                # Two packets agree with each other and not with those before: the board has restarted.
                self.restarts += 1
                self.doubts += bool(suspicion)
                return [suspect.counts.doubted(suspicion), *self._continue(suspect, packet, step, now)]
            self._dropped["inconsistent"] += 1
        packet.arrival = self._last.arrival.next(now, 1)
        self._suspect, self._suspicion = packet, gap.doubt if gap else ()
        return []

    def _gap(self, last, packet, now):
        """`_Gap` between the two packets; None where time or motors cannot have made it.

        Beyond 2^15 edges the totals modulo 2^16 no longer determine how many are missing.
        """
        periods, counts = packet.missed_since(last)
        bound = self._reach * periods
        most = last.arrival.most(now)
        if periods + 1 > most or bound >= 0x8000 or max(map(abs, counts)) > bound:
            return None
        # the counter begins at 0 with the board: whether all its packets may have been made since `last`
        if periods and packet.counter + 1 <= most < ANY:
            doubt = doubt_about(counts, periods, now - last.arrival.at, last.counts, packet.counts)
            if doubt:
                return _Gap(periods, counts, doubt.edges, doubt.late and doubt.unexplained > 0)
        return _Gap(periods, counts, (), False)

    def _continue(self, last, packet, gap, now):
        periods, counts, doubt, _ = gap
        packet.arrival = last.arrival.next(now, periods + 1)
        self._last = packet
        self._suspect = None
        if not periods:
            return [packet.counts]
        self.repaired += periods
        self.doubts += bool(doubt)
        return [*WholeCounts(len(counts)).share(counts, periods), packet.counts.doubted(doubt)]


class _Gap(NamedTuple):
    """Between two packets."""

    periods: int             # whose packets are missing
    counts: Tuple[int, ...]  # per wheel, in these
    doubt: Tuple[float, ...]  # [edges] as in a `Packet`
    restarted: bool          # whether a restart is likelier than these counts
