"""Stability of undamped systems of up to three degrees of freedom, without eigenvalues.

With A = M^-1 K and s = -lambda^2 the characteristic polynomial is s^3 - a s^2 + b s - c. Every
quantity here is built from the diagonal of A and from products around closed cycles of its
entries (a12 a21, a12 a23 a31, ...), which do not change when coordinates are rescaled: mixed
units cost nothing. The discriminant is taken from the deviatoric part of A, so that eigenvalues
which lie close together do not cancel; where one of them is far greater than the others it is
split off first, or its rounding would hide what the others do. Each value carries a bound of its
own rounding error, with errors of the entries of A included; what is smaller than its bound counts
as zero.
"""

import itertools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.linear.matrices import EPS, Reduced

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


def undamped_verdicts(A: NDArray, rounding: float = 4 * EPS) -> NDArray[np.int8]:
    """Verdict codes (...), UNDECIDED among them, of undamped systems A = M^-1 K (..., 3, 3)."""
    entries = np.ascontiguousarray(A.reshape(-1, 9).T)
    codes = np.empty(entries.shape[1], dtype=np.int8)
    for k in range(0, len(codes), CHUNK):
        codes[k : k + CHUNK] = code(list(entries[:, k : k + CHUNK]), rounding)
    return codes.reshape(A.shape[:-2])


def sum_verdicts(Q: NDArray, u: NDArray, rounding: float = 4 * EPS) -> NDArray[np.int8]:
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
