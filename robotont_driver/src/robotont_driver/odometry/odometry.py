"""Odometry of omni wheels on SE(2): exact steps, propagated covariance, nothing but numbers.

A pose is (x [m], y [m], yaw [rad]) of base_link in the odometry frame. A step is the integral of a constant
twist (v_x t [m], v_y t [m], omega t [rad]) in base_link.
"""

import math
from operator import mul

from robotont_driver.kinematics import se2
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.odometry.covariance import NONE, Covariance, WeightedSum
from robotont_driver.odometry.wheel_noise import PATH_VARIANCE, READING_VARIANCE, variance_per_edge

# Variance of each coordinate before the first step: the start is exact, but filters need a positive variance.
START_VARIANCE = 1e-9
START_COVARIANCE = Covariance(START_VARIANCE, 0.0, 0.0, START_VARIANCE, 0.0, START_VARIANCE)
# Longest time [s] for which a measured speed stays valid: without newer packets the board itself has stopped.
LONGEST_HOLD = 0.5
NOTHING = ((0.0, 0.0),) * 3


class Pose:
    """A pose and its Covariance, moved step by step. start_covariance: at the origin, added to START_VARIANCE."""

    def __init__(self, start_covariance=NONE):
        self._start_covariance = START_COVARIANCE.plus(start_covariance)
        self.reset()

    def reset(self):
        """Back to the origin."""
        self._lasting = None  # 3 rows of 2: covariance with errors that last, of a gyro's bias and scale
        self.x = self.y = self.yaw = 0.0
        self.covariance = self._start_covariance

    def resume(self, pose, covariance):
        """Go on from a pose (3 floats) with its Covariance."""
        self.reset()
        self.x, self.y, self.yaw = pose
        self.covariance = covariance

    def move(self, step, step_covariance=NONE, lasting=None):
        """Move by a step (3 floats) with its Covariance.

        Covariance: F P F' + G Q G', with the Jacobians F by the pose and G by the step, which are independent.
        `lasting`: where the step shares errors with those before and after it: its sensitivity to them (3 x 2), and
        their variances (2).
        """
        dx, dy, dyaw = step
        half = dyaw / 2
        chord = se2.sinc(half)
        slope = se2.sinc_derivative(half) / 2
        cos, sin = math.cos(self.yaw + half), math.sin(self.yaw + half)
        straight_x, straight_y = cos * dx - sin * dy, sin * dx + cos * dy
        moved_x, moved_y = chord * straight_x, chord * straight_y  # as se2.arc has it
        by_step = (
            (chord * cos, -chord * sin, slope * straight_x - moved_y / 2),
            (chord * sin, chord * cos, slope * straight_y + moved_x / 2),
            (0.0, 0.0, 1.0),
        )
        self.x, self.y, self.yaw = self.x + moved_x, self.y + moved_y, se2.wrap(self.yaw + dyaw)
        self.covariance = self.covariance.carried(moved_x, moved_y).plus(step_covariance.propagated(by_step))
        if lasting is not None or self._lasting is not None:
            self._carry((moved_x, moved_y), by_step, lasting)

    def _carry(self, moved, by_step, lasting):
        """Propagate the covariance with the lasting errors, C <- F C + G L B, and add its part to P."""
        by_pose = (1.0, 0.0, -moved[1]), (0.0, 1.0, moved[0]), (0.0, 0.0, 1.0)
        before = _product(by_pose, self._lasting or NOTHING)
        self._lasting = before
        if lasting is not None:
            dependence = _product(by_step, lasting[0])
            bias, scale = lasting[1]
            self._lasting = [
                (b + bias * d, s + scale * e) for (b, s), (d, e) in zip(before, dependence)]
            self.covariance = self.covariance.plus(_shared(before, dependence, self._lasting))

    def learn_bias(self, part):
        """Only that part of the bias' error is left."""
        if self._lasting is not None:
            self._lasting = [(bias * part, scale) for bias, scale in self._lasting]


