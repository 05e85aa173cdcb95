"""lambda^2 M + lambda C + K of large sparse matrices: freed of units, its roots and factors.

SuperLU comes with SciPy. Where solids have many rows PARDISO of MKL (extra `mkl`), if it is
installed, takes a third of its time and half its memory.
"""

from __future__ import annotations

import ctypes
import importlib.metadata
import itertools
import math
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError, MatrixError
from squeal.linear.eigen import Eigenvalue, ordered, root_rounding
from squeal.linear.matrices import EPS, norm_of
from squeal.linear.system import Matrix, Term, TermSystem

ComplexArray = NDArray[np.complex128]
Array = NDArray[np.float64]
ROUNDING = 8 * EPS  # backward error that a computed root has at least
PIVOT = 0.01  # a diagonal entry this large beside its column stays the pivot: far less fill
PARDISO_ROWS = 4_000  # below, SuperLU is as fast

Progress = Callable[[str], None]
PROGRESS: ContextVar[Progress] = ContextVar("progress", default=lambda _: None)
"""What is called with a line about each step of a long computation."""


@dataclass(frozen=True, eq=False, repr=False)
class Quadratic:
    """P(lambda) = lambda^2 M + lambda C + K in coordinates z, q = scale z; M may be singular.

    M, C, K are CSC arrays (n, n), C of zeros if undamped; `norms` bound their 2-norms.
    """

    M: Any
    C: Any
    K: Any
    scale: Array  # (n,) powers of two
    norms: tuple[float, float, float]

    @property
    def n(self) -> int:
        """Number of degrees of freedom."""
        return len(self.scale)

    @property
    def real(self) -> bool:
        """True if all matrices are real, so that roots come in conjugate pairs."""
        return not any(np.iscomplexobj(A.data) for A in (self.M, self.C, self.K))

    @property
    def rate(self) -> float:
        """sqrt(|K| / |M|), an upper scale of the frequencies, rad/s."""
        mass, damping, stiffness = self.norms
        return stiffness / damping if mass == 0.0 else math.sqrt(stiffness / mass)

    def at(self, value: complex) -> Any:
        """P(value), a CSC array; real where both are."""
        value = value.real if value.imag == 0.0 else value
        return value * (value * self.M + self.C) + self.K

    def slope(self, value: complex) -> Any:
        """dP/dlambda = 2 value M + C, a CSC array; real where both are."""
        return 2 * (value.real if value.imag == 0.0 else value) * self.M + self.C

    def apply(self, values: ComplexArray, vectors: ComplexArray) -> ComplexArray:
        """P(values[j]) vectors[:, j] as columns (n, m)."""
        mass, damping, stiffness = (combined(A, vectors) for A in (self.M, self.C, self.K))
        return np.asarray(mass * values**2 + damping * values + stiffness)

    def backward_errors(self, values: ComplexArray, vectors: ComplexArray) -> Array:
        """|P x| / ((|v|^2 |M| + |v| |C| + |K|) |x|) for each column x of vectors (n, m)."""
        rest = np.linalg.norm(self.apply(values, vectors), axis=0)
        size = self.size(values) * np.linalg.norm(vectors, axis=0)
        return np.divide(rest, size, out=np.zeros_like(rest), where=size > 0)  # K = 0: root 0

    def size(self, values: ComplexArray) -> Array:
        """|v|^2 |M| + |v| |C| + |K| for each value, a bound of |P(v)|."""
        return np.asarray(np.polyval(self.norms, np.abs(values)))

    def transposed(self) -> Quadratic:
        """The problem of the left vectors: P(lambda)' y = 0, y not conjugated."""
        return Quadratic(self.M.T, self.C.T, self.K.T, self.scale, self.norms)


def combined(A: Any, columns: ComplexArray) -> ComplexArray:
    """A (n, k) times complex columns (k, m), of a real A without a complex copy of it."""
    real, imaginary = np.split(A @ np.hstack([columns.real, columns.imag]), 2, axis=1)
    return np.asarray(real + 1j * imaginary)


