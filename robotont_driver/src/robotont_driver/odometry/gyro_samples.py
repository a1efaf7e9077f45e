"""The turn of a gyro between any two times. Turns are counterclockwise, in [rad]."""

from collections import deque

from robotont_driver.timing.odometry_stamps import SECOND

GAP = SECOND // 10      # [ns] between two samples; across a longer one the turn is unknown
HOLD = SECOND * 3 // 10  # [ns] by which samples of a period may be late and count as its own; shorter than SETTLING
NOTHING = 0.0, 0.0
KEPT = 4096             # samples: more than four seconds of any gyro, for packets that are late


class TurnIntegral:
    """Integral of a gyro's rates from one stamp to the next.

    The wheels replace samples that are late; once they have arrived, their turn is made good. `sampled` is what samples
    alone tell of the last stretch, and of ends of earlier ones for which they came late: (turn [rad], [s]).
    """

    def __init__(self):
        self._samples = deque(maxlen=KEPT)  # (stamp [ns], turn [rad] since the first one, rate [rad/s])
        self._wheels = deque(maxlen=KEPT)   # (stamp [ns], turn [rad] of the wheels up to then)
        self._reached = None                # turn at the end of the last stretch
        self._sampled = None                # (stamp [ns], turn [rad]) up to which `sampled` has told
        self.sampled = NOTHING
        self._silent = False                # whether the samples of the last stretch were later than HOLD
        self.gaps = 0                       # times that samples were missing

    def add(self, stamp, rate):
        """Take a sample: `rate` [rad/s] at `stamp` [ns]. A sample not newer than the last one restarts the integral."""
        turn = 0.0
        if self._samples:
            last, turn, last_rate = self._samples[-1]
            if 0 < stamp - last <= GAP:
                turn += (last_rate + rate) / 2 * ((stamp - last) / SECOND)
            else:
                self.gaps += 1
                self._samples.clear()
                self._reached = self._sampled = None
        self._samples.append((stamp, turn, rate))

    def forget(self):
        """The stamps so far say nothing of those to come."""
        self._wheels.clear()
        self._reached = self._sampled = None

    def turned(self, stamp, wheels):
        """(turn [rad] from the stamp [ns] of the last call to this one, turn [rad] to make good).

        wheels: [rad] that the gyro should have measured according to the wheels. The first is None where samples are
        missing, or later than HOLD; then the wheels' turn counts. The second is by how much that was wrong in calls
        before, as far as samples have arrived since.
        """
        if self._wheels and stamp <= self._wheels[-1][0]:
            self._wheels.clear()  # the clock was set
        before, was_silent = self._reached, self._silent
        late = 0.0
        if was_silent and before is not None and self._wheels:
            then = self._turn_at(self._wheels[-1][0])
            late, before = (0.0, None) if then is None else (then - before, then)
        self._wheels.append((stamp, (self._wheels[-1][1] if self._wheels else 0.0) + wheels))
        self._reached = self._turn_at(stamp)
        self._silent = self._reached is not None and stamp - self._samples[-1][0] > HOLD
        unknown = before is None or self._reached is None or self._silent
        self._tell_sampled(None if unknown else min(stamp, self._samples[-1][0]))
        return None if unknown else self._reached - before, late

    def _tell_sampled(self, until):
        """`sampled` from where it ended to `until` [ns]; nothing, and no such end, for None."""
        before, self._sampled = self._sampled, None if until is None else (until, self._turn_at(until))
        if before is None or until is None:
            self.sampled = NOTHING
        else:
            self.sampled = self._sampled[1] - before[1], (until - before[0]) / SECOND

    def _turn_at(self, stamp):
        if not self._samples:
            return None
        newest = self._samples[-1]
        if stamp <= newest[0]:
            return interpolate(self._samples, stamp)
        since = interpolate(self._wheels, newest[0])
        return None if since is None else newest[1] + self._wheels[-1][1] - since


def interpolate(samples, stamp):
    """Value at `stamp` of (stamp, value, ...) in order of time; None where they do not reach so far back."""
    later = None
    for sample in reversed(samples):
        if sample[0] <= stamp:
            if later is None:
                return sample[1]
            return sample[1] + (later[1] - sample[1]) * ((stamp - sample[0]) / (later[0] - sample[0]))
        later = sample
    return None
