"""Factorisations against dense solutions and determinants."""

import ctypes

import numpy as np
import pytest
from scipy.linalg import lu
from scipy.sparse import csc_array, csr_array, diags_array

from squeal.errors import ComputationError
from squeal.sparse import factor
from squeal.sparse.quadratic import scaled_problem
from tests import large

MAKERS = ("superlu", "pardiso")


class Manual:
    """PARDISO as MKL's manual describes it, on dense matrices, where it is not installed."""

    def __init__(self):
        self.held = {}

    def pardiso(self, memory, _most, _which, kind, phase, n, data, rows, columns, _order, *more):
        many, control, _level, right, found, error = more
        n = _at(n)[0]
        many = _at(many)[0]
        phase = _at(phase)[0]
        control = _at(control, 64)
        kinds = {11: ("f8", "f4"), 13: ("c16", "c8")}[_at(kind)[0]]
        kind = kinds[control[27]]
        memory = _at(memory, 64, "i8")
        if phase in (12, 22):
            assert control[[0, 1, 34, 55]].tolist() == [1, 2, 1, 1]
            assert control[9] == (6 if control[27] else 13)
            rows = _at(rows, n + 1)
            columns = _at(columns, rows[-1])
            matrix = csr_array((_at(data, rows[-1], kind), columns, rows), shape=(n, n)).toarray()
            if phase == 12:
                memory[0] = 1 + max(self.held, default=0)
            assert memory[0]  # the analysis: the library itself crashes without it
            self.held[memory[0]] = matrix
            _at(error)[0] = -4 if np.linalg.matrix_rank(matrix) < n else 0
            control[13] = np.abs(np.diag(matrix)).max() == 9.0  # pivots that were moved
        elif phase == 33:
            matrix = self.held[memory[0]]
            solved = np.linalg.solve(
                matrix.T if control[11] == 2 else matrix,
                _at(right, n * many, kind).reshape(many, n).T,
            )
            _at(found, n * many, kind)[:] = solved.T.ravel()
        else:
            assert phase == -1
            self.held.pop(memory[0], None)

    def pardiso_getdiag(self, memory, pivots, _diagonal, _which, _error):
        matrix = self.held[_at(memory, 64, "i8")[0]]
        _at(pivots, len(matrix), matrix.dtype)[:] = np.diag(lu(matrix)[2])


def _at(place, count=1, kind="i4"):
    size = int(count) * np.dtype(kind).itemsize
    return np.frombuffer((ctypes.c_char * size).from_address(place.value or 0), kind, int(count))


def mkl():
    """MKL, where it is installed."""
    try:
        return factor._mkl()
    except ImportError:
        return Manual()


def made(name, matrix, like=None):
    """A factorisation by one of the ways."""
    if name == "superlu":
        return factor.Factor(matrix)
    library = like._library if like else mkl()
    return factor._Pardiso(matrix, library, like)


@pytest.mark.parametrize("name", MAKERS)
@pytest.mark.parametrize("value", [2.0, -3.0, 1.0 + 4.0j])
def test_solutions_and_determinant_are_those_of_numpy(name, value, rng):
    M, C, K = large.blocks(rng.uniform(0.1, 0.5, 31), rng.uniform(1.0, 6.0, 31), rng)
    P = csc_array(value**2 * M + value * C - 7 * K)
    found = made(name, P)
    dense = P.toarray()
    for right in (rng.standard_normal(31), rng.standard_normal((31, 3)) + 1j):
        for transposed, matrix in ((False, dense), (True, dense.T)):
            assert np.allclose(found.solve(right, transposed), np.linalg.solve(matrix, right))
    sign, size = np.linalg.slogdet(dense)
    turns = 1 if name == "superlu" else 2  # PARDISO knows the phase up to half turns
    logarithm = found.logarithm()
    assert logarithm.real == pytest.approx(size, rel=1e-10)
    assert np.exp(turns * 1j * logarithm.imag) == pytest.approx(complex(sign) ** turns, abs=1e-10)


@pytest.mark.parametrize("n", [2, 3, 4, 5])
def test_a_determinant_without_a_diagonal_has_its_sign(n, rng):
    """Rows have to change their places: a cycle of n has the sign (-1)^(n - 1)."""
    values = rng.uniform(0.5, 2.0, n) * rng.choice([-1.0, 1.0], n)
    matrix = csc_array((values, (np.arange(n), (np.arange(n) + 1) % n)), shape=(n, n))
    found = np.exp(factor.Factor(matrix).logarithm())
    assert found == pytest.approx((-1) ** (n - 1) * np.prod(values), rel=1e-12)


