"""The matrices of M q'' + C q' + K q = 0: checked, free of units, their ranks and invariants.

Invariants decide on undamped systems of up to three rows without eigenvalues. With A = M^-1 K and
s = -lambda^2 the characteristic polynomial is s^3 - a s^2 + b s - c. They are built from the
diagonal of A and from products around closed cycles of its entries (a12 a21, a12 a23 a31, ...),
which do not change when coordinates are rescaled. The discriminant is taken from the deviatoric
part of A, so that eigenvalues which lie close together do not cancel; where one of them is far
greater than the others it is split off first, or its rounding would hide what the others do. What
is smaller than the bound of its own rounding, of the entries of A included, counts as zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.errors import ComputationError, InputError, MatrixError

Array = NDArray[np.float64]
EPS = float(np.finfo(float).eps)
ROUNDING = 4 * EPS  # relative error of an entry of M^-1 K, M diagonal
SKEW = 1e-12  # of a matrix: an unsymmetric part up to this is rounding
ILL = 1e-7  # reciprocal condition of M, its diagonal scaled to 1, below which it is not inverted
BEYOND = "M, C, K: the eigenvalues are beyond double precision"


class SingularTogetherError(MatrixError):
    """Rounding does not tell M, C and K from matrices for which every number is a root."""


class LightMassError(MatrixError):
    """M is singular, or so nearly that its inverse would cost the digits of other modes."""


@dataclass(frozen=True)
class Reduced:
    """z'' + B z' + A z = 0, where q = T z and T' M T = 1.

    A (n, n) in rad^2/s^2 and B (n, n) in rad/s, None without damping, whatever units M mixes. A
    symmetric K gives a symmetric A.
    """

    A: Array
    B: Array | None
    T: Array
    rounding: float  # relative size of the errors that the reduction leaves in A


Change = tuple[Any, Any, Any]
"""M, C and K, or their derivatives dM, dC and dK."""


def is_sparse(matrix: Any) -> bool:
    """True for a SciPy sparse array or matrix."""
    return hasattr(matrix, "tocsc")


def dense(matrix: Any) -> np.ndarray:
    """The matrix as a NumPy array."""
    return np.asarray(matrix.toarray() if is_sparse(matrix) else matrix)


def _unwrapped(value: object) -> object:
    """The sparse matrix in a data frame of sparse columns (pandas) or in a data array (xarray);
    anything else as it is."""
    columns: Any = getattr(value, "sparse", None)  # which a frame of dense columns has not
    if hasattr(columns, "to_coo"):
        return columns.to_coo()
    inside = getattr(value, "data", None)
    if hasattr(value, "dims") and is_sparse(inside):
        return inside
    return value


def given_matrix(value: Any, name: str = "", real: bool = False) -> Any:
    """A given matrix (n, m) of finite numbers, or `real` ones; sparse as CSC.

    Raises InputError, also for numbers that no double holds.
    """
    value = _unwrapped(value)
    if np.ma.is_masked(value):
        words = "has masked entries; a matrix of finite numbers is required"
        raise InputError(f"{name}: {words}" if name else words)
    try:
        X: Any = value.tocsc() if is_sparse(value) else np.asarray(value)
        turned = np.iscomplexobj(X) and (X.data if is_sparse(X) else X).imag.any()
        fine = X.ndim == 2 and X.dtype.kind in "biufcO" and not (real and turned)
        given = X.real if np.iscomplexobj(X) and not turned else X
        X = given.astype(complex if turned else float, copy=False)
        fine &= np.isfinite(X.data if is_sparse(X) else X).all()
    except (TypeError, ValueError, OverflowError):
        fine = False
    if fine and _are_rounded(*(A.data if is_sparse(A) else A for A in (given, X))):
        words = f"an entry of {given.dtype} has more digits than a double; .astype(float) rounds it"
        raise InputError(f"{name}: {words}" if name else words)
    if not fine:
        words = f"must be a matrix of finite {'real ' * real}numbers"
        raise InputError(f"{name}: {words}" if name else words)
    return X


def _are_rounded(given: np.ndarray, doubles: np.ndarray) -> bool:
    """Whether entries (n, m) are no doubles, or complex pairs of them, but near some."""
    if given.dtype == doubles.dtype or given.dtype.itemsize <= 4:
        return False
    # as objects the comparison is of the numbers themselves
    return bool(np.any(given.astype(object) != doubles.astype(object)))


def _square(name: str, value: ArrayLike, n: int | None = None) -> Array:
    matrix = dense(given_matrix(value, name, real=True))
    if matrix.shape[0] != matrix.shape[1] or not matrix.size:
        raise InputError(f"{name}: shape {matrix.shape}; a square matrix is required")
    if n is not None and len(matrix) != n:
        raise InputError(f"{name}: shape {matrix.shape}; M has shape {(n, n)}")
    return matrix


def checked(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> tuple[Array, Array | None, Array]:
    """The matrices as float arrays of one shape (n, n); a C of zeros becomes None.

    Raises InputError for anything that is not a square, finite matrix of the size of M.
    """
    mass = _square("M", M)
    damping = None if C is None else _square("C", C, len(mass))
    moves = damping is not None and damping.any()
    return mass, damping if moves else None, _square("K", K, len(mass))


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
    unit = unit_diagonal(M)
    if np.abs(unit - unit.T).max() > SKEW:
        raise MatrixError("M: a symmetric matrix is required")
    np.fill_diagonal(unit, np.sign(np.diag(M)))  # without rounding
    sizes = np.linalg.eigvalsh(unit)
    if sizes[0] < -4 * EPS * n * abs(sizes[-1]):
        raise MatrixError("M: a positive definite matrix is required")
    if sizes[0] <= ILL * sizes[-1]:
        least = max(sizes[0] / (sizes[-1] or 1.0), 0.0)
        words = f"some motion has {least:.1g} of the others' mass"
        raise LightMassError(f"M: {words}; a well-conditioned matrix is required")
    inverse = np.linalg.inv(np.linalg.cholesky((unit + unit.T) / 2))
    T = (1.0 / np.sqrt(np.diag(M)))[:, None] * inverse.T
    T.setflags(write=False)  # the cache holds it
    return T, ROUNDING * float(np.linalg.norm(inverse, 2) ** 2)


def divisor(size: Any) -> Any:
    """Sizes (...), at least 0, to divide by: those of nothing become 1."""
    return np.where(size > 0, size, 1.0)


def unit_diagonal(M: Any) -> Any:
    """A matrix (n, n) with a diagonal of ones where it has one: units cost no condition then."""
    size = divisor(np.sqrt(np.abs(np.diag(M))))
    return M / size[:, None] / size


def check_regular(M: Any, C: Any, K: Any) -> None:
    """Refuse matrices (n, n) for which every number is a root, as far as rounding shows.

    Raises SingularTogetherError.
    """
    sizes = [float(abs(X).max()) for X in (M, K)]
    rate = np.sqrt(sizes[1] / sizes[0]) if all(sizes) else 1.0
    for turn in (0.8 + 0.6j, -0.9 + 1.7j):  # no root but by accident, and not both
        z = rate * turn
        if scaled_rank(z * z * M + (0.0 if C is None else z * C) + K) == len(M):
            return
    raise SingularTogetherError(
        "M, C and K: are singular together as far as rounding shows, so that every number is a root"
    )


def rank_of(singular: Array, size: float | None = None) -> int:
    """How many falling singular values are more than rounding of a matrix of that size (2-norm)."""
    largest = size if size is not None else np.max(singular, initial=0.0)
    return int(np.sum(singular > 4 * EPS * len(singular) * largest))


def scaled_rank(K: Any) -> int:
    """The rank of K with its rows and columns scaled to a largest entry of one: what is small
    beside others still counts."""
    for axis in (1, 0, 1):
        K = K / divisor(np.abs(K).max(axis=axis, keepdims=True))
    return rank_of(np.linalg.svd(K, compute_uv=False))


def first_order(A: Any, B: Any, rate: ArrayLike | None = None) -> tuple[Any, Array]:
    """The first-order form F (..., 2n, 2n) of z'' + B z' + A z = 0 in the time unit 1/rate, and
    rate (1/s; left out each system's own): F's eigenvalues times it are the roots (rad/s).
    """
    if rate is None:
        a, b = (np.linalg.norm(X, axis=(-2, -1)) for X in (A, B))
        rate = np.asarray(np.maximum(np.sqrt(a), b))
        rate = 2.0 ** np.round(np.log2(divisor(rate)))  # rounds nothing
    n, rate = A.shape[-1], np.asarray(rate)
    turn = rate[..., None, None]
    state = np.zeros((*A.shape[:-2], 2 * n, 2 * n), dtype=np.result_type(A, B))
    state[..., :n, n:] = np.eye(n)
    np.multiply(A, -1.0 / turn**2, out=state[..., n:, :n])
    np.multiply(B, -1.0 / turn, out=state[..., n:, n:])
    return state, rate


def state_matrices(M: Array, C: Array, K: Array) -> tuple[Array, Array]:
    """A (2n, 2n) of the states (q, q') of M q'' + C q' + K q = f, and B (2n, n) of the forces f."""
    inverse = np.linalg.inv(M)
    return first_order(inverse @ K, inverse @ C, 1.0)[0], np.vstack([0.0 * inverse, inverse])


def applied(change: Change, z: Any, x: NDArray) -> NDArray:
    """(z^2 dM + z dC + dK) x of columns x (n, m) at values z (m,), or of one vector."""
    each = zip(change, (z**2, z, z**0), strict=True)
    return sum((A @ x * f for A, f in each if A is not None), np.zeros_like(x))


def inertia(change: Change, z: Any, x: NDArray) -> NDArray:
    """The derivative of that by z, (2 z dM + dC) x."""
    return applied((None, *change[:2]), 2 * z, x)


def reaches(pattern: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which rows (n, n) depend on which unknowns, on their own ones and by way of other rows."""
    reach = pattern | np.eye(len(pattern), dtype=bool)
    for _ in range(len(pattern).bit_length()):
        further = reach.astype(np.float32) @ reach.astype(np.float32) > 0.0
        if np.array_equal(further, reach):
            break
        reach = further
    return reach


def components(reach: NDArray[np.bool_]) -> list[NDArray[np.intp]]:
    """The rows of each strong component. A matrix is block triangular in them, so that what acts
    from one on another one way only changes no eigenvalue."""
    first = (reach & reach.T).argmax(axis=1)
    return [np.flatnonzero(first == k) for k in np.unique(first)]


def norm_of(A: Any) -> float:
    """sqrt(|A|_1 |A|_inf), which bounds the 2-norm, of an array or sparse array."""
    size = abs(A)
    return float(np.sqrt(size.sum(axis=0).max() * size.sum(axis=1).max()))


def noise_of(A: Any, rounding: float = ROUNDING) -> float:
    """Singular values of A (n, n) up to this are rounding, of a relative size."""
    return 2 * len(A) * rounding * float(np.linalg.norm(A, 2))


def null_spaces(A: Any, noise: float) -> tuple[Any, Any]:
    """Orthonormal right and left null vectors (n, k) of A, whose singular values are noise."""
    left, singular, right = np.linalg.svd(A)
    rank = int(np.sum(singular > noise))
    return right[rank:].conj().T, left[:, rank:]


def zero_roots(A: Any, noise: float, M: Any = None) -> int:
    """Algebraic multiplicity of the root 0 of A - s M (without M of A - s), from ranks.

    The null space is split off and the rest examined again until it has full rank, so that chains
    such as a free body (double zero root of the first-order problem) are counted to their end.
    """
    count = 0
    while len(A):
        _, singular, right = np.linalg.svd(A)
        rank = int(np.sum(singular > noise))
        null, rest = np.split(right.conj().T, [rank], axis=1)[::-1]
        if not null.shape[1]:
            break
        count += null.shape[1]
        images = rest
        if M is not None:
            images = np.linalg.qr(M @ null, mode="complete")[0][:, null.shape[1] :]
            M = images.conj().T @ M @ rest
        A = images.conj().T @ A @ rest
    return count


# Stability of undamped systems of up to three degrees of freedom, without eigenvalues


class Value(NamedTuple):
    """A number (or array) and a bound of its rounding error."""

    value: Any
    bound: Any


class Cubic(NamedTuple):
    """Invariants of A (3, 3): the coefficients of its cubic and the discriminant."""

    a: Value  # trace
    b: Value  # sum of the principal minors
    c: Value  # determinant
    discriminant: Value  # negative with a complex pair
    vague: Any  # True where a great root and rounding together hide what the others do


def _cycles(e: Sequence[Any]) -> tuple[Any, Any, Any, Any]:
    """Products around cycles of two of the off-diagonal entries e (row by row), 12, 13 and 23, and
    the sum of those of three."""
    return e[1] * e[3], e[2] * e[6], e[5] * e[7], e[1] * e[5] * e[6] + e[2] * e[3] * e[7]


def _pairs(x: Any, y: Any, z: Any) -> Any:
    return x * y + (x + y) * z


def invariants(entries: Sequence[Any], floor: float = 0.0) -> Cubic:
    """Invariants of A from its nine entries, row by row (numbers or arrays of one shape).

    The relative error of each entry is `ROUNDING`, `floor` (rad^2/s^2) adds an absolute one (a
    product with a full M^-1 spreads its errors over all entries).
    """
    size = [np.abs(x) + floor for x in entries]
    d, D = entries[::4], size[::4]
    p12, p13, p23, t = _cycles(entries)
    P12, P13, P23, T = _cycles(size)
    p, P, unit = p12 + p13 + p23, P12 + P13 + P23, 2 * ROUNDING

    def determinant(x: Sequence[Any]) -> Any:
        """With a diagonal x."""
        return x[0] * (x[1] * x[2] - p23) - x[1] * p13 - x[2] * p12 + t

    def magnitude(x: Sequence[Any]) -> Any:
        """The same of the sizes of its terms."""
        return x[0] * (x[1] * x[2] + P23) + x[1] * P13 + x[2] * P12 + T

    a = Value(d[0] + d[1] + d[2], unit * (D[0] + D[1] + D[2]))
    b = Value(_pairs(*d) - p, 2 * unit * (_pairs(*D) + P))
    c = Value(determinant(d), 3 * unit * magnitude(D))

    m, h = a.value / 3, a.bound  # error of a deviator
    e = [x - m for x in d]
    E = [np.abs(x) for x in e]
    wide = E[0] + E[1] + E[2]
    J2 = 0.5 * (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]) + p
    J3 = determinant(e)
    squares = 0.5 * (E[0] * E[0] + E[1] * E[1] + E[2] * E[2])
    e_2 = h * (wide + 1.5 * h) + 2 * unit * (squares + P)
    e_3 = h * (_pairs(*E) + P + h * (wide + h)) + 3 * unit * magnitude(E)
    J22, absJ2, absJ3 = J2 * J2, np.abs(J2), np.abs(J3)
    disc = 4 * J22 * J2 - 27 * J3 * J3
    bound = (
        4 * e_2 * (3 * J22 + e_2 * (3 * absJ2 + e_2))
        + 27 * e_3 * (2 * absJ3 + e_3)
        + 4 * EPS * (4 * absJ2 * J22 + 27 * J3 * J3)
    )
    vague = ~np.isfinite(disc + bound)
    share, aa = 0.03, a.value * a.value  # of the greatest root, below which others are far from it
    far = (np.abs(b.value) < share * aa) & (np.abs(c.value) < share**2 * np.abs(aa * a.value))
    if np.any(far):
        split, known = _split(a, b, c)
        disc, bound = np.where(far, split.value, disc), np.where(far, split.bound, bound)
        vague = np.where(far, (c.bound > 0.0) & ~known, vague)
    return Cubic(a, b, c, Value(disc, bound), vague)


def _split(a: Value, b: Value, c: Value) -> tuple[Value, Any]:
    """The discriminant of a cubic whose greatest root s is real and far from the others, and
    whether it is known to more than 1e-9 of its terms.

    The others' sum is t = (b - c/s)/s and their product d = c/s: nothing of the size of s cancels.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        s = a.value
        for _ in range(4):  # Newton's steps; the start is off by a few per cent
            residual = ((s - a.value) * s + b.value) * s - c.value
            s = s - residual / ((3 * s - 2 * a.value) * s + b.value)
        size = np.abs(s)
        off = (a.bound + (b.bound + c.bound / size) / size) / size + 4 * EPS  # of s, relative
        t, d = (b.value - c.value / s) / s, c.value / s
        e_t = (b.bound + c.bound / size) / size + np.abs(t) * off
        e_d = c.bound / size + np.abs(d) * off
        terms, apart = t * t + 4 * np.abs(d), ((s - t) * s + d) ** 2
        value = (t * t - 4 * d) * apart
        error = 2 * np.abs(t) * e_t + e_t * e_t + 4 * e_d + 4 * EPS * terms
        bound = error * apart + 8 * off * np.abs(value)
        return Value(value, bound), bound <= 1e-9 * terms * apart
