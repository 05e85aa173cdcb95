"""Eigenvalues of a parametrised system along its parameter: a spectrum with slopes at each value,
matched from one value to the next. Nothing here knows of growth or of verdicts.

The eigenvalues z of A(p) v = z v stand for lambda in one of three problem classes. Without damping
they are z = -lambda^2 in mass-normalised coordinates. An undamped gyroscopic system (M and K
symmetric, C skew) has z = -i lambda, any other one z = lambda, both over a frequency scale and of
the first-order form. What neither grows nor decays lies on a line: the real axis of the first two,
*conservative* classes, the imaginary axis of the third. A spectrum that is symmetric about its line
leaves it only where two eigenvalues meet on it.

From one value to the next roots are matched by where their slopes at both ends point; two that
coalesce in between are matched as a pair, by mean and squared half difference. What is in doubt
halves the step. Two roots that come close within a step are predicted from their coupling. In the
eigenvectors of A(p) the matrix at p + x is diag(z) + x W, exactly if its factors are affine, so
that roots k, l follow diag(z_k, z_l) + x [[W_kk, a], [b, W_ll]], in which all others shift the
coupling to a = W_kl + x T_kl, b = W_lk + x T_lk with
T_kl = sum_m W_km W_ml (1 / (z_k - z_m) + 1 / (z_l - z_m)) / 2.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError, MatrixError
from squeal.linear.eigen import (
    DIVERGENCE,
    FLUTTER,
    Codes,
    UnstableCount,
    assigned,
    kinds,
    left_vectors,
    root_rounding,
    square_roots,
)
from squeal.linear.matrices import (
    EPS,
    ILL,
    Array,
    Change,
    LightMassError,
    components,
    divisor,
    first_order,
    norm_of,
    null_spaces,
    reaches,
    reduce,
    unit_diagonal,
)
from squeal.linear.system import SystemFunction, TermSystem, matrices_of, with_slopes

ComplexArray = NDArray[np.complex128]
Bools = NDArray[np.bool_]
Matrices = tuple[Array, Array, Array]
"""M, C and K at one value of the parameter, or their derivatives."""


class ProblemClass(StrEnum):
    """What the eigenvalues z stand for: -lambda^2, -i lambda or lambda, see above."""

    UNDAMPED = "undamped"
    GYROSCOPIC = "gyroscopic"
    DAMPED = "damped"


UNDAMPED, GYROSCOPIC, DAMPED = ProblemClass


@dataclass(frozen=True)
class ContinuationOptions:
    """What a continuation and a search for thresholds may cost, and when they are in doubt.

    A threshold that is missed calls for more `steps`, or for a smaller `doubt`.
    """

    steps: int = 24  # values at which the eigenvalues are computed first; large systems take fewer
    depth: int = 12  # how often a step may be divided
    budget: int = 1500  # values in all, of systems of up to 60 rows; larger ones take fewer
    # a root is matched if the slopes at both ends predict its change to this share of the change ..
    doubt: float = 0.25
    near: float = 1e-3  # .. or of |z|; frequencies that differ by this share may be of one root
    alike: float = 0.8  # product of left and right vectors beyond which two roots are one mode ..
    likely: float = 0.5  # .. where the slopes agree too
    difference: float = 1e-6  # of the range: step of a difference that stands for a derivative
    # of the range: events closer than this coincide, unless the counts between them agree; of its
    # value: an interval narrower than this has converged
    same: float = 1e-9
    sure: float = 4.0  # standard deviations of rounding that an interval holds
    wide: float = 1e-4  # of the range: the widest interval of a certified search
    aside: float = 0.4837  # of a step: where it is divided
    rounds: int = 12  # steps of Newton's method, and half of those of inverse iteration
    small: int = 40  # rows up to which systems are stacked, and SciPy's loading is not worth while


Numbers = NDArray | complex


def hermite_cubic(a: Numbers, da: Numbers, b: Numbers, db: Numbers) -> NDArray:
    """Coefficients (4, ...) by rising powers of t through values and derivatives at 0 and 1."""
    return np.array([a, da, 3 * (b - a) - 2 * da - db, 2 * (a - b) + da + db])


def zeros_between(cubic: Array) -> list[float]:
    """Real zeros in 0 <= t <= 1, or next to it, of a cubic by rising powers."""
    if not np.any(cubic[1:]):
        return []
    roots = np.roots(cubic[::-1])
    real = roots[np.abs(roots.imag) < 1e-9].real
    return sorted(real[np.abs(real - 0.5) <= 0.5 + 1e-9].tolist())


class ModalCouplings(NamedTuple):
    """Pairs of roots k, l that may meet, and the derivatives W and T (see above) that couple them.

    direct: W_kl and W_lk (2, pairs); indirect: T_kl and T_lk; bend: half of z_k'' - z_l'' by all
    other roots; conjugate: whether the two are conjugate, or meet at zero.
    """

    k: NDArray[np.intp]
    l: NDArray[np.intp]
    conjugate: Bools
    direct: ComplexArray
    indirect: ComplexArray
    bend: ComplexArray


@dataclass(frozen=True, eq=False, repr=False)
class SpectrumAtParameter:
    """The spectrum at one value of the parameter.

    `roots` (m,), `right` and `left` unit vectors (N, m); `coupling` (m, m) is dA/dp in them, with
    left^H right = 1, and has the slopes dz/dp on its diagonal. `rounding` bounds how far rounding
    moves a root.
    """

    value: float
    roots: ComplexArray
    right: ComplexArray
    left: ComplexArray
    coupling: ComplexArray
    rounding: Array
    problem: ProblemClass = DAMPED
    frequency_scale: float | Array = 1.0

    @property
    def slopes(self) -> ComplexArray:
        """Derivatives dz/dp (m,)."""
        return np.asarray(self.coupling.diagonal())

    @cached_property
    def exponents(self) -> ComplexArray:
        """The eigenvalues lambda (rad/s) of the roots; without damping those that do not decay."""
        return exponents(self.roots, self.problem, self.frequency_scale)

    @cached_property
    def omegas(self) -> Array:
        """Angular frequencies (rad/s) of the roots."""
        return np.abs(self.exponents.imag)

    @cached_property
    def real(self) -> Bools:
        """Roots that are real, as far as rounding tells."""
        return np.abs(self.roots.imag) <= self.rounding

    @cached_property
    def on_line(self) -> Bools:
        """Roots that neither grow nor decay, as far as rounding tells."""
        if self.problem is DAMPED:
            return np.asarray(np.abs(self.roots.real) <= self.rounding)
        if self.problem is GYROSCOPIC:
            return self.real
        return self.real & (self.roots.real >= -self.rounding)

    @cached_property
    def close(self) -> Bools:
        """Which roots (m, m) rounding does not separate. The bound holds twice: rounding moves the
        squared difference of two roots by twice that difference times itself."""
        distances = np.abs(self.roots[:, None] - self.roots)
        return np.asarray(distances <= 2 * np.add.outer(self.rounding, self.rounding))

    @cached_property
    def kinds(self) -> Codes:
        """What each root does, see `eigen.kinds`; of a pair that grows both."""
        if self.problem is UNDAMPED:
            return kinds(*square_roots(self.roots, self.rounding))
        turn = 1.0 if self.problem is DAMPED else 1j
        return kinds(self.roots * turn, self.rounding)

    @cached_property
    def unstable_pairs(self) -> list[int]:
        """Indices of the upper roots of growing pairs, the fastest first."""
        across = self.roots.real if self.problem is GYROSCOPIC else self.roots.imag
        return self._fastest_first((self.kinds == FLUTTER) & (across > 0.0))

    @cached_property
    def unstable_reals(self) -> list[int]:
        """Indices of growing real roots, the fastest first."""
        return self._fastest_first(self.kinds == DIVERGENCE)

    def _fastest_first(self, chosen: Bools) -> list[int]:
        order = np.argsort(-self.exponents.real)
        return [int(k) for k in order if chosen[k]]

    @cached_property
    def unstable_count(self) -> UnstableCount:
        """How many roots grow by more than rounding, and how fast."""
        rates = self.exponents.real
        pairs = self.unstable_pairs
        reals = self.unstable_reals
        return UnstableCount(
            pairs=len(pairs),
            reals=len(reals),
            pair_rate=float(rates[pairs[0]]) if pairs else 0.0,
            real_rate=float(rates[reals[0]]) if reals else 0.0,
        )

    @cached_property
    def bounds(self) -> tuple[int, int]:
        """At least and at most how many roots (two for a pair) grow, rounding considered."""
        z = self.roots
        rounding = 2 * self.rounding  # that of two which are close, see `close`
        possible = self.close.sum(axis=1) > 1
        if self.problem is DAMPED:
            certain = z.real > rounding
            possible = z.real > -rounding
        elif self.problem is GYROSCOPIC:
            certain = z.imag < -rounding
        else:  # each complex s and each negative one gives a growing root
            certain = (np.abs(z.imag) > rounding) | (z.real < -rounding)
            possible = possible | (z.real < rounding)
        return int(np.sum(certain)), int(np.sum(certain | possible))

    @property
    def sure(self) -> bool:
        """True if rounding leaves no doubt about how many roots grow."""
        least, most = self.bounds
        return least == most

    @cached_property
    def couplings(self) -> ModalCouplings:
        """The derivative couplings of pairs on the line or above it, or conjugate."""
        z = self.roots
        W = self.coupling
        slopes = self.slopes
        differences = z[:, None] - z
        unsure = np.add.outer(self.rounding, self.rounding)
        conjugate = np.abs(z[:, None] - z.conj()) <= unsure
        if self.problem is DAMPED:
            upper = z.imag >= -self.rounding
        else:
            positive = z.real > (0 if self.problem is UNDAMPED else -self.rounding)
            upper = self.real & positive
            conjugate &= positive
        if self.problem is GYROSCOPIC:  # those that meet at zero
            conjugate |= (np.abs(z[:, None] + z) <= unsure) & self.real
        k, l = np.nonzero(np.triu((upper[:, None] & upper) | conjugate, 1))
        both_ways = np.stack([k, l]), np.stack([l, k])
        with np.errstate(all="ignore"):
            inverse = np.where(np.abs(differences) > unsure, 1 / differences, 0.0)
            F = W * inverse
            T = (F @ W - W @ F + F * (slopes[:, None] - slopes)) / 2
            second = np.einsum("km,mk->k", F, W)
            bend = second[k] - second[l] - 2 * W[k, l] * W[l, k] * inverse[k, l]
        return ModalCouplings(
            k=k,
            l=l,
            conjugate=conjugate[k, l],
            direct=W[both_ways],
            indirect=T[both_ways],
            bend=bend,
        )


def exponents(
    roots: ComplexArray, problem: ProblemClass, frequency_scale: float | Array
) -> ComplexArray:
    """The eigenvalues lambda (rad/s) of roots; without damping those that do not decay."""
    if problem is UNDAMPED:
        return np.asarray(np.sqrt(-roots + 0j))
    turned = roots if problem is DAMPED else 1j * roots
    return np.asarray(turned * frequency_scale)


class StandardProblem(NamedTuple):
    """A(p) and dA/dp (N, N), and the sizes of which the rounding of each entry of A is eps times
    one."""

    A: NDArray
    derivative: NDArray
    sizes: Array


class Continuation:
    """The spectrum of system(p) -> (M, C, K), real and M regular, for low <= p <= high.

    Examples
    --------
    >>> import numpy as np
    >>> K = lambda p: np.array([[2.0, -1.0 + 4 * p / 3], [-1.0, 2.0]])
    >>> continuation = Continuation(lambda p: (np.eye(2), None, K(p)), 0.0, 2.0)
    >>> continuation.problem.value, continuation.at(0.75).roots.real.round(6).tolist()
    ('undamped', [2.0, 2.0])
    """

    problem: ProblemClass
    frequency_scale: float | Array | None = None

    def __init__(
        self,
        system: SystemFunction,
        low: float,
        high: float,
        options: ContinuationOptions | None = None,
    ) -> None:
        self.system = system
        self.low = low
        self.high = high
        self.options = options or ContinuationOptions()
        if isinstance(system, TermSystem) and not system.real:
            raise InputError(
                "thresholds: complex matrices (structural damping) are not allowed; damping by "
                "rayleigh or ratios is"
            )
        inner_values = [low + x * (high - low) for x in (0.07, 0.31, 0.53, 0.71, 0.97)]
        samples = matrices_of(system, inner_values)
        self._projections = _without_free_motions(samples)
        self.problem = problem_class_of(samples)
        n = len(samples[0][0])
        if self._projections is not None:
            n = self._projections[0].shape[1]
        self.size = n if self.problem is UNDAMPED else 2 * n  # rows N of A
        if self.problem is UNDAMPED:
            self.frequency_scale = 1.0
        self._states: dict[float, SpectrumAtParameter] = {}
        self._last: tuple[float, StandardProblem] | None = None
        self._pattern = np.zeros((self.size, self.size), dtype=bool)
        self._components: list[NDArray[np.intp]] = []  # strong ones of A at all values so far
        for M, C, K in samples:  # sets frequency scale and components
            zero = np.zeros_like(M)
            self._standard((M, C, K), (zero, zero, zero))

    @property
    def states(self) -> list[SpectrumAtParameter]:
        """All states so far, by rising value."""
        return [self._states[p] for p in sorted(self._states)]

    def _standard(self, matrices: Matrices, slopes: Change) -> StandardProblem:
        """The standard eigenproblem, without what one strong component of the rows does to another:
        that changes no eigenvalue and costs digits."""
        M, C, K = (self._projected(X) for X in matrices)
        dM, dC, dK = (self._projected(X) for X in slopes)
        left, right = _normalising(M)
        A: NDArray = left @ K @ right
        B = left @ C @ right
        mass_slope = left @ dM @ right
        dA: NDArray = left @ dK @ right - mass_slope @ A
        dB = left @ dC @ right - mass_slope @ B
        abs_left = np.abs(left)
        abs_right = np.abs(right)
        mass_error = abs_left @ np.abs(M) @ abs_right  # what rounding makes of left M right = 1
        amplification = getattr(self.system, "error_amplification", 1.0)  # see StaticCondensation
        sizes = amplification * (abs_left @ np.abs(K) @ abs_right + mass_error @ np.abs(A))
        damping_sizes = amplification * (abs_left @ np.abs(C) @ abs_right + mass_error @ np.abs(B))
        if self.problem is not UNDAMPED:
            n = len(A)
            A, self.frequency_scale = first_order(A, B, self.frequency_scale)
            dA = first_order(dA, dB, self.frequency_scale)[0]
            sizes = first_order(-sizes, -damping_sizes, self.frequency_scale)[0]
            dA[:n] = sizes[:n] = 0.0
        if self.problem is GYROSCOPIC:
            A = -1j * A
            dA = -1j * dA
        pattern = self._pattern | (A != 0.0) | (dA != 0.0)
        if not np.array_equal(pattern, self._pattern):
            self._pattern = pattern
            self._components = components(reaches(pattern))
        if len(self._components) > 1:
            within = np.zeros(A.shape)
            for rows in self._components:
                within[np.ix_(rows, rows)] = 1.0
            return StandardProblem(A * within, dA * within, sizes * within)
        return StandardProblem(A, dA, sizes)

    def _projected(self, X: Array) -> Array:
        if self._projections is None:
            return X
        P, Q = self._projections
        return P.T @ X @ Q

    def _standards(self, ps: Sequence[float]) -> list[StandardProblem]:
        given = with_slopes(self.system, ps, self.low, self.high, self.options.difference)
        return [self._standard(matrices, slopes) for matrices, slopes in given]

    def matrix_and_derivative(self, p: float) -> StandardProblem:
        """A(p), dA/dp, and the sizes of what is rounded in the entries of A."""
        if self._last is None or self._last[0] != p:
            self._last = p, self._standards([p])[0]
        return self._last[1]

    def couplings(self, state: SpectrumAtParameter, change: Change) -> ComplexArray:
        """What a change of M, C and K (n, n) is in the vectors of a state (m, m), the slopes of its
        roots on the diagonal."""
        (matrices,) = matrices_of(self.system, [state.value])
        derivative = self._standard(matrices, change).derivative
        return _in_vectors(derivative, state.left, state.right)

    def perturbed_by_rounding(self, p: float) -> list[StandardProblem]:
        """The problem at p with derivatives by relative changes of each number that the system
        computes A from; none of a system that does not know them."""
        perturbed = getattr(self.system, "perturbed_by_rounding", None)
        if perturbed is None:
            return []
        return [self._standard(matrices, slopes) for matrices, slopes in perturbed(p)]

    def at(self, p: float) -> SpectrumAtParameter:
        """The state at p, computed once."""
        if p not in self._states:
            standard = self.matrix_and_derivative(p)
            self._add(p, standard, *_eigenvectors(standard.A, self._components))
        return self._states[p]

    def prepare(self, ps: Iterable[float]) -> None:
        """Compute the states at several values together, if that saves time."""
        new = [p for p in dict.fromkeys(ps) if p not in self._states]
        if new and self.size <= self.options.small:
            standards = self._standards(new)
            matrices = np.array([standard.A for standard in standards])
            roots, right = _eigenvectors(matrices, self._components)
            for i, p in enumerate(new):
                self._add(p, standards[i], roots[i], right[i])

    def _add(self, p: float, standard: StandardProblem, roots: NDArray, right: NDArray) -> None:
        A = standard.A
        left = np.zeros_like(right)
        rounding = np.zeros(len(A))
        for rows in self._components:
            block = np.ix_(rows, rows)
            left[block] = left_vectors(A[block], roots[rows], right[block])
        with np.errstate(all="ignore"):
            condition = 1.0 / np.abs(np.sum(left.conj() * right, axis=0))
        for rows in self._components:
            size = norm_of(A[np.ix_(rows, rows)])
            error = 2 * len(rows) * EPS
            rounding[rows] = root_rounding(roots[rows], condition[rows], error, size)
        self._states[p] = SpectrumAtParameter(
            value=p,
            roots=roots,
            right=right,
            left=left,
            coupling=_in_vectors(standard.derivative, left, right),
            rounding=rounding,
            problem=self.problem,
            frequency_scale=1.0 if self.frequency_scale is None else self.frequency_scale,
        )


def _in_vectors(matrix: NDArray, left: NDArray, right: NDArray) -> ComplexArray:
    """left^H matrix right (m, m), where left^H right = 1."""
    products = np.sum(left.conj() * right, axis=0)
    with np.errstate(all="ignore"):
        return np.asarray(np.nan_to_num(left.conj().T @ (matrix @ right) / products[:, None]))


def _eigenvectors(A: NDArray, parts: Sequence[NDArray[np.intp]]) -> tuple[NDArray, NDArray]:
    """Eigenvalues (..., N) and unit vectors (..., N, N) of matrices (..., N, N), or of each of the
    `parts` that they fall into by itself: as many of its own as it has rows."""
    roots = np.zeros(A.shape[:-1], complex)
    right = np.zeros(A.shape, complex)
    for rows in parts:
        block = A[..., rows[:, None], rows]
        hermitian = np.array_equal(block, block.conj().swapaxes(-1, -2))
        solver = np.linalg.eigh if hermitian else np.linalg.eig
        roots[..., rows], right[..., rows[:, None], rows] = solver(block)
    return roots, right


def problem_class_of(samples: Sequence[tuple[Array, Array | None, Array]]) -> ProblemClass:
    """The problem class of matrices M, C, K at some values."""
    if not any(C is not None and C.any() for _, C, _ in samples):
        return UNDAMPED
    for M, C, K in samples:
        if not (_has_symmetry(M, 1) and _has_symmetry(K, 1)):
            return DAMPED
        if C is not None and not _has_symmetry(C, -1):
            return DAMPED
    return GYROSCOPIC


def _has_symmetry(X: Array, sign: int) -> bool:
    """True if X is symmetric (sign 1) or skew (-1), to rounding."""
    return bool(np.abs(X - sign * X.T).max() <= 4 * EPS * len(X) * np.abs(X).max())


def _without_free_motions(samples: Sequence[Matrices]) -> tuple[Array, Array] | None:
    """P, Q (n, n - k), P' M Q q'' + ... without the k motions that neither K nor C ever acts on."""
    M = samples[0][0]
    acting = []
    for other_M, C, K in samples:
        if not np.array_equal(M, other_M):
            return None
        acting += [X for X in (K, C) if X.any()]
    if not acting:
        return None
    # along a unit diagonal of M, so that units do not matter
    scale = 1.0 / np.sqrt(divisor(np.diag(M)))[:, None]
    unit = []
    for X in acting:
        scaled = scale * X * scale.T
        unit.append(scaled / np.abs(scaled).max())
    noise = 8 * EPS * len(M) * float(np.linalg.norm(np.hstack(unit), 2))
    right = scale * null_spaces(np.vstack(unit), noise)[0]
    left = scale * null_spaces(np.hstack(unit), noise)[1]
    k = right.shape[1]
    if not 0 < k < len(M) or left.shape[1] != k or np.linalg.cond(left.T @ M @ right) > 1 / ILL:
        return None
    P = scale * np.linalg.qr(scale * (M @ right), "complete")[0][:, k:]
    Q = scale * np.linalg.qr(scale * (M.T @ left), "complete")[0][:, k:]
    return P, Q