@pytest.mark.parametrize("name", MAKERS)
def test_a_singular_matrix_is_refused(name):
    with pytest.raises(ZeroDivisionError):
        made(name, csc_array(np.diag([1.0, 0.0, 2.0])))


@pytest.mark.parametrize("rows", [3, 4])  # from which PARDISO factorises
def test_integers_have_solutions_that_are_none(rows, monkeypatch):
    monkeypatch.setattr(factor, "PARDISO_ROWS", rows)
    library = mkl()
    monkeypatch.setattr(factor, "_mkl", lambda: library)
    found = factor.factorise(csc_array(np.array([[2, 0, 0], [0, 4, 0], [0, 0, 5]])))
    assert found.solve(np.array([0.5, 0.7, 1.0])) == pytest.approx([0.25, 0.175, 0.2])


@pytest.mark.parametrize("entry", [np.nan, np.inf])
def test_a_matrix_that_is_not_finite_is_not_called_singular(entry):
    with pytest.raises(ComputationError, match="an entry is not finite"):
        factor.factorise(csc_array(np.diag([1.0, entry, 2.0])))


def test_large_matrices_and_single_precision_go_to_pardiso(monkeypatch):
    """A pivot that was moved counts as zero, and what a factor held is given back."""
    library = Manual()
    matrix = csc_array(np.diag([1.0, 3.0, 2.0]))
    monkeypatch.setattr(factor, "_mkl", lambda: library)
    assert isinstance(factor.factorise(matrix), factor.Factor)
    monkeypatch.setattr(factor, "PARDISO_ROWS", 3)
    for single, kind in ((True, np.float32), (False, float)):
        found = factor.factorise(matrix, single)
        assert isinstance(found, factor._Pardiso)
        assert found.solve(np.array([1.0, 3.0, 4.0])).tolist() == [1.0, 1.0, 2.0]
        assert found.solve(np.ones(3)).dtype == kind
        assert len(library.held) == 1
        del found
    assert not library.held
    with pytest.raises(ZeroDivisionError):
        factor.factorise(csc_array(np.diag([1.0, 9.0, 2.0])))


def test_an_ordering_serves_again(rng):
    """A factor that is no longer needed lends its ordering to one of its pattern and type."""
    M, C, K = large.blocks(rng.uniform(0.1, 0.5, 31), rng.uniform(1.0, 6.0, 31), rng)
    pattern = csc_array(abs(M) + abs(C) + abs(K))
    right = rng.standard_normal(31)
    found = None
    for kind, lends in ((float, False), (float, True), (complex, False)):
        data = rng.standard_normal(pattern.nnz).astype(kind)
        matrix = csc_array((data, *_of(pattern)), shape=pattern.shape)
        before = found
        found = made("pardiso", matrix, before)
        assert before is None or before._memory.any() != lends
        expected = np.linalg.solve(matrix.toarray(), right)
        assert np.allclose(found.solve(right.astype(kind)), expected)


def test_an_ordering_is_lent_once(monkeypatch):
    """A singular matrix takes the ordering along: the matrix close by needs an analysis."""
    library = mkl()
    monkeypatch.setattr(factor, "_mkl", lambda: library)
    monkeypatch.setattr(factor, "PARDISO_ROWS", 2)
    problem = scaled_problem(np.eye(2), None, np.array([[2.0, -1.0], [-1.0, 2.0]]))
    lender = factor.factorise(problem.at(2j))
    value, found = factor.factorise_at(problem, 1j, reusable=lender)
    assert value != 1j
    image = problem.at(value) @ np.array([1.0, 2.0])
    assert found.solve(image) == pytest.approx([1.0, 2.0], rel=1e-9)


def _of(pattern):
    return pattern.indices, pattern.indptr


def test_the_parts_of_a_problem_share_a_pattern(rng):
    """P at any place is the sum of its parts, whatever entries these have."""
    M = diags_array(rng.uniform(1, 2, 9), offsets=0)
    C = diags_array(rng.uniform(1, 2, 7), offsets=2)
    K = diags_array(rng.uniform(1, 2, 6), offsets=-3)
    K = csc_array(K + M)
    problem = scaled_problem(csc_array(M), csc_array(C - K), K)
    for value in (2.0, 1.0 + 3.0j):
        sums = value**2 * problem.M + value * problem.C + problem.K
        assert np.allclose(problem.at(value).toarray(), sums.toarray(), rtol=1e-14)
        assert problem.at(value).nnz == problem.at(-1.0).nnz
