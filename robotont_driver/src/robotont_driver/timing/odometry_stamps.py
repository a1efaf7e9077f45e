"""When a packet was made: stamps from packet numbers and arrivals, for packets that stand for one period each.

The board makes packet k at a + b k on its own clock; it arrives later than that, never earlier. So a packet is stamped
by the lower envelope of the arrivals over the packet numbers (docs/odometry.md). Compare E. Olson, A Passive Solution
to the Sensor Synchronization Problem (IROS 2010), which bounds the drift b; here it is estimated, too.
"""

import math

SECOND = 1_000_000_000  # [ns]

BLOCK = 50              # [packets] of each of which the earliest arrival is kept; ...
FIRST_BLOCK = 10        # ... of the first ones, so that the line does not run away from a board that drifts, ...
FIRST_BLOCKS = 10       # ... of so many
BLOCKS = 30             # earliest arrivals that the period is estimated from ...
FEWEST = 2              # ... and the least number of them
RECENT = 5              # earliest arrivals that the line touches the lowest of
LARGEST_DRIFT = 0.02    # part by which the board's period may differ from the nominal one
USUAL_DRIFT = 0.02      # ... and its standard deviation: a microcontroller's own oscillator
ROUGH = SECOND // 200   # [ns] standard deviation of the earliest arrival of a block
RELIABLE = 18           # blocks behind a period that is kept when the line starts anew
LATE = 0.75             # [periods] packets all later than this, ...
SPREAD = 1.0            # [periods] ... by about as much, ...
PACKETS = 25            # ... so many of them in a row, mean that packets are missing; ...
SHARP = 0.2             # [periods] beyond whole ones, late by which packets before are lost where some have been
SOON = 10               # packets at most since one less late than SHARP; behind a line too fast they are late by and by
LATE_BLOCKS = 2         # ... so do as many blocks in a row in which even the earliest is so late
CATCHING_UP = 0.8       # of its periods; a block that comes in less time is a queue that gets shorter
TURN = SECOND // 2000   # [ns] a packet so soon behind its predecessor came with it, and waited for its turn ...
BURST = SECOND // 300   # [ns] ... for no longer than this
TOGETHER = 0.5          # [periods] packets that are closer to each other than this may belong to one burst, ...
MANY = 4                # ... and do so where a burst has so many of them on average
PAUSE = 3 * SECOND      # [ns] without packets; more than 109 periods at 50 Hz, which serial_com_node can repair
STEP = SECOND // 200    # [ns] change of the wall clock against the steady one that is a step and no drift
TICK = 1000             # [ns] least time between two stamps; tf2 in Python holds those that differ by less for the same