def _normalising(M: Array) -> tuple[Array, Array]:
    """L, R with L M R = 1; L = R' if M is symmetric, positive definite."""
    try:
        T = reduce(M, None, np.zeros_like(M)).T
    except LightMassError:
        raise
    except InputError:
        if not ILL * np.linalg.cond(unit_diagonal(M)) < 1.0:
            raise MatrixError(
                "M: a regular matrix is required to search for all thresholds; where rows have no "
                "mass those of a band can be given"
            ) from None
        return np.asarray(np.linalg.inv(M), dtype=float), np.eye(len(M))
    return T.T, T


@dataclass(frozen=True, eq=False)
class Guess:
    """A place where one root may cross the line, or two may meet on it."""

    value: float
    root: complex  # of two the mean
    right: ComplexArray  # (N, 1) or (N, 2)
    left: ComplexArray
    coalesces: bool
    width: float  # of the parameter within which it must lie, or half of where two stay close
    doubtful: bool = False  # other roots decide over the coupling of the two


def near_coalescences(before: SpectrumAtParameter, after: SpectrumAtParameter) -> Iterator[Guess]:
    """Pairs that may meet, or exchange and cross the line, within a step; seen from both ends."""
    span = after.value - before.value
    yield from _meetings_seen_from(before, span, 1)
    yield from _meetings_seen_from(after, span, -1)


