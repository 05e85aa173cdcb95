"""Inverses, and inverse iteration on matrices that are singular, exactly and but for rounding."""

import numpy as np
import pytest
from scipy.linalg import lu_solve

from squeal.numerics.inverse import SMALL, inverse, near_singular


@pytest.mark.parametrize("off", [0.0, 1e-17, 1e-3])
def test_the_null_vector_comes_from_one_solution(off):
    vector = np.array([2.0, -1.0, 2.0]) / 3
    P = np.eye(3) - (1 - off) * np.outer(vector, vector)
    x = lu_solve(near_singular(P), np.array([1.0, 2.0, 4.0]))
    assert np.all(np.isfinite(x))
    exact = np.array([1.0, 2.0, 4.0]) + (1 / off - 1) * (8 / 3) * vector if off else vector
    assert abs(x @ exact) / np.linalg.norm(x) / np.linalg.norm(exact) == pytest.approx(1, abs=1e-14)


def test_a_matrix_of_zeros_gives_numbers():
    assert np.all(np.isfinite(lu_solve(near_singular(np.zeros((2, 2))), np.ones(2))))


@pytest.mark.parametrize("n", [30, SMALL + 1])
@pytest.mark.parametrize("kind", [float, complex])
def test_an_inverse_comes_with_the_determinant(kind, n):
    A = np.random.default_rng(1).normal(size=(2, n, n))
    A = A[0] if kind is float else A[0] + 1j * A[1]
    other, size = inverse(A)
    assert other @ A == pytest.approx(np.eye(n), abs=1e-11)
    assert size == pytest.approx(np.linalg.slogdet(A)[1], rel=1e-12)
    A[3] = A[4] = 0.0
    with pytest.raises(np.linalg.LinAlgError):
        inverse(A)
