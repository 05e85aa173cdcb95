"""The number of finite roots, against determinants in rational arithmetic."""

import itertools
from fractions import Fraction

import numpy as np
import pytest

from squeal.linear.finite_roots import finite_root_count

NO_GUESS = -1  # so that all is counted in exact arithmetic


def _determinant(X):
    """Of rows of fractions, by elimination."""
    rows = [list(row) for row in X]
    determinant = Fraction(1)
    for k in range(len(rows)):
        pivot = next((i for i in range(k, len(rows)) if rows[i][k]), None)
        if pivot is None:
            return Fraction(0)
        if pivot != k:
            rows[k], rows[pivot] = rows[pivot], rows[k]
            determinant = -determinant
        determinant *= rows[k][k]
        for i in range(k + 1, len(rows)):
            share = rows[i][k] / rows[k][k]
            rows[i] = [a - share * b for a, b in zip(rows[i], rows[k], strict=True)]
    return determinant


def _degree(M, C, K):
    """Of det(z^2 M + z C + K), of whole numbers: by divided differences of its values."""
    points = range(2 * len(M) + 1)
    values = []
    for z in points:
        whole = (z * z * M + z * C + K).astype(int)
        values.append(_determinant([[Fraction(int(x)) for x in row] for row in whole]))
    degree = 0
    for order in points[1:]:
        values = [(b - a) / order for a, b in itertools.pairwise(values)]
        if any(values):
            degree = order
    return degree


@pytest.mark.parametrize("seed", range(40))
def test_the_count_is_the_degree_of_the_determinant(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 6))

    def of_low_rank():
        rank = int(rng.integers(0, n + 1))
        return (rng.integers(-2, 3, (n, rank)) @ rng.integers(-2, 3, (rank, n))).astype(float)

    M, C, K = (of_low_rank() for _ in range(3))
    assert finite_root_count(M, C, K, NO_GUESS) == _degree(M, C, K)


def test_complex_matrices_count_once():
    M = np.diag([1.0, 0.0])
    K = np.array([[2.0 + 0.2j, -1.0], [-1.0, 1.0 + 0.1j]])
    assert finite_root_count(M, None, K, NO_GUESS) == 2


def test_a_constraint_in_other_coordinates_takes_its_roots():
    # two masses held at one distance: one motion is left
    M = np.diag([1.0, 2.0, 0.0])
    K = np.array([[3.0, 0.0, 1.0], [0.0, 1.0, -1.0], [1.0, -1.0, 0.0]])
    rows = np.array([[1.0, 2.0, -1.0], [0.0, 1.0, 3.0], [2.0, 0.0, 1.0]])
    assert finite_root_count(rows @ M @ rows.T, None, rows @ K @ rows.T, NO_GUESS) == 2


def test_the_count_of_many_rows_is_a_bound_at_little_cost():
    """Of 41 rows two powers of w are counted: each constraint then takes two roots of its four."""
    n, held = 41, 2
    M = np.diag(np.append(np.ones(n - held), np.zeros(held)))
    K = np.diag(np.append(np.arange(1.0, n - held + 1.0), np.zeros(held)))
    K[:held, n - held :] = K[n - held :, :held] = np.eye(held)
    T = np.eye(n)
    T[:, 0] = T[0] = 1.0  # no row or column is without mass any more
    M, K = (T.T @ X @ T for X in (M, K))
    count = finite_root_count(M, None, K, NO_GUESS)
    assert 2 * n - 4 * held < count <= 2 * n - 2 * held
