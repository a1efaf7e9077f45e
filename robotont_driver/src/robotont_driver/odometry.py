"""Odometry of omni wheels on SE(2): exact steps, propagated covariance, nothing but numbers.

A pose is (x [m], y [m], yaw [rad]) of base_link in the odometry frame. A step is a displacement
(dx [m], dy [m], dyaw [rad]) in base_link, made with a constant twist.
"""

import math

import numpy as np

# Variance of each coordinate before the first step: the start is known, but no filter likes a zero.
START_VARIANCE = 1e-9
# What one encoder edge hides: a uniform error of one edge has the variance edge^2 / 12.
QUANTISATION = 1.0 / 12.0
# Longest time [s] that a measured speed is held: without newer packets the board itself has stopped.
LONGEST_HOLD = 0.5


class Pose:
    """A pose and its covariance, moved step by step."""

    def __init__(self):
        self.reset()

    def reset(self):
        """Back to the origin."""
        self._both = np.zeros((6, 6))  # covariance of pose and step, which know nothing of each other
        self.x = self.y = self.yaw = 0.0
        self.covariance = START_VARIANCE * np.eye(3)

    def move(self, step, step_covariance):
        """Move by a step (3 floats) with its covariance, 3 x 3.

        A constant twist makes an arc. Its chord is the step shortened by sinc(dyaw / 2) and turned by
        half of dyaw, which is exact. Covariance: F P F' + G Q G', with the Jacobians F by the pose and
        G by the step side by side.
        """
        dx, dy, dyaw = step
        half = dyaw / 2
        chord = sinc(half)
        slope = sinc_derivative(half) / 2
        cos, sin = math.cos(self.yaw + half), math.sin(self.yaw + half)
        turned = (cos * dx - sin * dy, sin * dx + cos * dy)
        forward, left = chord * turned[0], chord * turned[1]
        jacobians = np.array((
            (1.0, 0.0, -left, chord * cos, -chord * sin, slope * turned[0] - left / 2),
            (0.0, 1.0, forward, chord * sin, chord * cos, slope * turned[1] + forward / 2),
            (0.0, 0.0, 1.0, 0.0, 0.0, 1.0),
        ))
        self.x += forward
        self.y += left
        self.yaw = wrap(self.yaw + dyaw)
        self._both[:3, :3] = self.covariance
        self._both[3:, 3:] = step_covariance
        self.covariance = jacobians @ self._both @ jacobians.T


class WheelOdometry:
    """Counts of the wheels in; pose, twist, their covariances and the wheels' angles out.

    period: time [s] that one packet stands for. 0: packets hold speeds, each valid until the next one.
    wheel_noise: standard deviation [m] of a wheel's path after 1 m; its variance grows with the path.
    """

    def __init__(self, kinematics, period, wheel_noise):
        wheels = kinematics.wheels
        self.kinematics = kinematics
        self.period = period
        self.pose = Pose()
        self.twist = np.zeros(3)                     # (v_x, v_y, omega) of the newest packet
        self.twist_covariance = np.zeros((3, 3))
        self.wheel_angles = np.zeros(wheels.amount)  # [rad] since the start
        self.wheel_rates = np.zeros(wheels.amount)   # [rad/s]
        self._to_step = kinematics.inverse * np.array(wheels.metres_per_edge)  # 3 x n: edges to step, (8)-(11)
        self._noise = wheel_noise ** 2 / np.array(wheels.metres_per_edge)      # [edges^2 per edge], per wheel
        self._radians_per_edge = 2 * math.pi / wheels.edges_per_turn
        self._rate = 1.0 / period if period else wheels.pid_frequency  # [Hz] packets per second
        self._held = np.zeros(wheels.amount)

    def update(self, counts, elapsed):
        """Take one packet, n counts [edges per PID period], `elapsed` [s] after the one before.

        `elapsed` matters only when the period is 0.
        """
        edges = np.array(counts, dtype=float)
        step, covariance = self._step(edges)
        if self.period:
            self._move(edges, step, covariance)
        else:
            held = self._held * (min(max(elapsed, 0.0), LONGEST_HOLD) * self._rate)
            self._move(held, *self._step(held))
            self._held = edges
        self.twist = step * self._rate
        self.twist_covariance = covariance * self._rate ** 2
        self.wheel_rates = edges * (self._radians_per_edge * self._rate)

    def _step(self, edges):
        """Step (3) that n `edges` make, and its covariance: per wheel from its path and quantisation."""
        variances = self._noise * np.abs(edges) + QUANTISATION
        return self._to_step @ edges, (self._to_step * variances) @ self._to_step.T

    def _move(self, edges, step, covariance):
        if edges.any():  # a robot at rest gains no uncertainty
            self.pose.move(step.tolist(), covariance)
            self.wheel_angles += edges * self._radians_per_edge


def sinc(angle):
    """sin(angle) / angle, and 1 at 0. angle: [rad]."""
    return math.sin(angle) / angle if angle else 1.0


def sinc_derivative(angle):
    """Derivative of sinc. angle: [rad]."""
    if abs(angle) < 1e-4:
        return -angle / 3  # the next term of the series is angle^3 / 30
    return (math.cos(angle) - sinc(angle)) / angle


def wrap(angle):
    """The same angle [rad] within [-pi, pi]."""
    return math.remainder(angle, 2 * math.pi)
