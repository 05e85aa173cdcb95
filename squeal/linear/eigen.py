"""Eigenvalues of M q'' + C q' + K q = 0 with vectors, rounding, residuals and slopes.

How far rounding moves a root is its backward error times its condition number (`root_rounding`),
which grows without limit where roots coalesce; roots that meet move together, by no more than the
m-th root of the relative error. Where conditions are not computed it is a share of |lambda|
(`assumed_rounding`). Every eigenvalue carries this number. What acts on a part of the rows and is
not acted on by it changes none of its roots: strong components are solved one by one.

How is flutter decided? A root grows if its real part is greater than its rounding; if its imaginary
part is greater too it is one of a pair (flutter), else real (divergence). That is `kinds`, of any
roots. The fastest growing one names the verdict (`decide`). Nothing grows: `marginal` if some root
lies within its rounding of the imaginary axis, else `stable`.

At a flutter boundary two roots coalesce, and computed real parts are noise of the size of the
square root of the machine precision. Up to three rows without damping the roots therefore follow
the signs of invariants, each against a bound of its own rounding (`matrices.invariants`). Maps take
these signs themselves (`map_verdicts`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.errors import ComputationError
from squeal.linear.matrices import (
    BEYOND,
    EPS,
    ROUNDING,
    Array,
    Cubic,
    Reduced,
    components,
    first_order,
    invariants,
    noise_of,
    null_spaces,
    reaches,
    reduce,
    scaled_rank,
    zero_roots,
)

ComplexArray = NDArray[np.complex128]
Codes = NDArray[np.int8]
STIFF = (
    "one stiffness or damping is so much greater than others that rounding of it hides the slow "
    "modes; values that differ by fewer decades are required"
)
STABLE, MARGINAL, FLUTTER, DIVERGENCE = range(4)
VERDICTS = ("stable", "marginal", "flutter", "divergence")  # in the order of their int8 codes
GROWING = ("flutter", "divergence")
ACCEPTED = 1e-6  # backward error up to which a root decides


# Roots with what rounding does to them


@dataclass(frozen=True, eq=False)
class Eigenvalue:
    """One eigenvalue of (value^2 M + value C + K) right = 0 and what is known of it.

    Attributes
    ----------
    value : complex
        rad/s.
    right, left : array (n,)
        The mode shape, right^H M right = 1, and the left eigenvector alike.
    residual : float
        The backward error |P(value) x| / (|value|^2 |M| + |value| |C| + |K|), mass-normalised.
    condition : float
        1 / |y^H x| of the standard problem that was solved (in value^2 without damping), or inf.
    rounding : float
        How far rounding may move it, rad/s.
    error : float, optional
        How far a reduction, or what digits of data leave open, may move it, rad/s.
    open : bool
        True if this error leaves open whether it grows.
    grows : bool
        True if it is proved to grow, however far rounding may move it.
    """

    value: complex
    right: ComplexArray = field(repr=False)
    left: ComplexArray = field(repr=False)
    residual: float = field(repr=False)
    condition: float = field(repr=False)
    rounding: float = field(default=0.0, repr=False)
    error: float | None = field(default=None, repr=False)
    open: bool = field(default=False, repr=False)
    grows: bool = field(default=False, repr=False)

    @property
    def kind(self) -> str:
        """The verdict on it alone."""
        if self.grows:
            return "flutter" if self.value.imag else "divergence"
        return VERDICTS[kinds(self.value, self.rounding)]

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


@dataclass(frozen=True, eq=False)
class Spectrum:
    """All 2n eigenvalues, by rising frequency; of one frequency the fastest growing first.

    Conjugate pairs stand together, positive imaginary part first.
    """

    eigenvalues: tuple[Eigenvalue, ...]

    @property
    def values(self) -> ComplexArray:
        """The eigenvalues as an array (2n,), rad/s."""
        return np.array([e.value for e in self.eigenvalues])

    @property
    def rounding(self) -> Array:
        """How far rounding may move each (2n,), rad/s."""
        return np.array([e.rounding for e in self.eigenvalues])

    @property
    def dominant(self) -> Eigenvalue:
        """The eigenvalue of largest real part (of several, the one of largest frequency)."""
        return max(self.eigenvalues, key=lambda e: (e.value.real, e.value.imag))

    def __len__(self) -> int:
        return len(self.eigenvalues)


@dataclass(frozen=True)
class UnstableMode:
    """A mode that grows: a pair of eigenvalues (flutter) or a real one (divergence).

    damping_ratio is negative; onset is the parameter value at which this mode began to grow, None
    where it is not known or the mode grows from the start of the range on; interval: where it lies,
    None to rounding.
    """

    kind: str
    frequency_hz: float
    growth_rate: float  # 1/s
    damping_ratio: float
    onset: float | None = None
    interval: tuple[float, float] | None = None

    @property
    def root(self) -> complex:
        """The eigenvalue (rad/s), of a pair that above the axis."""
        return complex(self.growth_rate, 2 * np.pi * self.frequency_hz)


def growing(values: Iterable[Eigenvalue]) -> tuple[UnstableMode, ...]:
    """What grows by more than rounding and is accepted, the fastest first; of pairs the upper."""
    modes = []
    for e in sorted(values, key=lambda e: -e.growth_rate):
        upper = e.value.imag >= -e.rounding
        if upper and e.residual <= ACCEPTED and e.kind in GROWING:
            modes.append(UnstableMode(e.kind, e.frequency_hz, e.growth_rate, e.damping_ratio))
    return tuple(modes)


def ordered(values: ComplexArray) -> NDArray[np.intp]:
    """Indices that sort eigenvalues (..., m) as a Spectrum does, along the last axis."""
    # an exact conjugate pair or quadruple has equal |Im|, so the later keys decide within it;
    # of repeated eigenvalues the first is paired with the first conjugate, and so on
    equal = values[..., :, None] == values[..., None, :]
    occurrence = np.sum(np.tril(equal, -1), axis=-1)
    keys = (-values.imag, occurrence, -values.real, np.abs(values.imag))
    return np.lexsort(keys, axis=-1)


def root_rounding(
    values: ComplexArray,
    condition: float | Array,
    error: float | Array,
    size: float | Array,
    rows: int | None = None,
) -> Array:
    """How far rounding moves each eigenvalue (m,) of a matrix.

    One that is far from all others moves by its size times error times condition, R. The
    determinant, and with it R, is shared with others at distances d_j: where these come into reach,
    r with r prod(1 + r / d_j) = R is how far it moves. No eigenvalue moves further than by the m-th
    root of the relative error (Elsner 1985).

    Parameters
    ----------
    values : array (m,)
        The eigenvalues.
    condition : float or array (m,)
        Their condition numbers 1 / |y^H x|.
    error : float or array (m,)
        The relative backward error of the matrix.
    size : float or array (m,)
        Its norm.
    rows : int, optional
        Its rows, if these are not the m eigenvalues given.
    """
    least = np.broadcast_to(size * error, values.shape)
    alone = np.broadcast_to(least * condition, values.shape)
    bound = np.broadcast_to(2 * size * error ** (1 / (rows or max(len(values), 1))), values.shape)
    distances = np.maximum(np.abs(values[:, None] - values), least[:, None])
    np.fill_diagonal(distances, np.inf)
    moved = np.minimum(alone, bound)
    near = np.flatnonzero(moved > 1e-3 * distances.min(axis=1, initial=np.inf))
    with np.errstate(divide="ignore"):
        log_alone = np.log(alone[near])
        log_moved = np.log(moved[near])
    for _ in range(16):  # Newton's method on logarithms: convex, and from above
        share = np.exp(log_moved)[:, None] / distances[near]
        excess = log_moved + np.log1p(share).sum(axis=1) - log_alone
        slope = 1.0 + (share / (1.0 + share)).sum(axis=1)
        log_moved = log_moved - np.maximum(excess, 0.0) / slope
    moved[near] = np.exp(log_moved)
    return moved


def assumed_rounding(values: ArrayLike, undamped: bool = False) -> Array:
    """How far rounding may move roots (...) without known left vectors, hence without condition: a
    share of |lambda|, greater without damping, where it parts two equal roots as a square root."""
    return np.asarray((1e-7 if undamped else 1e-10) * np.abs(values))


def kinds(values: ArrayLike, rounding: ArrayLike) -> Codes:
    """What each of the roots lambda (...) does, as an index into `VERDICTS`.

    rounding: how far rounding may move each, rad/s.
    """
    values = np.asarray(values)
    growing = np.where(np.abs(values.imag) > rounding, FLUTTER, DIVERGENCE)
    not_growing = np.where(values.real >= -np.asarray(rounding), MARGINAL, STABLE)
    return np.where(values.real > rounding, growing, not_growing).astype(np.int8)


def square_roots(s: ComplexArray, rounding: Array) -> tuple[ComplexArray, Array]:
    """The roots lambda (...) of s = -lambda^2 that do not decay, and how far rounding moves them.

    A complex pair s within its own rounding is a coalescence: a real double root. Since
    d lambda = ds / (2 |lambda|) a root s that is zero to rounding moves lambda by a square root.
    """
    s = np.where(np.abs(s.imag) <= rounding, s.real, s)
    size = np.abs(s)
    is_zero = size <= rounding
    slope = 1 / (2 * np.sqrt(np.where(is_zero, 1.0, size)))
    return np.sqrt(-s), np.where(is_zero, np.sqrt(rounding), rounding * slope)


class Roots(NamedTuple):
    """Eigenvalues (m,) with unit vectors as columns, condition numbers and `root_rounding`."""

    values: ComplexArray
    right: ComplexArray
    left: ComplexArray
    condition: Array
    rounding: Array


def assigned(cost: Array) -> NDArray[np.intp]:
    """For each row of a cost matrix (m, k) a column of its own, the cheapest pairs first.

    -1 for rows that are left over where there are more of them than columns.
    """
    cheapest = np.argmin(cost, axis=1)
    if len(set(cheapest.tolist())) == len(cheapest):
        return cheapest
    order = np.full(len(cost), -1, dtype=np.intp)
    taken: set[int] = set()
    by_cost = np.unravel_index(np.argsort(cost, axis=None), cost.shape)
    for i, j in zip(*by_cost, strict=True):
        if order[i] < 0 and int(j) not in taken:
            order[i] = j
            taken.add(int(j))
    return order


def left_vectors(A: Array, values: ComplexArray, right: ComplexArray) -> ComplexArray:
    """Unit left eigenvectors as columns: by the inverse of the right ones or, near a coalescence,
    where that loses digits, by the transpose."""
    singular = np.linalg.svd(right, compute_uv=False)
    if singular[-1] > 1e-6 * singular[0]:
        left = np.linalg.inv(right).conj().T
    else:
        others, left = np.linalg.eig(A.conj().T)
        left = left[:, assigned(np.abs(values[:, None] - others.conj()))]
    return np.asarray(left / np.linalg.norm(left, axis=0), dtype=complex)


def _standard_roots(A: Array, rounding: float, stiffness: Array | None = None) -> Roots:
    """Eigenvalues of a real matrix, whose zero roots are counted by rank and set to zero.

    Their vectors are those of the null spaces.

    Parameters
    ----------
    A : array (m, m)
        The matrix.
    rounding : float
        The relative error of its entries.
    stiffness : array (m/2, m/2), optional
        The stiffness block of a first-order matrix. Where it is regular there are no zero roots,
        however strong the damping is.
    """
    values, right = (x.astype(complex) for x in np.linalg.eig(A))
    left = left_vectors(A, values, right)
    zeros = 0
    noise = noise_of(A, rounding)
    if stiffness is None or zero_roots(stiffness, noise_of(stiffness, rounding)):
        zeros = zero_roots(A, noise)
    smallest = np.argsort(np.abs(values))[:zeros]
    if zeros:
        values[smallest] = 0.0
        null, conull = null_spaces(A, noise)
        column = np.arange(zeros) % null.shape[1]  # a chain repeats its one vector
        right[:, smallest] = null[:, column]
        left[:, smallest] = conull[:, column]
    with np.errstate(divide="ignore"):
        condition = 1.0 / np.abs(np.sum(left.conj() * right, axis=0))
    moved = root_rounding(values, condition, 2 * len(A) * rounding, float(np.linalg.norm(A, 2)))
    if stiffness is not None:
        moved[smallest] = 0.0  # found by rank, hence exact
    return Roots(values, right, left, condition, moved)


def _agree_with_invariants(s: ComplexArray, rounding: Array, reduced: Reduced) -> None:
    """Correct up to three roots s = -lambda^2 by the invariants of the matrix, in place.

    Where roots coalesce or pass zero the signs of its discriminant and coefficients tell, beyond
    rounding, whether there is a complex pair and how many roots are negative. Vague invariants
    change nothing.

    Parameters
    ----------
    s : array (n,)
        The roots, n <= 3.
    rounding : array (n,)
        How far rounding moves each.
    reduced : Reduced
        The system.
    """
    n = len(s)
    A = np.zeros((3, 3))  # a missing row is one of zeros: a zero root
    A[:n, :n] = reduced.A
    has_diagonal_mass = np.count_nonzero(reduced.T) == n
    floor = 0.0 if has_diagonal_mass else reduced.rounding / ROUNDING * float(np.abs(A).max())
    with np.errstate(over="ignore", invalid="ignore"):
        cubic = invariants(A.ravel().tolist(), floor=floor)
    if cubic.vague:
        return
    # of real roots the coefficients of p(-s) change sign once for each negative one (Descartes)
    signs = [1.0]
    for coefficient in cubic[:3]:
        if abs(coefficient.value) > coefficient.bound:
            signs.append(np.sign(coefficient.value))
    negative = sum(bool(x != y) for x, y in itertools.pairwise(signs))
    reals = np.arange(n)
    if cubic.discriminant.value < -cubic.discriminant.bound:
        negative = int(cubic.c.value < -cubic.c.bound)  # the real root has the sign of c
        pair = _make_complex_pair(s, rounding, cubic)
        reals = np.setdiff1d(reals, pair)
    s[reals] = s[reals].real
    rising = reals[np.argsort(s[reals].real)]
    for k in rising[:negative]:
        if s[k].real >= 0.0 or rounding[k] >= -s[k].real:
            others = float(np.prod(np.delete(s, k)).real)
            s[k] = -abs(cubic[n - 1].value / others) if others else -rounding[k]
        rounding[k] = min(rounding[k], abs(s[k]) / 2)
    not_negative = rising[negative:]
    s[not_negative] = np.maximum(s[not_negative].real, 0.0)


def _make_complex_pair(s: ComplexArray, rounding: Array, cubic: Cubic) -> NDArray[np.intp]:
    """Make two of the roots s (n,) a complex pair, in place; returns their indices (2,).

    They are the two conjugates or, where rounding made them real, the closest two. Where rounding
    hides their imaginary part it follows from the discriminant, (s1 - s2)^2 times the square of the
    product (s3 - s1) (s3 - s2). rounding (n,): how far rounding moves each.
    """
    n = len(s)
    distances = np.abs(s[:, None] - s.conj()) + np.diag(np.full(n, np.inf))
    pair = np.array(np.unravel_index(np.argmin(distances), distances.shape))
    if np.any(np.abs(s[pair].imag) <= rounding[pair]):
        product = cubic.b.value  # with a third root of zero
        if n == 3:
            third = np.setdiff1d(np.arange(n), pair)[0]
            product = np.prod(s[third] - s[pair])
        mean = s[pair].real.mean()
        half_difference = np.sqrt(-cubic.discriminant.value) / 2 / abs(product)
        s[pair] = mean + np.array([1j, -1j]) * half_difference
    rounding[pair] = np.minimum(rounding[pair], np.abs(s[pair].imag) / 2)
    return pair


def dependence(reduced: Reduced) -> NDArray[np.bool_]:
    """Which rows (n, n) of A and B depend on which unknowns, see `matrices.reaches`."""
    pattern = reduced.A != 0.0
    return reaches(pattern if reduced.B is None else pattern | (reduced.B != 0.0))


def roots_of(reduced: Reduced, reach: NDArray[np.bool_] | None = None) -> Roots:
    """The 2n roots lambda (rad/s) of a system, vectors (n, 2n) in mass-normalised coordinates.

    Each strong component of the rows has its own, with vectors that leave out what it drives; what
    acts one way only would cost digits and change no root. Those that neither grow nor decay have a
    real part of at most their rounding, without damping of exactly zero. `reach` is `dependence`,
    if it is known. Raises ComputationError if roots are beyond double precision.
    """
    parts = []
    for rows in components(dependence(reduced) if reach is None else reach):
        part = _roots_of_component(_part_of(reduced, rows))
        right = np.zeros((len(reduced.A), len(part.values)), complex)
        left = np.zeros_like(right)
        right[rows] = part.right
        left[rows] = part.left
        parts.append(part._replace(right=right, left=left))
    return Roots(
        values=np.concatenate([part.values for part in parts]),
        right=np.concatenate([part.right for part in parts], axis=1),
        left=np.concatenate([part.left for part in parts], axis=1),
        condition=np.concatenate([part.condition for part in parts]),
        rounding=np.concatenate([part.rounding for part in parts]),
    )


def _part_of(reduced: Reduced, rows: NDArray[np.intp]) -> Reduced:
    """Some of the rows, without what acts on them from others."""
    within = np.ix_(rows, rows)
    B = None if reduced.B is None else reduced.B[within]
    damping = B if B is not None and B.any() else None
    return Reduced(reduced.A[within], damping, reduced.T[within], reduced.rounding)


def _roots_of_component(reduced: Reduced) -> Roots:
    if reduced.B is None:
        roots = _undamped_roots(reduced)
    else:
        n = len(reduced.A)
        matrix, scale = first_order(reduced.A, reduced.B)
        standard = _standard_roots(matrix, reduced.rounding, reduced.A)
        roots = standard._replace(
            values=standard.values * scale,
            right=standard.right[:n],
            left=standard.left[n:],
            rounding=standard.rounding * scale,
        )
    if not np.isfinite(roots.values).all():
        raise ComputationError(BEYOND)
    return roots


def _undamped_roots(reduced: Reduced) -> Roots:
    """Both square roots of each s = -lambda^2."""
    s, right, left, condition, moved = _standard_roots(reduced.A, reduced.rounding)
    if len(s) <= 3:
        _agree_with_invariants(s, moved, reduced)
    half, rounding = square_roots(s, moved)
    return Roots(
        values=np.asarray(np.ravel([half, -half], order="F") + 0.0),
        right=np.repeat(right, 2, axis=1),
        left=np.repeat(left, 2, axis=1),
        condition=np.repeat(condition, 2),
        rounding=np.repeat(rounding, 2),
    )


def complex_eigenvalues(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> Spectrum:
    """All 2n eigenvalues of M q'' + C q' + K q = 0, in rad/s, by rising frequency.

    Without damping the n x n problem in lambda^2 is solved, so that marginal modes have real
    parts, and divergent ones imaginary parts, of exactly zero.

    Parameters
    ----------
    M, C, K : array (n, n)
        In consistent units; M symmetric, positive definite, C None without damping.

    Raises
    ------
    InputError
        For matrices that are not square, real, finite and of one size.
    ComputationError
        If roots are beyond double precision.

    Examples
    --------
    >>> mode = complex_eigenvalues([[2.0]], [[0.4]], [[50.0]]).eigenvalues[0]
    >>> round(mode.frequency_hz, 4), round(mode.damping_ratio, 4)
    (0.7956, 0.02)
    """
    return spectrum_of(reduce(M, C, K))


def spectrum_of(reduced: Reduced, roots: Roots | None = None) -> Spectrum:
    """As `complex_eigenvalues`, for a system in mass-normalised coordinates, with its `roots_of` if
    they are known."""
    A = reduced.A
    B = np.zeros_like(A) if reduced.B is None else reduced.B
    reach = dependence(reduced)
    values, right, left, condition, rounding = roots or roots_of(reduced, reach)
    if (reach != reach.T).any():
        _drive_vectors(A, B, reach, values, right, left, condition)
    length = np.abs(values)
    norm_A = float(np.linalg.norm(A, 2))
    norm_B = float(np.linalg.norm(B, 2))
    size = (length**2 + length * norm_B + norm_A) * np.linalg.norm(right, axis=0)
    defect = np.linalg.norm(values**2 * right + values * (B @ right) + A @ right, axis=0)
    residuals = np.divide(defect, size, out=np.zeros_like(defect), where=size > 0)
    shapes = _physical(reduced.T, right)
    left_shapes = _physical(reduced.T, left)
    eigenvalues = []
    for k in ordered(values):
        eigenvalue = Eigenvalue(
            value=complex(values[k]),
            right=shapes[:, k],
            left=left_shapes[:, k],
            residual=float(residuals[k]),
            condition=float(condition[k]),
            rounding=float(rounding[k]),
        )
        eigenvalues.append(eigenvalue)
    return Spectrum(tuple(eigenvalues))


def _drive_vectors(
    A: Array,
    B: Array,
    reach: NDArray[np.bool_],
    values: ComplexArray,
    right: ComplexArray,
    left: ComplexArray,
    condition: Array,
) -> None:
    """Complete the vectors of single strong components by what they drive in others, in place.

    A right and a left vector overlap in their own component alone, so that y^H P'(lambda) x changes
    only as their lengths do, and the condition number with it.

    Parameters
    ----------
    A, B : array (n, n)
        Of z'' + B z' + A z = 0.
    reach : array of bool (n, n)
        reach[i, j]: row i depends on unknown j, see `dependence`.
    values : array (m,)
        The roots, rad/s.
    right, left : array (n, m)
        Vectors as columns, zero outside of the component of each root; on return of unit length.
    condition : array (m,)
        Condition numbers of the roots in their components.
    """
    identity = np.eye(len(A))
    driven_last = sorted(components(reach), key=lambda rows: reach[rows[0]].sum())
    driving_last = sorted(components(reach), key=lambda rows: reach.T[rows[0]].sum())
    for k, z in enumerate(values):
        P = z * z * identity + z * B + A
        own_share = _drive(P, reach, driven_last, right[:, k])
        own_share *= _drive(P.conj().T, reach.T, driving_last, left[:, k])
        condition[k] /= max(own_share, EPS)


def _drive(
    P: ComplexArray,
    reach: NDArray[np.bool_],
    parts: Sequence[NDArray[np.intp]],
    vector: ComplexArray,
) -> float:
    """Complete the null vector (n,) of one component of P by what it drives in others, in place.

    Returns the share of its entries in its own component, both of unit length. The `parts` are the
    components, each behind those that it depends on. Where a driven one is singular, too, the
    vector of that one alone comes out.
    """
    own = int(np.argmax(np.abs(vector)))
    own_entry = abs(vector[own]) / np.linalg.norm(vector)
    size = float(np.linalg.norm(P))
    for rows in parts:
        if reach[rows[0], own] and not reach[own, rows[0]]:
            inner = P[np.ix_(rows, rows)]
            inner = inner + EPS * size * np.eye(len(rows))
            vector[rows] = -np.linalg.solve(inner, P[rows] @ vector)
            vector /= np.abs(vector).max()
    vector /= np.linalg.norm(vector)
    return float(abs(vector[own]) / own_entry)


def _physical(T: Array, z: ComplexArray) -> ComplexArray:
    """Mass-normalised vectors (n, m) of unit length in the caller's coordinates, their largest
    parts positive."""
    vectors = T @ (z / np.linalg.norm(z, axis=0))
    largest = vectors[np.argmax(np.abs(vectors), axis=0), np.arange(z.shape[1])]
    vectors = vectors * (np.abs(largest) / largest)
    vectors.setflags(write=False)
    return np.asarray(vectors, dtype=complex)


def hidden(reduced: Reduced, C: Array | None, K: Array, roots: Roots | None = None) -> bool:
    """True if rounding hides slow roots, as beside a light mass, a stiff spring or a strong damper.

    Then some root is known to fewer than three digits, or there are more zero roots than the ranks
    of K and of K and C together leave free. Roots of pads, and of systems whose nearly massless
    coordinates are eliminated instead, need this answer before the referee is asked.

    Parameters
    ----------
    reduced : Reduced
        The system.
    C, K : array (n, n)
        The matrices from which it was made; C may be None.
    roots : Roots, optional
        Its roots, if they are known.
    """
    zeros = 0
    for rows in components(dependence(reduced)):
        block = np.ix_(rows, rows)
        rank = scaled_rank(K[block])
        rank_with_damping = rank
        if C is not None and reduced.B is not None:
            rank_with_damping = scaled_rank(np.vstack([K[block], C[block]]))
        zeros += 2 * len(rows) - rank - rank_with_damping
    known = roots or roots_of(reduced)
    size = np.abs(known.values)
    has_few_digits = np.any(known.rounding > 0.005 * size, where=size > 0.0)
    return bool(has_few_digits or np.sum(size == 0) != zeros)


# The verdict


@dataclass(frozen=True)
class Judgement:
    """A verdict, the largest real part and the rounding (rad/s) that it was held against."""

    verdict: str
    value: float
    tolerance: float

    def __str__(self) -> str:
        size = f"{self.value:.6g} (rounding {self.tolerance:.2g})"
        return f"{self.verdict}: largest Re lambda = {size}"


def decide(values: ArrayLike, rounding: ArrayLike) -> Judgement:
    """The verdict on roots lambda (m,), rad/s, of a pair at least that with Im > 0.

    `rounding` (rad/s) is how far each may lie from where it was computed.

    >>> decide([1j, 0.1 + 2j], 1e-9).verdict, decide([-0.1 + 1j, 1j], 1e-9).verdict
    ('flutter', 'marginal')
    """
    values = np.atleast_1d(np.asarray(values, dtype=complex))
    rounding = np.broadcast_to(rounding, values.shape)
    each = kinds(values, rounding)
    fastest = int(np.argmax(np.where(each >= FLUTTER, values.real, -np.inf)))
    name = VERDICTS[each[fastest]]
    if name not in GROWING:
        name = "marginal" if np.any(each == MARGINAL) else "stable"
        fastest = int(np.argmax(values.real))
    return Judgement(name, float(values[fastest].real), float(rounding[fastest]))


@dataclass(frozen=True)
class UnstableCount:
    """How many pairs and how many real roots grow, and the fastest rate of each (1/s)."""

    pairs: int
    reals: int
    pair_rate: float
    real_rate: float

    @property
    def verdict(self) -> str:
        """flutter or divergence, whichever grows faster, or quiet."""
        if not self.roots:
            return "quiet"
        return "flutter" if self.pairs and self.pair_rate >= self.real_rate else "divergence"

    @property
    def roots(self) -> int:
        """Growing roots, two for a pair."""
        return 2 * self.pairs + self.reals


def judge(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> Judgement:
    """The verdict on M q'' + C q' + K q = 0, with the reason; matrices as `complex_eigenvalues`.

    Examples
    --------
    >>> judge([[1, 0], [0, 1]], None, [[2, -1], [0.25, 2]]).verdict
    'flutter'
    """
    roots = roots_of(reduce(M, C, K))
    return decide(roots.values, roots.rounding)


def verdict(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> str:
    """Verdict on M q'' + C q' + K q = 0 in one word, see `judge`."""
    return judge(M, C, K).verdict