class _Approaches(NamedTuple):
    """Pairs of roots k, l whose squared half difference is (u + x v)^2 / 4 + x^2 a b at a distance
    x from an end of a step.

    `ends` (2, pairs) are its zeros, `inside` (3, pairs) says which of them, and their middle, lie
    in the step. The roots cross without their coupling at `crossing`; `crosses`: in the step.
    """

    k: NDArray[np.intp]
    l: NDArray[np.intp]
    conjugate: Bools
    u: ComplexArray
    v: ComplexArray
    a: ComplexArray
    b: ComplexArray
    crossing: Array
    crosses: Bools
    ends: Array
    inside: Bools

    def select(self, chosen: Bools) -> _Approaches:
        """Some of the pairs."""
        return _Approaches._make(each[..., chosen] for each in self)


def _approaches(state: SpectrumAtParameter, span: float, direction: int) -> _Approaches:
    """All pairs, looking forwards (1) or backwards (-1)."""
    pairs = state.couplings
    slopes = direction * state.slopes
    u = state.roots[pairs.k] - state.roots[pairs.l]
    v = slopes[pairs.k] - slopes[pairs.l]
    crossing = np.nan_to_num((-u / v).real)
    crosses = (crossing > 0) & (crossing < span) & (state.problem is not DAMPED)
    crossing = np.clip(crossing, 0.0, span)
    v = v + crossing * pairs.bend
    a, b = direction * pairs.direct + crossing * pairs.indirect
    split = 2 * np.sqrt(-a * b)
    ends = np.stack([-u / (v - split), -u / (v + split)]).real
    ends = np.where(np.isfinite(ends), ends, 1e9 * span)
    middle_and_ends = np.stack([*ends, ends.mean(axis=0)])
    return _Approaches(
        k=pairs.k,
        l=pairs.l,
        conjugate=pairs.conjugate,
        u=u,
        v=v,
        a=a,
        b=b,
        crossing=crossing,
        crosses=crosses,
        ends=ends,
        inside=np.abs(middle_and_ends - span / 2) <= span / 2,
    )


