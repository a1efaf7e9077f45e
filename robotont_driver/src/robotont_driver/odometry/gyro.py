"""A gyro's turn in each period, and its bias.

The gyro's rate is `scale * rate + bias + white noise`, the bias walks slowly. It is learnt while the wheels stand, and
only then: an error of the wheel parameters must not become one of the gyro. Turns are counterclockwise, in [rad].
"""

import math

FIRST_BIAS = 0.02       # [rad/s] standard deviation of the bias of an unknown gyro
SETTLING = 0.5          # [s] without counts until the robot counts as standing
LEARNING = 1.0          # [s] of standing until the bias is good enough to use the gyro
OUTLIER = 5.0           # [standard deviations] a larger turn while the wheels stand is not bias, ...
RELEARN = 3.0           # [s] ... unless it goes on for so long and ...
STEADY = 10.0           # [standard deviations] ... its rates differ by no more than this


class Gyro:
    """The bias of a gyro, and its turn in one period after the other.

    period: [s] of a packet. noise: [rad/s/sqrt(Hz)] density of its white noise. bias_drift: [rad/s/sqrt(s)] walk of
    its bias. scale: its rate for 1 rad/s; scale_noise: standard deviation of that.
    """

    def __init__(self, period, noise, bias_drift, scale=1.0, scale_noise=0.0):
        self.period = period
        self.scale = scale
        self.scale_variance = (scale_noise / scale) ** 2
        self.noise = noise ** 2 * period   # [rad^2] variance of a period's turn
        self._density = noise ** 2         # [rad^2/s]
        self._walk = bias_drift ** 2 * period
        self.bias = 0.0                    # [rad/s]
        self.bias_variance = FIRST_BIAS ** 2
        self._learnt = 0.0                 # [s] of standing
        self.learnt_part = 1.0             # of the bias' error that remained after the newest period
        self._still = 0                    # periods without motion of the wheels
        self._path = None                  # [edges] of each wheel while standing
        self._odd = []                     # (turn [rad], [s]) of a standing robot that do not fit the bias

    @property
    def ready(self):
        """Whether the bias has been estimated."""
        return self._learnt >= LEARNING

    @property
    def stands(self):
        """Whether the wheels have stood for long enough; an encoder may flicker between two edges."""
        return self._still * self.period >= SETTLING

    def watch_wheels(self, counts):
        """Take the n counts of a period, before `turn`."""
        path = list(counts) if self._path is None else [sum(pair) for pair in zip(self._path, counts)]
        if max(map(abs, path)) > 1:
            self._still, self._path = 0, [0] * len(path)
        else:
            self._still, self._path = self._still + 1, path

    def age(self, periods):
        """The bias has walked for so many periods, with samples or without."""
        self.bias_variance = min(self.bias_variance + self._walk * max(periods, 0.0), FIRST_BIAS ** 2)

    def turn(self, measured, seconds):
        """[rad] that the robot turned in the `seconds` in which the gyro `measured` so much."""
        return measured / self.scale - self.bias * seconds

    def learn(self, measured, seconds):
        """Learn the bias while the robot stands, from samples alone: they `measured` so much in so many `seconds`."""
        self.learnt_part = 1.0
        if not self.stands:
            self._odd = []
        elif seconds > 0.0:
            self._learn(self.turn(measured, seconds), seconds)

    def _learn(self, turn, seconds):
        variance = self.bias_variance * seconds ** 2 + self._density * seconds
        if turn ** 2 > OUTLIER ** 2 * variance:
            self._odd.append((turn, seconds))
            if sum(seconds for _, seconds in self._odd) >= RELEARN:
                self._relearn()
            return
        self._odd = []
        gain = self.bias_variance * seconds / variance
        self.bias += gain * turn
        self.learnt_part = 1 - gain * seconds
        self.bias_variance *= self.learnt_part
        self._learnt += seconds

    def _relearn(self):
        """A steady turn for RELEARN while the wheels stand means that the bias has changed."""
        change = sum(turn for turn, _ in self._odd) / sum(seconds for _, seconds in self._odd)
        left = [(turn - change * seconds) / math.sqrt(self._density * seconds) for turn, seconds in self._odd]
        if max(left) - min(left) < STEADY:
            self.bias += change
            self.bias_variance = FIRST_BIAS ** 2
            self._learnt = 0.0
            self.learnt_part = 0.0  # this is another bias
        self._odd = []
