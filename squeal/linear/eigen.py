"""Eigenvalues of M q'' + C q' + K q = 0 with vectors, rounding, residuals and slopes.

How far rounding moves a root has one definition, `root_rounding`: its backward error times its
condition number. The condition number grows without limit where roots coalesce; m roots that meet
are moved by no more than the m-th root of the relative error. Every eigenvalue carries this
number, and undamped roots lie exactly on the axes unless they are off them by more.

How is flutter decided? Every eigenvalue comes with the distance that rounding may move it
(`root_rounding`). A root grows if its real part is greater than this distance; a growing root
whose imaginary part is greater too is one of a pair (flutter), else it is real (divergence). The
fastest growing one names the verdict. Nothing grows: `marginal` if some root lies within the
distance from the imaginary axis, `stable` if none does. That is `decide`, of any roots.

At a flutter boundary two roots coalesce, and computed real parts are noise of the size of the
square root of the machine precision. Up to three rows without damping the roots therefore follow
the signs of the discriminant and of the coefficients of the polynomial in lambda^2, each against a
bound of its own rounding (`matrices.invariants`). Maps take these signs themselves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.errors import ComputationError
from squeal.linear.matrices import (
    BEYOND,
    DIVERGENCE,
    EPS,
    FLUTTER,
    STABLE,
    UNDECIDED,
    VERDICTS,
    Array,
    Cubic,
    Reduced,
    checked,
    cubic_of,
    first_order,
    noise_of,
    null_spaces,
    reduce,
    scaled_rank,
    sum_codes,
    undamped_codes,
    unstable_roots,
    zero_roots,
)

ComplexArray = NDArray[np.complex128]
HIDDEN = 1e-2  # of the slowest root's square: rounding that hides it
STIFF = (
    "one stiffness or damping is so much greater than others that rounding of it hides the slow "
    "modes; values that differ by fewer decades are required"
)


@dataclass(frozen=True, eq=False)
class Eigenvalue:
    """One eigenvalue (rad/s) of (value^2 M + value C + K) right = 0 and what is known of it.

    right (n,) is the mode shape, right^H M right = 1, and left (n,) alike; residual the backward
    error |P(value) x| / (|v|^2 |M| + |v| |C| + |K|), mass-normalised; condition 1/|y^H x| of the
    standard problem solved (in value^2 if undamped), or inf; rounding (rad/s) how far rounding may
    move it.
    """

    value: complex
    right: ComplexArray = field(repr=False)
    left: ComplexArray = field(repr=False)
    residual: float = field(repr=False)
    condition: float = field(repr=False)
    rounding: float = field(default=0.0, repr=False)

    @property
    def grows(self) -> bool:
        """True if it grows by more than rounding."""
        return self.value.real > self.rounding

    @property
    def oscillates(self) -> bool:
        """True if it is one of a pair by more than rounding, and not real."""
        return abs(self.value.imag) > self.rounding

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


@dataclass(frozen=True, eq=False, repr=False)
class Spectrum:
    """All 2n eigenvalues, by rising frequency; of one frequency the fastest growing first.

    Conjugate pairs stand together, positive imaginary part first.
    """

    eigenvalues: tuple[Eigenvalue, ...]

    @property
    def rigid_body_roots(self) -> int:
        """How many eigenvalues are exactly zero."""
        return sum(not e.value for e in self.eigenvalues)

    @property
    def values(self) -> ComplexArray:
        """The eigenvalues as an array (2n,), rad/s."""
        return np.array([e.value for e in self.eigenvalues])

    @property
    def rounding(self) -> Array:
        """How far rounding may move each (2n,), rad/s."""
        return np.array([e.rounding for e in self.eigenvalues])

    @property
    def frequencies_hz(self) -> Array:
        """Frequencies in Hz of the modes (n,), of which each has two eigenvalues."""
        return np.array([e.frequency_hz for e in self.eigenvalues[::2]])

    @property
    def dominant(self) -> Eigenvalue:
        """The eigenvalue of largest real part (of several, the one of largest frequency)."""
        return max(self.eigenvalues, key=lambda e: (e.value.real, e.value.imag))

    @property
    def unstable(self) -> tuple[Eigenvalue, ...]:
        """What grows by more than rounding, the fastest first; of a pair Im > 0."""
        growing = [e for e in self.eigenvalues if e.grows and e.value.imag >= -e.rounding]
        return tuple(sorted(growing, key=lambda e: -e.growth_rate))

    def __len__(self) -> int:
        return len(self.eigenvalues)

    def __repr__(self) -> str:
        most = 6
        shown = ", ".join(f"{f:.6g}" for f in self.frequencies_hz[:most])
        more = ", ..." if len(self) > 2 * most else ""
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


def root_rounding(
    values: ComplexArray, condition: Array, error: float | Array, size: float | Array
) -> Array:
    """How far (m,) rounding moves eigenvalues of condition numbers 1/|y^H x| and relative backward
    errors `error`: `size`, such as the matrix's norm, times the lesser of error times condition and
    the k-th root of the error, where k >= 2 roots lie close together.
    """
    near = np.broadcast_to(4 * error ** (1 / 3) * size, values.shape)
    close = np.sum(np.abs(values[:, None] - values) <= near[:, None], axis=1)
    return np.asarray(size * np.minimum(error * condition, error ** (1 / np.maximum(2, close))))


class Roots(NamedTuple):
    """Eigenvalues (m,) with unit vectors as columns, condition numbers and `root_rounding`."""

    values: ComplexArray
    right: ComplexArray
    left: ComplexArray
    condition: Array
    rounding: Array


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


def standard_roots(A: Array, rounding: float, stiffness: Array | None = None) -> Roots:
    """Eigenvalues of a real matrix (m, m) whose entries carry a relative error `rounding`.

    Zero roots counted by rank are set to exactly zero, with vectors from the null spaces; of a
    first-order matrix with a regular `stiffness` block there are none, however strong the damping.
    """
    values, right = (x.astype(complex) for x in np.linalg.eig(A))
    left = _left_vectors(A, values, right)
    regular = stiffness is not None and not zero_roots(stiffness, noise_of(stiffness, rounding))
    noise = noise_of(A, rounding)
    zeros = 0 if regular else zero_roots(A, noise)
    where = np.argsort(np.abs(values))[:zeros]
    if zeros:
        values[where] = 0.0
        null, conull = null_spaces(A, noise)
        overlap = conull.T @ null
        if zeros == null.shape[1] and np.linalg.cond(overlap) < 1e8:
            conull = conull @ np.linalg.inv(overlap).T  # biorthogonal within the null spaces
        pick = np.arange(zeros) % null.shape[1]  # a chain repeats its one vector
        right[:, where], left[:, where] = null[:, pick], conull[:, pick]
        left[:, where] /= np.linalg.norm(left[:, where], axis=0)
    with np.errstate(divide="ignore"):
        condition = 1.0 / np.abs(np.sum(left.conj() * right, axis=0))
    size = float(np.linalg.norm(A, 2))
    moved = root_rounding(values, condition, 2 * len(A) * rounding, size)
    if stiffness is not None:
        moved[where] = 0.0  # found by rank, hence exact
    return Roots(values, right, left, condition, moved)


def squared_frequencies(reduced: Reduced) -> Roots:
    """The n roots s = -lambda^2 of an undamped system (rad^2/s^2).

    A complex pair within its own rounding is a coalescence and is returned as a real double root.
    Up to three rows the invariants decide that, which know the discriminant and the determinant to
    full digits where roots coalesce or pass zero.
    """
    roots = standard_roots(reduced.A, reduced.rounding)
    cubic = cubic_of(reduced) if reduced.n <= 3 else None
    if cubic is not None and not cubic.vague:
        _agree(roots.values, roots.rounding, cubic)
    else:
        real = np.abs(roots.values.imag) <= roots.rounding
        roots.values[real] = roots.values.real[real]
    return roots


def _agree(s: ComplexArray, rounding: Array, cubic: Cubic) -> None:
    """Give up to three roots the pairs and signs, beyond rounding, that their invariants tell."""
    pairs, negative = unstable_roots(cubic)
    reals = np.arange(len(s))
    if pairs:
        # two conjugates, or where rounding made them real the closest two
        apart = np.abs(s[:, None] - s.conj()) + np.diag(np.full(len(s), np.inf))
        pair = np.array(np.unravel_index(np.argmin(apart), apart.shape))
        reals = np.setdiff1d(reals, pair)
        if np.any(np.abs(s[pair].imag) <= rounding[pair]):
            mean = s[pair].real.mean()
            if abs(cubic.c.value) > cubic.c.bound:
                half = np.sqrt(-cubic.discriminant.value) / 2 / abs(s[reals[0]] - mean) ** 2
            else:
                half = np.sqrt(-cubic.discriminant2.value) / 2
            s[pair] = mean + np.array([1j, -1j]) * half
        rounding[pair] = np.minimum(rounding[pair], np.abs(s[pair].imag) / 2)
    s[reals] = s[reals].real
    rising = reals[np.argsort(s[reals].real)]
    for k in rising[:negative]:
        if s[k].real >= 0.0 or rounding[k] >= -s[k].real:
            others = float(np.prod(np.delete(s, k)).real)
            product = (cubic.a, cubic.b, cubic.c)[len(s) - 1].value
            s[k] = -abs(product / others) if others else -rounding[k]
        rounding[k] = min(rounding[k], abs(s[k]) / 2)
    least = rising[negative:]
    s[least] = np.maximum(s[least].real, 0.0)


def roots_of(reduced: Reduced) -> Roots:
    """The 2n roots lambda (rad/s) of a system, vectors (n, 2n) in mass-normalised coordinates.

    Those that neither grow nor decay have a real part of at most their rounding, without damping
    of exactly zero. Raises ComputationError if roots are beyond double precision.
    """
    if reduced.B is not None:
        matrix, rate = first_order(reduced.A, reduced.B)
        values, x, y, condition, moved = standard_roots(matrix, reduced.rounding, reduced.A)
        n = reduced.n
        values, x, y, moved = values * rate, x[:n], y[n:], moved * rate
    else:
        s, x, y, condition, moved = squared_frequencies(reduced)
        # the partner of s is its exact conjugate: one root serves both
        half = np.sqrt(-(s.real + 1j * np.abs(s.imag)))
        half = np.where(s.imag < 0, half.conj(), half)
        half = np.where((s.imag == 0) & (s.real > 0), 1j * np.abs(half.imag), half)
        size = np.abs(s)
        below = size <= moved
        moved = np.where(below, np.sqrt(moved), moved / (2 * np.sqrt(np.where(below, 1.0, size))))
        values = np.asarray(np.ravel([half, -half], order="F") + 0.0, dtype=complex)
        x, y = np.repeat(x, 2, axis=1), np.repeat(y, 2, axis=1)
        condition, moved = np.repeat(condition, 2), np.repeat(moved, 2)
    if not np.isfinite(values).all():
        raise ComputationError(BEYOND)
    return Roots(values, x, y, condition, moved)


def complex_eigenvalues(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> Spectrum:
    """All 2n eigenvalues of M q'' + C q' + K q = 0.

    Without damping the n x n problem in lambda^2 is solved, so that marginal modes have real
    parts, and divergent ones imaginary parts, of exactly zero.

    Parameters
    ----------
    M : array (n, n)
        Symmetric, positive definite.
    C : array (n, n) or None
    K : array (n, n)
        Any consistent units.

    Returns
    -------
    Spectrum
        By rising frequency, in rad/s.

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


