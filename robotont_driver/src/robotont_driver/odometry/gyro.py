"""Fusion of a gyro with the wheels: its turn in each period, its bias, and the disagreement of both.

The gyro's rate is `scale * rate + bias + white noise`, the bias walks slowly. It is learnt while the wheels stand, and
only then: an error of the wheel parameters must not become one of the gyro. Turns are counterclockwise, in [rad].
"""

import math
from collections import deque
from operator import add
from typing import NamedTuple, Tuple

from robotont_driver.odometry.covariance import Covariance
from robotont_driver.odometry.slip import TOLERANCE, WINDOW, chi_square_limit
from robotont_driver.odometry.wheel_noise import PATH_VARIANCE

SECOND = 1_000_000_000  # [ns]

GAP = SECOND // 10      # [ns] between two samples; across a longer one the turn is unknown
HOLD = SECOND * 3 // 10  # [ns] by which samples of a period may be late and count as its own; shorter than SETTLING
KEPT = 4096             # samples: more than four seconds of any gyro, for packets that are late

LEAP = 5.0              # [periods] more than this between the stamps of two packets is a leap; ...
CROWDED = 0.5           # ... behind it, packets that waited are less than this apart

FIRST_BIAS = 0.02       # [rad/s] standard deviation of the bias of an unknown gyro
SETTLING = 0.5          # [s] without counts until the robot counts as standing
LEARNING = 1.0          # [s] of standing until the bias is good enough to use the gyro
OUTLIER = 5.0           # [standard deviations] a larger turn while the wheels stand is not bias, ...
RELEARN = 3.0           # [s] ... unless it goes on for so long and ...
STEADY = 10.0           # [standard deviations] ... its rates differ by no more than this
TIMING = 0.005          # [s] by which the times of gyro and wheels may differ
SLIPPING = 1.5          # a wheel slips by at most this part of its path
BRAKING = 0.8           # a wheel brakes when the newer half of its path is shorter than this part of the older


class TurnIntegral:
    """Integral of a gyro's rates from one stamp to the next.

    The wheels replace samples that have not arrived yet, however late they are; once they have, their turn is made
    good. So a machine that is late with them loses nothing.
    """

    def __init__(self):
        self._samples = deque(maxlen=KEPT)  # (stamp [ns], turn [rad] since the first one, rate [rad/s])
        self._wheels = deque(maxlen=KEPT)   # (stamp [ns], turn [rad] of the wheels up to then)
        self._reached = None                # turn at the end of the last stretch
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
                self._reached = None
        self._samples.append((stamp, turn, rate))

    def forget(self):
        """The stamps so far say nothing of those to come."""
        self._wheels.clear()
        self._reached = None

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
        if before is None or self._reached is None or self._silent:
            return None, late
        return self._reached - before, late

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
        self._walk = bias_drift ** 2 * period
        self.bias = 0.0                    # [rad/s]
        self.bias_variance = FIRST_BIAS ** 2
        self.learnt = 0                    # periods of standing
        self.learnt_part = 1.0             # of the bias' error that remained after the newest period
        self._still = 0                    # periods without motion of the wheels
        self._path = None                  # [edges] of each wheel while standing
        self._odd = []                     # [rad] turns of a standing robot that do not fit the bias

    @property
    def ready(self):
        """Whether the bias has been estimated."""
        return self.learnt * self.period >= LEARNING

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

    def turn(self, measured):
        """[rad] that the robot turned in a period in which the gyro `measured` so much; learns while it stands."""
        self.bias_variance += self._walk
        turn = measured / self.scale - self.bias * self.period
        self.learnt_part = 1.0
        if self.stands:
            self._learn(turn)
        else:
            self._odd = []
        return turn

    def _learn(self, turn):
        period = self.period
        variance = self.bias_variance * period ** 2 + self.noise
        if turn ** 2 > OUTLIER ** 2 * variance:
            self._odd.append(turn)
            if len(self._odd) * period >= RELEARN:
                self._relearn()
            return
        self._odd = []
        gain = self.bias_variance * period / variance
        self.bias += gain * turn
        self.learnt_part = 1 - gain * period
        self.bias_variance *= self.learnt_part
        self.learnt += 1

    def _relearn(self):
        """A steady turn for RELEARN while the wheels stand means that the bias has changed."""
        if max(self._odd) - min(self._odd) < STEADY * math.sqrt(self.noise):
            self.bias += sum(self._odd) / len(self._odd) / self.period
            self.bias_variance = FIRST_BIAS ** 2
            self.learnt = 0
            self.learnt_part = 0.0  # this is another bias
        self._odd = []