class ScaledSystem:
    """A system of terms in coordinates z, q = scale z, the same at all parameters.

    Rows and columns are scaled alike, by powers of two, to a unit diagonal of K + w^2 M at the
    system's own scale w and its own parameters: mixtures of units cost no accuracy. `terms` are the
    scaled matrices of M, of C and of K. Raises InputError for a row without mass and stiffness, or
    a system without mass.
    """

    def __init__(self, system: TermSystem) -> None:
        from scipy.sparse import csc_array

        self.system, self.n = system, system.n
        self.terms = [[csc_array(t.matrix, copy=True) for t in terms] for terms in system.parts]
        self._zero = csc_array((self.n, self.n))
        self.scale = _scale(system, self.terms)
        for A in itertools.chain(*self.terms):
            A.sum_duplicates()
            A.data = A.data * self.scale[A.indices] * np.repeat(self.scale, np.diff(A.indptr))

    def at(self, changes: Mapping[str, float] | None = None) -> Quadratic:
        """The problem at the system's parameters, some of them changed."""
        p = self.system.values(changes)
        M, C, K = self._sums(lambda factor: factor.value(p))
        norms = norm_of(M), norm_of(C), norm_of(K)
        if not norms[0] and not norms[1]:
            raise MatrixError("M: is zero beside K in double precision; M or C must not be")
        if not np.isfinite(norms).all():
            raise MatrixError("M, C and K: all entries must be finite")
        return Quadratic(M, C, K, self.scale, norms)

    def slope(self, name: str, changes: Mapping[str, float] | None, value: complex) -> Any:
        """dP(value)/d name as a CSC array."""
        p = self.system.values(changes)
        M, C, K = self._sums(lambda factor: factor.slope(p, name))
        return value * (value * M + C) + K

    def _sums(self, number: Callable[[Any], complex]) -> Iterator[Any]:
        for terms, each in zip(self.system.parts, self.terms, strict=True):
            factors = (number(term.factor) for term in terms)
            parts = (f * A for f, A in zip(factors, each, strict=True) if f)
            yield sum(parts, self._zero)


def quadratic(M: Matrix, C: Matrix | None, K: Matrix) -> Quadratic:
    """The scaled problem of M q'' + C q' + K q = 0, matrices (n, n), sparse or dense.

    Raises InputError for a row without mass and stiffness, or without any mass.
    """
    damping = () if C is None else (Term(C),)
    return ScaledSystem(TermSystem((Term(M),), damping, (Term(K),))).at()


