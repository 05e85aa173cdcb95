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
from numpy.typing import ArrayLike, NDArray

from squeal.linear.matrices import EPS, Reduced

STABLE, MARGINAL, FLUTTER, DIVERGENCE = range(4)
VERDICTS = ("stable", "marginal", "flutter", "divergence")
"""Verdicts in the order of their int8 codes."""
UNDECIDED = 4

STIFF = 0.03  # the other roots over the greatest: it is split off below this
VAGUE = 1e-9  # of its terms: a discriminant known to less is left to eigenvalues
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
    deviator: tuple[Any, Any]  # J2, J3 of y^3 - J2 y - J3 = 0 with s = a/3 + y
    vague: Any  # True where a great root and rounding together hide what the others do


def _cycles(e: Sequence[Any]) -> tuple[Any, Any, Any, Any, Any]:
    """Products around the five cycles of the off-diagonal entries e (row by row)."""
    return e[1] * e[3], e[2] * e[6], e[5] * e[7], e[1] * e[5] * e[6], e[2] * e[3] * e[7]


def invariants(entries: Sequence[Any], rounding: float = 4 * EPS, floor: Any = 0.0) -> Cubic:
    """Invariants of A from its nine entries, row by row (numbers or arrays that broadcast).

    `rounding` bounds the relative error of each entry, `floor` (rad^2/s^2) adds an absolute one
    (a product with a full M^-1 spreads its errors over all entries).
    """
    d = entries[0], entries[4], entries[8]
    p12, p13, p23, t1, t2 = _cycles(entries)
    size = [np.abs(x) + floor for x in entries]
    D1, D2, D3 = size[0], size[4], size[8]
    P12, P13, P23, T1, T2 = _cycles(size)
    unit = rounding + 4 * EPS

    a = d[0] + d[1] + d[2]
    D = D1 + D2 + D3
    p = p12 + p13 + p23
    P = P12 + P13 + P23
    b = d[0] * d[1] + (d[0] + d[1]) * d[2] - p
    c = d[0] * (d[1] * d[2] - p23) - d[1] * p13 - d[2] * p12 + (t1 + t2)
    C = D1 * (D2 * D3 + P23) + D2 * P13 + D3 * P12 + T1 + T2
    bound_a = unit * D
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
    error_c = 3 * unit * C
    stiff = (np.abs(b) < STIFF * a * a) & (np.abs(c) < STIFF**2 * np.abs(a * a * a))
    vague = np.zeros_like(stiff)
    if np.any(stiff):
        split, terms = _split(Value(a, bound_a), Value(b, bound_b), Value(c, error_c))
        disc, bound = np.where(stiff, split.value, disc), np.where(stiff, split.bound, bound)
        vague = stiff & (error_c > 0.0) & ~(split.bound <= VAGUE * terms)
    # a^2 - 4 b without the cancellation, exact in the difference for a padded 2 x 2
    apart = d[0] - d[1] - d[2]
    disc2 = apart * apart + 4 * (p - d[1] * d[2])
    bound2 = bound_a * (2 * np.abs(apart) + bound_a) + 8 * unit * (P + D2 * D3)
    return Cubic(
        Value(a, bound_a),
        Value(b, bound_b),
        Value(c, error_c),
        Value(disc, bound),
        Value(disc2, bound2),
        (J2, J3),
        vague,
    )


