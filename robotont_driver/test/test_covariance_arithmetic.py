"""Covariance and WeightedSum against numpy's matrices."""

import numpy as np
import pytest

from robotont_driver.odometry.covariance import Covariance


def random_covariance(generator):
    """A positive definite 3 x 3 matrix."""
    root = generator.normal(size=(3, 3))
    return root @ root.T


def test_as_matrices():
    generator = np.random.default_rng(1)
    for _ in range(20):
        one, other = random_covariance(generator), random_covariance(generator)
        jacobian, vector = generator.normal(size=(3, 3)), generator.normal(size=3)
        covariance = Covariance.of_matrix(one)
        assert np.array_equal(covariance.matrix, (one + one.T) / 2)
        assert covariance.rows == tuple(covariance.matrix.ravel())
        assert covariance.plus(Covariance.of_matrix(other)).matrix == pytest.approx(one + other)
        assert covariance.times(0.3).matrix == pytest.approx(0.3 * one)
        assert covariance.propagated(jacobian).matrix == pytest.approx(jacobian @ one @ jacobian.T)
        assert Covariance.of_vector(vector).matrix == pytest.approx(np.outer(vector, vector))