def spectrum_of(reduced: Reduced) -> Spectrum:
    """As `complex_eigenvalues`, for a system in mass-normalised coordinates."""
    roots = roots_of(reduced)
    residuals = _residuals(reduced, roots.values, roots.right)
    return Spectrum(
        tuple(
            Eigenvalue(
                complex(roots.values[k]),
                _physical(reduced.T, roots.right[:, k]),
                _physical(reduced.T, roots.left[:, k]),
                float(residuals[k]),
                float(roots.condition[k]),
                float(roots.rounding[k]),
            )
            for k in ordered(roots.values)
        )
    )


def _residuals(reduced: Reduced, values: ComplexArray, x: ComplexArray) -> Array:
    """Backward errors (m,) of roots with vectors (n, m)."""
    A, B = reduced.A, np.zeros_like(reduced.A) if reduced.B is None else reduced.B
    length, norms = np.abs(values), [float(np.linalg.norm(X, 2)) for X in (A, B)]
    size = (length**2 + length * norms[1] + norms[0]) * np.linalg.norm(x, axis=0)
    rest = np.linalg.norm(values**2 * x + values * (B @ x) + A @ x, axis=0)
    return np.divide(rest, size, out=np.zeros_like(rest), where=size > 0)


def _physical(T: Array, z: ComplexArray) -> ComplexArray:
    """A unit mass-normalised vector in the caller's coordinates, its largest part positive."""
    z = z / np.linalg.norm(z)
    largest = z[np.argmax(np.abs(z))]
    vector = T @ (z * (abs(largest) / largest))
    vector.setflags(write=False)
    return np.asarray(vector, dtype=complex)