def _meetings_seen_from(state: SpectrumAtParameter, span: float, direction: int) -> Iterator[Guess]:
    """Near coalescences within a step of this length from one of its ends."""
    with np.errstate(all="ignore"):
        every = _approaches(state, span, direction)
        near = every.inside.any(axis=0) | every.crosses
        if not near.any():
            return
        pairs = every.select(near)
        k = pairs.k
        l = pairs.l
        ends = pairs.ends
        inside = pairs.inside
        w = pairs.a * pairs.b
        centre = ends.mean(axis=0)
        half = np.abs(ends[0] - ends[1]) / 2
        # of a wide window the end that lies in the step
        end_inside = np.where(inside[0], ends[0], ends[1])
        place = np.clip(np.where(inside[2], centre, end_inside), 0.0, span)
        width = np.abs(pairs.u * np.sqrt(w) / pairs.v**2)
        width = width + 1e-6 * span  # also where both ends are one
        offsets = 10.0 ** np.linspace(-1.0, 0.9, 12)  # of the half width of a close approach
        offsets = np.concatenate([-offsets, [0.0], offsets])[:, None]
        x = np.clip(centre + offsets * np.maximum(half, width), 0.0, span)
        d = (pairs.u + x * pairs.v) ** 2 / 4 + x**2 * w
        third = _third_root_coupling(state, pairs, direction)
        error = x**2 * (third + 0.1 * np.abs(w))  # a tenth of the pair's own coupling may be wrong
        slopes = direction * state.slopes
        mean = (state.roots[k] + state.roots[l]) / 2
        mean_slope = (slopes[k] + slopes[l]) / 2
        noise_k = state.rounding[k]
        noise_l = state.rounding[l]
        passes = _passes_zero(d.real, error)
        if state.problem is DAMPED:
            slack = np.minimum(np.sqrt(error), error / np.sqrt(np.abs(d))) + noise_k + noise_l
            middle = (mean + x * mean_slope).real
            split = np.sqrt(d).real
            passes |= ~pairs.conjugate
            passes &= _passes_zero(middle + split, slack) | _passes_zero(middle - split, slack)
        # what rounding alone couples
        passes &= x.max(axis=0) ** 2 * (np.abs(w) + third) > noise_k * noise_l
        doubtful = third > np.abs(w)
        passes |= pairs.crosses & doubtful & (pairs.crossing**2 * third > noise_k * noise_l)
    for n in np.flatnonzero(passes).tolist():
        both = [k[n], l[n]]
        yield Guess(
            value=state.value + direction * float(place[n]),
            root=complex(mean[n] + place[n] * mean_slope[n]),
            right=state.right[:, both],
            left=state.left[:, both],
            coalesces=True,
            width=float(half[n]),
            doubtful=bool(doubtful[n]),
        )


