"""When a packet was made, from its number and its arrival [ns].

The board makes packet k at a + b k; it arrives later than that, never earlier: the stamp is the lower envelope of the
arrivals (E. Olson, A Passive Solution to the Sensor Synchronization Problem, IROS 2010; here b is estimated, too).
"""

import math

SECOND, TICK = 1_000_000_000, 1000  # [ns]; between stamps: tf2 takes closer ones for the same
FIRST_BLOCKS, BLOCKS, RECENT = 10, 30, 5  # of 0.2, the others of 1 s; kept for the period; newest, for the height
LARGEST_DRIFT = 0.03  # part by which the board's period may differ from the nominal one: generation 3's by 0.025
ROUGH = SECOND // 200  # error of a block's earliest arrival; a clock that moves by more was set
PAUSE, SETTLED = 3 * SECOND, SECOND // 20  # without packets, or with late ones that are no queue: the line begins anew
LATE, LOST, SHARP = 0.75, 8, 0.2  # [periods] late; up to so many whole ones, and this beyond: packets were lost


class OdometryStamps:
    """Stamps packets of a nominal period [s]; 0: by arrival alone.

    `drift` of the board's period [1]; `restarts` of the line; `event`: a clock was set, at the arrival `event_at`.
    """

    def __init__(self, period):
        self._nominal = self._period = self._reliable = period * SECOND
        self._origin = self._newest = self._given = None
        self.drift, self.restarts, self.event, self.event_at = 0.0, -1, None, None
        self._losses = 0  # 0 to 3: gaps before packets without numbers that were losses, less those that were not

    def stamp(self, arrival, now, number=None):
        """Stamp of the packet `number` (periods, or None), at most `now`; arrival: as now, on a clock never set."""
        if self._origin is None:
            self._origin, self._arrival, self._offset = arrival, 0, now - arrival
        offset, since = now - arrival, arrival - self._origin - self._arrival
        step, self._offset = offset - self._offset + min(since, 0), offset
        if abs(step) > ROUGH:
            self.event = f"the clock was set {'back' if step < 0 else 'forward'} by {abs(step) / SECOND:.4g} s"
            self.event_at, self._newest = arrival, self._newest if step > 0 else None
        self._arrival += since
        self._advance(self._arrival, since, number)
        stamp = min(math.floor(self._line), self._arrival) + self._origin + offset
        self._newest = stamp if self._newest is None else max(stamp, self._newest, min(self._newest + TICK, now))
        return self._newest

    def _advance(self, arrival, since, number):
        """Move the line on to a packet `since` [ns] after the last one; begin anew where it does not fit."""
        periods = 1 if number is None or self._given is None else number - self._given
        self._given = number
        if not 0 <= since < PAUSE or periods <= 0 or self.restarts < 0 or not self._nominal:
            self._begin(arrival)
            return
        if number is None:
            periods += self._lost_before(arrival - self._line - self._period)
        self._number += periods
        self._line += periods * self._period
        late = max(arrival - self._line, 0.0 if self._skipped else -math.inf)
        on_time, queue = late < LATE * self._period, late < self._late - self._period / 2
        self._late_from = math.inf if on_time or queue else min(self._late_from, arrival)
        if on_time or queue or late > self._late + self._period:
            self._late = late  # a queue gets less late than this, however slowly it is read
        # numbers tell what was lost: late is only late
        settled = SECOND if number is not None else SETTLED * (late < LOST * self._period)
        if late < -LATE * self._period or arrival - self._late_from > settled:
            self._losses = (self._losses or 1) * (late >= 0)  # before what comes so early no packet was lost
            self._begin(arrival)
            return
        if self._line + late - self._earliest[0] < self._period * (self._number - self._earliest[1]):
            self._earliest = self._line + late, self._number
        self._line += min(late, 0.0)  # nothing arrives before it is made
        if on_time and arrival - self._begun >= (SECOND if len(self._minima) >= FIRST_BLOCKS else SECOND // 5):
            self._fit(arrival)

    def _lost_before(self, late):
        """Periods lost before a packet without a number that is so `late`; < 0: those before were not, after all."""
        before, self._skipped = self._skipped, 0
        if before:
            wrong = late < -self._period / 2
            self._losses = max(0, self._losses - 1) if wrong else min(3, self._losses + 1)
            return -before if wrong else 0
        lost = math.floor(late / self._period + SHARP / 2)
        if self._losses and 0 < lost <= LOST and late < (lost + SHARP) * self._period:
            self._skipped = lost
        return self._skipped

    def _fit(self, arrival):
        """Estimate the period from an early and a late one of the earliest arrivals; lay the line on the newest."""
        self._minima = [*self._minima, self._earliest][-BLOCKS:]
        third = (len(self._minima) + 2) // 3
        old, new = (min(part, key=self._residual) for part in (self._minima[:third], self._minima[-third:]))
        if new[1] > old[1]:
            weight = 1 / (1 + (ROUGH / ((new[1] - old[1]) * LARGEST_DRIFT * self._nominal)) ** 2)
            period = self._reliable + weight * ((new[0] - old[0]) / (new[1] - old[1]) - self._reliable)
            self.drift = min(max(period / self._nominal - 1, -LARGEST_DRIFT), LARGEST_DRIFT)
            self._period = self._nominal * (1 + self.drift)
            self._reliable = self._period if len(self._minima) > FIRST_BLOCKS else self._reliable
        self._line = min(min(map(self._residual, self._minima[-RECENT:])) + self._number * self._period, arrival)
        self._begun, self._earliest = arrival, (math.inf, 0)

    def _residual(self, numbered):
        return numbered[0] - self._period * numbered[1]

    def _begin(self, arrival):
        """Forget the arrivals so far: they do not predict those to come."""
        self.restarts += bool(self._nominal or self.restarts < 0)
        self._line, self._period, self._begun = float(arrival), self._reliable, arrival
        self._number, self._late, self._skipped, self._late_from = 0, 0.0, 0, math.inf
        self._minima, self._earliest = [], (math.inf, 0)  # (arrival, number) of each block's earliest
