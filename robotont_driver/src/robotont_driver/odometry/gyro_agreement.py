"""Whether a gyro turns as the wheels do: wrong signs, axes and frames show. Turns are counterclockwise, in [rad]."""

BLOCK = 2.0             # [s] over which turns are compared; ...
TURNS = 0.4             # [rad] ... with less, noise of the wheels may be all there is
JUDGED = 3.0            # [rad] of such turns, to and fro, make a judgement; ...
BOUNDS = 0.7, 1.3       # ... so much of the wheels' turn a gyro measures that is used: they slip and err, too


class TurnAgreement:
    """Turn of the gyro for one of the wheels, `per_turn`, over the newest turns; None before those. period: [s]."""

    def __init__(self, period):
        self._packets = round(BLOCK / period)
        self.per_turn = None
        self._begin()
        self._begin_block()

    @property
    def refused(self):
        """Whether the gyro does not turn as the wheels do."""
        return self.per_turn is not None and not BOUNDS[0] <= self.per_turn <= BOUNDS[1]

    def update(self, gyro, wheels, given):
        """Take the turns of a packet and the heading that the gyro has `given`; the heading to take back, mostly 0."""
        self._gyro += gyro
        self._wheels += wheels
        self._given += given
        self._left -= 1
        if self._left:
            return 0.0
        if abs(self._wheels) >= TURNS:
            self._product += self._gyro * self._wheels
            self._square += self._wheels ** 2
            self._turned += abs(self._wheels)
        self._begin_block()
        return 0.0 if self._turned < JUDGED else self._judge()

    def _judge(self):
        before, given = self.refused, self._given
        self.per_turn = self._product / self._square
        self._begin()
        return given if self.refused and not before else 0.0

    def _begin(self):
        self._product = self._square = self._turned = self._given = 0.0

    def _begin_block(self):
        self._gyro = self._wheels = 0.0
        self._left = self._packets
