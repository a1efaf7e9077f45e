"""From wheel paths to the step of the robot: two solvers for n >= 3 wheels.

All of it is linear, so a solver is a 3 x n matrix: step (dx [m], dy [m], dyaw [rad]) = matrix @ paths [m, n].
"""

import itertools

import numpy as np

# A triple counts as well conditioned up to this ratio of its greatest to its least singular value,
# with turning measured in metres at the wheels. Three evenly placed wheels have 1.4.
LARGEST_CONDITION = 10.0


def least_squares(matrix, wheels):
    """3 x n: the step with the least sum of squared differences from the paths of the `wheels`.

    matrix: the n x 3 wheel matrix (6); wheels: indices of those in use, a list. Columns of excluded wheels
    are 0. Formula (7) for three wheels; for more, with equal noise, the best linear unbiased estimate (Gauss-Markov).
    """
    solution = np.zeros((3, len(matrix)))
    solution[:, wheels] = np.linalg.pinv(matrix[wheels])
    return solution


def triples(matrix, wheels):
    """3 x n: the mean of the steps that every well-conditioned combination of three wheels gives.

    Arguments as in `least_squares`. The thesis' outlook 5.2.2, after P. Kallas, Probabilistic
    Localization of a Soccer Robot (Tartu, 2013). Where no combination is well conditioned, the best one is used.
    """
    combinations = [list(triple) for triple in itertools.combinations(wheels, 3)]
    conditions = [condition(matrix[triple]) for triple in combinations]
    limit = max(LARGEST_CONDITION, min(conditions))
    used = [triple for triple, value in zip(combinations, conditions) if value <= limit]
    return np.mean([least_squares(matrix, triple) for triple in used], axis=0)


SOLVERS = {"least_squares": least_squares, "triples": triples}


def condition(matrix):
    """Ratio of the greatest to the least singular value of wheel-matrix rows, turning taken at the wheels.

    Infinite where the wheels do not determine every motion.
    """
    scaled = matrix / (1.0, 1.0, np.abs(matrix[:, 2]).mean() or 1.0)
    values = np.linalg.svd(scaled, compute_uv=False)
    return values[0] / values[2] if len(matrix) >= 3 and values[2] > 1e-9 * values[0] else np.inf
