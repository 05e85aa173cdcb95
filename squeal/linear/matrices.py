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

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

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
        given = np.asarray(value)
        if np.iscomplexobj(given) and given.imag.any():
            raise ValueError
        matrix = np.asarray(given.real, dtype=float)
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


def state_matrices(M: Array, C: Array, K: Array) -> tuple[Array, Array]:
    """A (2n, 2n) of the states (q, q') of M q'' + C q' + K q = f, and B (2n, n) of the forces f."""
    n, eye, zero = len(M), np.eye(len(M)), np.zeros(np.shape(M))
    lower = np.linalg.solve(M, np.hstack([-K, -C, eye]))
    return np.block([[zero, eye], [lower[:, : 2 * n]]]), np.vstack([zero, lower[:, 2 * n :]])


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
        images = rest
        if M is not None:
            images = np.linalg.qr(M @ null, mode="complete")[0][:, null.shape[1] :]
            M = images.conj().T @ M @ rest
        A = images.conj().T @ A @ rest
    return count


# Stability of undamped systems of up to three degrees of freedom, without eigenvalues


STABLE, MARGINAL, FLUTTER, DIVERGENCE = range(4)
VERDICTS = ("stable", "marginal", "flutter", "divergence")
"""Verdicts in the order of their int8 codes."""
UNDECIDED = 4
CHUNK = 8192  # matrices per pass: temporaries of 64 kB stay in the cache and in malloc's pool


class Value(NamedTuple):
    """A number (or array) and a bound of its rounding error."""

    value: Any
    bound: Any


class Cubic(NamedTuple):
    """Invariants of A (3, 3): the coefficients of its cubic and two discriminants."""

    a: Value  # trace
    b: Value  # sum of the principal minors
    c: Value  # determinant
    discriminant: Value  # of the cubic: negative with a complex pair
    discriminant2: Value  # a^2 - 4 b, of the quadratic that remains where c = 0
    vague: Any  # True where a great root and rounding together hide what the others do


def _cycles(e: Sequence[Any]) -> tuple[Any, Any, Any, Any, Any]:
    """Products around the five cycles of the off-diagonal entries e (row by row)."""
    return e[1] * e[3], e[2] * e[6], e[5] * e[7], e[1] * e[5] * e[6], e[2] * e[3] * e[7]


def invariants(
    entries: Sequence[Any], rounding: float = 4 * EPS, floor: Any = 0.0, stiff: float = 0.03
) -> Cubic:
    """Invariants of A from its nine entries, row by row (numbers or arrays of one shape).

    `rounding` bounds the relative error of each entry, `floor` (rad^2/s^2) adds an absolute one
    (a product with a full M^-1 spreads its errors over all entries). Where the other roots are less
    than `stiff` times the greatest, that one is split off.
    """
    d = entries[0], entries[4], entries[8]
    p12, p13, p23, t1, t2 = _cycles(entries)
    size = [np.abs(x) + floor for x in entries]
    D1, D2, D3 = size[0], size[4], size[8]
    P12, P13, P23, T1, T2 = _cycles(size)
    unit = rounding + 4 * EPS

    a, D = d[0] + d[1] + d[2], D1 + D2 + D3
    p, P = p12 + p13 + p23, P12 + P13 + P23
    b = d[0] * d[1] + (d[0] + d[1]) * d[2] - p
    c = d[0] * (d[1] * d[2] - p23) - d[1] * p13 - d[2] * p12 + (t1 + t2)
    C = D1 * (D2 * D3 + P23) + D2 * P13 + D3 * P12 + T1 + T2
    bound_a, bound_c = unit * D, 3 * unit * C
    bound_b = 2 * unit * (D1 * D2 + (D1 + D2) * D3 + P)

    m = a / 3
    e1, e2, e3 = d[0] - m, d[1] - m, d[2] - m
    E1, E2, E3 = np.abs(e1), np.abs(e2), np.abs(e3)
    J2 = 0.5 * (e1 * e1 + e2 * e2 + e3 * e3) + p
    J3 = e1 * (e2 * e3 - p23) - e2 * p13 - e3 * p12 + (t1 + t2)
    E = E1 + E2 + E3
    h = bound_a  # error of a deviator
    e_2 = h * (E + 1.5 * h) + 2 * unit * (0.5 * (E1 * E1 + E2 * E2 + E3 * E3) + P)
    minors = E1 * E2 + (E1 + E2) * E3 + P
    e_3 = h * (minors + h * (E + h)) + 3 * unit * (
        E1 * (E2 * E3 + P23) + E2 * P13 + E3 * P12 + T1 + T2
    )
    J22, absJ2, absJ3 = J2 * J2, np.abs(J2), np.abs(J3)
    disc = 4 * J22 * J2 - 27 * J3 * J3
    bound = (
        4 * e_2 * (3 * J22 + e_2 * (3 * absJ2 + e_2))
        + 27 * e_3 * (2 * absJ3 + e_3)
        + 4 * EPS * (4 * absJ2 * J22 + 27 * J3 * J3)
    )
    vague = ~np.isfinite(disc + bound)
    far = (np.abs(b) < stiff * a * a) & (np.abs(c) < stiff**2 * np.abs(a * a * a))
    if np.any(far):
        split, known = _split(Value(a, bound_a), Value(b, bound_b), Value(c, bound_c))
        disc, bound = np.where(far, split.value, disc), np.where(far, split.bound, bound)
        vague = np.where(far, (bound_c > 0.0) & ~known, vague)
    # a^2 - 4 b without the cancellation, exact in the difference for a padded 2 x 2
    apart = d[0] - d[1] - d[2]
    disc2 = apart * apart + 4 * (p - d[1] * d[2])
    bound2 = bound_a * (2 * np.abs(apart) + bound_a) + 8 * unit * (P + D2 * D3)
    coefficients = Value(a, bound_a), Value(b, bound_b), Value(c, bound_c)
    return Cubic(*coefficients, Value(disc, bound), Value(disc2, bound2), vague)


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


