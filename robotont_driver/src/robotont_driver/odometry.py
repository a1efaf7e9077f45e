"""Odometry of omni wheels on SE(2): exact steps, propagated covariance, nothing but numbers.

A pose is (x [m], y [m], yaw [rad]) of base_link in the odometry frame. A step is the integral of a constant
twist (v_x t [m], v_y t [m], omega t [rad]) in base_link.
"""

import math

import numpy as np

from robotont_driver import se2
from robotont_driver.gyro import UNCHANGED
from robotont_driver.kinematics import Kinematics
from robotont_driver.mean_twist import MeanTwist
from robotont_driver.wheel_noise import PATH_VARIANCE, READING_VARIANCE, variance_per_edge

# Variance of each coordinate before the first step: the start is exact, but filters need a positive variance.
START_VARIANCE = 1e-9
# Longest time [s] for which a measured speed stays valid: without newer packets the board itself has stopped.
LONGEST_HOLD = 0.5
EXACT = (0.0,) * 6  # covariance of what has no error


class Pose:
    """A pose and its covariance, moved step by step. start_covariance: 3 x 3 at the origin, added to START_VARIANCE.

    Covariances are `upper` triangles, six floats (xx, xy, xa, yy, ya, aa): with so few numbers plain arithmetic is many
    times faster than arrays, and a packet has to become an odometry message at once.
    """

    def __init__(self, start_covariance=0.0):
        self._start = upper_of(START_VARIANCE * np.eye(3) + start_covariance)
        self.reset()

    def reset(self):
        """Back to the origin."""
        self._lasting = None  # 3 x 2: covariance with errors that last, of a gyro's bias and scale
        self.x = self.y = self.yaw = 0.0
        self.upper = self._start

    @property
    def covariance(self):
        """3 x 3, of (x, y, yaw)."""
        return matrix_of(self.upper)

    def move(self, step, step_upper=EXACT, lasting=None):
        """Move by a step (3 floats) with its covariance, an upper triangle.

        Covariance: F P F' + G Q G', with the Jacobians F by the pose and G by the step. `lasting`: where the step
        shares errors with those before and after it: its sensitivity to them (3 x 2), and their variances (2).
        """
        dx, dy, dyaw = step
        half = dyaw / 2
        chord = se2.sinc(half)
        slope = se2.sinc_derivative(half) / 2
        cos, sin = math.cos(self.yaw + half), math.sin(self.yaw + half)
        along, across = cos * dx - sin * dy, sin * dx + cos * dy
        moved_x, moved_y = chord * along, chord * across
        # F = [1 0 -moved_y, 0 1 moved_x, 0 0 1], G = [c -s g, s c h, 0 0 1]
        c, s = chord * cos, chord * sin
        g, h = slope * along - moved_y / 2, slope * across + moved_x / 2
        xx, xy, xa, yy, ya, aa = self.upper
        qxx, qxy, qxa, qyy, qya, qaa = step_upper
        fxa, fya = xa - moved_y * aa, ya + moved_x * aa
        gxx, gxy, gxa = c * qxx - s * qxy + g * qxa, c * qxy - s * qyy + g * qya, c * qxa - s * qya + g * qaa
        gyx, gyy, gya = s * qxx + c * qxy + h * qxa, s * qxy + c * qyy + h * qya, s * qxa + c * qya + h * qaa
        self.upper = (
            xx - moved_y * (xa + fxa) + c * gxx - s * gxy + g * gxa,
            xy - moved_y * ya + moved_x * fxa + s * gxx + c * gxy + h * gxa,
            fxa + gxa,
            yy + moved_x * (ya + fya) + s * gyx + c * gyy + h * gya,
            fya + gya,
            aa + qaa,
        )
        self.x, self.y, self.yaw = self.x + moved_x, self.y + moved_y, se2.wrap(self.yaw + dyaw)
        if lasting is not None or self._lasting is not None:
            self._carry(np.array(((1.0, 0.0, -moved_y), (0.0, 1.0, moved_x), (0.0, 0.0, 1.0))),
                        np.array(((c, -s, g), (s, c, h), (0.0, 0.0, 1.0))), lasting)

    def _carry(self, by_pose, by_step, lasting):
        """Propagate the covariance with the lasting errors, C <- F C + G L B, and add its part to P."""
        before = by_pose @ (np.zeros((3, 2)) if self._lasting is None else self._lasting)
        self._lasting = before
        if lasting is not None:
            dependence = by_step @ lasting[0]
            self._lasting = before + dependence * lasting[1]
            self.upper = upper_of(self.covariance + before @ dependence.T + dependence @ self._lasting.T)

    def learn(self, factors):
        """Scale the lasting errors by (2) factors, as they have been estimated better."""
        if self._lasting is not None:
            self._lasting = self._lasting * factors