class WheelOdometry:
    """Counts of the wheels in; pose, twist, their covariances and the wheels' angles out.

    period: time [s] that one packet stands for. 0: packets contain speeds, each valid until the next one.
    wheel_noise: standard deviation [m] of a wheel's path after 1 m; its variance grows with the path.
    gyro: a GyroFusion, or None.
    """

    def __init__(self, kinematics, period, wheel_noise, gyro=None):
        wheels = kinematics.wheels
        self.kinematics = kinematics
        self.period = period
        self._variance_per_edge = variance_per_edge(wheel_noise, wheels.metres_per_edge)
        self._gyro = gyro
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
        by_wheel = [Covariance.of_vector(column.tolist()) for column in by_edge.T]  # of a step, for 1 edge^2 of each
        self._edge_covariance = WeightedSum(by_wheel)([1.0] * len(by_wheel))       # for 1 edge^2 in every wheel
        self._end_covariance = self._edge_covariance.times(READING_VARIANCE)
        self._path_covariance = WeightedSum([                                      # by n paths [edges]
            covariance.times(variance) for covariance, variance in zip(by_wheel, self._variance_per_edge.tolist())])
        if self._gyro:
            self._gyro.use_wheels(by_edge)

    @property
    def pose_covariance(self):
        """Covariance of the pose: accumulated on the way, plus the quantisation of the newest reading."""
        cos, sin = math.cos(self.pose.yaw), math.sin(self.pose.yaw)
        turn = (cos, -sin, 0.0), (sin, cos, 0.0), (0.0, 0.0, 1.0)
        return self.pose.covariance.plus(self._end_covariance.propagated(turn))

    def update(self, counts, elapsed, stamp=0):
        """Take one packet, n counts [edges per PID period], `elapsed` [s] after the one before.

        `elapsed` matters only when the period is 0, `stamp` [ns] only with a gyro, on whose clock it is.
        """
        step, covariance = self._step(counts)
        edge_covariance = self._edge_covariance
        if self._gyro:
            step, covariance, edge_covariance = self._move_with_gyro(counts, step, covariance, stamp)
        elif self.period:
            self._move(counts, step, covariance)
        else:
            share = min(max(elapsed, 0.0), LONGEST_HOLD) * self._rate
            held = [edges * share for edges in self._held]
            self._move(held, *self._step(held))
            self._held = counts
        self.twist = [length * self._rate for length in step]
        self.twist_covariance = Covariance(*[
            (own + PATH_VARIANCE * edge) * self._rate ** 2 for own, edge in zip(covariance, edge_covariance)])
        factor = self._radians_per_edge * self._rate
        self.wheel_rates = [edges * factor for edges in counts]

    def _move_with_gyro(self, counts, step, covariance, stamp):
        """Move by wheels and gyro; the step, its Covariance, and its Covariance for 1 edge^2 in every wheel."""
        fused = self._gyro.fuse(counts, step, covariance, stamp)
        if self._gyro.gyro.learnt_part != 1.0:
            self.pose.learn_bias(self._gyro.gyro.learnt_part)
        if fused is None:
            self._move(counts, step, covariance)
            return step, covariance, self._edge_covariance
        self._move(counts, fused.step, fused.covariance, fused.lasting)
        return fused.step, fused.covariance, self._edge_covariance.propagated(fused.wheels)

    def _step(self, edges):
        """Step (3 floats) by n encoder `edges`, and its Covariance by noise that grows with each wheel's path.

        (8)-(11), with paths for speeds.
        """
        step = [sum(map(mul, row, edges)) for row in self._rows]
        return step, self._path_covariance([abs(path) for path in edges])

    def _move(self, edges, step, covariance, lasting=None):
        if any(edges) or any(step):  # a robot at rest gains no uncertainty
            self.pose.move(step, covariance, lasting)
            factor = self._radians_per_edge
            self.wheel_angles = [angle + path * factor for angle, path in zip(self.wheel_angles, edges)]


def _product(matrix, rows):
    """3 x 3 times 3 x 2, by rows."""
    (bx, sx), (by, sy), (ba, sa) = rows
    return [(x * bx + y * by + a * ba, x * sx + y * sy + a * sa) for x, y, a in matrix]


def _shared(before, dependence, after):
    """Covariance B D' + D A' of 3 x 2 matrices, by rows, where A = B + D V and V is diagonal: it is symmetric."""
    return Covariance(*[
        before[i][0] * dependence[j][0] + before[i][1] * dependence[j][1]
        + dependence[i][0] * after[j][0] + dependence[i][1] * after[j][1]
        for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))])
