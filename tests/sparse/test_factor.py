"""Factorisations against dense solutions and determinants."""

import numpy as np
import pytest
from scipy.sparse import csc_array, diags_array

from squeal.sparse import quadratic as factor
from squeal.sparse.quadratic import quadratic
from tests import large

MAKERS = ("superlu", "pardiso")


def mkl():
    """MKL, where it is installed."""
    try:
        return factor._mkl()
    except ImportError:
        return pytest.skip("mkl is not installed")


def made(name, matrix, like=None):
    """A factorisation by one of the ways."""
    return factor.Factor(matrix) if name == "superlu" else factor._Pardiso(matrix, mkl(), like)


@pytest.mark.parametrize("name", MAKERS)
@pytest.mark.parametrize("value", [2.0, -3.0, 1.0 + 4.0j])
def test_solutions_and_determinant(name, value, rng):
    M, C, K = large.blocks(rng.uniform(0.1, 0.5, 31), rng.uniform(1.0, 6.0, 31), rng)
    P = csc_array(value**2 * M + value * C - 7 * K)
    found, dense = made(name, P), P.toarray()
    for right in (rng.standard_normal(31), rng.standard_normal((31, 3)) + 1j):
        for transposed, matrix in ((False, dense), (True, dense.T)):
            assert np.allclose(found.solve(right, transposed), np.linalg.solve(matrix, right))
    sign, size = np.linalg.slogdet(dense)
    turns = 1 if name == "superlu" else 2  # PARDISO knows the phase up to half turns
    logarithm = found.logarithm()
    assert logarithm.real == pytest.approx(size, rel=1e-10)
    assert np.exp(turns * 1j * logarithm.imag) == pytest.approx(complex(sign) ** turns, abs=1e-10)


@pytest.mark.parametrize("n", [2, 3, 4, 5])
def test_the_sign_of_a_determinant_without_a_diagonal(n, rng):
    """Rows have to change their places: a cycle of n has the sign (-1)^(n - 1)."""
    values = rng.uniform(0.5, 2.0, n) * rng.choice([-1.0, 1.0], n)
    matrix = csc_array((values, (np.arange(n), (np.arange(n) + 1) % n)), shape=(n, n))
    found = np.exp(factor.Factor(matrix).logarithm())
    assert found == pytest.approx((-1) ** (n - 1) * np.prod(values), rel=1e-12)


@pytest.mark.parametrize("name", MAKERS)
def test_singular(name):
    with pytest.raises(ZeroDivisionError):
        made(name, csc_array(np.diag([1.0, 0.0, 2.0])))


def test_an_ordering_serves_again(rng):
    """A factor that is no longer needed lends its ordering to one of its pattern and type."""
    M, C, K = large.blocks(rng.uniform(0.1, 0.5, 31), rng.uniform(1.0, 6.0, 31), rng)
    pattern = csc_array(abs(M) + abs(C) + abs(K))
    right, found = rng.standard_normal(31), None
    for kind, lends in ((float, False), (float, True), (complex, False)):
        data = rng.standard_normal(pattern.nnz).astype(kind)
        matrix, before = csc_array((data, *_of(pattern)), shape=pattern.shape), found
        found = made("pardiso", matrix, before)
        assert before is None or before._memory.any() != lends
        expected = np.linalg.solve(matrix.toarray(), right)
        assert np.allclose(found.solve(right.astype(kind)), expected)


def _of(pattern):
    return pattern.indices, pattern.indptr


def test_the_parts_of_a_problem_share_a_pattern(rng):
    """P at any place is the sum of its parts, whatever entries these have."""
    M, C, K = (diags_array(rng.uniform(1, 2, 9 - abs(k)), offsets=k) for k in (0, 2, -3))
    K = csc_array(K + M)
    problem = quadratic(csc_array(M), csc_array(C - K), K)
    for value in (2.0, 1.0 + 3.0j):
        sums = value**2 * problem.M + value * problem.C + problem.K
        assert np.allclose(problem.at(value).toarray(), sums.toarray(), rtol=1e-14)
        assert problem.at(value).nnz == problem.at(-1.0).nnz