def sensitivities(
    M: ArrayLike,
    C: ArrayLike | None,
    K: ArrayLike,
    *,
    dM: ArrayLike | None = None,
    dC: ArrayLike | None = None,
    dK: ArrayLike | None = None,
    spectrum: Spectrum | None = None,
) -> ComplexArray:
    """Derivatives (2n,) of the eigenvalues by a parameter p, in the order of the spectrum.

    d lambda/dp = -y^H (lambda^2 dM + lambda dC + dK) x / y^H (2 lambda M + C) x with the right and
    left vectors x, y and the derivatives dM, dC, dK of the matrices (None: zero); rad/s per unit
    of p. Where the denominator vanishes (a coalescence, or an undamped zero root) the eigenvalue
    moves like a square root of p: the derivative is inf, or 0 if the numerator vanishes too.
    `spectrum` saves the eigenvalues if they are known. Raises InputError.

    Examples
    --------
    >>> sensitivities([[1.0]], None, [[4.0]], dK=[[1.0]]).imag.tolist()
    [0.25, -0.25]
    """
    mass, damping, _ = checked(M, C, K)
    known = spectrum or complex_eigenvalues(M, C, K)
    z = known.values
    right, left = np.swapaxes([(e.right, e.left) for e in known.eigenvalues], 0, 1)

    def form(parts: list[tuple[ComplexArray, ArrayLike | None]]) -> tuple[ComplexArray, Array]:
        """y^H (sum of factors times matrices) x, and the size of which eps is rounding."""
        total, size = np.zeros(len(z), dtype=complex), np.zeros(len(z))
        for factor, X in parts:
            X = np.zeros_like(mass) if X is None else np.asarray(X, dtype=float)
            total += factor * np.sum((left.conj() @ X) * right, axis=1)
            size += np.abs(factor) * np.sum((np.abs(left) @ np.abs(X)) * np.abs(right), axis=1)
        return total, size

    moved, moved_size = form([(z**2, dM), (z, dC), (z**0, dK)])
    weight, weight_size = form([(2 * z, mass), (z**0, damping)])
    rounding = 100 * EPS
    still = np.where(np.abs(moved) <= rounding * moved_size, 0.0, np.inf)
    regular = np.abs(weight) > rounding * weight_size
    return np.where(regular, -moved / np.where(regular, weight, 1.0), still)


