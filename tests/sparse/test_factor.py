"""Factorisations against dense solutions and determinants."""

import numpy as np
import pytest
from scipy.sparse import csc_array

from squeal.sparse import quadratic as factor
from tests import large

MAKERS = ("superlu", "mumps", "pardiso")


def mkl():
    """MKL, where it is installed."""
    try:
        return factor._mkl()
    except ImportError:
        return pytest.skip("mkl is not installed")


def made(name, matrix, new=None, like=None):
    """A factorisation by one of the ways."""
    if name == "superlu":
        return factor.Factor(matrix)
    if name == "pardiso":
        return factor._Pardiso(matrix, mkl(), like)
    return factor._Mumps(matrix, new or pytest.importorskip("mumps").Context, like)


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
    logarithm = found.logarithm()
    assert logarithm.real == pytest.approx(size, rel=1e-10)
    assert np.exp(1j * logarithm.imag) == pytest.approx(complex(sign), abs=1e-10)


@pytest.mark.parametrize("name", MAKERS)
def test_singular(name):
    with pytest.raises(ZeroDivisionError):
        made(name, csc_array(np.diag([1.0, 0.0, 2.0])))


def test_an_ordering_serves_again(rng):
    """A factor that is no longer needed lends its context to one of its pattern and type."""
    contexts = pytest.importorskip("mumps").Context
    M, C, K = large.blocks(rng.uniform(0.1, 0.5, 31), rng.uniform(1.0, 6.0, 31), rng)
    pattern = csc_array(abs(M) + abs(C) + abs(K))
    right, found, given = rng.standard_normal(31), None, []

    def new():
        given.append(1)
        return contexts()

    for kind, number in ((float, 1), (float, 1), (complex, 2)):
        data = rng.standard_normal(pattern.nnz).astype(kind)
        matrix = csc_array((data, pattern.indices, pattern.indptr), shape=pattern.shape)
        found = factor._Mumps(matrix, new, found)
        assert len(given) == number
        assert np.allclose(
            found.solve(right.astype(kind)), np.linalg.solve(matrix.toarray(), right)
        )
        sign, size = np.linalg.slogdet(matrix.toarray())
        assert found.logarithm().real == pytest.approx(size, rel=1e-10)
        assert np.exp(1j * found.logarithm().imag) == pytest.approx(complex(sign), abs=1e-10)
