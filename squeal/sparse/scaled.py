"""Sparse systems of terms, freed of units and laid out on one pattern."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.errors import MatrixError
from squeal.linear.matrices import norm_of
from squeal.linear.system import Matrix, Term, TermSystem
from squeal.sparse.quadratic import Array, Quadratic

PARTS = ("M", "C", "K")


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
            self._array(part, [t.factor.value(p) for t in getattr(self.system, part)])
            for part in PARTS
        )
        mass = norm_of(M)
        if not mass:
            there = any(norm_of(t.matrix) for t in self.system.M)
            beside = " beside C and K in double precision" if there else ""
            raise MatrixError(f"M: is zero{beside}; a mass is required")
        norms = mass, norm_of(C), norm_of(K)
        if not np.isfinite(norms).all():
            raise MatrixError("M, C and K: all entries must be finite")
        return Quadratic(M, C, K, self.scale, norms)

    def slope(self, name: str, changes: Mapping[str, float] | None, value: complex) -> Any:
        """dP(value)/d name as a CSC array."""
        p = self.system.values(changes)
        result = None
        for part, power in zip(PARTS, (value * value, value, 1.0), strict=True):
            slopes = [t.factor.slope(p, name) for t in getattr(self.system, part)]
            term = power * self._array(part, slopes)
            result = term if result is None else result + term
        return result

    def terms(self, part: str) -> list[Any]:
        """The scaled matrices of M, C or K, in the order of the terms."""
        return [self._csc(data) for data in self._data[part]]

    def _array(self, part: str, factors: list[float]) -> Any:
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


def _on_one_pattern(matrices: list[Any]) -> tuple[Any, list[NDArray]]:
    """A pattern with all entries of the matrices, and the data of each on it."""
    from scipy.sparse import csc_array

    shape = matrices[0].shape
    ones = [csc_array((np.ones(A.nnz), A.indices, A.indptr), shape=shape) for A in matrices]
    pattern = sum(ones[1:], ones[0])
    pattern.sort_indices()
    n = shape[0]
    keys = _keys(pattern, n)
    result = []
    for A in matrices:
        A.sum_duplicates()
        data = np.zeros(len(keys), dtype=A.data.dtype)
        data[np.searchsorted(keys, _keys(A, n))] = A.data
        result.append(data)
    return pattern, result


def _keys(A: Any, n: int) -> NDArray[np.int64]:
    columns = np.repeat(np.arange(n, dtype=np.int64), np.diff(A.indptr))
    return np.asarray(columns * n + A.indices)