def hidden_share(reduced: Reduced, C: Array | None, K: Array) -> float:
    """How much of the slowest mode's stiffness rounding of A or B may be, infinite where all of it
    or of its damping: where a mass is light, a spring stiff or a damper strong beside others."""
    sizes = np.linalg.svd(reduced.A, compute_uv=False)
    square = sizes[0]
    if reduced.B is not None:
        square = max(square, float(np.linalg.norm(reduced.B, 2)) ** 2)
    error = 2 * reduced.n * reduced.rounding
    present = sizes[sizes > error * sizes[0]]
    if len(present) != scaled_rank(K):
        return np.inf
    if C is not None and reduced.B is not None and len(present) < reduced.n:
        # of what K leaves free the roots are those of its damping
        parts = (X / np.linalg.norm(X, 2) for X in (reduced.A, reduced.B) if X.any())
        both = np.linalg.svd(np.vstack(list(parts)), compute_uv=False)
        if np.sum(both > error) != scaled_rank(np.vstack([K, C])):
            return np.inf
    return float(error * square / present[-1]) if len(present) else 0.0


def hidden(reduced: Reduced, C: Array | None, K: Array) -> bool:
    """True if rounding leaves slow modes too few digits, see `hidden_share`."""
    return hidden_share(reduced, C, K) > HIDDEN


