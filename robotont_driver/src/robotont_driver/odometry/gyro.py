"""A gyro beside the wheels: its bias, whether it turns as they do, the heading by both. Counterclockwise [rad], [ns].

Its rate is `scale * rate + bias + white noise`. The bias is learnt at rest: the wheels' errors must not become its.
"""

import math
from bisect import bisect_left
from collections import deque

import numpy as np

from robotont_driver.odometry.odometry import NO_LASTING, Covariance
from robotont_driver.odometry.odometry_stamps import SECOND

KEPT, MOST = 4096, 200.0  # samples, over 4 s of any gyro; [rad/s] a rate not below it is an error of the line
GAP, PAUSE, LATE, WAIT = 0.1, 1.0, 0.3, 4.0  # [s] between samples, packets; late beside the wheels, and at all
BEHIND, AHEAD = 0.5, 0.1  # [s] by which all stamps of a second may differ from this computer's clock
SETTLING, STILL = 1.0, (2.5, 0.0004)  # [s] after which the robot stands; ... edges or [m] are no motion of a wheel
FIRST_BIAS = 0.02        # [rad/s] standard deviation of the bias of an unknown gyro
LEARNING, PATIENCE = 1.0, 5.0  # [s] of standing until the bias is good enough to use; of which nothing was learnt
OUTLIER, RELEARN, STEADY = 5.0, 3.0, 10.0  # [sigma] a larger turn at rest is no bias, unless for [s] within [sigma]
BLOCK, ENDS, MEMORY = 1.0, 0.1, 0.97  # [s] over which turns are compared; of the rates at its ends; of older ones
STRAIGHT = 0.1  # [rad], [rad/s] in a block, below which nobody has turned
JUDGED, SURE = 3.0, 3.0  # [rad] turned, which make a judgement; [sigma] beyond the limits
SCALE, OWN, DELAY = 0.05, 0.005, 0.03  # error of the scale that is refused, that is the wheels'; [s] of the stamps
FLAT, FAST, BEYOND = 5, 0.5, 1.03  # saturated: samples at the largest rate; [rad/s], [rad]; wheels turn by so much more
TIMING, UNKNOWN = 0.016, 0.1  # [s] by which stamps of gyro and wheels differ (standard deviation); until it is known


class Bias:
    """The bias [rad/s] of a gyro. noise: [rad/s/sqrt(Hz)] density of white noise; walk: [rad/s/sqrt(s)] of the bias."""

    def __init__(self, noise, walk):
        self._noise, self._walk, self._odd = noise ** 2, walk ** 2, []
        self.value, self.variance = 0.0, FIRST_BIAS ** 2
        self.learnt = self.unsteady = 0.0  # [s] at rest from which it was learnt; of late was not

    def learn(self, turn, seconds, stands):
        """Take a turn: of a robot whose wheels stand, or let the bias walk."""
        self.variance = min(self.variance + self._walk * seconds, FIRST_BIAS ** 2)
        if not stands:
            return
        beyond, variance = turn - self.value * seconds, self.variance * seconds ** 2 + self._noise * seconds
        if beyond ** 2 <= OUTLIER ** 2 * variance:
            gain = self.variance * seconds / variance
            self.value, self.variance = self.value + gain * beyond, self.variance * (1 - gain * seconds)
            self.learnt, self.unsteady, self._odd = self.learnt + seconds, max(0.0, self.unsteady - seconds), []
            return
        self.unsteady += seconds  # turned by hand, or another bias
        self.learnt = self.learnt if self.learnt >= LEARNING else 0.0
        self._odd.append(turn / seconds)
        if len(self._odd) * seconds >= RELEARN:
            if np.ptp(self._odd) < STEADY * math.sqrt(self._noise / seconds):
                self.value, self.variance = np.mean(self._odd).item(), FIRST_BIAS ** 2
                self.learnt = self.unsteady = 0.0
            self._odd = []