def cubic_of(reduced: Reduced) -> Cubic:
    """Invariants of one undamped system of n <= 3; a missing row is one of zeros: a zero root."""
    A = np.zeros((3, 3))
    A[: reduced.n, : reduced.n] = reduced.A
    diagonal = np.count_nonzero(reduced.T) == reduced.n
    floor = 0.0 if diagonal else reduced.rounding * float(np.abs(A).max())
    with np.errstate(over="ignore", invalid="ignore"):
        return invariants([float(x) for x in A.ravel()], floor=floor)


def unstable_roots(cubic: Cubic) -> tuple[int, int]:
    """How many complex pairs and how many negative real roots s the cubic of one system has."""
    a, b, c = (0 if abs(v.value) <= v.bound else v.value for v in cubic[:3])
    disc = cubic.discriminant if c else cubic.discriminant2
    if disc.value < -disc.bound:
        return 1, int(c < 0)
    # all roots are real: the coefficients of p(-s) change sign once for each negative one
    signs = [np.sign(v) for v in (1.0, a, b, c) if v]
    return 0, sum(bool(x != y) for x, y in itertools.pairwise(signs))


def code(entries: Sequence[Any], rounding: float = 4 * EPS) -> NDArray[np.int8]:
    """Verdict codes (N,), MARGINAL, FLUTTER, DIVERGENCE or UNDECIDED, of nine entries (N,) of A.

    Real and non-negative roots s are marginal; a negative one is divergence, a complex pair
    flutter. A coalescence that rounding cannot tell from real roots counts as real.
    """
    cubic = invariants(entries, rounding)
    a, b, c = cubic[:3]
    zero = np.abs(c.value) <= c.bound
    disc = np.where(zero, cubic.discriminant2.value, cubic.discriminant.value)
    pair = disc < -np.where(zero, cubic.discriminant2.bound, cubic.discriminant.bound)
    falling = (c.value < -c.bound) | (b.value < -b.bound) | (a.value < -a.bound)
    verdict = np.where(pair, FLUTTER, np.where(falling, DIVERGENCE, MARGINAL)).astype(np.int8)
    both = pair & (c.value < -c.bound)
    if np.any(both):
        verdict[both] = _faster([x[both] for x in entries])
    verdict[cubic.vague] = UNDECIDED
    return verdict


