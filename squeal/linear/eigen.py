"""Complex eigenvalues of M q'' + C q' + K q = 0 with vectors, residuals and conditions."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.linear.matrices import (
    Array,
    Reduced,
    first_order,
    noise_of,
    null_spaces,
    rank_of,
    reduce,
    zero_roots,
)

ComplexArray = NDArray[np.complex128]
HIDDEN = 1e-2  # of the slowest root's square: rounding that hides it
STIFF = (
    "one stiffness or damping is so much greater than others that rounding of it hides the slow "
    "modes; values that differ by fewer decades are required"
)
FAST = 1e70  # rad/s: fourth powers overflow
MOST_SHOWN = 6  # frequencies in a representation


@dataclass(frozen=True, eq=False)
class Eigenvalue:
    """One eigenvalue (rad/s) of (value^2 M + value C + K) right = 0 and what is known of it."""

    value: complex
    right: ComplexArray = field(repr=False)  # (n,) mode shape, right^H M right = 1
    left: ComplexArray = field(repr=False)  # (n,) left^H (...) = 0, left^H M left = 1
    residual: float = field(
        repr=False
    )  # backward error: |P(value) x| / (|v|^2 |M| + |v| |C| + |K|), mass-normalised
    condition: float = field(
        repr=False
    )  # 1/|y^H x| of the standard problem solved (in value^2 if undamped), or inf

    @property
    def frequency_hz(self) -> float:
        """|Im| / (2 pi), in Hz."""
        return abs(self.value.imag) / (2 * math.pi)

    @property
    def growth_rate(self) -> float:
        """Real part, 1/s: positive where the motion grows."""
        return self.value.real

    @property
    def damping_ratio(self) -> float:
        """-Re / |value|; 0 for a rigid-body root, which neither grows nor decays."""
        return -self.value.real / abs(self.value) + 0.0 if self.value else 0.0

    def to_dict(self) -> dict[str, float]:
        """real, imag (rad/s), frequency_hz and damping_ratio."""
        return {
            "real": self.value.real,
            "imag": self.value.imag,
            "frequency_hz": self.frequency_hz,
            "damping_ratio": self.damping_ratio,
        }


@dataclass(frozen=True, eq=False, repr=False)
class Spectrum:
    """All 2n eigenvalues, by rising frequency; of one frequency the fastest growing first.

    Conjugate pairs stand together, positive imaginary part first.
    """

    eigenvalues: tuple[Eigenvalue, ...]
    undamped: bool
    rigid_body_roots: int  # eigenvalues that are exactly zero

    @property
    def values(self) -> ComplexArray:
        """The eigenvalues as an array (2n,), rad/s."""
        return np.array([e.value for e in self.eigenvalues])

    @property
    def frequencies_hz(self) -> Array:
        """Frequencies in Hz of the modes (n,), of which each has two eigenvalues."""
        return np.array([e.frequency_hz for e in self.eigenvalues[::2]])

    @property
    def dominant(self) -> Eigenvalue:
        """The eigenvalue of largest real part (of several, the one of largest frequency)."""
        return max(self.eigenvalues, key=lambda e: (e.value.real, e.value.imag))

    def __len__(self) -> int:
        return len(self.eigenvalues)

    def __repr__(self) -> str:
        shown = ", ".join(f"{f:.6g}" for f in self.frequencies_hz[:MOST_SHOWN])
        more = ", ..." if len(self) > 2 * MOST_SHOWN else ""
        growth = self.dominant.growth_rate
        return f"Spectrum({len(self)} eigenvalues, {shown}{more} Hz, growth {growth:.6g} 1/s)"


def ordered(values: ComplexArray) -> NDArray[np.intp]:
    """Indices that sort eigenvalues (..., m) as a Spectrum does, along the last axis."""
    # an exact conjugate pair or quadruple has equal |Im|, so the later keys decide within it;
    # of repeated eigenvalues the first is paired with the first conjugate, and so on
    equal = values[..., :, None] == values[..., None, :]
    occurrence = np.sum(np.tril(equal, -1), axis=-1)
    keys = (-values.imag, occurrence, -values.real, np.abs(values.imag))
    return np.lexsort(keys, axis=-1)


def _left_vectors(A: Array, values: ComplexArray, right: ComplexArray) -> ComplexArray:
    """Unit left eigenvectors as columns.

    Rows of the inverse where the right vectors are independent; near a coalescence, where the
    inverse loses digits, the left null vector of A - s one by one.
    """
    singular = np.linalg.svd(right, compute_uv=False)
    if singular[-1] > 1e-6 * singular[0]:
        left = np.linalg.inv(right).conj().T
    else:
        shifted = A[None] - values[:, None, None] * np.eye(len(A))
        left = np.linalg.svd(shifted)[0][:, :, -1].T
    return left / np.linalg.norm(left, axis=0)


def standard_eigenvalues(
    A: Array, rounding: float, stiffness: Array | None = None
) -> tuple[ComplexArray, ComplexArray, ComplexArray, Array]:
    """Eigenvalues, unit right and left vectors, conditions 1/|y^H x| of a real matrix.

    Zero roots counted by rank are set to exactly zero, with vectors from the null spaces; of a
    first-order matrix with a regular `stiffness` block there are none, however strong the damping.
    """
    values, right = np.linalg.eig(A)
    values, right = values.astype(complex), right.astype(complex)
    left = _left_vectors(A, values, right)
    regular = stiffness is not None and not zero_roots(stiffness, noise_of(stiffness, rounding))
    noise = noise_of(A, rounding)
    zeros = 0 if regular else zero_roots(A, noise)
    if zeros:
        where = np.argsort(np.abs(values))[:zeros]
        values[where] = 0.0
        null, conull = null_spaces(A, noise)
        overlap = conull.T @ null
        if zeros == null.shape[1] and np.linalg.cond(overlap) < 1e8:
            conull = conull @ np.linalg.inv(overlap).T  # biorthogonal within the null spaces
        pick = np.arange(zeros) % null.shape[1]  # a chain repeats its one vector
        right[:, where], left[:, where] = null[:, pick], conull[:, pick]
        left[:, where] /= np.linalg.norm(left[:, where], axis=0)
    cosine = np.abs(np.sum(left.conj() * right, axis=0))
    with np.errstate(divide="ignore"):
        return values, right, left, 1.0 / cosine


def axis_noise(A: Array, values: ComplexArray, condition: Array, rounding: float) -> Array:
    """How far from an axis an eigenvalue of A that lies on it may be computed, unit of A.

    Condition number times backward error; but no more than the m-th root of the relative error,
    which is what m coalescing eigenvalues spread by (m: those found close together, at least 2).
    """
    error, norm = 2 * len(A) * rounding, float(np.linalg.norm(A, 2))
    close = np.abs(values[:, None] - values[None, :]) <= 4 * error ** (1 / 3) * norm
    cluster = np.maximum(2, close.sum(axis=1))
    return np.asarray(norm * np.minimum(error * condition, error ** (1 / cluster)))


def squared_frequencies(reduced: Reduced) -> tuple[ComplexArray, ComplexArray, ComplexArray, Array]:
    """The n roots s = -lambda^2 of an undamped system; vectors and conditions as columns.

    A complex pair whose imaginary part is within its own rounding error (condition times backward
    error of A, both known) is a coalescence and is returned as a real double root.
    """
    values, right, left, condition = standard_eigenvalues(reduced.A, reduced.rounding)
    real = np.abs(values.imag) <= axis_noise(reduced.A, values, condition, reduced.rounding)
    values[real] = values.real[real]
    return values, right, left, condition


def scaled_rank(K: Array) -> int:
    """The rank of K with its rows and columns scaled to a largest entry of one: what is small
    beside others still counts."""
    for axis in (1, 0):
        size = np.abs(K).max(axis=axis, keepdims=True)
        K = K / np.where(size > 0, size, 1.0)
    return rank_of(np.linalg.svd(np.asarray(K, dtype=np.float64), compute_uv=False))


def hidden_share(reduced: Reduced, K: Array) -> float:
    """How much of the slowest mode's stiffness rounding of A or B may be, infinite where all of it:
    where a mass is light, a spring stiff or a damper strong beside the others."""
    sizes = np.linalg.svd(reduced.A, compute_uv=False)
    square = sizes[0]
    if reduced.B is not None:
        square = max(square, float(np.linalg.norm(reduced.B, 2)) ** 2)
    error = 2 * reduced.n * reduced.rounding
    present = sizes[sizes > error * sizes[0]]
    if len(present) != scaled_rank(K):
        return np.inf
    return float(error * square / present[-1]) if len(present) else 0.0


def hidden(reduced: Reduced, K: Array) -> bool:
    """True if rounding leaves slow modes too few digits, see `hidden_share`."""
    return hidden_share(reduced, K) > HIDDEN


def _residuals(reduced: Reduced, values: ComplexArray, x: ComplexArray) -> list[float]:
    """Backward errors of roots (m,) with vectors (n, m)."""
    A, B = reduced.A, np.zeros_like(reduced.A) if reduced.B is None else reduced.B
    fastest = float(np.abs(values).max())
    if fastest > FAST:
        unit = math.frexp(fastest)[1]  # a power of two rounds nothing
        A, B = np.ldexp(A, -2 * unit), np.ldexp(B, -unit)
        values = values * 2.0**-unit
    A_norm, B_norm = np.linalg.norm(A, 2), np.linalg.norm(B, 2)
    length = np.abs(values)
    size = (length**2 + length * B_norm + A_norm) * np.linalg.norm(x, axis=0)
    rest = np.linalg.norm(values**2 * x + values * (B @ x) + A @ x, axis=0)
    return np.divide(rest, size, out=np.zeros_like(rest), where=size > 0).tolist()


def _physical(T: Array, z: ComplexArray) -> ComplexArray:
    """A unit mass-normalised vector in the caller's coordinates, its largest part positive."""
    z = z / np.linalg.norm(z)
    largest = z[np.argmax(np.abs(z))]
    vector = T @ (z * (abs(largest) / largest))
    vector.setflags(write=False)
    return np.asarray(vector, dtype=complex)


