"""lambda^2 M + lambda C + K of large sparse matrices: freed of units, on one pattern, its roots and
factors.

SuperLU comes with SciPy. MUMPS (extra `mumps`) takes a third of its time and half its memory where
solids have many rows, and is taken there if it is installed.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError, MatrixError
from squeal.linear.eigen import Eigenvalue, root_rounding
from squeal.linear.matrices import EPS, norm_of
from squeal.linear.system import Matrix, Term, TermSystem
from squeal.numerics.differentiation import Formula

ComplexArray = NDArray[np.complex128]
Array = NDArray[np.float64]
PARTS = ("M", "C", "K")
ROUNDING = 8 * EPS  # backward error that a computed root has at least
FULL = 0.2  # share of entries above which a matrix is factorised as a full one
PIVOT = 0.01  # a diagonal entry this large beside its column stays the pivot: far less fill
MUMPS_ROWS = 10_000  # below, SuperLU is as fast

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Quadratic:
    """P(lambda) = lambda^2 M + lambda C + K in coordinates z, q = scale z: S P S.

    M, C, K are CSC arrays (n, n) of one and the same pattern, C of zeros if undamped; `norms` are
    upper bounds of their 2-norms. M may be singular. All methods speak of z.
    """

    M: Any = field(repr=False)
    C: Any = field(repr=False)
    K: Any = field(repr=False)
    scale: Array = field(repr=False)  # (n,) powers of two
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
        return float(np.sqrt(self.norms[2] / self.norms[0]))

    def at(self, value: complex) -> Any:
        """P(value), a CSC array; real where both are."""
        value = value.real if value.imag == 0.0 else value
        return self._on_pattern(value * (value * self.M.data + self.C.data) + self.K.data)

    def slope(self, value: complex) -> Any:
        """dP/dlambda = 2 value M + C, a CSC array; real where both are."""
        value = value.real if value.imag == 0.0 else value
        return self._on_pattern(2 * value * self.M.data + self.C.data)

    def _on_pattern(self, data: NDArray) -> Any:
        from scipy.sparse import csc_array

        return csc_array((data, self.K.indices, self.K.indptr), shape=self.K.shape)

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
    system's own scale w and its own parameters: mixtures of units cost no accuracy. All terms
    share one pattern, so that the matrices at other parameters are sums of arrays. Raises
    InputError for a row without mass and stiffness, or a system without mass.
    """

    def __init__(self, system: TermSystem) -> None:
        from scipy.sparse import csc_array

        self.system = system
        terms = {part: [csc_array(t.matrix) for t in getattr(system, part)] for part in PARTS}
        self.scale = _scale(system, terms)
        n, matrices = system.n, [A for part in PARTS for A in terms[part]]
        for A in matrices:
            A.sum_duplicates()
        keys = [A.indices + n * np.repeat(np.arange(n), np.diff(A.indptr)) for A in matrices]
        pattern, place = np.unique(np.concatenate(keys), return_inverse=True)
        self._rows, self._ends = pattern % n, np.searchsorted(pattern // n, np.arange(n + 1))
        sizes = self.scale[self._rows] * self.scale[pattern // n]
        self._data: dict[str, list[NDArray]] = {part: [] for part in PARTS}
        ends = iter(np.cumsum([len(own) for own in keys]))
        for part in PARTS:
            for A in terms[part]:
                data, end = np.zeros(len(pattern), A.dtype), next(ends)
                own = place[end - A.nnz : end]
                data[own] = A.data * sizes[own]
                self._data[part].append(data)

    @property
    def n(self) -> int:
        """Number of degrees of freedom."""
        return len(self.scale)

    def at(self, changes: Mapping[str, float] | None = None) -> Quadratic:
        """The problem at the system's parameters, some of them changed."""
        p = self.system.values(changes)
        M, C, K = (self._sum(part, lambda factor: factor.value(p)) for part in PARTS)
        norms = norm_of(M), norm_of(C), norm_of(K)
        if not norms[0]:
            raise MatrixError("M: is zero beside C and K in double precision; a mass is required")
        if not np.isfinite(norms).all():
            raise MatrixError("M, C and K: all entries must be finite")
        return Quadratic(M, C, K, self.scale, norms)

    def slope(self, name: str, changes: Mapping[str, float] | None, value: complex) -> Any:
        """dP(value)/d name as a CSC array."""
        p = self.system.values(changes)
        M, C, K = (self._sum(part, lambda factor: factor.slope(p, name)) for part in PARTS)
        return value * value * M + value * C + K

    def terms(self, part: str) -> list[Any]:
        """The scaled matrices of M, C or K, in the order of the terms."""
        return [self._csc(data) for data in self._data[part]]

    def _sum(self, part: str, number: Callable[[Formula], float]) -> Any:
        total = np.zeros(len(self._rows))
        for term, data in zip(getattr(self.system, part), self._data[part], strict=True):
            if factor := number(term.factor):
                total = total + factor * data
        return self._csc(total)

    def _csc(self, data: NDArray) -> Any:
        from scipy.sparse import csc_array

        return csc_array((data, self._rows, self._ends), shape=(self.n, self.n))


def quadratic(M: Matrix, C: Matrix | None, K: Matrix) -> Quadratic:
    """The scaled problem of M q'' + C q' + K q = 0, matrices (n, n), sparse or dense.

    Raises InputError for a row without mass and stiffness, or without any mass.
    """
    damping = () if C is None else (Term(C),)
    return ScaledSystem(TermSystem((Term(M),), damping, (Term(K),))).at()


def _scale(system: TermSystem, terms: Mapping[str, list[Any]]) -> Array:
    mass, damping, stiffness = (
        sum(
            (
                abs(t.factor.value(system.parameters)) * _diagonal(A)
                for t, A in zip(getattr(system, part), terms[part], strict=True)
            ),
            np.zeros(system.n),
        )
        for part in PARTS
    )
    ratio = stiffness / np.where(mass > 0, mass, np.inf)
    square = float(np.median(ratio[ratio > 0])) if np.any(ratio > 0) else 1.0
    diagonal = square * mass + stiffness + np.sqrt(square) * damping
    if not np.all(diagonal > 0):
        row = int(np.argmin(diagonal > 0))
        raise MatrixError(
            f"row {row + 1} of M, C and K is empty; every row needs mass or stiffness"
        )
    return np.asarray(2.0 ** -np.round(np.log2(diagonal) / 2))


def _diagonal(A: Any) -> Array:
    """Size of the diagonal; where it is zero, of the column's largest entry."""
    diagonal = np.abs(A.diagonal())
    if np.any(diagonal == 0) and A.nnz:
        diagonal = np.where(diagonal > 0, diagonal, abs(A).max(axis=0).toarray().ravel())
    return np.asarray(diagonal, dtype=float)


@dataclass(frozen=True, eq=False)
class Roots:
    """Values (m,) with right vectors (n, m) and, as far as known, left ones (else NaN)."""

    values: ComplexArray
    right: ComplexArray = field(repr=False)
    left: ComplexArray = field(repr=False)

    def picked(self, which: NDArray) -> Roots:
        """Some of them, by mask or index."""
        return Roots(self.values[which], self.right[:, which], self.left[:, which])

    def mirrored(self) -> Roots:
        """The conjugate roots."""
        return Roots(self.values.conj(), self.right.conj(), self.left.conj())

    def joined(self, other: Roots) -> Roots:
        """These roots, then the others."""
        values = np.concatenate([self.values, other.values])
        return Roots(
            values, np.hstack([self.right, other.right]), np.hstack([self.left, other.left])
        )


def listed(problem: Quadratic, roots: Roots) -> tuple[Eigenvalue, ...]:
    """Roots with backward errors, conditions and `root_rounding`, by rising frequency.

    What rounding of K moves is the square of a slow root: its own size says less than the
    problem's rate. Exact zeros have no rounding.
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
    rounding = np.where(size > 0, root_rounding(values, own, error, scale), 0.0)
    x, y = _physical(problem, right), _physical(problem, left)
    numbers = residuals, condition, rounding
    eigenvalues = [
        Eigenvalue(complex(v), x[:, j], y[:, j], *(float(each[j]) for each in numbers))
        for j, v in enumerate(values)
    ]
    return tuple(
        sorted(eigenvalues, key=lambda e: (abs(e.value.imag), -e.value.real, -e.value.imag))
    )


def _physical(problem: Quadratic, z: ComplexArray) -> ComplexArray:
    """Columns (n, m) in the caller's coordinates: x^H M x = 1 if there is mass, largest part
    positive; NaN where a vector is unknown."""
    mass = np.abs(np.sum(z.conj() * (problem.M @ z), axis=0))
    size = np.where(mass == 0, np.linalg.norm(z, axis=0), np.sqrt(mass))
    largest = z[np.argmax(np.abs(z), axis=0), np.arange(z.shape[1])]
    with np.errstate(invalid="ignore"):
        vectors = problem.scale[:, None] * z * (np.abs(largest) / largest / size)
    vectors.setflags(write=False)
    return np.asarray(vectors)


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
            warnings.simplefilter("ignore")  # singular: refused below
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
    try:
        factor = _superlu(A, 0.0)
    except ZeroDivisionError:  # a pivot vanishes
        return False
    pivots = factor.U.diagonal()
    return bool(np.array_equal(factor.perm_r, factor.perm_c) and np.all(pivots.real > 0.0))
