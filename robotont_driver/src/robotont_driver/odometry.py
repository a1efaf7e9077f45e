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
from robotont_driver.wheel_noise import READING_VARIANCE, variance_per_edge

# Variance of each coordinate before the first step: the start is exact, but filters need a positive variance.
START_VARIANCE = 1e-9
# Longest time [s] for which a measured speed stays valid: without newer packets the board itself has stopped.
LONGEST_HOLD = 0.5


class Pose:
    """A pose and its covariance, moved step by step. start_covariance: 3 x 3 at the origin, added to START_VARIANCE."""

    def __init__(self, start_covariance=0.0):
        self._start_covariance = START_VARIANCE * np.eye(3) + start_covariance
        self.reset()

    def reset(self):
        """Back to the origin."""
        self._lasting = None  # 3 x 2: covariance with errors that last, of a gyro's bias and scale
        self._both = np.zeros((6, 6))  # joint covariance of pose and step, which are independent
        self.x = self.y = self.yaw = 0.0
        self.covariance = self._start_covariance.copy()

    def move(self, step, step_covariance, lasting=None):
        """Move by a step (3 floats) with its covariance, 3 x 3.

        Covariance: F P F' + G Q G', with the Jacobians F by the pose and G by the step side by side. `lasting`: where
        the step shares errors with those before and after it: its sensitivity to them (3 x 2), and their
        variances (2).
        """
        dx, dy, dyaw = step
        half = dyaw / 2
        chord = se2.sinc(half)
        slope = se2.sinc_derivative(half) / 2
        cos, sin = math.cos(self.yaw + half), math.sin(self.yaw + half)
        moved_x, moved_y, _ = se2.arc(step, self.yaw)
        jacobians = np.array((
            (1.0, 0.0, -moved_y, chord * cos, -chord * sin, slope * (cos * dx - sin * dy) - moved_y / 2),
            (0.0, 1.0, moved_x, chord * sin, chord * cos, slope * (sin * dx + cos * dy) + moved_x / 2),
            (0.0, 0.0, 1.0, 0.0, 0.0, 1.0),
        ))
        self.x, self.y, self.yaw = self.x + moved_x, self.y + moved_y, se2.wrap(self.yaw + dyaw)
        self._both[:3, :3] = self.covariance
        self._both[3:, 3:] = step_covariance
        self.covariance = jacobians @ self._both @ jacobians.T
        self._carry(jacobians, lasting)

    def _carry(self, jacobians, lasting):
        """Propagate the covariance with the lasting errors, C <- F C + G L B, and add its part to P."""
        if lasting is None and self._lasting is None:
            return
        if self._lasting is None:
            self._lasting = np.zeros((3, 2))
        before = jacobians[:, :3] @ self._lasting
        self._lasting = before
        if lasting is not None:
            dependence = jacobians[:, 3:] @ lasting[0]
            self._lasting = before + dependence * lasting[1]
            self.covariance = self.covariance + before @ dependence.T + dependence @ self._lasting.T

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
        self._mean_twist = MeanTwist(1.0 / self._rate, max(1, round(twist_window * self._rate)) if period else 1)
        self.exclude(())
        self.pose = Pose(READING_VARIANCE * self._edge_covariance)
        self.twist = np.zeros(3)                     # (v_x, v_y, omega)
        self.twist_covariance = np.zeros((3, 3))
        self.wheel_angles = np.zeros(wheels.amount)  # [rad] since the start
        self.wheel_rates = np.zeros(wheels.amount)   # [rad/s]
        self._radians_per_edge = 2 * math.pi / wheels.edges_per_turn
        self._held = np.zeros(wheels.amount)

    def exclude(self, wheels):
        """From now on no packet moves the robot by the counts of these `wheels` (indices)."""
        self.kinematics = Kinematics(self.kinematics.wheels, self.kinematics.solver, wheels)
        by_edge = self.kinematics.inverse * self.kinematics.wheels.metres_per_edge  # 3 x n: step by one edge of each
        self._edge_covariance = by_edge @ by_edge.T  # of a step, for 1 edge^2 in every wheel
        self._end_covariance = (READING_VARIANCE * self._edge_covariance).tolist()
        # n x 9: covariance of a step, row by row, by one edge of each wheel's path
        columns = by_edge.T
        self._path_covariances = (
            columns[:, :, None] * columns[:, None, :] * self._variance_per_edge[:, None, None]).reshape(-1, 9)
        if self._gyro:
            self._gyro.use_wheels(by_edge)

    @property
    def pose_covariance(self):
        """3 x 3 covariance of the pose: accumulated on the way, plus the quantisation of the newest reading."""
        (xx, xy, xa), (_, yy, ya), (_, _, aa) = self._end_covariance
        cos, sin = math.cos(self.pose.yaw), math.sin(self.pose.yaw)
        across = (xx - yy) * cos * sin + xy * (cos * cos - sin * sin)
        forward, left = cos * xa - sin * ya, sin * xa + cos * ya
        mixed = 2 * cos * sin * xy
        end = (
            (cos * cos * xx + sin * sin * yy - mixed, across, forward),
            (across, sin * sin * xx + cos * cos * yy + mixed, left),
            (forward, left, aa),
        )
        return np.add(self.pose.covariance, end)

    def update(self, counts, elapsed, stamp=0):
        """Take one packet, n counts [edges per PID period], `elapsed` [s] after the one before.

        `elapsed` matters only when the period is 0, `stamp` [ns] only with a gyro, on whose clock it is.
        """
        edges = np.array(counts, dtype=float)
        step, covariance = self._step(edges)
        edge_covariance = self._edge_covariance
        if self._gyro:
            step, covariance, edge_covariance = self._move_with_gyro(counts, edges, step, covariance, stamp)
        elif self.period:
            self._move(edges, step, covariance)
        else:
            held = self._held * (min(max(elapsed, 0.0), LONGEST_HOLD) * self._rate)
            self._move(held, *self._step(held))
            self._held = edges
        self.twist, self.twist_covariance = self._mean_twist.add(step, covariance, edge_covariance)
        self.wheel_rates = edges * (self._radians_per_edge * self._rate)

    def _move_with_gyro(self, counts, edges, step, covariance, stamp):
        """Move by wheels and gyro; the step, its covariance, and its covariance for 1 edge^2 in every wheel."""
        fused = self._gyro.fuse(counts, step, covariance, stamp)
        if self._gyro.learnt != UNCHANGED:
            self.pose.learn(self._gyro.learnt)
        if fused is None:
            self._move(edges, step, covariance)
            return step, covariance, self._edge_covariance
        self._move(edges, fused.step, fused.covariance, fused.lasting)
        return fused.step, fused.covariance, fused.wheels @ self._edge_covariance @ fused.wheels.T

    def _step(self, edges):
        """Step (3,) for n encoder `edges`, and its covariance (3 x 3) by noise that grows with each wheel's path.

        Edges of one PID period are units, so (8)-(11) give their twist, and that times the period the step.
        """
        step = self.kinematics.twist_of_units(edges) / self.kinematics.wheels.pid_frequency
        return step, (np.abs(edges) @ self._path_covariances).reshape(3, 3)

    def _move(self, edges, step, covariance, lasting=None):
        if edges.any() or step.any():  # a robot at rest gains no uncertainty
            self.pose.move(step.tolist(), covariance, lasting)
            self.wheel_angles += edges * self._radians_per_edge