class OdometryStamps:
    """Stamps packets of a known nominal period [s].

    Counted: `restarts` (after a pause, or a steady clock that went back), `shifts` (packets that came later than
    their number implies, from some packet on), `steps` (of the wall clock). `event`: description of the newest time
    that the clock was set, `event_at` its arrival [ns]; None when that never happened.
    """

    def __init__(self, period):
        self._nominal = period * SECOND
        self._period = self._nominal  # [ns] as estimated
        self._origin = None           # [ns] arrival of the first packet; times below are relative to it
        self._offset = 0              # [ns] wall clock minus steady clock
        self._newest = None           # [ns] newest stamp
        self._minima = []
        self._bursts = False          # whether the packets come in bursts
        self._loses = False           # whether packets have been missing
        self._skipped = 0             # packets that were taken for lost when the newest gap was seen
        self._lowered = 0.0           # [ns] by which early packets have lowered the line since then
        self.restarts = self.shifts = self.steps = 0
        self.event = self.event_at = None

    @property
    def drift(self):
        """Part by which the board's periods are longer than the nominal one."""
        return self._period / self._nominal - 1.0

    def stamp(self, arrival, now):
        """Stamp [ns] on the wall clock of the next packet; never newer than `now`, always newer than the one before.

        arrival: [ns] on a clock that is never set (time.monotonic). now: [ns] the wall clock at the same instant.
        Where there is only one clock (simulated time) both are the same. After the wall clock, or the only one, went
        back, so do the stamps; while it stands still they exceed it by `TICK` each.
        """
        if self._origin is None:
            self._origin, self._offset = arrival, now - arrival
            self._restart(0.0)
        else:
            self._notice_step(arrival, now)
            self._advance(float(arrival - self._origin))
        stamp = self._origin + int(self._line) + self._offset
        if self._newest is not None:
            stamp = max(stamp, self._newest + TICK)
        self._newest = stamp
        return stamp

    def _notice_step(self, arrival, now):
        offset = now - arrival
        step, self._offset = offset - self._offset, offset
        if abs(step) > STEP:
            self.steps += 1
            self._clock_was_set(arrival, step)

    def _advance(self, arrival):
        """Move the line on to a packet that came at `arrival`."""
        gap, self._arrival = arrival - self._arrival, arrival
        alone = gap < 0 or gap >= TOGETHER * self._nominal
        in_burst = not alone if self._bursts else 0 <= gap < TURN and arrival - self._burst < BURST
        if in_burst:
            arrival = self._burst
        self._burst = arrival
        self._groups += alone
        if gap < 0 or gap > PAUSE:
            self.restarts += 1
            if gap < 0:
                self._clock_was_set(self._origin + int(arrival), int(gap))
            self._restart(arrival)
            return
        self._number += 1
        self._line += self._period
        late = arrival - self._line
        missing = math.floor(late / self._period + SHARP / 2)
        lost = self._loses and alone and not self._bursts and self._number - self._on_time <= SOON
        lost = lost and missing > 0 and late / self._period - missing < SHARP
        if lost:
            late = max(0.0, self._skip(missing, late))
        elif self._skipped and late < -self._period / 2:
            late = self._skip(-self._skipped, late)  # they were not lost, but late
        if late < 0:
            self._line = arrival  # nothing arrives before it is made
            self._lowered -= late
            late = 0.0
        self._on_time = self._number if late < SHARP * self._period else self._on_time
        self._notice_shift(late)
        if not lost and arrival - self._period * self._number < self._residual(self._earliest):
            self._earliest = (self._number, arrival)
        self._left -= 1
        if not self._left:
            self._fit()

    def _skip(self, packets, late):
        """Count packets that were lost, or not after all; by how much the newest one is still `late` [ns] then."""
        if packets > 0:
            self._lowered, self._earliest_before = 0.0, self._earliest
        else:  # what came since then was not early
            self._line += self._lowered
            late -= self._lowered
            self._earliest = self._earliest_before
        self._skipped = max(packets, 0)
        self.shifts += packets > 0
        self._number += packets
        self._line += packets * self._period
        return late - packets * self._period

    def _notice_shift(self, late):
        """Packets that are late by a period, one after the other: packets are missing, and the line has to follow."""
        if late < LATE * self._period:
            self._late = []
            return
        self._late.append(late)
        if max(self._late) - min(self._late) > SPREAD * self._period:
            self._late = [late]
        elif len(self._late) == PACKETS:
            self._shift(min(self._late))

    def _shift(self, late):
        self._line += late
        self.shifts += 1
        self._loses = True
        self._forget()

    def _fit(self):
        """Estimate the period from the earliest arrivals, and lay the line on the newest of them."""
        number, arrival = self._earliest
        late = arrival - self._line + self._period * (self._number - number)
        self._bursts = self._groups * MANY <= self._size
        if late > LATE * self._period and self._arrival - self._begun > CATCHING_UP * self._size * self._period:
            self._late_packets += self._size
            if self._late_packets >= LATE_BLOCKS * BLOCK:
                self._shift(late)
            else:
                self._begin_block()
            return
        self._late_packets = 0
        self._minima.append(self._earliest)
        del self._minima[:-BLOCKS]
        if len(self._minima) >= FEWEST:
            self._estimate_period()
        newest = min(self._minima[-RECENT:], key=self._residual)
        self._line = newest[1] + self._period * (self._number - newest[0])
        self._line = min(self._line, self._burst)
        self._begin_block()

    def _estimate_period(self):
        """From an early and a late one of the earliest arrivals, weighed against the nominal period."""
        third = (len(self._minima) + 2) // 3
        old, new = (min(part, key=self._residual) for part in (self._minima[:third], self._minima[-third:]))
        packets = new[0] - old[0]
        if packets <= 0:
            return
        weight = 1 / (1 + (ROUGH / (packets * USUAL_DRIFT * self._nominal)) ** 2)
        drift = weight * ((new[1] - old[1]) / packets - self._nominal)
        bound = LARGEST_DRIFT * self._nominal
        self._period = self._nominal + min(max(drift, -bound), bound)

    def _residual(self, numbered):
        number, arrival = numbered
        return arrival - self._period * number

    def _restart(self, arrival):
        self._line = self._arrival = self._burst = arrival
        self._number = 0
        self._forget()

    def _forget(self):
        """Discard the arrivals so far, which no longer predict those to come; keep a period that many of them gave."""
        if len(self._minima) < RELIABLE:
            self._period = self._nominal
        self._minima = []  # (packet number, arrival) of the earliest arrival of each block
        self._late_packets = 0  # of blocks in a row
        self._on_time = self._number  # the newest packet that was not late
        self._late = []    # [ns] by which packets in a row were late
        self._begin_block()

    def _begin_block(self):
        self._size = self._left = BLOCK if len(self._minima) >= FIRST_BLOCKS else FIRST_BLOCK
        self._lowered = 0.0
        self._groups = 0  # packets that came alone, and bursts
        self._begun = self._arrival
        self._earliest = self._earliest_before = (0, float("inf"))  # packet number, arrival; the latter: before a skip

    def _clock_was_set(self, arrival, step):
        """The stamps follow, backwards too."""
        way = "back" if step < 0 else "forward"
        self.event = f"the clock was set {way} by {describe(abs(step) / SECOND)}"
        self.event_at = arrival
        if step < 0:
            self._newest = None


class ArrivalClock(OdometryStamps):
    """Stamps by arrival, for packets that stand for no certain period."""

    def __init__(self):
        super().__init__(0.0)

    @property
    def drift(self):
        """Unknown: 0."""
        return 0.0

    def _advance(self, arrival):
        gap, self._arrival = arrival - self._arrival, arrival
        if gap < 0:
            self.restarts += 1
            self._clock_was_set(self._origin + int(arrival), int(gap))
        self._line = arrival


def describe(seconds):
    """A duration [s] as text."""
    return f"{seconds:.3f} s" if seconds < 10 else f"{seconds:.0f} s"