def _faster(entries: Sequence[Any]) -> NDArray[np.int8]:
    """FLUTTER or DIVERGENCE where both occur: that which grows faster."""
    s = np.linalg.eigvals(np.stack(entries, axis=-1).reshape(-1, 3, 3)).astype(complex)
    first = np.argmax(np.abs(np.sqrt(-s).real), axis=1)[:, None]
    pair = np.take_along_axis(s.imag, first, axis=1)[:, 0] != 0.0
    return np.where(pair, np.int8(FLUTTER), np.int8(DIVERGENCE))


def undamped_codes(A: NDArray, rounding: float = 4 * EPS) -> NDArray[np.int8]:
    """Verdict codes (...), UNDECIDED among them, of undamped systems A = M^-1 K (..., 3, 3)."""
    entries = np.ascontiguousarray(A.reshape(-1, 9).T)
    codes = np.empty(entries.shape[1], dtype=np.int8)
    for k in range(0, len(codes), CHUNK):
        codes[k : k + CHUNK] = code(list(entries[:, k : k + CHUNK]), rounding)
    return codes.reshape(A.shape[:-2])


def sum_codes(Q: NDArray, u: NDArray, rounding: float = 4 * EPS) -> NDArray[np.int8]:
    """Verdict codes (n1, n2) of the undamped systems A = Q[:, :, k] + u[:, i] u[:, i]'.

    UNDECIDED is among them. Q (3, 3, n2) and u (3, n1) are in coordinates with a mass matrix of
    one. A rank-one term enters the coefficients linearly: with P = u u' the trace is tr Q + tr P,
    the sum of minors b(Q) + u' (tr Q - Q) u, the determinant det Q + u' adj(Q) u. Over a grid each
    is the product of a matrix over i with one over k, so that no matrix A is formed but at a
    boundary.
    """
    trace = Q[0, 0] + Q[1, 1] + Q[2, 2]
    cofactors = np.array([np.cross(Q[i - 2], Q[i - 1], axis=0) for i in range(3)])
    minors = cofactors[0, 0] + cofactors[1, 1] + cofactors[2, 2]
    rows = np.vstack([np.ones(u.shape[1]), np.einsum("in,jn->ijn", u, u).reshape(9, -1)]).T
    of_b = np.vstack([minors, (trace * np.eye(3)[:, :, None] - Q).reshape(9, -1)])
    of_c = np.vstack([np.sum(Q[0] * cofactors[0], axis=0), cofactors.reshape(9, -1)])
    squares = np.sum(u * u, axis=0)
    size = 2 * float(np.sqrt(np.sum(Q * Q, axis=(0, 1))).max() + squares.max())
    step = max(1, CHUNK // Q.shape[2])

    def part(start: int) -> NDArray[np.int8]:
        own = slice(start, start + step)

        def picked(which: Any) -> list[Any]:
            i, k = np.nonzero(which)
            i = i + start
            return [Q[m, n, k] + u[m, i] * u[n, i] for m in range(3) for n in range(3)]

        values = squares[own, None] + trace, rows[own] @ of_b, rows[own] @ of_c
        return _settled(*values, size, rounding, picked)

    return np.concatenate([part(start) for start in range(0, u.shape[1], step)])


def _settled(
    a: NDArray,
    b: NDArray,
    c: NDArray,
    size: float,
    rounding: float,
    picked: Callable[[Any], Sequence[Any]],
) -> NDArray[np.int8]:
    """Verdict codes from the coefficients; `picked` gives the entries where they do not decide.

    The coefficients and the deviator's invariants are at most size, size^2 and size^3: bounds of
    their rounding errors, coarser than those of `invariants`, are multiples of these.
    """
    aa = a * a
    J2 = aa / 3
    J2 -= b
    J3 = aa
    J3 *= 2 / 27
    J3 -= b / 3
    J3 *= a
    J3 += c
    disc = J2 * J2
    disc *= J2
    disc *= 4
    disc -= 27 * J3 * J3

    unit = 64 * (rounding + 4 * EPS)
    pair, below = disc < 0.0, c < 0.0
    verdict = np.where(below | (b < 0.0) | (a < 0.0), np.int8(DIVERGENCE), np.int8(MARGINAL))
    verdict[pair] = FLUTTER
    unsettled = np.abs(disc) <= 16 * unit * size**6
    for power, value in enumerate((a, b, c), 1):
        unsettled |= np.abs(value) <= unit * size**power
    unsettled |= pair & below
    if np.any(unsettled):
        verdict[unsettled] = code(picked(unsettled), rounding)
    return verdict