def complex_eigenvalues(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> Spectrum:
    """All 2n eigenvalues of M q'' + C q' + K q = 0.

    M (n, n) symmetric positive definite, C (n, n) or None, K (n, n), any consistent units.
    Without damping the n x n problem in lambda^2 is solved, so that marginal modes have real
    parts, and divergent ones imaginary parts, of exactly zero. Raises InputError, and
    OverflowError if roots are beyond double precision.
    """
    return spectrum_of(reduce(M, C, K))


def spectrum_of(reduced: Reduced) -> Spectrum:
    """As `complex_eigenvalues`, for a system in mass-normalised coordinates."""
    rows: list[tuple[complex, ComplexArray, ComplexArray, float]] = []
    if reduced.B is None:
        squares, right, left, condition = squared_frequencies(reduced)
        for k, s in enumerate(squares):
            # the partner of s is its exact conjugate: one root serves both
            root = np.sqrt(-complex(s.real, abs(s.imag)))
            if s.imag < 0:
                root = root.conjugate()
            root = complex(0.0, abs(root.imag)) if s.imag == 0 and s.real > 0 else complex(root)
            rows += [(v + 0.0, right[:, k], left[:, k], float(condition[k])) for v in (root, -root)]
    else:
        matrix, rate = first_order(reduced.A, reduced.B)
        values, right, left, condition = standard_eigenvalues(matrix, reduced.rounding, reduced.A)
        n = reduced.n
        for k, v in enumerate(values * rate):
            rows.append((complex(v), right[:n, k], left[n:, k], float(condition[k])))
    order = ordered(np.array([row[0] for row in rows]))
    rows = [rows[k] for k in order]
    shapes = np.array([x for _, x, _, _ in rows]).T
    residuals = _residuals(reduced, np.array([v for v, *_ in rows]), shapes)
    eigenvalues = tuple(
        Eigenvalue(v, _physical(reduced.T, x), _physical(reduced.T, y), r, c)
        for (v, x, y, c), r in zip(rows, residuals, strict=True)
    )
    zeros = sum(e.value == 0 for e in eigenvalues)
    return Spectrum(eigenvalues, reduced.B is None, zeros)
