"""Fusion of a gyro with the wheels' odometry. Turns are counterclockwise, in [rad]."""

from operator import add
from typing import NamedTuple, Tuple

from robotont_driver.odometry.covariance import Covariance, Rows
from robotont_driver.odometry.gyro_agreement import TurnAgreement
from robotont_driver.odometry.gyro_samples import TurnIntegral
from robotont_driver.odometry.slip_by_gyro import TurnWatch
from robotont_driver.odometry.wheel_noise import PATH_VARIANCE
from robotont_driver.timing.odometry_stamps import SECOND

LEAP = 5.0              # [periods] more than this between the stamps of two packets is a leap; ...
CROWDED = 0.5           # ... behind it, packets that waited are less than this apart
UNIT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
NO_LASTING = ((0.0, 0.0),) * 3, (0.0, 0.0)


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

    gyro: a `Gyro`. false_alarms: of `TurnWatch`, per hour; 0: no watch. Its `integral` takes the samples.
    """

    def __init__(self, gyro, false_alarms):
        self.gyro = gyro
        self.integral = TurnIntegral()
        self.agreement = TurnAgreement(gyro.period)
        self.watch = TurnWatch(gyro, false_alarms) if false_alarms else None
        self._stamp = None    # [ns] of the newest packet
        self._leapt = False   # whether the stamps have leapt, and packets still come at once
        self.missing = 0  # packets without its turn
        self.turned = 0.0  # [rad] by the gyro since it counts, to and fro, for its calibration

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
        seconds = self._watch_stamps(stamp)
        measured, late = self.integral.turned(stamp, gyro.scale * (step[2] + gyro.bias * seconds))
        gyro.learn(*self.integral.sampled)
        turn = None if measured is None else gyro.turn(measured, seconds)
        fused = self._fuse_turn(counts, step, covariance, turn)
        if not late or not gyro.ready or self.agreement.refused:
            return fused
        if fused is None:
            fused = Fused(step, covariance, UNIT, NO_LASTING)
        dx, dy, dyaw = fused.step
        return fused._replace(step=(dx, dy, dyaw + late / gyro.scale))

    def _watch_stamps(self, stamp):
        """[s] since the packet before. After a leap those that waited come at once; till then wheels count alone."""
        periods = 1.0 if self._stamp is None else (stamp - self._stamp) / SECOND / self.gyro.period
        self.gyro.age(periods)
        self._stamp = stamp
        self._leapt = not 0.0 < periods < LEAP or (self._leapt and periods < CROWDED)
        if self._leapt:
            self.integral.forget()
        return periods * self.gyro.period

    def _fuse_turn(self, counts, step, covariance, turn):
        """`Fused` step with the `turn` by the gyro in this period; None without."""
        gyro = self.gyro
        if turn is None:
            self.missing += 1
            if self.watch:
                self.watch.forget()
            return None
        if not gyro.ready:
            return None
        difference = turn - step[2]
        if self.agreement.refused:
            self.agreement.update(turn, step[2], 0.0)
            if self.watch:
                self.watch.rest()
            return None
        self.turned += turn
        if self.watch and self.watch.update(counts, turn, difference, covariance.aa):
            covariance = self._doubt(covariance, difference)
        elif gyro.stands:
            return None  # an encoder that flickers between two edges is no reason to add up the gyro's noise
        fused = self._weigh(step, covariance, turn, difference)
        wrong = self.agreement.update(turn, step[2], fused.step[2] - step[2])
        return Fused((*step[:2], step[2] - wrong), covariance, UNIT, NO_LASTING) if wrong else fused

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
