"""Odometry of omni wheels on SE(2): exact steps, propagated covariance, nothing but numbers.

A pose is (x [m], y [m], yaw [rad]) of base_link in the odometry frame. A step is a displacement
(dx [m], dy [m], dyaw [rad]) in base_link, made with a constant twist.
"""

import math

import numpy as np

from robotont_driver.solvers import least_squares

# Variance of each coordinate before the first step: the start is known, but no filter likes a zero.
START_VARIANCE = 1e-9
# [edges^2] What one encoder edge hides of a wheel's angle: the variance of a uniform error of one edge.
# Counts are differences of angles, so their errors cancel from packet to packet: of a path, however long,
# only those of its start and of its end remain.
QUANTISATION = 1.0 / 12.0
# Longest time [s] that a measured speed is held: without newer packets the board itself has stopped.
LONGEST_HOLD = 0.5


class Pose:
    """A pose and its covariance, moved step by step. start_covariance: 3 x 3 at the origin, beside START_VARIANCE."""

    def __init__(self, start_covariance=0.0):
        self._start_covariance = START_VARIANCE * np.eye(3) + start_covariance
        self.reset()

    def reset(self):
        """Back to the origin."""
        self._both = np.zeros((6, 6))  # covariance of pose and step, which know nothing of each other
        self.x = self.y = self.yaw = 0.0
        self.covariance = self._start_covariance.copy()

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
    solver: one of solvers.SOLVERS.
    """

    def __init__(self, kinematics, period, wheel_noise, solver=least_squares):
        wheels = kinematics.wheels
        self.kinematics = kinematics
        self.period = period
        self._solver = solver
        self._metres_per_edge = np.array(wheels.metres_per_edge)
        self._noise = wheel_noise ** 2 / self._metres_per_edge  # [edges^2 per edge], per wheel
        self.leave_out(())
        self.pose = Pose(QUANTISATION * self._edge_covariance)
        self.twist = np.zeros(3)                     # (v_x, v_y, omega) of the newest packet
        self.twist_covariance = np.zeros((3, 3))
        self.wheel_angles = np.zeros(wheels.amount)  # [rad] since the start
        self.wheel_rates = np.zeros(wheels.amount)   # [rad/s]
        self._radians_per_edge = 2 * math.pi / wheels.edges_per_turn
        self._rate = 1.0 / period if period else wheels.pid_frequency  # [Hz] packets per second
        self._held = np.zeros(wheels.amount)

    def leave_out(self, wheels):
        """From now on no packet moves the robot by the counts of these `wheels` (indices)."""
        counted = [wheel for wheel in range(self.kinematics.wheels.amount) if wheel not in wheels]
        # 3 x n: edges to step, (8)-(11)
        self._to_step = self._solver(self.kinematics.matrix, counted) * self._metres_per_edge
        self._edge_covariance = self._to_step @ self._to_step.T  # of a step, for 1 edge^2 in every wheel
        self._end_covariance = (QUANTISATION * self._edge_covariance).tolist()
        # n x 9: covariance of a step, row by row, that one edge of each wheel's path brings
        columns = self._to_step.T
        self._path_covariances = (
            columns[:, :, None] * columns[:, None, :] * self._noise[:, None, None]).reshape(-1, 9)

    @property
    def pose_covariance(self):
        """3 x 3 covariance of the pose: what was gathered on the way, and the edge that each wheel is in."""
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
        self.twist_covariance = (covariance + 2 * QUANTISATION * self._edge_covariance) * self._rate ** 2
        self.wheel_rates = edges * (self._radians_per_edge * self._rate)

    def _step(self, edges):
        """Step (3) that n `edges` make, and its covariance (3 x 3) by noise that grows with each wheel's path."""
        return self._to_step @ edges, (np.abs(edges) @ self._path_covariances).reshape(3, 3)

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
