"""The matrices of M q'' + C q' + K q = 0: checked, freed of their units, and their ranks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.errors import ComputationError, InputError, MatrixError

Array = NDArray[np.float64]
EPS = float(np.finfo(float).eps)
SKEW = 1e-12  # of a matrix: an unsymmetric part up to this is rounding
ILL = 1e-7  # reciprocal condition of M, its diagonal scaled to 1, below which it is not inverted
REQUIRED = "a well-conditioned matrix is required"
BEYOND = "M, C, K: the eigenvalues are beyond double precision"


class LightMassError(MatrixError):
    """M is singular, or so nearly that its inverse would cost the digits of other modes."""


@dataclass(frozen=True)
class Reduced:
    """z'' + B z' + A z = 0, where q = T z and T' M T = 1.

    A (n, n) in rad^2/s^2 and B (n, n) in rad/s, B None without damping: all entries carry the
    same unit whatever mixture of translations, rotations and masses M holds. A symmetric K gives
    a symmetric A.
    """

    A: Array
    B: Array | None
    T: Array
    rounding: float  # relative size of the errors that the reduction leaves in A

    @property
    def n(self) -> int:
        """Number of degrees of freedom."""
        return len(self.A)


def _square(name: str, value: ArrayLike, n: int | None = None) -> Array:
    try:
        found = np.asarray(value)
        if np.iscomplexobj(found) and found.imag.any():
            raise ValueError
        matrix = np.asarray(found.real, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name}: a square matrix of real numbers is required") from None
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not matrix.size:
        raise InputError(f"{name}: shape {matrix.shape}; a square matrix is required")
    if n is not None and len(matrix) != n:
        raise InputError(f"{name}: shape {matrix.shape}; M has shape {(n, n)}")
    if not np.all(np.isfinite(matrix)):
        raise InputError(f"{name}: all entries must be finite")
    return matrix


def checked(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> tuple[Array, Array | None, Array]:
    """The matrices as float arrays of one shape (n, n); a C of zeros becomes None.

    Raises InputError for anything that is not a square, finite matrix of the size of M.
    """
    mass = _square("M", M)
    damping = None if C is None else _square("C", C, len(mass))
    if damping is not None and not damping.any():
        damping = None
    return mass, damping, _square("K", K, len(mass))


def reduce(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> Reduced:
    """The system in mass-normalised coordinates; masses may differ by many decades.

    Raises InputError unless M is symmetric positive definite, ComputationError beyond double
    precision.
    """
    mass, damping, stiffness = checked(M, C, K)
    T, rounding = _factor(mass.tobytes(), len(mass))
    with np.errstate(all="ignore"):
        A, B = _normalised(T, stiffness), None if damping is None else _normalised(T, damping)
        size = np.linalg.norm(A) + (0.0 if B is None else np.linalg.norm(B) ** 2)
    if not np.isfinite(size):
        raise ComputationError(BEYOND)
    return Reduced(A, B, T, rounding)


def _normalised(T: Array, X: Array) -> Array:
    t = np.diag(T)
    if np.count_nonzero(T) == len(t):  # T is regular
        # symmetry of X survives to the last bit: one factor for each pair of entries
        return np.asarray(X * (t[:, None] * t))
    return T.T @ X @ T


@lru_cache(maxsize=8)  # along mu the mass matrix stays
def _factor(mass: bytes, n: int) -> tuple[Array, float]:
    """T with T' M T = 1, and the relative size of the errors that it brings."""
    M = np.frombuffer(mass).reshape(n, n)
    diagonal = np.diag(M)
    if np.any(diagonal < 0.0):
        raise MatrixError("M: its diagonal must be positive (M symmetric, positive definite)")
    if np.any(diagonal == 0.0):
        light_motions(M)
        row = int(np.argmin(diagonal)) + 1
        raise LightMassError(f"M: row {row} has no mass; {REQUIRED}")
    scale = 1.0 / np.sqrt(diagonal)
    unit = unit_diagonal(M)
    if np.abs(unit - unit.T).max() > SKEW:
        raise MatrixError("M: a symmetric matrix is required")
    if np.count_nonzero(M) == n:
        T, inverse = np.diag(scale), np.eye(n)
    else:
        least, *_, greatest = np.linalg.eigvalsh(unit)
        if least < -4 * EPS * n * greatest:
            raise MatrixError("M: a positive definite matrix is required")
        if least < ILL * greatest:
            size = max(least / greatest, 0.0)
            raise LightMassError(f"M: some motion has {size:.1g} of the others' mass; {REQUIRED}")
        inverse = np.linalg.inv(np.linalg.cholesky((unit + unit.T) / 2))
        T = scale[:, None] * inverse.T
    T.setflags(write=False)  # the cache holds it
    return T, 4 * EPS * float(np.linalg.norm(inverse, 2) ** 2)


