"""Odometry of omni wheels on SE(2): exact steps, propagated covariance.

A pose is (x [m], y [m], yaw [rad]) of base_link in the odometry frame. A step is the integral of a constant
twist (v_x t [m], v_y t [m], omega t [rad]) in base_link. Plain arithmetic: an update takes half of numpy's time.
"""

import math
from operator import add, mul
from typing import NamedTuple

import numpy as np

from robotont_driver.kinematics.kinematics import Kinematics

# Variance of each coordinate before the first step: the start is exact, but filters need a positive variance.
START_VARIANCE = 1e-9
LONGEST_HOLD = 0.5  # [s] for which a measured speed stays valid without a newer packet
# [edges^2] Variance of the quantisation error of one encoder reading: uniform over one edge. Counts are differences
# of readings, so the errors cancel from packet to packet: of a path, however long, two readings' errors remain.
READING_VARIANCE = 1.0 / 12.0
PATH_VARIANCE = 2 * READING_VARIANCE


class Covariance(NamedTuple):
    """Of (x [m], y [m], yaw [rad]): the upper triangle, row by row, of a symmetric 3 x 3 matrix; a = yaw."""

    xx: float
    xy: float
    xa: float
    yy: float
    ya: float
    aa: float

    @classmethod
    def of_vector(cls, vector):
        """Of an error that is always along a vector v (3): v v'."""
        x, y, a = vector
        return cls(x * x, x * y, x * a, y * y, y * a, a * a)

    def plus(self, other):
        """Of the sum of two independent errors."""
        return Covariance(*map(add, self, other))

    def times(self, factor):
        """Each variance and covariance times a factor."""
        return Covariance(*map(mul, self, (factor,) * 6))

    def carried(self, x, y):
        """Of a pose that has moved on by x, y [m], F P F': an error of its heading has become one of its place."""
        xx, xy, xa, yy, ya, aa = self
        return Covariance(
            xx - 2 * y * xa + y * y * aa, xy + x * xa - y * (ya + x * aa), xa - y * aa,
            yy + 2 * x * ya + x * x * aa, ya + x * aa, aa)

    def propagated(self, x_row, y_row, turn=1.0):
        """J P J' of a 3 x 3 Jacobian J whose last row is (0, 0, turn): yaw depends on yaw alone."""
        xx, xy, xa, yy, ya, aa = self
        (a, b, c), (d, e, f) = x_row, y_row
        x1, y1, a1 = a * xx + b * xy + c * xa, a * xy + b * yy + c * ya, a * xa + b * ya + c * aa  # rows of J P
        a2 = d * xa + e * ya + f * aa
        return Covariance(
            x1 * a + y1 * b + a1 * c, x1 * d + y1 * e + a1 * f, a1 * turn,
            (d * xx + e * xy + f * xa) * d + (d * xy + e * yy + f * ya) * e + a2 * f, a2 * turn, aa * turn * turn)