class TurnWatch:
    """Detects when the turn of the wheels is not that of the gyro: a wheel slips, or the robot is moved from outside.

    gyro: a `Gyro`. false_alarms: per hour at most. For n >= 3 wheels.
    """

    def __init__(self, gyro, false_alarms):
        self._gyro = gyro
        self._limit = chi_square_limit(min(0.5, false_alarms * gyro.period / 3600.0), 1)
        self._hold = 0      # packets until the alarm ends
        self.suspects = ()  # wheels of which one slips; all of them: the robot is pushed, lifted or carried
        self.alarms = 0

    def use_wheels(self, turn_per_edge):
        """From now on one edge of each wheel turns the robot by `turn_per_edge`, n [rad]."""
        self._per_edge = turn_per_edge
        self._edges = PATH_VARIANCE * sum(turn ** 2 for turn in turn_per_edge)  # [rad^2] at both ends
        self.forget()

    def forget(self):
        """Begin a new window, after a gap in the gyro's samples."""
        self._window = deque(maxlen=WINDOW)
        self._difference = self._variance = self._turn = 0.0
        self._path = [0] * len(self._per_edge)
        if not self._hold:
            self.suspects = ()

    def update(self, counts, turn, difference, variance):
        """Take one packet; whether there is an alarm.

        counts: n. turn: [rad] by the gyro; difference: [rad] by which it exceeds that of the wheels; variance: [rad^2]
        of the wheels' turn, but for the ends of the path.
        """
        if len(self._window) == WINDOW:
            old_counts, old_turn, old_difference, old_variance = self._window[0]
            self._difference -= old_difference
            self._variance -= old_variance
            self._turn -= old_turn
            self._path = [path - count for path, count in zip(self._path, old_counts)]
        self._window.append((counts, turn, difference, variance))
        self._difference += difference
        self._variance += variance
        self._turn += turn
        self._path = [path + count for path, count in zip(self._path, counts)]
        if self._difference ** 2 > self._limit * self._expected_variance():
            self.alarms += not self.suspects
            self.suspects = self._suspected()
            self._hold = WINDOW
        elif self._hold:
            self._hold -= 1
            if not self._hold:
                self.suspects = ()
        return bool(self.suspects)

    def _expected_variance(self):
        """[rad^2] of the difference over the window, of wheels that roll."""
        gyro, lasted = self._gyro, len(self._window) * self._gyro.period
        faster = (self._window[-1][1] - self._window[0][1]) / gyro.period  # [rad/s]
        return (
            self._edges + self._variance + len(self._window) * gyro.noise
            + sum((TOLERANCE * turn * path) ** 2 for turn, path in zip(self._per_edge, self._path))
            + gyro.bias_variance * lasted ** 2 + gyro.scale_variance * self._turn ** 2
            + (TIMING * faster) ** 2)

    def _suspected(self):
        """The wheels that can have slipped alone: that turn too fast, or, when they brake, too slowly."""
        suspects = []
        half = len(self._window) // 2
        for wheel, (turn, path) in enumerate(zip(self._per_edge, self._path)):
            slip = -self._difference / turn if turn else math.inf  # [edges] more than the wheel rolled
            older = sum(packet[0][wheel] for packet in list(self._window)[:half])
            brakes = abs(path - older) < BRAKING * abs(older)
            longest = SLIPPING * max(abs(path), 2 * abs(older) if brakes else 0)
            if abs(slip) <= longest and (slip * older < 0 if brakes else slip * path > 0):
                suspects.append(wheel)
        return tuple(suspects) or tuple(range(len(self._per_edge)))


Rows = Tuple[Tuple[float, ...], ...]  # of a matrix, in plain numbers, as in covariance.py
UNIT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
UNCHANGED = (1.0, 1.0)  # factors on the errors of bias and scale of a period without learning


class Fused(NamedTuple):
    """A step of wheels and gyro together."""

    step: Tuple[float, float, float]  # (dx [m], dy [m], dyaw [rad])
    covariance: Covariance  # of the errors that are independent from period to period
    wheels: Rows            # 3 x 3, sensitivity of the step to an error of the wheels' step
    # (how the step depends on the errors of bias [rad/s] and scale [1], 3 x 2; their variances, 2), which are the same
    # in the periods to come, so that their covariance with the pose has to be kept (S. F. Schmidt, 1966)
    lasting: Tuple[Rows, Tuple[float, float]]