def unit_diagonal(M: Any) -> Any:
    """A matrix (n, n) with a diagonal of ones where it has one: units cost no condition then."""
    size = np.sqrt(np.abs(np.diag(M)))
    size = 1.0 / np.where(size > 0, size, 1.0)
    return M * size[:, None] * size


def light_motions(M: Array) -> tuple[Array, Array]:
    """Rising masses (n,), 0 where they are rounding, of motions, the columns of T: T' M T diagonal.

    Raises InputError unless M is symmetric, positive semidefinite.
    """
    size = np.sqrt(np.abs(np.diag(M)))
    if not size.any():
        raise MatrixError("M: has no mass on its diagonal; a mass is required")
    masses, vectors = np.linalg.eigh(unit_diagonal(M))
    least = 4 * EPS * len(M) * masses[-1]
    if masses[0] < -least:
        raise MatrixError("M: a positive definite matrix is required")
    scale = 1.0 / np.where(size > 0, size, 1.0)
    return np.where(masses > least, masses, 0.0), scale[:, None] * vectors


def check_regular(M: Any, C: Any, K: Any) -> None:
    """Refuse matrices (n, n) for which every number is a root. Raises InputError."""
    sizes = [float(abs(X).max()) for X in (M, K)]
    rate = np.sqrt(sizes[1] / sizes[0]) if all(sizes) else 1.0
    for turn in (0.8 + 0.6j, -0.9 + 1.7j):  # no root but by accident, and not both
        z = rate * turn
        if scaled_rank(z * z * M + (0.0 if C is None else z * C) + K, 3) == len(M):
            return
    raise MatrixError("M, C and K: are singular together, so that every number is a root")


def rank_of(singular: Array, size: float | None = None) -> int:
    """How many falling singular values are more than rounding of a matrix of that size (2-norm)."""
    largest = size if size is not None else float(singular[0]) if len(singular) else 0.0
    return int(np.sum(singular > 4 * EPS * len(singular) * largest))


def scaled_rank(K: Any, passes: int = 2) -> int:
    """The rank of K with its rows and columns scaled to a largest entry of one: what is small
    beside others still counts."""
    for axis in (1, 0, 1)[:passes]:
        size = np.abs(K).max(axis=axis, keepdims=True)
        K = K / np.where(size > 0, size, 1.0)
    return rank_of(np.linalg.svd(K, compute_uv=False))


def first_order(A: Any, B: Any, rate: ArrayLike | None = None) -> tuple[Any, Array]:
    """The first-order form F (..., 2n, 2n) of z'' + B z' + A z = 0 in the time unit 1/rate, and
    rate (1/s; left out each system's own): F's eigenvalues times it are the roots (rad/s).
    """
    if rate is None:
        a, b = (np.linalg.norm(X, axis=(-2, -1)) for X in (A, B))
        rate = np.asarray(np.maximum(np.sqrt(a), b))
        # a power of two rounds nothing
        rate = 2.0 ** np.round(np.log2(rate, out=np.zeros_like(rate), where=rate > 0))
    n, rate = A.shape[-1], np.asarray(rate)
    turn = rate[..., None, None]
    state = np.zeros((*A.shape[:-2], 2 * n, 2 * n), dtype=np.result_type(A, B))
    state[..., :n, n:] = np.eye(n)
    np.multiply(A, -1.0 / turn**2, out=state[..., n:, :n])
    np.multiply(B, -1.0 / turn, out=state[..., n:, n:])
    return state, rate


def norm_of(A: Any) -> float:
    """sqrt(|A|_1 |A|_inf), which bounds the 2-norm, of an array or sparse array."""
    size = abs(A)
    return float(np.sqrt(size.sum(axis=0).max() * size.sum(axis=1).max()))


def noise_of(A: Any, rounding: float = 4 * EPS) -> float:
    """Singular values of A (n, n) up to this are rounding, of a relative size."""
    return 2 * len(A) * rounding * float(np.linalg.norm(A, 2))


def null_spaces(A: Any, noise: float) -> tuple[Any, Any]:
    """Orthonormal right and left null vectors (n, k) of A, whose singular values are noise."""
    left, singular, right = np.linalg.svd(A)
    rank = int(np.sum(singular > noise))
    return right[rank:].conj().T, left[:, rank:]


def zero_roots(A: Any, noise: float, M: Any = None) -> int:
    """Algebraic multiplicity of the root 0 of A - s M, from ranks instead of small roots.

    The null space is split off and the rest examined again until it has full rank, so that chains
    such as a free body (double zero root of the first-order problem) are counted to their end.
    Without M it is one.
    """
    count = 0
    while len(A):
        _, singular, right = np.linalg.svd(A)
        rank = int(np.sum(singular > noise))
        null, rest = np.split(right.conj().T, [rank], axis=1)[::-1]
        if not null.shape[1]:
            break
        count += null.shape[1]
        kept = rest
        if M is not None:
            kept = np.linalg.qr(M @ null, mode="complete")[0][:, null.shape[1] :]
            M = kept.conj().T @ M @ rest
        A = kept.conj().T @ A @ rest
    return count
