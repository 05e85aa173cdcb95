"""lambda^2 M + lambda C + K of large sparse matrices: freed of units, on one pattern, its roots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.errors import MatrixError
from squeal.linear.eigen import Eigenvalue, root_rounding
from squeal.linear.matrices import EPS, norm_of
from squeal.linear.system import Matrix, Term, TermSystem

ComplexArray = NDArray[np.complex128]
Array = NDArray[np.float64]
PARTS = ("M", "C", "K")
ROUNDING = 8 * EPS  # backward error that a computed root has at least


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
        return self._combined(value * value, value, 1.0)

    def slope(self, value: complex) -> Any:
        """dP/dlambda = 2 value M + C, a CSC array; real where both are."""
        value = value.real if value.imag == 0.0 else value
        return self._combined(2 * value, 1.0, 0.0)

    def _combined(self, m: complex, c: complex, k: complex) -> Any:
        from scipy.sparse import csc_array

        data = m * self.M.data + c * self.C.data + k * self.K.data
        return csc_array((data, self.K.indices, self.K.indptr), shape=self.K.shape)

    def apply(self, values: ComplexArray, vectors: ComplexArray) -> ComplexArray:
        """P(values[j]) vectors[:, j] as columns (n, m)."""
        mass, damping, stiffness = (combined(A, vectors) for A in (self.M, self.C, self.K))
        return np.asarray(mass * values**2 + damping * values + stiffness)

    def backward_errors(self, values: ComplexArray, vectors: ComplexArray) -> Array:
        """|P x| / ((|v|^2 |M| + |v| |C| + |K|) |x|) for each column x of vectors (n, m)."""
        rest = np.linalg.norm(self.apply(values, vectors), axis=0)
        return np.asarray(rest / (self.size(values) * np.linalg.norm(vectors, axis=0)))

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

        self.system = system = system.simplified()
        terms = [[csc_array(t.matrix) for t in getattr(system, part)] for part in PARTS]
        self.scale = _scale(system, terms)
        flat = [_scaled(A, self.scale) for part in terms for A in part]
        self._pattern, data = _on_one_pattern(flat)
        self._data: dict[str, list[NDArray]] = {}
        for part, matrices in zip(PARTS, terms, strict=True):
            self._data[part], data = data[: len(matrices)], data[len(matrices) :]

    @property
    def n(self) -> int:
        """Number of degrees of freedom."""
        return len(self.scale)

    def at(self, changes: Mapping[str, float] | None = None) -> Quadratic:
        """The problem at the system's parameters, some of them changed."""
        p = self.system.values(changes)
        M, C, K = (
            self._sum(part, [t.factor.value(p) for t in getattr(self.system, part)])
            for part in PARTS
        )
        norms = norm_of(M), norm_of(C), norm_of(K)
        if not norms[0]:
            raise MatrixError("M: is zero beside C and K in double precision; a mass is required")
        if not np.isfinite(norms).all():
            raise MatrixError("M, C and K: all entries must be finite")
        return Quadratic(M, C, K, self.scale, norms)

    def slope(self, name: str, changes: Mapping[str, float] | None, value: complex) -> Any:
        """dP(value)/d name as a CSC array."""
        p = self.system.values(changes)
        slopes = [
            self._sum(part, [t.factor.slope(p, name) for t in getattr(self.system, part)])
            for part in PARTS
        ]
        return value * value * slopes[0] + value * slopes[1] + slopes[2]

    def terms(self, part: str) -> list[Any]:
        """The scaled matrices of M, C or K, in the order of the terms."""
        return [self._csc(data) for data in self._data[part]]

    def _sum(self, part: str, factors: list[float]) -> Any:
        total = np.zeros(len(self._pattern.indices))
        for factor, data in zip(factors, self._data[part], strict=True):
            if factor:
                total = total + factor * data
        return self._csc(total)

    def _csc(self, data: NDArray) -> Any:
        from scipy.sparse import csc_array

        pattern = self._pattern
        return csc_array((data, pattern.indices, pattern.indptr), shape=pattern.shape)


def quadratic(M: Matrix, C: Matrix | None, K: Matrix) -> Quadratic:
    """The scaled problem of M q'' + C q' + K q = 0, matrices (n, n), sparse or dense.

    Raises InputError for a row without mass and stiffness, or without any mass.
    """
    damping = () if C is None else (Term(C),)
    return ScaledSystem(TermSystem((Term(M),), damping, (Term(K),))).at()


def _scale(system: TermSystem, terms: list[list[Any]]) -> Array:
    p = system.parameters
    sizes = []
    for part, matrices in zip(PARTS, terms, strict=True):
        size = np.zeros(system.n)
        for term, matrix in zip(getattr(system, part), matrices, strict=True):
            size += abs(term.factor.value(p)) * _diagonal(matrix)
        sizes.append(size)
    ratio = sizes[2] / np.where(sizes[0] > 0, sizes[0], np.inf)
    positive = ratio[ratio > 0]
    square = float(np.median(positive)) if len(positive) else 1.0
    diagonal = square * sizes[0] + sizes[2] + np.sqrt(square) * sizes[1]
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


def _scaled(A: Any, scale: Array) -> Any:
    result = A.copy()
    result.data = A.data * scale[A.indices] * np.repeat(scale, np.diff(A.indptr))
    return result


def _on_one_pattern(matrices: list[Any]) -> tuple[Any, list[NDArray]]:
    """A pattern with all entries of the matrices, and the data of each on it."""
    from scipy.sparse import csc_array

    shape = matrices[0].shape
    ones = [csc_array((np.ones(A.nnz), A.indices, A.indptr), shape=shape) for A in matrices]
    pattern = sum(ones[1:], ones[0])
    pattern.sort_indices()
    keys = _keys(pattern)
    result = []
    for A in matrices:
        A.sum_duplicates()
        data = np.zeros(len(keys), dtype=A.data.dtype)
        data[np.searchsorted(keys, _keys(A))] = A.data
        result.append(data)
    return pattern, result


def _keys(A: Any) -> NDArray[np.int64]:
    n = A.shape[0]
    columns = np.repeat(np.arange(n, dtype=np.int64), np.diff(A.indptr))
    return np.asarray(columns * n + A.indices)


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

    What rounding of K moves is the square of a slow root: its own size tells less than the
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
    scale = np.maximum(size, root * problem.rate * (problem.rate / slow))
    own = np.minimum(condition, 1 / EPS) * size / scale
    rounding = np.where(size > 0, root_rounding(values, own, error, scale), 0.0)
    x, y = _physical(problem, right), _physical(problem, left)
    told = residuals, condition, rounding
    found = [
        Eigenvalue(complex(v), x[:, j], y[:, j], *(float(each[j]) for each in told))
        for j, v in enumerate(values)
    ]
    return tuple(sorted(found, key=lambda e: (abs(e.value.imag), -e.value.real, -e.value.imag)))


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
