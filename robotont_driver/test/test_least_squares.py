import numpy as np

from robotont_driver.kinematics.kinematics import SOLVERS, condition, least_squares, triples, wheel_matrix
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_testing.robots import UNEVEN_4, UNEVEN_5


def test_without_noise_both_solvers_give_the_twist(wheels):
    matrix = wheel_matrix(wheels)
    twists = np.random.default_rng(1).uniform(-2, 2, (1000, 3))
    speeds, everything = twists @ matrix.T, list(range(wheels.amount))
    for solver in SOLVERS.values():
        assert np.abs(speeds @ solver(matrix, everything).T - twists).max() < 1e-9


def test_a_triple_that_cannot_distinguish_motions_is_no_part_of_the_mean():
    """Six wheels, three of which stand (almost) in parallel: their inverse would drown all others."""
    wheels = read_wheels({**UNEVEN_5, "wheelAmount": 6, "wheelRadius": 0.035,
                          "wheelRads": [0.0, 1e-4, 2e-4, 1.5, 3.0, 4.5]})
    matrix = wheel_matrix(wheels)
    assert condition(matrix[:3]) > 1e3
    solution = triples(matrix, list(range(len(matrix))))
    assert np.abs(solution @ matrix - np.eye(3)).max() < 1e-9
    assert np.abs(solution).max() < 2 * np.abs(least_squares(matrix, list(range(len(matrix))))).max() + 5


def test_the_best_triple_serves_where_none_is_good():
    wheels = read_wheels({**UNEVEN_4, "wheelRads": [0.0, 0.25, 0.5, 0.75], "wheelDistanceFromCenter": 0.1})
    matrix = wheel_matrix(wheels)
    assert min(condition(matrix[[a, b, c]]) for a, b, c in ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))) > 10
    assert np.abs(triples(matrix, list(range(len(matrix)))) @ matrix - np.eye(3)).max() < 1e-9
