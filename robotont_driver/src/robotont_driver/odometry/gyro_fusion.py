"""Fusion of a gyro with the wheels' odometry. Turns are counterclockwise, in [rad]."""

from operator import add

from robotont_driver.odometry.gyro import SECOND, Agreement, Bias, Turns
from robotont_driver.odometry.odometry import NO_LASTING, Covariance

GAP = SECOND // 10       # [ns] between two samples; across a longer one the turn is unknown
PAUSE = SECOND           # [ns] between two packets, across which the wheels' turn is unknown
LATE = 3 * SECOND // 10  # [ns] by which the newest sample may be late while wheels and gyro are compared for slip
SETTLING = SECOND // 2   # [ns] without motion of the wheels until the robot stands: ...
STILL = 2.5, 0.001       # ... its wheels have moved by no more than so many edges or [m]
FLAT, FAST, BEYOND = 5, 0.5, 1.1  # samples at the largest rate, [rad/s], share of it that wheels turn: saturated
TIMING, UNKNOWN = 0.016, 0.1  # [s] by which stamps of gyro and wheels differ (standard deviation); until that is known


class GyroFusion:
    """Weighs the turns of wheels and gyro by their covariances. period: [s] of a packet; metres_per_edge: n [m].

    noise: [rad/s/sqrt(Hz)]; bias_walk: [rad/s/sqrt(s)]; scale: rate for 1 rad/s, and its standard deviation.
    """

    def __init__(self, period, metres_per_edge, noise, bias_walk, scale=1.0, scale_noise=0.0):
        self.period, self._noise = period, noise ** 2
        self._scale, self._scale_variance = scale, (scale_noise / scale) ** 2
        self._still = [max(STILL[0], STILL[1] / edge) for edge in metres_per_edge]
        self._paths, self._still_since = [0.0] * len(metres_per_edge), 0
        self._samples = self._wheels = self._common = None  # `Turns`; stamp up to which they have been compared
        self._rate = self._top = self._hits = 0.0
        self.bias, self.agreement = Bias(noise, bias_walk), Agreement()
        self.compared = None  # (turn beyond the wheels', its variance, [s] of timing) of the newest packet, or None
        self.behind = 0.0     # packets whose turn is still that of the wheels alone
        self.learns = False   # whether the bias has been learnt with the newest packet
        self.saturates = 0.0  # [rad/s] at which it does; 0: not seen
        self.missing = self.gaps = 0  # packets without its turn; times that samples were missing
        self.turned = 0.0     # by the gyro since it counts, to and fro, for its calibration

    @property
    def variances(self):
        """Of bias and scale, which is as uncertain as the wheels show it to be."""
        wrong = 0.0 if self.agreement.refused else self.agreement.wrong
        return self.bias.variance, max(self._scale_variance, wrong ** 2)

    def add(self, stamp, rate):
        """Take a sample: `rate` [rad/s] at `stamp` [ns]. One that is not newer than the last begins anew."""
        if self._samples is None or not 0 < stamp - self._samples.newest <= GAP:
            self.gaps += self._samples is not None
            self._samples, self._common = Turns(stamp), None
        else:
            self._samples.add(stamp, (self._rate + rate) / 2 * ((stamp - self._samples.newest) / SECOND))
        self._rate = rate
        if abs(rate) > self._top:
            self._top, self._hits, self._flat = abs(rate), 0, [0.0, 0.0]
        self._hits += abs(rate) == self._top

    def fuse(self, counts, step, covariance, readings, stamp, doubted):
        """(step, Covariance, lasting as in `Pose.move`) of the packet that ends at `stamp` [ns].

        counts: n; step: (dx, dy, dyaw) of the wheels, with its Covariance, and that of two `readings` of encoders.
        doubted: whether wheels may slip.
        """
        wheels, before = (step, covariance, NO_LASTING), self._common
        self.compared, self.learns = None, False
        news = self._news(counts, step[2], stamp)
        if news is None:
            self.missing += 1
            self.behind = 0.0
            return wheels
        measured, turned, seconds = news
        self.behind = (stamp - self._common) / SECOND / self.period
        stands = before >= self._still_since + SETTLING
        compares = self.agreement.judged or stands
        if not seconds:
            self.compared = (0.0, 0.0, self._timing()) if compares else None
            return wheels
        self.bias.age(seconds)
        if stands:
            self.bias.learn(measured / self._scale, seconds)
            self.learns = True
        turn = measured / self._scale - self.bias.value * seconds
        if not self.bias.ready or self._is_saturated(turn, turned):
            return wheels
        agreement, beyond = self.agreement, turn - turned
        fused = wheels
        if not agreement.refused:
            self.turned += turn
            if compares and stamp - self._common < LATE:
                self.compared = beyond, self._variance(turn, seconds), self._timing()
            if doubted or not stands:  # a robot that stands does not turn, but by hand
                fused = self._weigh(step, covariance, readings, turn, beyond, seconds)
        wrong = agreement.update(beyond, turned, seconds, fused[0][2] - step[2], covariance.aa - fused[1].aa)
        if not wrong:
            return fused
        (x, y, yaw), known, _ = fused
        return (x, y, yaw - wrong), known._replace(aa=known.aa + agreement.saved), NO_LASTING

    def _news(self, counts, turn, stamp):
        """(turn of the gyro, of the wheels, [s]) since the last call, as far as both are known; None: they are not."""
        self._paths = list(map(add, self._paths, counts))
        begins = self._wheels is None or not 0 <= stamp - self._wheels.newest <= PAUSE
        if begins or any(abs(path) > still for path, still in zip(self._paths, self._still)):
            self._still_since, self._paths = stamp, [0.0] * len(self._paths)
        if begins:
            self._wheels, self._common = Turns(stamp), None
        else:
            self._wheels.add(stamp, turn)
        if self._samples is None:
            return None
        before, self._common = self._common, min(stamp, self._samples.newest)
        if before is None:
            return None
        if self._common <= before:
            self._common = before
            return (0.0, 0.0, 0.0) if stamp - before < LATE else None
        turns = self._samples.between(before, self._common), self._wheels.between(before, self._common)
        return None if None in turns else (*turns, (self._common - before) / SECOND)

    def _is_saturated(self, turn, turned):
        """Whether the gyro shows the largest rate it can, over which the wheels have turned by more than it has."""
        if self._hits < FLAT or not self._top == abs(self._rate) > FAST:
            return False
        self._flat = [self._flat[0] + abs(turn), self._flat[1] + abs(turned)]
        if self._flat[0] > FAST:
            self.saturates = self._top if self._flat[1] > BEYOND * self._flat[0] else 0.0
        return self.saturates > 0.0

    def _timing(self):
        return max(TIMING, abs(self.agreement.delay)) if self.agreement.delay else UNKNOWN

    def _variance(self, turn, seconds):
        """Of the turn in a window of 0.5 s, its packet's part: errors of bias and scale are the same in all of it."""
        bias, scale = self.variances
        return seconds * (self._noise + 0.5 * (bias + scale * (turn / seconds) ** 2))

    def _weigh(self, step, covariance, readings, turn, beyond, seconds):
        period, (bias, scale) = self.period, self.variances
        rate = turn / seconds
        whole = covariance.aa + readings.aa + period * self._noise + period ** 2 * (bias + scale * rate ** 2)
        x, y, yaw = gain = [(own + read) / whole for own, read in (
            (covariance.xa, readings.xa), (covariance.ya, readings.ya), (covariance.aa, readings.aa))]
        if seconds < 2 * period:  # what comes late is made good, but no covariance of the past
            left = (1.0, 0.0, -x), (0.0, 1.0, -y), (0.0, 0.0, 1.0 - yaw)
            covariance = covariance.propagated(left).plus(Covariance.of_vector(gain).times(self._noise * seconds))
        lasting = [seconds * part for part in gain], [turn * part for part in gain]
        return tuple(own + part * beyond for own, part in zip(step, gain)), covariance, lasting