def _third_root_coupling(state: SpectrumAtParameter, pairs: _Approaches, direction: int) -> Array:
    """How other roots, near where the two of a pair meet, may change the product a b (pairs,)."""
    k = pairs.k
    l = pairs.l
    W = state.coupling
    crossing = pairs.crossing[:, None]
    row = np.arange(len(k))
    there = state.roots + crossing * (direction * state.slopes)
    distances = there - (there[row, k] + there[row, l])[:, None] / 2
    distances[row, k] = distances[row, l] = np.inf
    forth = np.abs(crossing * W[k] * W[:, l].T / distances).sum(axis=1)
    back = np.abs(crossing * W[l] * W[:, k].T / distances).sum(axis=1)
    return np.asarray(forth * np.abs(pairs.b) + back * np.abs(pairs.a) + forth * back)


def may_exchange_partner(before: SpectrumAtParameter, after: SpectrumAtParameter) -> bool:
    """True if a root on the line may take the partner of a root off it; without damping.

    It passes so closely that coupling moves the root off the line by a quarter of its distance.
    """
    span = after.value - before.value
    return _may_exchange_partner(before, span, 1) or _may_exchange_partner(after, span, -1)


def _may_exchange_partner(state: SpectrumAtParameter, span: float, direction: int) -> bool:
    """The same as seen from one end of the step.

    Between a root i off the line and a root j on it the coupling W, a distance x ahead, moves root
    i by x^2 W_ij W_ji / (z_i - z_j); its partner is its conjugate, at twice its height.
    """
    z = state.roots
    W = state.coupling
    slopes = direction * state.slopes
    above = z.imag > state.rounding
    if state.problem is DAMPED or not above.any():
        return False
    gap = z[:, None] - z
    gap_slope = slopes[:, None] - slopes
    with np.errstate(all="ignore"):
        closest = -(gap * gap_slope.conj()).real / np.abs(gap_slope) ** 2
        moved = closest**2 * np.abs(W * W.T) / np.abs(gap + closest * gap_slope)
        height = np.abs(z.imag[:, None] + closest * slopes.imag[:, None])
        exchanges = (closest > 0) & (closest < span) & (4 * moved > height)
    return bool(exchanges[np.ix_(above, state.on_line)].any())


