"""Factorised sparse matrices: solutions, and the logarithm of the determinant.

SuperLU comes with SciPy. For solids of many rows PARDISO of MKL (extra `mkl`), if it is installed,
takes a third of its time and half its memory.
"""

from __future__ import annotations

import ctypes
import importlib.metadata
import sys
from contextlib import suppress
from enum import IntEnum
from functools import lru_cache
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError
from squeal.linear.matrices import Array, Matrix
from squeal.numerics.threads import side_by_side
from squeal.sparse.quadratic import ScaledProblem

if TYPE_CHECKING:
    from scipy.sparse import csc_array

PIVOT = 0.01
"""Of the largest entry of a column: a diagonal entry of at least this stays the pivot, which makes
far less fill."""
PARDISO_ROWS = 4_000  # below, SuperLU is as fast


class Factor:
    """A CSC matrix A (n, n) of finite real or complex doubles, or singles, factorised by SuperLU.

    `factorise` makes one of other matrices. Raises ZeroDivisionError if A is exactly singular: a
    pivot of zero would divide. Callers catch it, and try another shift or say what it means.
    """

    def __init__(self, matrix: csc_array) -> None:
        from scipy.sparse.linalg import splu

        self.matrix = matrix
        self.dtype = matrix.dtype
        try:
            # SuperLU's settings for matrices of nearly symmetric pattern: the ordering of A + A^T
            # makes little fill only if most pivots stay on the diagonal
            self.lu = splu(
                matrix,
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=PIVOT,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            if "singular" not in str(error):
                raise ComputationError(f"a sparse factorisation failed: {error}") from None
            raise ZeroDivisionError from None

    def solve(self, right: NDArray, transposed: bool = False) -> NDArray:
        """A^-1 right, or A'^-1 right (not conjugated); right (n,) or (n, m)."""
        if np.iscomplexobj(right) and self.dtype.kind != "c":
            parts = [right.real, right.imag]
            real, imaginary = side_by_side(self.solve, parts, [transposed, transposed])
            return real + 1j * imaginary
        return self._solve_own_type(np.ascontiguousarray(right, self.dtype), transposed)

    def _solve_own_type(self, right: NDArray, transposed: bool) -> NDArray:
        return self.lu.solve(right, "T" if transposed else "N")

    def __reduce__(self) -> tuple[object, ...]:
        return factorise, (self.matrix,)  # a factor stays in its process: another one factorises

    def logarithm(self) -> complex:
        """log det A, its imaginary part up to whole turns; by PARDISO up to half turns.

        A is P L U Q with unit L: the pivots are the diagonal of U, and each odd permutation turns
        the sign.
        """
        pivots = self.lu.U.diagonal().astype(complex)
        logarithm = complex(np.sum(np.log(pivots)))
        if _is_odd(self.lu.perm_r) != _is_odd(self.lu.perm_c):
            logarithm += 1j * np.pi
        return logarithm


def _is_odd(order: NDArray) -> bool:
    """True if a permutation is odd: n minus its number of cycles is then odd."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    n = len(order)
    graph = csr_array((np.ones(n), order, np.arange(n + 1)))  # an edge from each i to order[i]
    cycles, _ = connected_components(graph, directed=False)
    return bool((n - cycles) % 2)


@lru_cache(maxsize=1)
def _mkl() -> ctypes.CDLL:
    """The library of the package `mkl`, on one thread. Raises ImportError."""
    files = importlib.metadata.files("mkl") or ()
    library = next(file for file in files if file.name.startswith(("libmkl_rt.", "mkl_rt.")))
    mkl = ctypes.CDLL(str(library.locate()))
    mkl.MKL_Set_Threading_Layer(1)  # sequential
    return mkl


class _Phase(IntEnum):
    """What a call of PARDISO does."""

    RELEASE = -1
    ANALYSE_AND_FACTORISE = 12
    FACTORISE = 22
    SOLVE = 33


class _Control(IntEnum):
    """Entries of PARDISO's array `iparm`, counted from zero."""

    OWN_SETTINGS = 0
    ORDERING = 1
    PIVOT_PERTURBATION = 9
    TRANSPOSED = 11
    MOVED_PIVOTS = 13
    SINGLE_PRECISION = 27
    INDICES_FROM_ZERO = 34
    KEEP_PIVOTS = 55


NESTED_DISSECTION = 2
TRANSPOSE = 2
REAL_UNSYMMETRIC = 11
COMPLEX_UNSYMMETRIC = 13
EXACTLY_SINGULAR = -4


class _Pardiso(Factor):
    """A factor by MKL's PARDISO, which pivots within the diagonal blocks alone.

    PARDISO reads compressed rows. It gets the columns of the CSC array: the rows of the transpose.
    `reusable` is a factor that may lend its ordering and its memory, and solves nothing afterwards.
    Raises ZeroDivisionError if the matrix is singular to rounding.
    """

    def __init__(self, matrix: csc_array, library: ctypes.CDLL, reusable: Factor | None) -> None:
        self._library = library
        self.matrix = matrix
        self._n = matrix.shape[0]
        self.dtype = matrix.dtype
        columns_sorted = matrix.sorted_indices()
        self._data = columns_sorted.data
        self._starts = columns_sorted.indptr.astype(np.int32)
        self._indices = columns_sorted.indices.astype(np.int32)
        self._is_solving = Lock()  # one thread at a time
        # PARDISO's own arrays have 64 entries each
        self._memory = np.zeros(64, np.int64)  # zeros: none was handed out yet
        self._control = np.zeros(64, np.int32)
        is_single = self.dtype in (np.float32, np.complex64)
        self._control[_Control.OWN_SETTINGS] = 1
        self._control[_Control.ORDERING] = NESTED_DISSECTION
        self._control[_Control.PIVOT_PERTURBATION] = 6 if is_single else 13  # decimal digits
        self._control[_Control.SINGLE_PRECISION] = is_single
        self._control[_Control.INDICES_FROM_ZERO] = 1
        self._control[_Control.KEEP_PIVOTS] = 1
        if isinstance(reusable, _Pardiso) and reusable._can_lend_to(self):
            # the reusable factor gets the empty memory, and releases nothing at its end
            self._memory, reusable._memory = reusable._memory, self._memory
            self._call(_Phase.FACTORISE)
        else:
            self._call(_Phase.ANALYSE_AND_FACTORISE)
        if self._control[_Control.MOVED_PIVOTS]:  # vanishing pivots that PARDISO has replaced
            raise ZeroDivisionError

    def _can_lend_to(self, other: _Pardiso) -> bool:
        """True if the matrix of another factor has the same pattern, and the memory is not lent."""
        return bool(
            self._memory.any()
            and self.dtype == other.dtype
            and np.array_equal(self._starts, other._starts)
            and np.array_equal(self._indices, other._indices)
        )

    def _call(self, phase: _Phase, right: NDArray | None = None) -> NDArray:
        """One call of the library; in the phase SOLVE the solution for `right` (n,) or (n, m)."""
        rhs = np.zeros(0, self.dtype) if right is None else np.asfortranarray(right)
        solution = np.empty_like(rhs)
        error = np.zeros(1, np.int32)
        arguments: tuple[NDArray | int, ...] = (
            self._memory,
            1,  # how many factors the memory holds
            1,  # number of the factor of this call
            COMPLEX_UNSYMMETRIC if self.dtype.kind == "c" else REAL_UNSYMMETRIC,
            int(phase),
            self._n,
            self._data,
            self._starts,
            self._indices,
            np.zeros(self._n, np.int32),  # no ordering is prescribed
            rhs.shape[1] if rhs.ndim == 2 else 1,
            self._control,
            0,  # PARDISO prints nothing
            rhs,
            solution,
            error,
        )
        self._library.pardiso(*map(_pointer, arguments))
        if error[0] == EXACTLY_SINGULAR:
            raise ZeroDivisionError
        if error[0]:
            raise ComputationError(f"a sparse factorisation failed: PARDISO error {error[0]}")
        return solution

    def _solve_own_type(self, right: NDArray, transposed: bool) -> NDArray:
        if not right.size:
            return right
        # PARDISO has the transpose of A: to solve with A it has to transpose
        with self._is_solving:
            self._control[_Control.TRANSPOSED] = 0 if transposed else TRANSPOSE
            return self._call(_Phase.SOLVE, right)

    def logarithm(self) -> complex:
        pivots = np.empty(self._n, self.dtype)
        diagonal = np.empty(self._n, self.dtype)
        arguments: tuple[NDArray | int, ...] = (
            self._memory,
            pivots,  # receives them
            diagonal,  # receives the diagonal of the matrix, which is not read
            1,  # number of the factor of this call
            np.zeros(1, np.int32),  # receives an error code, which is not read
        )
        self._library.pardiso_getdiag(*map(_pointer, arguments))
        return complex(np.sum(np.log(pivots.astype(complex))))

    def __del__(self) -> None:
        if not sys.is_finalizing():
            with suppress(ComputationError, ZeroDivisionError):
                self._call(_Phase.RELEASE)


def _pointer(value: NDArray | int) -> ctypes.c_void_p:
    array = np.array(value, np.int32) if isinstance(value, int) else value
    return array.ctypes.data_as(ctypes.c_void_p)  # which holds the array


def factorise(matrix: csc_array, single: bool = False, reusable: Factor | None = None) -> Factor:
    """A factorised CSC matrix, in `single` precision at half the time and memory.

    `reusable` is a factor of a matrix of the same pattern that is no longer needed: it may lend its
    ordering and its memory, and solves nothing afterwards.

    PARDISO factorises matrices of at least `PARDISO_ROWS` rows if MKL is installed, SuperLU all
    others.

    Raises ZeroDivisionError if SuperLU finds the matrix exactly singular, or PARDISO finds it
    singular to rounding; ComputationError if an entry is not finite.
    """
    if not np.isfinite(matrix.data).all():
        raise ComputationError("a sparse factorisation failed: an entry is not finite")
    rounded = matrix
    if single:
        rounded = matrix.astype(np.complex64 if np.iscomplexobj(matrix.data) else np.float32)
    elif matrix.dtype.kind not in "fc":  # solutions of integers would be cut off to integers
        rounded = matrix.astype(float)
    if rounded.shape[0] >= PARDISO_ROWS:
        with suppress(ImportError):  # by `_mkl`, where the library is not installed
            return _Pardiso(rounded, _mkl(), reusable)
    return Factor(rounded)


def modes_near(
    K: Matrix, M: Matrix, shift: float, count: int, factor: Factor, seed: int = 0, **limits: int
) -> tuple[Array, Array]:
    """The `count` real modes of K x = s M x nearest to a shift, by inverse (Lanczos) iteration.

    Parameters
    ----------
    K, M : sparse array (n, n)
        Symmetric.
    shift : float
        In the unit of s.
    count : int
        How many.
    factor : Factor
        Of K - shift M.
    seed : int
        Of the random vector that the iteration starts from.
    limits : int
        Of the iteration, as `scipy.sparse.linalg.eigsh` takes them.

    Returns
    -------
    squares : array (count,)
        The eigenvalues s, in no order.
    shapes : array (n, count)
        The modes, with x' M x = 1.

    Raises
    ------
    ArpackError
        If the iteration does not converge.
    """
    from scipy.sparse.linalg import LinearOperator, eigsh

    inverse = LinearOperator(K.shape, matvec=factor.solve, dtype=float)
    start = np.random.default_rng(seed).standard_normal(K.shape[0])
    return eigsh(K, count, M, shift, OPinv=inverse, v0=start, **limits)


def factorise_at(
    problem: ScaledProblem, value: complex, single: bool = False, reusable: Factor | None = None
) -> tuple[complex, Factor]:
    """The value at which P was factorised, and the factor: `value`, or a value close by if P is
    exactly singular at `value` (rad/s). single, reusable: as `factorise` takes them.

    Raises ComputationError if P is singular at the value close by as well.
    """
    with suppress(ZeroDivisionError):
        return value, factorise(problem.at(value), single, reusable)
    # off the axes, on which roots lie
    shifted = value + 1e-6 * (1 + 0.5j) * (abs(value) or problem.frequency_scale or 1.0)
    with suppress(ZeroDivisionError):  # in double precision, whatever `single` says
        return shifted, factorise(problem.at(shifted), reusable=reusable)
    raise ComputationError(
        f"lambda^2 M + lambda C + K is singular at and around {value:.6g}: M, C and K share a "
        "null vector, a part that nothing holds and that has no mass"
    )
