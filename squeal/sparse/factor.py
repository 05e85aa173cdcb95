"""Factorised sparse matrices: solutions and the determinant.

SuperLU comes with SciPy. MUMPS (extra `mumps`) takes a third of its time and half its memory where
solids have many rows, and is taken there if it is installed.
"""

import warnings
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError
from squeal.sparse.quadratic import Quadratic

FULL = 0.2  # share of entries above which a matrix is factorised as a full one
PIVOT = 0.01  # a diagonal entry this large beside its column stays the pivot: far less fill
MUMPS_ROWS = 10_000  # below, SuperLU is as fast

Progress = Callable[[str], None]


def quiet(text: str) -> None:
    """Progress that nobody reads."""


class Factor(Protocol):
    """A factorised matrix A (n, n)."""

    def solve(self, right: NDArray, transposed: bool = False) -> NDArray:
        """A^-1 right, or A'^-1 right (not conjugated); right (n,) or (n, m)."""

    def logarithm(self) -> complex:
        """log det A, its imaginary part up to whole turns."""


def _solved(solve: Callable[[NDArray], NDArray], right: NDArray, kind: Any) -> NDArray:
    """What a factor of a type gives; by parts for a complex right side of a real one."""
    if np.iscomplexobj(right) and kind.kind != "c":
        real, imaginary = (solve(np.ascontiguousarray(x, kind)) for x in (right.real, right.imag))
        return np.asarray(real + 1j * imaginary)
    return np.asarray(solve(right.astype(kind, copy=False)))


class _SuperLU:
    def __init__(self, matrix: Any) -> None:
        self._type, self._lu = matrix.dtype, _superlu(matrix, PIVOT)

    def solve(self, right: NDArray, transposed: bool = False) -> NDArray:
        trans = "T" if transposed else "N"
        return _solved(lambda b: self._lu.solve(b, trans), right, self._type)

    def logarithm(self) -> complex:
        return _logarithm(self._lu.U.diagonal(), _odd(self._lu.perm_r) != _odd(self._lu.perm_c))


def _superlu(matrix: Any, pivot: float) -> Any:
    from scipy.sparse.linalg import splu

    symmetric = {"SymmetricMode": True}
    try:
        return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=pivot, options=symmetric)
    except RuntimeError as error:
        if "singular" not in str(error):
            raise ComputationError(f"a sparse factorisation failed: {error}") from None
        raise ZeroDivisionError from None


class _Mumps:
    def __init__(self, matrix: Any, new: Callable[[], Any], like: Factor | None) -> None:
        lent = like._context if isinstance(like, _Mumps) and like._type == matrix.dtype else None
        self._context: Any = new() if lent is None else lent
        self._context.set_matrix(matrix)
        self._mumps = self._context.mumps_instance
        self._mumps.icntl[33] = 1  # the determinant too
        self._type: Any = matrix.dtype
        try:
            self._context.factor(ordering="metis", pivot_tol=PIVOT, reuse_analysis=lent is not None)
        except RuntimeError as error:
            if self._mumps.infog[1] in (-6, -10):
                raise ZeroDivisionError from None
            raise ComputationError(f"a sparse factorisation failed: {error}") from None

    def solve(self, right: NDArray, transposed: bool = False) -> NDArray:
        self._mumps.icntl[9] = 2 if transposed else 1
        return _solved(self._context.solve, right, self._type)

    def logarithm(self) -> complex:
        mantissa = complex(self._mumps.rinfog[12])
        if self._type.kind == "c":
            mantissa += 1j * self._mumps.rinfog[13]
        return complex(np.log(mantissa)) + float(np.log(2.0)) * self._mumps.infog[34]


class _Full:
    def __init__(self, matrix: Any) -> None:
        from scipy.linalg import lu_factor

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # singular: told below
            self._lu, self._rows = lu_factor(matrix.toarray(), check_finite=False)
        if not np.all(np.abs(np.diag(self._lu)) > 0):
            raise ZeroDivisionError

    def solve(self, right: NDArray, transposed: bool = False) -> NDArray:
        from scipy.linalg import lu_solve

        factor = self._lu, self._rows
        return np.asarray(lu_solve(factor, right, trans=int(transposed), check_finite=False))

    def logarithm(self) -> complex:
        swaps = int(np.sum(self._rows != np.arange(len(self._rows))))
        return _logarithm(np.diag(self._lu), swaps % 2 == 1)


def _logarithm(pivots: NDArray, negative: bool) -> complex:
    """Sum of the logarithms of pivots, none of which vanishes; half a turn more if negative."""
    return complex(np.sum(np.log(pivots.astype(complex)))) + (1j * np.pi if negative else 0j)


def _odd(permutation: NDArray) -> bool:
    """True if a permutation is odd: n minus its number of cycles."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    n = len(permutation)
    graph = csr_array((np.ones(n, dtype=np.int8), permutation, np.arange(n + 1)), shape=(n, n))
    cycles, _ = connected_components(graph, directed=False)
    return bool((n - cycles) % 2)


def factorise(matrix: Any, single: bool = False, like: Factor | None = None) -> Factor:
    """A factorised CSC matrix, in `single` precision at half the time and memory.

    `like` is a factor of a matrix of the same pattern that is no longer needed: it may lend its
    ordering and its memory, and solves nothing afterwards.

    Raises ZeroDivisionError if it is exactly singular.
    """
    if single:
        matrix = matrix.astype(np.complex64 if np.iscomplexobj(matrix.data) else np.float32)
    if matrix.nnz > FULL * matrix.shape[0] ** 2:
        return _Full(matrix)
    new = _contexts() if matrix.shape[0] >= MUMPS_ROWS else None
    return _SuperLU(matrix) if new is None else _Mumps(matrix, new, like)


def _contexts() -> Any:
    """What makes room for a factorisation by MUMPS, None where python-mumps is not installed."""
    try:
        from mumps import Context  # a package of another interface has the same name
    except ImportError:
        return None
    return Context


def factorise_at(
    problem: Quadratic, value: complex, single: bool = False, like: Factor | None = None
) -> tuple[complex, Factor]:
    """P(value) factorised; where it is singular, at a place close by, which is returned too.

    Raises ComputationError if it is singular there as well.
    """
    for nudge in (0.0, 1e-9, 1e-6):
        place = value + nudge * (1 + 0.5j) * (abs(value) or problem.rate)
        try:
            return place, factorise(problem.at(place), single, like)
        except ZeroDivisionError:
            continue
    raise ComputationError(
        f"lambda^2 M + lambda C + K is singular at and around {value:.6g}: M, C and K share a "
        "null vector, a part that nothing holds and that has no mass"
    )


def definite(A: Any) -> bool:
    """True if a Hermitian sparse array is positive definite: if all pivots on its diagonal are."""
    A = A.tocsc(copy=True)
    A.eliminate_zeros()
    if np.iscomplexobj(A.data) and not A.data.imag.any():
        A = A.real.copy()  # contiguous, as the factorisation wants it
    if np.any(A.diagonal().real <= 0.0):
        return False
    if A.nnz > FULL * A.shape[0] ** 2:
        try:
            np.linalg.cholesky(A.toarray())
        except np.linalg.LinAlgError:
            return False
        return True
    try:
        factor = _superlu(A, 0.0)
    except ZeroDivisionError:  # a pivot vanishes
        return False
    pivots = factor.U.diagonal()
    return bool(np.array_equal(factor.perm_r, factor.perm_c) and np.all(pivots.real > 0.0))
