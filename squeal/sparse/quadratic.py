"""lambda^2 M + lambda C + K of large sparse matrices, freed of units, evaluated on one pattern."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
        """dP/dlambda = 2 value M + C, a CSC array; real where both are."""
        if value.imag == 0.0:
            value = value.real
        return self._combined(2 * value, 1.0, 0.0)

    def _combined(self, m: complex, c: complex, k: complex) -> Any:
        from scipy.sparse import csc_array

        data = m * self.M.data + c * self.C.data + k * self.K.data
        return csc_array((data, self.K.indices, self.K.indptr), shape=self.K.shape)

    def apply(self, values: ComplexArray, vectors: ComplexArray) -> ComplexArray:
        """P(values[j]) vectors[:, j] as columns (n, m)."""
        parts = np.hstack([vectors.real, vectors.imag])  # of real matrices less work
        m, c, k = (np.split(A @ parts, 2, axis=1) for A in (self.M, self.C, self.K))
        mass, damping, stiffness = (x + 1j * y for x, y in (m, c, k))
        return np.asarray(mass * values**2 + damping * values + stiffness)

    def backward_errors(self, values: ComplexArray, vectors: ComplexArray) -> Array:
        """|P x| / ((|v|^2 |M| + |v| |C| + |K|) |x|) for each column x of vectors (n, m)."""
        rest = np.linalg.norm(self.apply(values, vectors), axis=0)
        return np.asarray(rest / (self.size(values) * np.linalg.norm(vectors, axis=0)))

    def size(self, values: ComplexArray) -> Array:
        """|v|^2 |M| + |v| |C| + |K| for each value, a bound of |P(v)|."""
        size = np.abs(values)
        return np.asarray(size**2 * self.norms[0] + size * self.norms[1] + self.norms[2])

    def transposed(self) -> Quadratic:
        """The problem of the left vectors: P(lambda)' y = 0, y not conjugated."""
        return Quadratic(
            self.M.T.tocsc(), self.C.T.tocsc(), self.K.T.tocsc(), self.scale, self.norms
        )


def combined(V: Array, inner: ComplexArray) -> ComplexArray:
    """V inner of a real V (n, d) and complex columns (d, m), without a complex copy of V."""
    real, imaginary = np.split(V @ np.hstack([inner.real, inner.imag]), 2, axis=1)
    return np.asarray(real + 1j * imaginary)