class WheelOdometry:
    """Counts of the wheels in; pose, twist, their covariances and the wheels' angles out.

    period: time [s] that one packet stands for. 0: packets contain speeds, each valid until the next one.
    wheel_noise: standard deviation [m] of a wheel's path after 1 m; its variance grows with the path.
    twist_window: [s] over which the twist is the mean; 0: that of the newest packet. gyro: a gyro.GyroFusion, or None.
    """

    def __init__(self, kinematics, period, wheel_noise, twist_window=0.0, gyro=None):
        wheels = kinematics.wheels
        self.kinematics = kinematics
        self.period = period
        self._variance_per_edge = variance_per_edge(wheel_noise, wheels.metres_per_edge)
        self._gyro = gyro
        self._rate = 1.0 / period if period else wheels.pid_frequency  # [Hz] packets per second
        window = round(twist_window * self._rate) if period else 1
        self._mean_twist = MeanTwist(1.0 / self._rate, window) if window > 1 else None
        self.exclude(())
        self.pose = Pose(READING_VARIANCE * matrix_of(self._reading_upper))
        self.newest_twist = (0.0,) * 3               # (v_x, v_y, omega)
        self.twist_upper = EXACT                     # upper triangle of its covariance
        self.wheel_angles = [0.0] * wheels.amount    # [rad] since the start
        self.wheel_rates = [0.0] * wheels.amount     # [rad/s]
        self._radians_per_edge = 2 * math.pi / wheels.edges_per_turn
        self._held = (0.0,) * wheels.amount

    def exclude(self, wheels):
        """From now on no packet moves the robot by the counts of these `wheels` (indices)."""
        self.kinematics = Kinematics(self.kinematics.wheels, self.kinematics.solver, wheels)
        by_edge = self.kinematics.inverse * self.kinematics.wheels.metres_per_edge  # 3 x n: step by one edge of each
        self._reading_upper = upper_of(by_edge @ by_edge.T)  # covariance of a step, for 1 edge^2 in every wheel
        # per wheel: step by one edge, and the upper triangle of its covariance by one edge of path
        self._by_edge = [
            (*column.tolist(), *upper_of(np.outer(column, column) * variance))
            for column, variance in zip(by_edge.T, self._variance_per_edge)]
        if self._gyro:
            self._gyro.use_wheels(by_edge)

    @property
    def twist(self):
        """(v_x, v_y, omega) as an array."""
        return np.array(self.newest_twist)

    @property
    def twist_covariance(self):
        """3 x 3, of the twist."""
        return matrix_of(self.twist_upper)

    @property
    def pose_covariance(self):
        """3 x 3, of the pose: see `pose_upper`."""
        return matrix_of(self.pose_upper)

    @property
    def pose_upper(self):
        """Upper triangle of the pose's covariance: gathered on the way, plus the quantisation of the newest reading."""
        xx, xy, xa, yy, ya, aa = self._reading_upper
        cos, sin = math.cos(self.pose.yaw), math.sin(self.pose.yaw)
        mixed = 2 * cos * sin * xy
        pxx, pxy, pxa, pyy, pya, paa = self.pose.upper
        return (
            pxx + READING_VARIANCE * (cos * cos * xx + sin * sin * yy - mixed),
            pxy + READING_VARIANCE * ((xx - yy) * cos * sin + xy * (cos * cos - sin * sin)),
            pxa + READING_VARIANCE * (cos * xa - sin * ya),
            pyy + READING_VARIANCE * (sin * sin * xx + cos * cos * yy + mixed),
            pya + READING_VARIANCE * (sin * xa + cos * ya),
            paa + READING_VARIANCE * aa,
        )

    def update(self, counts, elapsed, stamp=0):
        """Take one packet, n counts [edges per PID period], `elapsed` [s] after the one before.

        `elapsed` matters only when the period is 0, `stamp` [ns] only with a gyro, on whose clock it is.
        """
        step, upper = self._step(counts)
        reading_upper = self._reading_upper
        if self._gyro:
            step, upper, reading_upper = self._move_with_gyro(counts, step, upper, stamp)
        elif self.period:
            self._move(counts, step, upper)
        else:
            share = min(max(elapsed, 0.0), LONGEST_HOLD) * self._rate
            held = [edges * share for edges in self._held]
            self._move(held, *self._step(held))
            self._held = counts
        self._update_twist(step, upper, reading_upper)
        factor = self._radians_per_edge * self._rate
        self.wheel_rates = [edges * factor for edges in counts]

    def _update_twist(self, step, upper, reading_upper):
        if self._mean_twist:
            twist, covariance = self._mean_twist.add(
                np.array(step), matrix_of(upper), matrix_of(reading_upper))
            self.newest_twist, self.twist_upper = tuple(twist.tolist()), upper_of(covariance)
            return
        rate = self._rate
        self.newest_twist = (step[0] * rate, step[1] * rate, step[2] * rate)
        self.twist_upper = tuple([
            (new + PATH_VARIANCE * reading) * rate * rate for new, reading in zip(upper, reading_upper)])

    def _move_with_gyro(self, counts, step, upper, stamp):
        """Move by wheels and gyro; the step, its covariance, and its covariance for 1 edge^2 in every wheel."""
        fused = self._gyro.fuse(counts, np.array(step), matrix_of(upper), stamp)
        if self._gyro.learnt != UNCHANGED:
            self.pose.learn(self._gyro.learnt)
        if fused is None:
            self._move(counts, step, upper)
            return step, upper, self._reading_upper
        step, upper = tuple(fused.step.tolist()), upper_of(fused.covariance)
        self._move(counts, step, upper, fused.lasting)
        return step, upper, upper_of(fused.wheels @ matrix_of(self._reading_upper) @ fused.wheels.T)

    def _step(self, counts):
        """Step (3 floats) by n counts, and its covariance by noise that grows with each wheel's path.

        Formulas (8)-(11), with the inverse times the path of one edge: counts of one PID period are units, and their
        twist times the period is the step.
        """
        dx = dy = dyaw = xx = xy = xa = yy = ya = aa = 0.0
        for edges, (by_x, by_y, by_yaw, by_xx, by_xy, by_xa, by_yy, by_ya, by_aa) in zip(counts, self._by_edge):
            if edges:
                path = abs(edges)
                dx += by_x * edges
                dy += by_y * edges
                dyaw += by_yaw * edges
                xx += by_xx * path
                xy += by_xy * path
                xa += by_xa * path
                yy += by_yy * path
                ya += by_ya * path
                aa += by_aa * path
        return (dx, dy, dyaw), (xx, xy, xa, yy, ya, aa)

    def _move(self, counts, step, upper, lasting=None):
        if any(counts) or any(step):  # a robot at rest gains no uncertainty
            self.pose.move(step, upper, lasting)
            factor = self._radians_per_edge
            self.wheel_angles = [angle + edges * factor for angle, edges in zip(self.wheel_angles, counts)]


def upper_of(matrix):
    """Upper triangle of a symmetric 3 x 3 matrix, row by row: six floats."""
    (xx, xy, xa), (_, yy, ya), (_, _, aa) = np.asarray(matrix).tolist()
    return xx, xy, xa, yy, ya, aa


def matrix_of(upper):
    """Symmetric 3 x 3 matrix of an upper triangle."""
    xx, xy, xa, yy, ya, aa = upper
    return np.array(((xx, xy, xa), (xy, yy, ya), (xa, ya, aa)))