def _scale(system: TermSystem, matrices: list[list[Any]]) -> Array:
    sizes = np.zeros((3, system.n))
    for size, terms, each in zip(sizes, system.parts, matrices, strict=True):
        for term, A in zip(terms, each, strict=True):
            diagonal = np.abs(A.diagonal())
            if A.nnz and not diagonal.all():  # where it is zero the column's largest entry serves
                largest = abs(A).max(axis=0).toarray().ravel()
                diagonal = np.where(diagonal > 0, diagonal, largest)
            size += abs(term.factor.value(system.parameters)) * diagonal
    mass, damping, stiffness = sizes
    ratio = stiffness / np.where(mass > 0, mass, np.inf)
    ratio = np.sort(ratio[ratio > 0])  # those of a mass that is rounding are the greatest
    square = float(ratio[(len(ratio) - 1) // 2]) if len(ratio) else _first_order_rate(sizes) ** 2
    diagonal = square * mass + stiffness + np.sqrt(square) * damping
    if not np.all(diagonal > 0):
        row = int(np.argmin(diagonal > 0)) + 1
        raise MatrixError(f"row {row} of M, C and K is empty; every row needs mass or stiffness")
    return np.asarray(2.0 ** -np.round(np.log2(diagonal) / 2))


def _first_order_rate(sizes: Array) -> float:
    """The rate of C q' + K q = 0, from the sizes (3, n) of the diagonals of M, C and K."""
    _, damping, stiffness = sizes
    rates = stiffness[damping > 0.0] / damping[damping > 0.0]
    return float(np.median(rates[rates > 0.0])) if np.any(rates > 0.0) else 1.0


@dataclass(frozen=True, eq=False)
class Roots:
    """Values (m,) with right vectors (n, m) and, as far as known, left ones (else NaN)."""

    values: ComplexArray
    right: ComplexArray = field(repr=False)
    left: ComplexArray = field(repr=False)

    def picked(self, which: NDArray) -> Roots:
        """Some of them, by mask or index."""
        return Roots(self.values[which], self.right[:, which], self.left[:, which])

    def joined(self, other: Roots) -> Roots:
        """These roots, then the others."""
        pairs = ((self.values, other.values), (self.right, other.right), (self.left, other.left))
        return Roots(*(np.concatenate(pair, axis=-1) for pair in pairs))

    def with_conjugates(self) -> Roots:
        """These roots, then the conjugates of those above the real axis."""
        upper = self.picked(self.values.imag > 0.0)
        return self.joined(Roots(upper.values.conj(), upper.right.conj(), upper.left.conj()))


def listed(problem: Quadratic, roots: Roots) -> tuple[Eigenvalue, ...]:
    """Roots with backward errors, conditions and `root_rounding`, by rising frequency.

    What rounding of K moves is the square of a slow root: its own size says less than the
    problem's rate. Exact zeros have no rounding. Vectors are in the caller's coordinates,
    x^H M x = 1 if there is mass, the largest part positive; NaN where one is unknown.
    """
    values, right, left = roots.values, roots.right, roots.left
    size = np.abs(values)
    residuals = problem.backward_errors(values, right)
    image = combined(problem.M, right * (2 * values)) + combined(problem.C, right)
    across = size * np.abs(np.sum(left.conj() * image, axis=0))
    lengths = np.linalg.norm(right, axis=0) * np.linalg.norm(left, axis=0)
    condition = np.full(len(values), np.inf)
    np.divide(problem.size(values) * lengths, across, out=condition, where=across != 0)
    error = np.maximum(residuals, ROUNDING)
    root, slow = np.sqrt(error), np.maximum(size, np.sqrt(error) * problem.rate)
    with np.errstate(invalid="ignore"):  # K = 0: the root is 0
        scale = np.fmax(size, root * problem.rate * (problem.rate / slow))
        own = np.minimum(condition, 1 / EPS) * size / scale
    lone = problem.real & (values.imag != 0) & ~np.isin(values.conj(), values)
    every = np.append(values, values[lone].conj())  # a root may meet its conjugate
    conditions, errors, scales = (np.append(a, a[lone]) for a in (own, error, scale))
    moved = root_rounding(every, conditions, errors, scales, 2 * problem.n)[: len(values)]
    rounding = np.where(size > 0, moved, 0.0)

    def physical(z: ComplexArray) -> ComplexArray:
        mass = np.abs(np.sum(z.conj() * (problem.M @ z), axis=0))
        length = np.where(mass == 0, np.linalg.norm(z, axis=0), np.sqrt(mass))
        vectors = problem.scale[:, None] * z
        largest = vectors[np.argmax(np.abs(vectors), axis=0), np.arange(z.shape[1])]
        with np.errstate(invalid="ignore"):
            vectors = vectors * (np.abs(largest) / largest / length)
        vectors.setflags(write=False)
        return np.asarray(vectors)

    x, y = physical(right), physical(left)
    numbers = np.array([residuals, condition, rounding]).T.tolist()
    return tuple(
        Eigenvalue(complex(values[j]), x[:, j], y[:, j], *numbers[j]) for j in ordered(values)
    )


# Factors


class Factor:
    """A CSC matrix A (n, n) factorised by SuperLU.

    Raises ZeroDivisionError if it is exactly singular.
    """

    def __init__(self, matrix: Any) -> None:
        from scipy.sparse.linalg import splu

        options = {"permc_spec": "MMD_AT_PLUS_A", "options": {"SymmetricMode": True}}
        self.kind = matrix.dtype
        try:
            self.lu = splu(matrix, diag_pivot_thresh=PIVOT, **options)
        except RuntimeError as error:
            if "singular" not in str(error):
                raise ComputationError(f"a sparse factorisation failed: {error}") from None
            raise ZeroDivisionError from None

    def solve(self, right: NDArray, transposed: bool = False) -> NDArray:
        """A^-1 right, or A'^-1 right (not conjugated); right (n,) or (n, m)."""
        if np.iscomplexobj(right) and self.kind.kind != "c":
            real, imaginary = (self.solve(x, transposed) for x in (right.real, right.imag))
            return np.asarray(real + 1j * imaginary)
        return np.asarray(self._solved(np.ascontiguousarray(right, self.kind), transposed))

    def _solved(self, right: NDArray, transposed: bool) -> Any:
        return self.lu.solve(right, "T" if transposed else "N")

    def __reduce__(self) -> tuple[type[None], tuple[()]]:
        return type(None), ()  # a factor stays in its process

    def logarithm(self) -> complex:
        """log det A, its imaginary part up to whole turns; by PARDISO up to half turns."""
        pivots = self.lu.U.diagonal().astype(complex)
        odd = _odd(self.lu.perm_r) != _odd(self.lu.perm_c)
        return complex(np.sum(np.log(pivots))) + (1j * np.pi if odd else 0j)


def _odd(order: NDArray) -> bool:
    """True if a permutation is odd: n minus its number of cycles."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    graph = csr_array((np.ones(len(order)), order, np.arange(len(order) + 1)))
    return bool((len(order) - connected_components(graph, directed=False)[0]) % 2)


@lru_cache(maxsize=1)
def _mkl() -> Any:
    """The library of the package `mkl`, on one thread. Raises ImportError."""
    names = importlib.metadata.files("mkl") or ()
    library = next(f for f in names if f.name.startswith(("libmkl_rt.", "mkl_rt.")))
    mkl = ctypes.CDLL(str(library.locate()))
    mkl.MKL_Set_Threading_Layer(1)  # sequential
    return mkl


class _Pardiso(Factor):
    """By MKL's PARDISO for unsymmetric matrices, whose pivots stay on the diagonal of blocks."""

    def __init__(self, matrix: Any, library: Any, like: Factor | None) -> None:
        self._library, self.kind = library, matrix.dtype
        matrix = matrix.sorted_indices()
        rows, columns = (x.astype(np.int32) for x in (matrix.indptr, matrix.indices))
        self._arrays = matrix.data, rows, columns
        self._control, self._memory = np.zeros(64, np.int32), np.zeros(64, np.int64)
        single = self.kind.itemsize == (8 if self.kind.kind == "c" else 4)
        # own settings, nested dissection, smallest pivots, precision, from 0, pivots are wanted
        for index, value in ((0, 1), (1, 2), (9, 6 if single else 13), (27, single), (34, 1)):
            self._control[index] = value
        self._control[55] = 1
        lent = isinstance(like, _Pardiso) and like._lends(self)
        if lent:
            self._memory, like._memory = like._memory, self._memory  # type: ignore[union-attr]
        self._call(22 if lent else 12)
        if self._control[13]:
            raise ZeroDivisionError

    def _lends(self, other: _Pardiso) -> bool:
        same = zip(self._arrays[1:], other._arrays[1:], strict=True)
        return self.kind == other.kind and all(np.array_equal(*pair) for pair in same)

    def _call(self, phase: int, right: NDArray | None = None) -> Any:
        right = np.zeros(0, self.kind) if right is None else np.asfortranarray(right)
        found, n = np.empty_like(right), len(self._arrays[1]) - 1
        many = right.shape[1] if right.ndim == 2 else 1
        kind, none, error = 13 if self.kind.kind == "c" else 11, *np.zeros((2, n), np.int32)
        given = self._memory, 1, 1, kind, phase, n, *self._arrays, none, many, self._control, 0
        self._library.pardiso(*map(_place, (*given, right, found, error)))
        if error[0] == -4:
            raise ZeroDivisionError
        if error[0]:
            raise ComputationError(f"a sparse factorisation failed: PARDISO error {error[0]}")
        return found

    def _solved(self, right: NDArray, transposed: bool) -> Any:
        self._control[11] = 0 if transposed else 2  # columns are rows of the transpose
        return self._call(33, right)

    def logarithm(self) -> complex:
        pivots = np.empty((2, len(self._arrays[1]) - 1), self.kind)
        given = self._memory, *pivots, 1, np.zeros(1, np.int32)
        self._library.pardiso_getdiag(*map(_place, given))
        return complex(np.sum(np.log(pivots[0].astype(complex))))

    def __del__(self) -> None:
        if not sys.is_finalizing():
            with suppress(ComputationError, ZeroDivisionError):
                self._call(-1)


def _place(one: NDArray | int) -> Any:
    array = np.array(one, np.int32) if isinstance(one, int) else one
    return array.ctypes.data_as(ctypes.c_void_p)  # which holds the array


def factorise(matrix: Any, single: bool = False, like: Factor | None = None) -> Factor:
    """A factorised CSC matrix, in `single` precision at half the time and memory.

    `like` is a factor of a matrix of the same pattern that is no longer needed: it may lend its
    ordering and its memory, and solves nothing afterwards.

    Raises ZeroDivisionError if it is exactly singular.
    """
    if single:
        matrix = matrix.astype(np.complex64 if np.iscomplexobj(matrix.data) else np.float32)
    if matrix.shape[0] >= PARDISO_ROWS:
        with suppress(ImportError):
            return _Pardiso(matrix, _mkl(), like)
    return Factor(matrix)


def factorise_at(
    problem: Quadratic, value: complex, single: bool = False, like: Factor | None = None
) -> tuple[complex, Factor]:
    """P(value) factorised; where it is singular, at a place close by, which is returned too.

    Raises ComputationError if it is singular there as well.
    """
    for nudge in (0.0, 1e-6):
        place = value + nudge * (1 + 0.5j) * (abs(value) or problem.rate)
        with suppress(ZeroDivisionError):
            return place, factorise(problem.at(place), single and not nudge, like)
    raise ComputationError(
        f"lambda^2 M + lambda C + K is singular at and around {value:.6g}: M, C and K share a "
        "null vector, a part that nothing holds and that has no mass"
    )
