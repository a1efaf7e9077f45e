"""Whether lines were lost or the board has restarted unheard: judged by time, and by the speeds before and after.

Times are in periods of the board. Between two packets lie no more periods than the clock allows, and those that the
link may have held back. A board that may have sent all its packets within that time may have restarted: then the path
between the packets is not one that the wheels have made. Where their speeds do not explain it, it is in doubt.
"""

import math
from typing import NamedTuple

LARGEST_DRIFT = 0.02  # part by which the board's period may differ from the nominal one
HELD = 20.0       # [periods] whose packets the link may have held back when it was opened
JITTER = 2.0      # [periods] by which a packet may come too early or too late after its predecessor
EARLY = 10.0      # [periods] by which no packet comes too early, unless the board is faster than its robot's parameters
ANY = 256.0       # [periods] until the counter of the packets begins again
MEMORY = 50.0     # [periods] after which it is forgotten how late a packet was
NEGLIGIBLE = 5.0  # [edges] of a wheel's path; a Robotont that turns by 0.5 degrees makes 6
NOISE = 1.0       # [edges per period] by which a speed, out of one packet, may be wrong


class Arrival(NamedTuple):
    """When a packet came, and how late the link was then."""

    at: float           # [periods] on a clock that never goes back
    late: float = HELD  # [periods] that had begun by then, at most, and whose packets were still under way; < 0: early

    def most(self, now):
        """How many periods may lie between this packet and one that comes `now`, the latter's included.

        `ANY` where packets come faster than one per period.
        """
        if self.late < -EARLY:
            return ANY
        return min(ANY, (now - self.at) * (1 + LARGEST_DRIFT) + max(0.0, self.late) + JITTER)

    def next(self, now, periods):
        """`Arrival` of a packet that comes `now`, so many periods after this one."""
        elapsed = now - self.at
        late = self.late * math.exp(-elapsed / MEMORY) + elapsed * (1 + LARGEST_DRIFT) - periods
        return Arrival(now, late)


class Doubt(NamedTuple):
    """A gap in which the board may have restarted."""

    unexplained: float        # [edges] of a wheel's path, whenever it changed its speed from the old to the new one
    late: bool                # whether more time has passed than the lost periods took


def doubt_about(path, periods, elapsed, before, after):
    """`Doubt` about the `path` [edges], n, of the periods lost between two packets; None where it is negligible.

    elapsed: [periods] from packet to packet. before, after: n counts of these two.
    """
    difference = [way - periods * (old + new) / 2 for way, old, new in zip(path, before, after)]
    late = periods + 1 < elapsed - JITTER
    known = NEGLIGIBLE + NOISE * periods
    if largest(path) <= NEGLIGIBLE if late else largest(difference) <= known:
        return None
    unexplained = max(
        abs(way) - periods * abs(new - old) / 2 for way, old, new in zip(difference, before, after)) - known
    return Doubt(unexplained, late)


def largest(edges):
    """Magnitude of the longest of some paths [edges]."""
    return max(map(abs, edges))