class GyroFusion:
    """Weighs the turns of wheels and gyro by their covariances, and detects disagreement.

    gyro: a `Gyro`. false_alarms: of `TurnWatch`, per hour; 0: no watch. learnt: (2) factors by which the newest
    period reduced the errors of bias and scale.
    """

    def __init__(self, gyro, false_alarms):
        self.gyro = gyro
        self.integral = TurnIntegral()
        self.watch = TurnWatch(gyro, false_alarms) if false_alarms else None
        self.learnt = UNCHANGED
        self._stamp = None    # [ns] of the newest packet
        self._leapt = False   # whether the stamps have leapt, and packets still come at once
        self.used = 0     # packets in which the gyro counted
        self.missing = 0  # packets without its turn
        self.made_good = 0.0  # [rad] that samples which came too late have corrected, to and fro
        self.turned = 0.0  # [rad] by the gyro since it counts, to and fro, for its calibration

    def add(self, stamp, rates, up):
        """Take rates [rad/s], 3, around axes in which `up` (3) points up, at `stamp` [ns]; whether they are finite."""
        rate = sum(a * b for a, b in zip(rates, up))
        if not math.isfinite(rate):
            return False
        self.integral.add(stamp, rate)
        return True

    def use_wheels(self, by_edge):
        """From now on one edge of each wheel moves the robot by `by_edge`, 3 x n ([m], [m], [rad])."""
        self._by_edge = by_edge
        self._readings = (PATH_VARIANCE * by_edge @ by_edge[2]).tolist()  # (3,) of a step with its turn
        if self.watch:
            self.watch.use_wheels(by_edge[2].tolist())

    def fuse(self, counts, step, covariance, stamp):
        """`Fused` step of the period that ended at `stamp` [ns]; None without a turn of the gyro.

        counts: n. step: (dx, dy, dyaw) of the wheels, with its Covariance.
        """
        gyro = self.gyro
        gyro.watch_wheels(counts)
        self.learnt = UNCHANGED
        self._watch_stamps(stamp)
        measured, late = self.integral.turned(stamp, gyro.scale * (step[2] + gyro.bias * gyro.period))
        fused = self._fuse_measured(counts, step, covariance, measured)
        if not late or not gyro.ready:
            return fused
        self.made_good += abs(late / gyro.scale)
        if fused is None:
            fused = Fused(step, covariance, UNIT, (((0.0, 0.0),) * 3, (0.0, 0.0)))
        dx, dy, dyaw = fused.step
        return fused._replace(step=(dx, dy, dyaw + late / gyro.scale))

    def _watch_stamps(self, stamp):
        """After a leap of the stamps the packets that waited come at once; until they pass, the wheels count alone."""
        periods = 1.0 if self._stamp is None else (stamp - self._stamp) / SECOND / self.gyro.period
        self._stamp = stamp
        self._leapt = not 0.0 < periods < LEAP or (self._leapt and periods < CROWDED)
        if self._leapt:
            self.integral.forget()

    def _fuse_measured(self, counts, step, covariance, measured):
        """`Fused` step with the turn that the gyro measured in this period; None without."""
        gyro = self.gyro
        if measured is None:
            self.missing += 1
            if self.watch:
                self.watch.forget()
            return None
        turn = gyro.turn(measured)
        self.learnt = (gyro.learnt_part, 1.0)
        if not gyro.ready:
            return None
        self.used += 1
        self.turned += turn
        difference = turn - step[2]
        if self.watch and self.watch.update(counts, turn, difference, covariance.aa):
            covariance = self._doubt(covariance, difference)
        elif gyro.stands:
            return None  # an encoder that flickers between two edges is no reason to add up the gyro's noise
        return self._weigh(step, covariance, turn, difference)

    def _doubt(self, covariance, difference):
        """The covariance of the wheels' step when each of the suspects may have made the `difference` [rad]."""
        columns = self._by_edge[:, list(self.watch.suspects)]
        columns = columns[:, columns[2] != 0.0]
        slips = columns * (difference / columns[2])
        return covariance.plus(Covariance.of_matrix(slips @ slips.T))

    def _weigh(self, step, covariance, turn, difference):
        gyro = self.gyro
        period = gyro.period
        x, y, yaw = map(add, (covariance.xa, covariance.ya, covariance.aa), self._readings)
        whole = yaw + gyro.noise + gyro.bias_variance * period ** 2 + gyro.scale_variance * turn ** 2
        gain = x, y, yaw = x / whole, y / whole, yaw / whole
        kept = (1.0, 0.0, -x), (0.0, 1.0, -y), (0.0, 0.0, 1.0 - yaw)
        dx, dy, dyaw = step
        return Fused(
            (dx + x * difference, dy + y * difference, dyaw + yaw * difference),
            covariance.propagated(kept).plus(Covariance.of_vector(gain).times(gyro.noise)),
            kept, (tuple([(part * period, part * turn) for part in gain]), (gyro.bias_variance, gyro.scale_variance)))


def up_in(x, y, z, w):
    """Upward direction (3,) in the axes of a device with the orientation x, y, z, w (unit quaternion) on the robot."""
    return 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
