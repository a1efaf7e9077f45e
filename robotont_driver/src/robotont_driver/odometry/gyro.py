"""A gyro's turns between stamps, its bias, and whether it turns as the wheels do. Counterclockwise, in [rad] and [ns].

The gyro's rate is `scale * rate + bias + white noise`; the bias walks slowly. It is learnt while the wheels stand, and
only then: an error of the wheel parameters must not become one of the gyro.
"""

import math
from collections import deque

SECOND = 1_000_000_000
KEPT = 4096             # turns: more than four seconds of any gyro
FIRST_BIAS = 0.02       # [rad/s] standard deviation of the bias of an unknown gyro
LEARNING = 1.0          # [s] of standing until the bias is good enough to use the gyro
OUTLIER = 5.0           # [standard deviations] a larger turn while the wheels stand is not bias, ...
RELEARN, STEADY = 3.0, 10.0  # ... unless it goes on for so long [s], its rates within so many standard deviations
BLOCK, ENDS = 1.0, 0.1  # [s] over which turns are compared, and at whose ends the rate is taken
MEMORY = 0.97           # of a comparison after another one
JUDGED, CHANGED = 3.0, 4.0  # [rad] turned, and [(rad/s)^2] squared changes of the rate, that make a judgement
SCALE, OWN = 0.05, 0.005  # error of the scale from which on a gyro is refused; which the wheels' own may explain
DELAY = 0.03            # [s] of its stamps, from which on it is refused
SURE = 3.0              # [standard deviations] beyond these


class Turns:
    """What turned by when: turns are added, and read between any two stamps."""

    def __init__(self, stamp):
        self._known = deque([(stamp, 0.0)], maxlen=KEPT)

    @property
    def newest(self):
        """Stamp of the newest turn."""
        return self._known[-1][0]

    def add(self, stamp, turn):
        """Add a turn up to a newer stamp."""
        self._known.append((stamp, self._known[-1][1] + turn))

    def between(self, start, end):
        """Turn between two stamps; None where that is not known."""
        start, end = self._at(start), self._at(end)
        return None if start is None or end is None else end - start

    def _at(self, stamp):
        later = None
        for known in reversed(self._known):
            if known[0] <= stamp:
                if later is None:
                    return known[1] if known[0] == stamp else None
                return known[1] + (later[1] - known[1]) * ((stamp - known[0]) / (later[0] - known[0]))
            later = known
        return None


class Bias:
    """The bias [rad/s] of a gyro. noise: [rad/s/sqrt(Hz)] density of white noise; walk: [rad/s/sqrt(s)] of the bias."""

    def __init__(self, noise, walk):
        self._noise, self._walk = noise ** 2, walk ** 2
        self.value, self.variance = 0.0, FIRST_BIAS ** 2
        self._learnt, self._odd, self.unsteady = 0.0, [], 0.0  # the last: [s] at rest of which nothing was learnt

    @property
    def ready(self):
        """Whether the bias has been learnt."""
        return self._learnt >= LEARNING

    def age(self, seconds):
        """Let the bias walk for so long."""
        self.variance = min(self.variance + self._walk * seconds, FIRST_BIAS ** 2)

    def learn(self, turn, seconds):
        """Take a turn of a robot whose wheels stand."""
        turn -= self.value * seconds
        variance = self.variance * seconds ** 2 + self._noise * seconds
        self.unsteady += seconds
        if turn ** 2 > OUTLIER ** 2 * variance:  # turned by hand, or another bias
            self._learnt = self._learnt if self.ready else 0.0
            self._odd.append((turn, seconds))
            turns, lasted = map(sum, zip(*self._odd))
            if lasted < RELEARN:
                return
            left = [(turn - turns / lasted * seconds) / math.sqrt(self._noise * seconds) for turn, seconds in self._odd]
            if max(left) - min(left) < STEADY:
                self.value += turns / lasted
                self.variance, self._learnt, self.unsteady = FIRST_BIAS ** 2, 0.0, 0.0
        else:
            gain = self.variance * seconds / variance
            self.value += gain * turn
            self.variance *= 1 - gain * seconds
            self._learnt, self.unsteady = self._learnt + seconds, max(0.0, self.unsteady - seconds)
        self._odd = []


class Agreement:
    """Scale and delay of a gyro, by the wheels: its turn beyond theirs is `error * turn - delay * change of the rate`.

    `error` of the scale, `delay` [s] of its stamps, 0 until they are known; `judged`: whether the first is. `refused`:
    why it is not used, or empty. `wrong`: `error`, where the wheels do not explain it; else 0. `saved` [rad^2]:
    variance that it has spared the heading since it was surely right.
    """

    def __init__(self):
        self.error = self.delay = self.wrong = self.saved = self._given = self._turned = 0.0
        self.refused, self.judged = "", False
        self._sums = [0.0] * 5  # of turn^2, turn * change, change^2, difference * turn, difference * change
        self._squares = self._blocks = 0.0  # of differences, and how many
        self._begin()

    def _begin(self):
        self._seconds, self._stretches = 0.0, []

    def update(self, difference, turn, seconds, given, saved):
        """Take the gyro's turn beyond the wheels' `turn`, and the heading it has `given`; the heading to take back."""
        self._given += given
        self.saved += saved
        self._seconds += seconds
        self._stretches.append((difference, turn, seconds))
        if self._seconds < BLOCK:
            return 0.0
        stretches = self._stretches
        self._begin()
        difference, turn, _ = map(sum, zip(*stretches))
        change = _rate(stretches[::-1]) - _rate(stretches)
        new = turn ** 2, turn * change, change ** 2, difference * turn, difference * change
        self._sums = [MEMORY * old + value for old, value in zip(self._sums, new)]
        self._squares, self._blocks = MEMORY * self._squares + difference ** 2, MEMORY * self._blocks + 1.0
        self._turned = MEMORY * self._turned + abs(turn)
        self.judged = self._turned >= JUDGED
        return self._judge() if self.judged else 0.0

    def _judge(self):
        """Least squares; the heading to take back."""
        turn, both, change, by_turn, by_change = self._sums
        whole = turn * change - both ** 2
        if change < CHANGED:
            change, both, by_change, whole = 1.0, 0.0, 0.0, turn
        self.error = (change * by_turn - both * by_change) / whole
        self.delay = (both * by_turn - turn * by_change) / whole
        left = max(0.0, self._squares - self.error * by_turn + self.delay * by_change)
        spread = SURE * math.sqrt(left / max(1.0, self._blocks - 2.0) / whole)
        before, self.refused = self.refused, ""
        scatter, off = spread * math.sqrt(change), abs(self.error)
        self.wrong = off if off - scatter * 2 / 3 > OWN else 0.0
        if off + scatter < SCALE and abs(self.delay) < DELAY and not before:
            self._given = self.saved = 0.0
        if off - scatter > SCALE:
            self.refused = (f"measures {round(1 + self.error, 2) + 0.0:.2f} turns for one of the wheels: look for a "
                            "wrong sign, axis, unit, frame (TF) or gyro_scale, slipping wheels, a wrong wheel file")
        elif abs(self.delay) - spread * math.sqrt(turn) > DELAY:
            self.refused = f"its stamps are {self.delay:+.2f} s late: look at its driver's stamps and at the clocks"
        return self._given if self.refused and not before else 0.0


def _rate(stretches):
    """Rate [rad/s] of the wheels at the begin of (difference, turn, seconds), over ENDS."""
    turned = lasted = 0.0
    for _, turn, seconds in stretches:
        turned, lasted = turned + turn, lasted + seconds
        if lasted >= ENDS:
            break
    return turned / lasted