class Agreement:
    """Scale and delay of a gyro, by the wheels: its turn beyond theirs is `error * turn - delay * change of the rate`.

    `error`, `delay` [s]; `judged`: whether they are known. `refused`: why it is not used, or empty. `wrong`: the part
    of `error` that the wheels do not explain, 0 while refused. `sure`: a block has just shown it right.
    """

    def __init__(self):
        self.error = self.delay = self.wrong = 0.0
        self.refused, self.judged, self.sure = "", False, False
        self._block, self._products = [], np.zeros((3, 3))  # of (turn, change of the rate, what is beyond) of blocks
        self._known = np.zeros(2)  # blocks, [rad] turned

    def update(self, beyond, turned, seconds):
        """Take the gyro's turn in a packet beyond the wheels' `turned`."""
        self.sure = False
        self._block.append((beyond, turned))
        if len(self._block) * seconds < BLOCK:
            return
        (beyond, turned), self._block = np.array(self._block).T, []
        ends = max(1, round(ENDS / seconds))
        row = np.array((turned.sum(), (turned[:ends].sum() - turned[-ends:].sum()) / (ends * seconds), beyond.sum()))
        if abs(row).max() < STRAIGHT:  # it tells nothing, and would only make forget the turns before it
            return
        products = self._products = MEMORY * self._products + np.outer(row, row)
        blocks, way = self._known = MEMORY * self._known + (1.0, abs(row[0]))
        self.judged = way >= JUDGED
        if not self.judged:
            return
        inverse = np.linalg.inv(products[:2, :2] + np.diag((0.0, 1.0)))  # no delay, until changes of the rate show it
        self.error, self.delay = found = (inverse @ products[:2, 2]).tolist()
        variance = max(0.0, products[2, 2] - products[2, :2] @ found) / max(1.0, blocks - 2.0)
        scale, delay = SURE * np.sqrt(variance * np.diag(inverse))
        off = abs(self.error)
        self.sure = not self.refused and off + scale < SCALE and abs(self.delay) < DELAY
        self.refused = ""
        if off - scale > SCALE:
            self.refused = (f"measures {round(1 + self.error, 2) + 0.0:.2f} turns for one of the wheels: look for a "
                            "wrong sign, axis, unit, frame (TF) or gyro_scale, slipping wheels, a wrong wheel file")
        elif abs(self.delay) - delay > DELAY:
            self.refused = f"its stamps are {self.delay:+.2f} s late: look at its driver's stamps and at the clocks"
        self.wrong = 0.0 if self.refused or off - scale * 2 / 3 <= OWN else off