def _passes_zero(values: Array, slack: Array) -> Bools:
    """Which columns have values on both sides of zero, each up to its slack."""
    return np.asarray(((values - slack).min(axis=0) < 0) & ((values + slack).max(axis=0) > 0))


class StepEnds(NamedTuple):
    """Roots (m,) before a step, their slopes times its length, and the same after it."""

    z: ComplexArray
    dz: ComplexArray
    later_z: ComplexArray
    later_dz: ComplexArray


class RootPair(NamedTuple):
    """Two roots by their indices at the beginning of a step, and cubics (4,) over it of their mean
    and of the squared half difference."""

    indices: list[int]
    mean: ComplexArray
    square: ComplexArray


class Step:
    """Two neighbouring states, and which root of the one is which of the other.

    `order` is the index after the step of each root before it; `deviation` is how far each root is
    from where the slopes at both ends point, `matched` says where that is little; `cubic` (4, m)
    goes through the real parts, from `lowest` to `highest`.
    """

    def __init__(
        self, before: SpectrumAtParameter, after: SpectrumAtParameter, options: ContinuationOptions
    ) -> None:
        self.before = before
        self.after = after
        self.options = options
        h = after.value - before.value
        slope_sums = before.slopes[:, None] + after.slopes
        slope_changes = before.slopes[:, None] - after.slopes
        mismatch = np.abs(after.roots - before.roots[:, None] - h / 2 * slope_sums)
        # of two that cross in the middle those that turn back would fit as well
        self.mismatch = mismatch + 0.01 * np.abs(h * slope_changes)
        self.order = assigned(self.mismatch)
        self.ends = StepEnds(
            z=before.roots,
            dz=h * before.slopes,
            later_z=after.roots[self.order],
            later_dz=h * after.slopes[self.order],
        )
        z, dz, later_z, later_dz = self.ends
        self.deviation = later_z - z - (dz + later_dz) / 2
        self.rounding = np.maximum(before.rounding, after.rounding[self.order])
        allowed = np.maximum(options.doubt * np.abs(later_z - z), options.near * np.abs(z))
        self.matched = np.abs(self.deviation) <= allowed + 4 * self.rounding
        self.cubic = hermite_cubic(z.real, dz.real, later_z.real, later_dz.real)
        c = self.cubic
        t = np.linspace(0.0, 1.0, 17)[:, None]
        values = c[0] + t * (c[1] + t * (c[2] + t * c[3]))
        self.lowest = values.min(axis=0)
        self.highest = values.max(axis=0)

    @cached_property
    def same_mode(self) -> Bools:
        """Which roots (m, m') before and after are one mode by their vectors, slopes considered.

        |left^H right| of both ends is near 1 of one mode, near 0 of any other; in a row its
        products with what it is the other way round add up to 1.
        """
        before = self.before
        after = self.after
        options = self.options

        def products(left_of: SpectrumAtParameter, right_of: SpectrumAtParameter) -> Array:
            return np.abs(left_of.left.conj().T @ right_of.right)

        with np.errstate(all="ignore"):
            norms = np.multiply.outer(
                products(before, before).diagonal(), products(after, after).diagonal()
            )
            alike = products(before, after) * products(after, before).T / norms
        allowed = options.doubt * np.abs(after.roots - before.roots[:, None])
        allowed = np.maximum(allowed, options.near * np.abs(before.roots)[:, None])
        same = alike > options.alike
        same |= (alike > options.likely) & (self.mismatch <= allowed)
        only_one = (same.sum(axis=0) == 1) & (same.sum(axis=1) == 1)[:, None]
        return np.asarray(same & only_one)

    def vectors(self, t: float, roots: Sequence[int]) -> tuple[ComplexArray, ComplexArray]:
        """Right and left vectors of roots (indices before the step) at its nearer end."""
        if t < 0.5:
            indices = list(roots)
            return self.before.right[:, indices], self.before.left[:, indices]
        indices = self.order[list(roots)].tolist()
        return self.after.right[:, indices], self.after.left[:, indices]

    def pairs(self, roots: Sequence[int]) -> Iterator[RootPair]:
        """The pairs of roots (indices before the step), the closest first, whose mean and squared
        half difference follow cubics."""

        def closest(two: tuple[int, int]) -> float:
            k, l = two
            z = self.ends.z
            later_z = self.ends.later_z
            return min(abs(z[k] - z[l]), abs(later_z[k] - later_z[l]))

        remaining = set(roots)
        for two in sorted(itertools.combinations(roots, 2), key=closest):
            if not remaining.issuperset(two):
                continue
            ends = np.array([values[list(two)] for values in self.ends])
            mean = ends.mean(axis=1)
            half = (ends[:, 0] - ends[:, 1]) / 2
            square = half[0] ** 2, 2 * half[0] * half[1], half[2] ** 2, 2 * half[2] * half[3]
            largest = max(abs(square[0]), abs(square[2]))
            if self._is_cubic(mean, abs(mean[0])) and self._is_cubic(square, largest):
                remaining -= set(two)
                yield RootPair(list(two), hermite_cubic(*mean), hermite_cubic(*square))

    def _is_cubic(self, ends: Sequence[complex], size: float) -> bool:
        """True if slopes predict the change of something of that size within the step."""
        z, dz, later_z, later_dz = ends
        allowed = self.options.doubt * max(abs(later_z - z), self.options.near * size)
        return bool(abs(later_z - z - (dz + later_dz) / 2) <= allowed)