NONE = Covariance(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
NO_LASTING = ((0.0, 0.0, 0.0),) * 2


class Pose:
    """A pose and its Covariance, moved step by step. start_covariance: at the origin, added to START_VARIANCE.

    Two errors are the same in many steps, those of a gyro's bias and scale: how the pose depends on them is carried
    along (S. F. Schmidt's consider states, 1966). `variances`: theirs.
    """

    def __init__(self, start_covariance=NONE):
        self._start_covariance = Covariance(START_VARIANCE, 0, 0, START_VARIANCE, 0, START_VARIANCE).plus(
            start_covariance)
        self.variances = (0.0, 0.0)
        self.reset()

    def reset(self):
        """Back to the origin."""
        self.resume((0.0, 0.0, 0.0), self._start_covariance)

    def resume(self, pose, covariance):
        """Go on from a pose (3 floats) with its Covariance."""
        self.x, self.y, self.yaw = pose
        self._steps = covariance      # by errors that differ from step to step
        self._lasting = NO_LASTING    # change of the pose for an error of 1, of the bias and of the scale
        self._bent = (0.0, 0.0)       # [m] mean shift by the square of the heading's error

    @property
    def covariance(self):
        """An error d of the heading ends a way w by d^2 w / 2 short; the mean of d^4 is 3 times the square of d^2's."""
        xx, xy, xa, yy, ya, aa = self._steps
        x, y = self._bent
        total = Covariance(xx + 3 * x * x, xy + 3 * x * y, xa, yy + 3 * y * y, ya, aa)
        if self._lasting is not NO_LASTING:
            for change, variance in zip(self._lasting, self.variances):
                total = total.plus(Covariance.of_vector(change).times(variance))
        return total

    def move(self, step, step_covariance=NONE, lasting=NO_LASTING):
        """Move by a step (3 floats) along an arc: F P F' + G Q G', the Jacobians by the pose and by the step.

        lasting: change of the step for an error of 1, of bias and scale (2 x 3).
        """
        dx, dy, dyaw = step
        half = dyaw / 2
        chord = math.sin(half) / half if half else 1.0
        slope = (math.cos(half) - chord) / half / 2 if abs(half) > 1e-4 else -half / 6  # derivative of chord by dyaw
        cos, sin = math.cos(self.yaw + half), math.sin(self.yaw + half)
        straight_x, straight_y = cos * dx - sin * dy, sin * dx + cos * dy
        moved_x, moved_y = chord * straight_x, chord * straight_y
        by_step = ((chord * cos, -chord * sin, slope * straight_x - moved_y / 2),
                   (chord * sin, chord * cos, slope * straight_y + moved_x / 2))
        self.x, self.y, self.yaw = self.x + moved_x, self.y + moved_y, math.remainder(self.yaw + dyaw, 2 * math.pi)
        variance = self._steps.aa
        if lasting is not NO_LASTING or self._lasting is not NO_LASTING:
            variance += sum(change[2] ** 2 * each for change, each in zip(self._lasting, self.variances))
            self._lasting = [
                (x - moved_y * yaw + sum(map(mul, by_step[0], own)), y + moved_x * yaw + sum(map(mul, by_step[1], own)),
                 yaw + own[2]) for (x, y, yaw), own in zip(self._lasting, lasting)]
        self._bent = self._bent[0] + variance / 2 * moved_x, self._bent[1] + variance / 2 * moved_y
        self._steps = self._steps.carried(moved_x, moved_y).plus(step_covariance.propagated(*by_step))

    def settle(self):
        """The errors that lasted so far say nothing of those to come: the gyro's bias is learnt anew."""
        for change, variance in zip(self._lasting, self.variances):
            self._steps = self._steps.plus(Covariance.of_vector(change).times(variance))
        self._lasting = NO_LASTING


class WheelOdometry:
    """Packets in; pose, twist, their covariances and the wheels' angles out.

    period: time [s] that one packet stands for. 0: packets contain speeds, each valid until the next one.
    wheel_noise: as in `variance_per_edge`. gyro: a `Gyro`, or None.
    """

    def __init__(self, kinematics, period, wheel_noise, gyro=None):
        wheels = kinematics.wheels
        self.kinematics, self.period = kinematics, period
        self._variance_per_edge = variance_per_edge(wheel_noise, wheels.metres_per_edge)
        self._gyro, self._pending = gyro, NONE
        self._rate = 1.0 / period if period else wheels.pid_frequency  # [Hz] packets per second
        self.exclude(())
        self.pose = Pose(self._end_covariance)
        self.twist = (0.0, 0.0, 0.0)               # (v_x, v_y, omega)
        self.twist_covariance = NONE
        self.wheel_angles = [0.0] * wheels.amount  # [rad] since the start
        self.wheel_rates = [0.0] * wheels.amount   # [rad/s]
        self._radians_per_edge = 2 * math.pi / wheels.edges_per_turn
        self._held = (0.0,) * wheels.amount

    def exclude(self, wheels):
        """From now on no packet moves the robot by the counts of these `wheels` (indices)."""
        self.kinematics = Kinematics(self.kinematics.wheels, self.kinematics.solver, wheels)
        by_edge = self.kinematics.inverse * self.kinematics.wheels.metres_per_edge  # 3 x n: step by one edge of each
        self._rows = by_edge.tolist()
        # 6 x n: a step's covariance by the variances [edges^2] of its wheels
        self._columns = list(zip(*[Covariance.of_vector(column.tolist()) for column in by_edge.T]))
        each = Covariance(*map(sum, self._columns))  # for 1 edge^2 in every wheel
        self._end_covariance, self._path_covariance = each.times(READING_VARIANCE), each.times(PATH_VARIANCE)

    @property
    def pose_covariance(self):
        """Covariance of the pose: accumulated on the way, plus the quantisation of the newest reading."""
        cos, sin = math.cos(self.pose.yaw), math.sin(self.pose.yaw)
        end = self._end_covariance.plus(self._pending) if self._gyro else self._end_covariance
        return self.pose.covariance.plus(end.propagated((cos, -sin, 0.0), (sin, cos, 0.0)))

    def update(self, counts, elapsed, stamp=0, slips=None, periods=1.0):
        """Take one packet, n counts, or speeds [edges per PID period] `elapsed` [s] after the one before.

        stamp: [ns] on a gyro's clock. slips: n variances [edges^2] of wheels that may slip.
        periods: that the packet stands for.
        """
        step, covariance = self._step(counts, slips)
        lasting = NO_LASTING
        if self._gyro:
            wheels = covariance
            step, covariance, lasting = self._gyro.fuse(
                counts, step, covariance, self._path_covariance, stamp, slips is not None)
            if self._gyro.learns:
                self.pose.settle()
            self.pose.variances = self._gyro.variances
            self._pending = wheels.times(self._gyro.behind)  # what the gyro has not told yet
        if self.period:
            self._move(counts, step, covariance, lasting)
        else:
            share = min(max(elapsed, 0.0), LONGEST_HOLD) * self._rate
            held = [edges * share for edges in self._held]
            self._move(held, *self._step(held))
            self._held = counts
        rate = self._rate / periods
        self.twist = [length * rate for length in step]
        self.twist_covariance = covariance.plus(self._path_covariance).times(rate ** 2)
        factor = self._radians_per_edge * rate
        self.wheel_rates = [edges * factor for edges in counts]

    def _step(self, edges, slips=None):
        """(8)-(11): step (3 floats) by n `edges`, and its Covariance by noise that grows with each wheel's path."""
        step = [sum(map(mul, row, edges)) for row in self._rows]
        variances = list(map(mul, map(abs, edges), self._variance_per_edge))
        if slips:
            variances = list(map(add, variances, slips))
        return step, Covariance(*[sum(map(mul, column, variances)) for column in self._columns])

    def _move(self, edges, step, covariance, lasting=NO_LASTING):
        if any(edges) or any(step):  # a robot at rest gains no uncertainty
            self.pose.move(step, covariance, lasting)
            factor = self._radians_per_edge
            self.wheel_angles = [angle + path * factor for angle, path in zip(self.wheel_angles, edges)]


def variance_per_edge(wheel_noise, metres_per_edge):
    """[edges^2 per edge], n: by how much each edge adds to the variance of a wheel's path. metres_per_edge: n [m].

    wheel_noise: standard deviation of a wheel's path after 1 m, growing with the root of the path [m per root m].
    """
    return (wheel_noise ** 2 / np.asarray(metres_per_edge)).tolist()