class Gyro:
    """Weighs the turns of wheels and gyro by their covariances. period: [s] of a packet; metres_per_edge: n [m].

    noise: [rad/s/sqrt(Hz)]; bias_walk: [rad/s/sqrt(s)]; scale: rate for 1 rad/s, and its standard deviation.
    `compared`: the newest turn beyond the wheels', its variance, [s] of timing; or None. `behind`: packets whose turn
    is the wheels' alone as yet. `learns`: the robot stood. `saturates`: [rad/s], 0: not seen. `turned`: by it in all.
    `without`: share of the last second's packets without its turn.
    """

    def __init__(self, period, metres_per_edge, noise, bias_walk, scale=1.0, scale_noise=0.0):
        self.period, self._noise = period, noise ** 2
        self._scale, self._scale_variance = scale, (scale_noise / scale) ** 2
        self._still = [max(STILL[0], STILL[1] / edge) for edge in metres_per_edge]
        self._paths, self._still_since, self._newest = [0.0] * len(metres_per_edge), 0, None
        self._stamps, self._angles, self._rate, self._apart = [], [], 0.0, 0.0  # samples; [s] between the newest
        self._waiting, self._mark = deque(), None  # packets that it does not know yet; (angle, stamp) of the last one
        self._second, self._least, self._late, self._finite = 0, math.inf, math.inf, True
        self._top, self._hits, self._flat, self._given, self._saved, self._way = 0.0, 0, (0.0, 0.0), 0.0, 0.0, 0.0
        self.bias, self.agreement, self.compared = Bias(noise, bias_walk), Agreement(), None
        self.behind = self.gaps = self.saturates = self.turned = self.without = 0

    @property
    def variances(self):
        """Of bias and scale, which is as uncertain as the wheels show it to be."""
        return self.bias.variance, max(self._scale_variance, self.agreement.wrong ** 2)

    def add(self, stamp, rate, now):
        """Take a sample: `rate` [rad/s] at `stamp`, when this computer's clock read `now` [ns]."""
        self._least = min(self._least, (now - stamp) / SECOND)  # messages may wait: the least late of a second counts
        if not 0 <= now - self._second < SECOND:
            self._second, self._late, self._least = now, self._least, math.inf
        self._finite = abs(rate) < MOST  # not NaN
        if not self._finite or not -AHEAD < min(self._late, self._least) < BEHIND:
            return
        self._apart = (stamp - self._stamps[-1]) / SECOND if self._stamps else 0.0
        if 0 < self._apart <= GAP:
            self._angles.append(self._angles[-1] + (rate + self._rate) / 2 * self._apart)
            self._stamps.append(stamp)
            del self._stamps[:-KEPT], self._angles[:-KEPT]
        else:
            self.gaps += bool(self._stamps)
            self._stamps, self._angles, self._mark = [stamp], [0.0], None
        self._rate = rate
        if abs(rate) > self._top:
            self._top, self._hits, self._flat = abs(rate), 0, (0.0, 0.0)
        self._hits += abs(rate) == self._top

    def fuse(self, counts, step, covariance, readings, stamp, doubted):
        """(step, Covariance, lasting as in `Pose.move`) of the packet of n `counts` that ends at `stamp` [ns].

        step: of the wheels, with its Covariance and that of two `readings`. doubted: whether wheels may slip.
        """
        wheels, agreement, refused, used = (step, covariance, NO_LASTING), self.agreement, self.agreement.refused, []
        packets = self._packets_known_now(counts, step[2], stamp)
        self.learns = any(stands for *_, stands in packets)
        for measured, turned, seconds, stands in packets:
            self.bias.learn(measured / self._scale, seconds, stands)
            turn = measured / self._scale - self.bias.value * seconds
            if self.bias.learnt >= LEARNING and not self._is_saturated(turn, turned):
                used.append((turn, turn - turned, seconds, doubted or not stands))
                agreement.update(turn - turned, turned, seconds)
        turn, beyond, seconds, _ = map(sum, zip((0.0,) * 4, *used))
        timing, self.compared = max(TIMING, abs(agreement.delay)) if agreement.judged else UNKNOWN, None
        stands = stamp - self._still_since >= SETTLING * SECOND
        if (agreement.judged or stands) and not agreement.refused and self.behind * self.period < LATE:
            bias, scale = self.variances  # the same errors in all of a window of 0.5 s
            variance = seconds * (self._noise + 0.5 * (bias + scale * (turn / (seconds or 1.0)) ** 2))
            self.compared = beyond, variance, timing
        self.turned += turn * (not agreement.refused)
        # a robot that stands turns by hand alone
        turn, beyond, seconds, _ = map(sum, zip((0.0,) * 4, *[each for each in used if each[3]]))
        fused = wheels if refused or not seconds else self._weigh(step, covariance, readings, turn, beyond, seconds)
        if agreement.sure:
            self._given = self._saved = self._way = 0.0
        self._way += math.hypot(*step[:2])
        self._given += fused[0][2] - step[2]
        self._saved += covariance.aa - fused[1].aa
        if refused or not agreement.refused:
            return fused
        (x, y, yaw), known, _ = fused  # what it gave since it was surely right is taken back; the way gone by it cannot
        off = (self._way * min(2.0, abs(self._given))) ** 2
        return (x, y, yaw - self._given), known.plus(Covariance(off, 0.0, 0.0, off, 0.0, self._saved)), NO_LASTING

    def words(self, now):
        """What is wrong with it, or nothing."""
        late, bias = min(self._late, self._least), self.bias
        reasons = (
            (late > now / SECOND - 1.0, "its stamps are zero"),
            (not -AHEAD < late < BEHIND,
             f"its stamps are {abs(late):.1f} s {'behind' if late > 0 else 'ahead of'} this computer's clock"),
            (not self._finite, f"its samples are no finite numbers below {MOST:g} rad/s"),
            (self._apart > GAP, f"its samples are {self._apart:.2f} s apart, at most {GAP:g} s are allowed"),
            (self.agreement.refused, self.agreement.refused),
            (bias.unsteady > PATIENCE, "its samples at rest are not steady: a wrong unit, vibrations, a gyro_noise "
                                       "that is too small, or it is turned by hand"),
            (bias.learnt < LEARNING, f"let the robot stand for {SETTLING + LEARNING:g} s: the bias is learnt then"),
            (self.without > 0.5, "its samples come too late, or with gaps"),
            (self.saturates, f"it measures no more than {math.degrees(self.saturates):.0f} deg/s; not used beyond"),
        )
        return next((words for holds, words in reasons if holds), "")

    def _packets_known_now(self, counts, yaw, stamp):
        """[(turn of the gyro, of the wheels, [s], whether the robot stood)] of packets whose end it knows by now."""
        self._paths = [path + count for path, count in zip(self._paths, counts)]
        begins = self._newest is None or not 0 <= stamp - self._newest <= PAUSE * SECOND
        if begins or any(abs(path) > still for path, still in zip(self._paths, self._still)):
            self._still_since, self._paths = stamp, [0.0] * len(self._paths)
        if begins or len(self._waiting) * self.period > WAIT:
            self._waiting.clear()
            self._mark = None
        self._newest, known = stamp, []
        self._waiting.append((stamp, yaw, stamp - self._still_since >= SETTLING * SECOND))
        while self._stamps and self._waiting and self._waiting[0][0] <= self._stamps[-1]:
            end, yaw, stands = self._waiting.popleft()
            before, self._mark = self._mark, self._angle_at(end)
            if None not in (before, self._mark):
                known.append((self._mark[0] - before[0], yaw, (end - before[1]) / SECOND, stands))
        self.behind = len(self._waiting)
        missing = self._mark is None or self.behind * self.period > LATE
        self.without += (missing - self.without) * min(1.0, self.period)
        return known

    def _angle_at(self, stamp):
        """(turned until then, stamp); None before the first sample."""
        index = bisect_left(self._stamps, stamp)
        if not index:
            return (self._angles[0], stamp) if self._stamps[0] == stamp else None
        (first, last), (low, high) = self._stamps[index - 1:index + 1], self._angles[index - 1:index + 1]
        return low + (high - low) * ((stamp - first) / (last - first)), stamp

    def _is_saturated(self, turn, turned):
        """Whether the gyro shows the largest rate it may have: until FAST [rad] show that the wheels turn no more."""
        if self._hits < FLAT or abs(self._rate) != self._top or self._top < FAST:
            return False
        self._flat = flat, wheels = self._flat[0] + abs(turn), self._flat[1] + abs(turned)
        self.saturates = self._top if flat > FAST and wheels > BEYOND * flat else 0.0
        return flat <= FAST or self.saturates > 0.0

    def _weigh(self, step, covariance, readings, turn, beyond, seconds):
        period, (bias, scale) = self.period, self.variances
        lasts = bias + scale * (turn / seconds) ** 2
        whole = covariance.aa + readings.aa + period * self._noise + period ** 2 * lasts
        x, y, yaw = gain = [(own + read) / whole for own, read in (
            (covariance.xa, readings.xa), (covariance.ya, readings.ya), (covariance.aa, readings.aa))]
        if seconds < 2 * period:  # what comes late is made good, but no covariance of the past
            left = covariance.propagated((1.0, 0.0, -x), (0.0, 1.0, -y), 1.0 - yaw)
            covariance = left.plus(Covariance.of_vector(gain).times(self._noise * seconds))
        lasting = [seconds * part for part in gain], [turn * part for part in gain]
        return tuple(own + part * beyond for own, part in zip(step, gain)), covariance, lasting