# The verdict


GROWING = ("flutter", "divergence")
UNKNOWN = "unknown"
"""The verdict where some root is too uncertain and none of the others grows."""
ACCEPTED = 1e-6  # backward error up to which a root decides


@dataclass(frozen=True)
class Judgement:
    """A verdict with the number that decided it and the tolerance that number was held against."""

    verdict: str
    criterion: str
    value: float
    tolerance: float

    def __str__(self) -> str:
        size = f"{self.value:.6g} (rounding {self.tolerance:.2g})"
        return f"{self.verdict}: {self.criterion} = {size}"


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
        if not self.pairs and not self.reals:
            return "quiet"
        return "flutter" if self.pairs and self.pair_rate >= self.real_rate else "divergence"

    @property
    def numbers(self) -> tuple[int, int]:
        """Growing pairs and growing real roots."""
        return self.pairs, self.reals

    @property
    def roots(self) -> int:
        """Growing roots, two for a pair."""
        return 2 * self.pairs + self.reals


def decide(values: ArrayLike, rounding: ArrayLike, residuals: ArrayLike = 0.0) -> Judgement:
    """The verdict on roots lambda (m,), rad/s, of a pair at least that with Im > 0.

    `rounding` (rad/s) is how far each may lie from where it was computed. One whose backward error,
    of `residuals`, is above `ACCEPTED` decides nothing; the verdict is `UNKNOWN` if no other grows.

    >>> decide([1j, 0.1 + 2j], 1e-9).verdict, decide([-0.1 + 1j, 0.5], 1e-9, [0.0, 0.5]).verdict
    ('flutter', 'unknown')
    """
    values = np.atleast_1d(np.asarray(values, dtype=complex))
    rounding = np.broadcast_to(rounding, values.shape)
    sure = np.broadcast_to(residuals, values.shape) <= ACCEPTED
    excess = np.where(sure & (values.real > rounding), values.real, -np.inf)
    k = int(np.argmax(excess))
    if excess[k] > 0.0:
        name = "flutter" if abs(values[k].imag) > rounding[k] else "divergence"
    else:
        name = "marginal" if np.any(np.abs(values.real) <= rounding) else "stable"
        name = name if sure.all() else UNKNOWN
        k = int(np.argmax(values.real))
    return Judgement(name, "largest Re lambda", float(values[k].real), float(rounding[k]))