def _split(a: Value, b: Value, c: Value) -> tuple[Value, Any]:
    """The discriminant of a cubic whose greatest root s is real and far from the others, and the
    size of its terms.

    Their sum is t = (b - c/s)/s and their product d = c/s: nothing of the size of s cancels.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        s = a.value
        for _ in range(4):  # Newton's steps; the start is off by less than STIFF
            residual = ((s - a.value) * s + b.value) * s - c.value
            s = s - residual / ((3 * s - 2 * a.value) * s + b.value)
        size = np.abs(s)
        off = (a.bound + (b.bound + c.bound / size) / size) / size + 4 * EPS  # of s, relative
        t, d = (b.value - c.value / s) / s, c.value / s
        e_t = (b.bound + c.bound / size) / size + np.abs(t) * off
        e_d = c.bound / size + np.abs(d) * off
        apart = (s - t) * s + d
        value = (t * t - 4 * d) * apart**2
        error = 2 * np.abs(t) * e_t + e_t * e_t + 4 * e_d + 4 * EPS * (t * t + 4 * np.abs(d))
        terms = (t * t + 4 * np.abs(d)) * apart**2
        return Value(value, error * apart**2 + 8 * off * np.abs(value)), terms


def cubic_of(reduced: Reduced) -> Cubic:
    """Invariants of one undamped system of n <= 3; a missing row is one of zeros: a zero root."""
    A = np.zeros((3, 3))
    A[: reduced.n, : reduced.n] = reduced.A
    diagonal = not np.any(reduced.T - np.diag(np.diag(reduced.T)))
    floor = 0.0 if diagonal else reduced.rounding * float(np.abs(A).max())
    return invariants([float(x) for x in A.ravel()], floor=floor)


def flutter_outgrows(a: Any, c: Any, J2: Any, J3: Any, discriminant: Any) -> Any:
    """True where the complex pair grows faster than the real mode of negative s = -x.

    The pair grows at Re sqrt(-z) with Re(sqrt(-z))^2 = (|z| - Re z)/2, the real mode at sqrt(x);
    |z|^2 = -c/x and 2 Re z = a + x give the comparison |z| > (a + 5 x)/2.
    """
    root = np.cbrt(0.5 * np.abs(J3) + np.sqrt(np.maximum(-discriminant / 108, 0.0)))
    root = np.copysign(np.where(root > 0, root, 1.0), J3)
    y = root + J2 / (3 * root)
    for _ in range(2):  # the closed form cancels for J2 < 0
        slope = 3 * y * y - J2
        y = y - ((y * y - J2) * y - J3) / np.where(slope > 0, slope, np.inf)
    x = -(a / 3 + y)
    right = 0.5 * (a + 5 * x)
    return (right <= 0) | (-c > x * right * right)


def code(cubic: Cubic) -> NDArray[np.int8]:
    """Verdict codes (MARGINAL, FLUTTER, DIVERGENCE, UNDECIDED), array of the broadcast shape.

    Real and non-negative roots s are marginal; a negative one is divergence, a complex pair
    flutter. A coalescence that rounding cannot tell from real roots counts as real.
    """
    a, b, c = cubic.a, cubic.b, cubic.c
    zero = np.abs(c.value) <= c.bound
    disc = np.where(zero, cubic.discriminant2.value, cubic.discriminant.value)
    pair = disc < -np.where(zero, cubic.discriminant2.bound, cubic.discriminant.bound)
    falling = (c.value < -c.bound) | (b.value < -b.bound) | (a.value < -a.bound)
    verdict = np.where(pair, FLUTTER, np.where(falling, DIVERGENCE, MARGINAL)).astype(np.int8)
    both = pair & (c.value < -c.bound)
    if np.any(both):
        J2, J3 = cubic.deviator
        numbers = (a.value, c.value, J2, J3, cubic.discriminant.value)
        verdict[both] = _faster(both, *numbers)
    verdict[np.broadcast_to(cubic.vague, verdict.shape)] = UNDECIDED
    return verdict


def unstable_roots(cubic: Cubic) -> tuple[int, int]:
    """How many complex pairs and how many negative real roots s the cubic of one system has."""
    a, b, c = (0 if abs(v.value) <= v.bound else v.value for v in (cubic.a, cubic.b, cubic.c))
    disc = cubic.discriminant if c else cubic.discriminant2
    if disc.value < -disc.bound:
        return 1, int(c < 0)
    # all roots are real: the coefficients of p(-s) change sign once for each negative one
    signs = [np.sign(v) for v in (1.0, a, b, c) if v]
    return 0, sum(bool(x != y) for x, y in itertools.pairwise(signs))


def _faster(both: Any, *numbers: Any) -> NDArray[np.int8]:
    """FLUTTER or DIVERGENCE where `both` occur; numbers as `flutter_outgrows` takes them."""
    picked = (np.broadcast_to(x, both.shape)[both] for x in numbers)
    return np.where(flutter_outgrows(*picked), np.int8(FLUTTER), np.int8(DIVERGENCE))


def _quick(entries: Sequence[Any], rounding: float) -> NDArray[np.int8]:
    """As `code(invariants(entries))`, the bounds worked out only where they may matter.

    A coarse bound, of the same degree in the entries as the quantity that it guards and larger
    than the one of `invariants`, settles nearly all matrices at half the price.
    """
    d1, d2, d3 = entries[0], entries[4], entries[8]
    p12, p13, p23, t1, t2 = _cycles(entries)
    a = d1 + d2 + d3
    b = d1 * d2 + (d1 + d2) * d3 - (p12 + p13 + p23)
    c = d1 * (d2 * d3 - p23) - d2 * p13 - d3 * p12 + (t1 + t2)
    q1 = np.abs(d1) + np.abs(d2) + np.abs(d3)
    q2 = q1 * q1 + np.abs(p12) + np.abs(p13) + np.abs(p23)
    q3 = q1 * q2 + np.abs(t1) + np.abs(t2)

    def picked(which: Any) -> list[Any]:
        return [np.broadcast_to(e, which.shape)[which] for e in entries]

    return _settled((a, b, c), (q1, q2, q3), rounding, picked)


def _settled(
    coefficients: tuple[Any, Any, Any],
    sizes: tuple[Any, Any, Any],
    rounding: float,
    picked: Callable[[Any], Sequence[Any]],
) -> NDArray[np.int8]:
    """Verdict codes from the coefficients a, b, c; `picked` gives the entries where they decide.

    |J2| <= q2 and |J3| <= q3 of sizes = (q1, q2, q3), and so do a, b, c: bounds of their rounding
    errors are generous multiples of them.
    """
    a, b, c = np.broadcast_arrays(*coefficients)
    q1, q2, q3 = sizes
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
    unsettled = np.abs(disc) <= (8 * unit) * (q2 * q2 * q2 + q3 * q3)
    for value, size in ((c, q3), (b, q2), (a, q1)):
        unsettled |= np.abs(value) <= unit * size
    both = pair & below & ~unsettled
    if np.any(both):
        verdict[both] = _faster(both, a, c, J2, J3, disc)
    if np.any(unsettled):
        verdict[unsettled] = code(invariants(picked(unsettled), rounding))
    return verdict


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
        return _settled(values, (size, size**2, size**3), rounding, picked)

    return np.concatenate([part(start) for start in range(0, u.shape[1], step)])


def undamped_verdicts(entries: Sequence[ArrayLike], rounding: float = 4 * EPS) -> NDArray[np.int8]:
    """Verdict codes (index into VERDICTS, or UNDECIDED) of many undamped 3x3 systems, int8.

    `entries` are the nine entries of A = M^-1 K row by row, numbers or arrays that broadcast
    against each other; the result has the broadcast shape. Made for maps: nothing of size
    (N, 3, 3) is built, and passes are short enough to stay in the cache.
    """
    arrays = [np.asarray(e, dtype=float) for e in entries]
    shape = np.broadcast_shapes(*(e.shape for e in arrays))
    if not shape:
        return code(invariants([e.reshape(1) for e in arrays], rounding)).reshape(())
    result = np.empty(shape, dtype=np.int8)
    rows = max(1, CHUNK // max(1, int(np.prod(shape[1:]))))
    sliced = [e.ndim == len(shape) and e.shape[0] > 1 for e in arrays]

    for start in range(0, shape[0], rows):
        part = slice(start, start + rows)
        chunk = [e[part] if s else e for e, s in zip(arrays, sliced, strict=True)]
        result[part] = _quick(chunk, rounding)
    return result
