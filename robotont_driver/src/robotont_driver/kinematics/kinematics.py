"""Omni-wheel kinematics for n >= 3 wheels: the thesis' chapter 3, formulas (1)-(11).

A twist is (v_x [m/s], v_y [m/s], omega [rad/s]) in base_link (REP 103). A wheel speed [m/s] is that of the rim along
the wheel's positive driving direction. A unit is one encoder edge per PID period, the number in packets.
"""

import itertools
import math

import numpy as np

# A triple counts as well conditioned up to this ratio of its greatest to its least singular value,
# with turning measured in metres at the wheels. Three evenly placed wheels have 1.4.
LARGEST_CONDITION = 10.0


def least_squares(matrix, wheels):
    """3 x n: the step with the least sum of squared differences from the paths of the `wheels`.

    matrix: n x 3 (6); wheels: indices of those in use, a list; the others' columns are 0. Formula (7) for three
    wheels; for more, with equal noise, the best linear unbiased estimate (Gauss-Markov).
    """
    solution = np.zeros((3, len(matrix)))
    solution[:, wheels] = np.linalg.pinv(matrix[wheels])
    return solution


def triples(matrix, wheels):
    """3 x n: the mean of the steps that every well-conditioned combination of three wheels gives.

    Where none is, of the best one. The thesis' outlook 5.2.2, after P. Kallas, Probabilistic Localization of a Soccer
    Robot (Tartu, 2013).
    """
    combinations = [list(triple) for triple in itertools.combinations(wheels, 3)]
    conditions = [condition(matrix[triple]) for triple in combinations]
    limit = max(LARGEST_CONDITION, min(conditions))
    used = [triple for triple, value in zip(combinations, conditions) if value <= limit]
    return np.mean([least_squares(matrix, triple) for triple in used], axis=0)


SOLVERS = {"least_squares": least_squares, "triples": triples}


def condition(matrix):
    """Ratio of the greatest to the least singular value of wheel-matrix rows, turning at the wheels; inf: rank < 3."""
    scaled = matrix / (1.0, 1.0, np.abs(matrix[:, 2]).mean() or 1.0)
    values = np.linalg.svd(scaled, compute_uv=False)
    return values[0] / values[2] if len(matrix) >= 3 and values[2] > 1e-9 * values[0] else np.inf


def wheel_matrix(wheels):
    """Formulas (1) and (6): n x 3, wheel speeds [m/s] = matrix @ (v_x [m/s], v_y [m/s], omega [rad/s]).

    Row i is (cos theta_i, sin theta_i, lever), theta_i [rad] the wheel's direction in base_link.
    """
    return np.array([(math.cos(direction), math.sin(direction), lever)
                     for direction, lever in zip(wheels.directions, wheels.levers)])


class Kinematics:
    """Twist to units by plain numbers, and back by the matrices, for one set of `wheels`.

    solver: one of `SOLVERS`, for n > 3 wheels. excluded: indices of wheels that twists are computed without.
    """

    def __init__(self, wheels, solver=least_squares, excluded=()):
        self.wheels = wheels
        self.solver = solver
        self.matrix = wheel_matrix(wheels)  # (6)
        # (5), wheelSpeedToMainboardUnits: n factors [units per m/s]
        self.units_per_speed = 1.0 / (np.array(wheels.metres_per_edge) * wheels.pid_frequency)
        included = [wheel for wheel in range(wheels.amount) if wheel not in excluded]
        # (7), 3 x n: twist = inverse @ (units / units_per_speed), (8)-(11); 0 in the columns of excluded wheels
        self.inverse = solver(self.matrix, included)
        self._rows = self.matrix.tolist()
        self._unit_rows = (self.units_per_speed[:, np.newaxis] * self.matrix).tolist()

    def wheel_speeds(self, twist):
        """Wheel speeds [m/s], a list of n, of a twist: formula (1), v_i = R omega + |v| cos(theta_i - phi)."""
        # |v| cos(theta - phi) = v_x cos(theta) + v_y sin(theta) spares (2) and (3)
        x, y, omega = twist
        return [cos * x + sin * y + distance * omega for cos, sin, distance in self._rows]

    def units_of_twist(self, twist):
        """Units, a list of n, that a packet to the board carries for a twist: formula (4)."""
        x, y, omega = twist
        return [a * x + b * y + c * omega for a, b, c in self._unit_rows]