def unstable_count(values: ComplexArray, rounding: float | Array) -> UnstableCount:
    """How many of the roots (m,) of a system, both of each pair, grow; as `decide` does."""
    grows, oscillates = values.real > rounding, np.abs(values.imag) > rounding
    both = grows & oscillates & (values.imag > 0), grows & ~oscillates
    pairs, reals = (int(np.sum(some)) for some in both)
    return UnstableCount(
        pairs, reals, *(float(np.max(values.real[some], initial=0.0)) for some in both)
    )


def judge(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> Judgement:
    """The verdict on M q'' + C q' + K q = 0, with the reason.

    Parameters
    ----------
    M, C, K : array (n, n)
        M symmetric and positive definite; C None without damping.

    Raises
    ------
    InputError
        For matrices that make no system.

    Examples
    --------
    >>> judge([[1, 0], [0, 1]], None, [[2, -1], [0.25, 2]]).verdict
    'flutter'
    """
    return judge_reduced(reduce(M, C, K))


def verdict(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> str:
    """Verdict on M q'' + C q' + K q = 0 in one word, see `judge`."""
    return judge(M, C, K).verdict


def judge_reduced(reduced: Reduced) -> Judgement:
    """As `judge`, for a system in mass-normalised coordinates."""
    roots = roots_of(reduced)
    return decide(roots.values, roots.rounding)


def _code(A: Array, B: Array | None, rounding: float) -> int:
    return VERDICTS.index(judge_reduced(Reduced(A, B, np.eye(len(A)), rounding)).verdict)


def damped_verdicts(A: Array, B: Array, rounding: float = 4 * EPS) -> NDArray[np.int8]:
    """Verdict codes (N,), indices into VERDICTS, of z'' + B z' + A z = 0; A, B of (N, n, n).

    The coordinates are mass-normalised and no B is zero throughout. The codes are those of
    `judge`: its tolerances are bounded from above for all systems together, and only those with an
    eigenvalue within this bound of an axis are judged one by one.
    """
    matrices, _ = first_order(A, B)
    values = np.linalg.eigvals(matrices)
    error, norm = 2 * matrices.shape[-1] * rounding, np.linalg.norm(matrices, axis=(-2, -1))
    apart = np.abs(values[:, :, None] - values[:, None, :]) / norm[:, None, None]
    cluster = np.maximum(2, np.sum(apart <= 4 * error ** (1 / 3), axis=-1))
    bound = norm[:, None] * error ** (1 / cluster)
    grows = np.take_along_axis(values, values.real.argmax(axis=-1)[:, None], axis=-1)[:, 0]
    codes = np.where(grows.imag != 0.0, FLUTTER, DIVERGENCE).astype(np.int8)
    codes[grows.real < 0.0] = STABLE
    doubtful = np.abs(values.real) <= bound
    doubtful |= (values.real > 0.0) & (values.imag != 0.0) & (np.abs(values.imag) <= bound)
    for k in np.flatnonzero(doubtful.any(axis=-1)):
        codes[k] = _code(A[k], B[k], rounding)
    return codes


def undamped_verdicts(A: Array, rounding: float = 4 * EPS) -> NDArray[np.int8]:
    """Verdict codes (...), indices into VERDICTS, of undamped systems A = M^-1 K (..., 3, 3)."""
    codes = undamped_codes(A, rounding)
    for at in map(tuple, np.argwhere(codes == UNDECIDED)):
        codes[at] = _code(A[at], None, rounding)
    return codes


def sum_verdicts(Q: NDArray, u: NDArray, rounding: float = 4 * EPS) -> NDArray[np.int8]:
    """Verdict codes (n1, n2), indices into VERDICTS, of A = Q[:, :, k] + u[:, i] u[:, i]'.

    Q (3, 3, n2) and u (3, n1) are in coordinates with a mass matrix of one.
    """
    codes = sum_codes(Q, u, rounding)
    for i, k in np.argwhere(codes == UNDECIDED):
        codes[i, k] = _code(Q[:, :, k] + np.outer(u[:, i], u[:, i]), None, rounding)
    return codes
