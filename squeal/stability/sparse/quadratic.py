"""lambda^2 M + lambda C + K of large sparse matrices, freed of units, evaluated on one pattern."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError
from squeal.stability.terms import Matrix

ComplexArray = NDArray[np.complex128]
Array = NDArray[np.float64]


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
        if value.imag == 0.0:
            value = value.real
        return self._combined(value * value, value, 1.0)

    def slope(self, value: complex) -> Any:
        """dP/dlambda = 2 value M + C, a CSC array."""
        return self._combined(2 * value, 1.0, 0.0)

    def _combined(self, m: complex, c: complex, k: complex) -> Any:
        from scipy.sparse import csc_array

        data = m * self.M.data + c * self.C.data + k * self.K.data
        return csc_array((data, self.K.indices, self.K.indptr), shape=self.K.shape)

    def apply(self, values: ComplexArray, vectors: ComplexArray) -> ComplexArray:
        """P(values[j]) vectors[:, j] as columns (n, m)."""
        result = self.M @ (vectors * values**2) + self.C @ (vectors * values) + self.K @ vectors
        return np.asarray(result)

    def backward_errors(self, values: ComplexArray, vectors: ComplexArray) -> Array:
        """|P x| / ((|v|^2 |M| + |v| |C| + |K|) |x|) for each column x of vectors (n, m)."""
        size = np.abs(values)
        weight = size**2 * self.norms[0] + size * self.norms[1] + self.norms[2]
        rest = np.linalg.norm(self.apply(values, vectors), axis=0)
        return np.asarray(rest / (weight * np.linalg.norm(vectors, axis=0)))

    def transposed(self) -> Quadratic:
        """The problem of the left vectors: P(lambda)' y = 0, y not conjugated."""
        return Quadratic(
            self.M.T.tocsc(), self.C.T.tocsc(), self.K.T.tocsc(), self.scale, self.norms
        )


def quadratic(M: Matrix, C: Matrix | None, K: Matrix) -> Quadratic:
    """The scaled problem of M q'' + C q' + K q = 0, matrices (n, n), sparse or dense.

    Rows and columns are scaled alike, by powers of two, to a unit diagonal of K + w^2 M at the
    system's own scale w: mixtures of units cost no accuracy. Raises InputError for a row without
    mass and stiffness.
    """
    from scipy.sparse import csc_array

    given = [csc_array(A) for A in (M, K if C is None else C, K)]
    if C is None:
        given[1] = csc_array(given[0].shape)
    sizes = [_diagonal(A) for A in given]
    ratio = sizes[2] / np.where(sizes[0] > 0, sizes[0], np.inf)
    positive = ratio[ratio > 0]
    square = float(np.median(positive)) if len(positive) else 1.0
    diagonal = square * sizes[0] + sizes[2] + np.sqrt(square) * sizes[1]
    if not np.all(diagonal > 0):
        row = int(np.argmin(diagonal > 0))
        raise InputError(f"row {row + 1} of M, C and K is empty; every row needs mass or stiffness")
    scale = 2.0 ** -np.round(np.log2(diagonal) / 2)
    same = _on_one_pattern([_scaled(A, scale) for A in given])
    mass, damping, stiffness = map(_norm, same)
    if not mass:
        raise InputError("M: is zero; a mass is required")
    return Quadratic(same[0], same[1], same[2], scale, (mass, damping, stiffness))


def _diagonal(A: Any) -> Array:
    """Size of the diagonal; where it is zero, of the column's largest entry."""
    diagonal = np.abs(A.diagonal())
    if np.any(diagonal == 0):
        largest = np.asarray(
            abs(A).max(axis=0).todense() if A.nnz else np.zeros(A.shape[0])
        ).ravel()
        diagonal = np.where(diagonal > 0, diagonal, largest)
    return np.asarray(diagonal, dtype=float)


def _scaled(A: Any, scale: Array) -> Any:
    result = A.copy()
    columns = np.repeat(np.arange(A.shape[1]), np.diff(A.indptr))
    result.data = A.data * scale[A.indices] * scale[columns]
    return result


def _on_one_pattern(matrices: list[Any]) -> list[Any]:
    """The matrices with explicit zeros where any of them has an entry."""
    from scipy.sparse import csc_array

    shape = matrices[0].shape
    ones = [csc_array((np.ones(A.nnz), A.indices, A.indptr), shape=shape) for A in matrices]
    pattern = ones[0] + ones[1] + ones[2]
    pattern.sort_indices()
    n = shape[0]
    keys = _keys(pattern, n)
    result = []
    for A in matrices:
        A.sum_duplicates()
        data = np.zeros(len(keys), dtype=A.data.dtype)
        data[np.searchsorted(keys, _keys(A, n))] = A.data
        result.append(csc_array((data, pattern.indices, pattern.indptr), shape=shape))
    return result


def _keys(A: Any, n: int) -> NDArray[np.int64]:
    columns = np.repeat(np.arange(n, dtype=np.int64), np.diff(A.indptr))
    return np.asarray(columns * n + A.indices)


def _norm(A: Any) -> float:
    """sqrt(|A|_1 |A|_inf), which bounds the 2-norm."""
    size = abs(A)
    return float(np.sqrt(size.sum(axis=0).max() * size.sum(axis=1).max()))
