"""Eigenvalues of a parametrised system along its parameter: a spectrum with slopes at each value,
matched from one value to the next. Nothing here knows of growth or of verdicts.

The eigenvalues z of A(p) v = z v stand for lambda in one of three forms. Without damping they are
z = -lambda^2 in mass-normalised coordinates. An undamped gyroscopic system (M and K symmetric, C
skew) has z = -i lambda, any other one z = lambda, both over a rate and of the first-order form.
What neither grows nor decays lies on a line: the real axis of the first two, *conservative* forms,
the imaginary axis of the third. A spectrum that is symmetric about its line leaves it only where
two eigenvalues meet on it.

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
from functools import cached_property
from typing import Any

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


@dataclass(frozen=True)
class ContinuationOptions:
    """What a continuation and a search for thresholds may cost, and when they are in doubt.

    A threshold that is missed calls for more `steps`, or for a smaller `doubt`.
    """

    steps: int = 24  # values at which the eigenvalues are computed first; large systems take fewer
    depth: int = 12  # how often a step may be halved
    budget: int = 1500  # values in all, of systems of up to 60 rows; larger ones take fewer
    doubt: float = 0.25  # of its way: how far the slopes may miss a root that counts as matched
    near: float = 1e-3  # of |z|: ... or this; of a frequency: how far roots that are one differ
    alike: float = 0.8  # how alike the vectors of one mode are at both ends of a step
    likely: float = 0.5  # ... where slopes agree too
    difference: float = 1e-6  # of the range: step of a difference that stands for a derivative
    # of the range: events closer than this are at one place, unless the counts between them agree;
    # of its value: an interval narrower than this has converged
    same: float = 1e-9
    sure: float = 4.0  # standard deviations of rounding that an interval holds
    wide: float = 1e-4  # of the range: the widest interval of a certified search
    aside: float = 0.4837  # of a step: where it is divided
    rounds: int = 12  # steps of Newton's method, and half of those of inverse iteration
    small: int = 40  # rows up to which systems are stacked, and SciPy's loading is not worth while


def hermite_cubic(a: Any, da: Any, b: Any, db: Any) -> Array:
    """Coefficients (4, ...) by rising powers of t through values and derivatives at 0 and 1."""
    return np.array([a, da, 3 * (b - a) - 2 * da - db, 2 * (a - b) + da + db])


def zeros_between(cubic: Array) -> list[float]:
    """Real zeros in 0 <= t <= 1, or next to it, of a cubic by rising powers."""
    roots = np.roots(cubic[::-1]) if np.any(cubic[1:]) else np.zeros(0)
    real = roots[np.abs(roots.imag) < 1e-9].real
    return sorted(real[np.abs(real - 0.5) <= 0.5 + 1e-9].tolist())


@dataclass(frozen=True, eq=False, repr=False)
class State:
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
    form: str = "damped"  # undamped, gyroscopic, damped
    rate: float = 1.0

    @property
    def slopes(self) -> ComplexArray:
        """Derivatives dz/dp (m,)."""
        return np.asarray(self.coupling.diagonal())

    @cached_property
    def exponents(self) -> ComplexArray:
        """The eigenvalues lambda (rad/s) of the roots; without damping those that do not decay."""
        return exponents(self.roots, self.form, self.rate)

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
        if self.form == "damped":
            return np.asarray(np.abs(self.roots.real) <= self.rounding)
        return self.real & ((self.form == "gyroscopic") | (self.roots.real >= -self.rounding))

    @cached_property
    def close(self) -> Bools:
        """Which roots (m, m) rounding does not tell apart: twice, since it moves what two differ
        by, squared, by twice that difference times itself."""
        apart = np.abs(self.roots[:, None] - self.roots)
        return np.asarray(apart <= 2 * np.add.outer(self.rounding, self.rounding))

    @cached_property
    def kinds(self) -> Codes:
        """What each root does, see `eigen.kinds`; of a pair that grows both."""
        if self.form == "undamped":
            return kinds(*square_roots(self.roots, self.rounding))
        return kinds(self.roots * (1.0 if self.form == "damped" else 1j), self.rounding)

    @cached_property
    def growing(self) -> tuple[list[int], list[int]]:
        """Indices of upper roots of growing pairs, and of growing real roots; the fastest first."""
        across = self.roots.real if self.form == "gyroscopic" else self.roots.imag
        order = np.argsort(-self.exponents.real).tolist()
        pairs = [k for k in order if self.kinds[k] == FLUTTER and across[k] > 0.0]
        return pairs, [k for k in order if self.kinds[k] == DIVERGENCE]

    @cached_property
    def growth(self) -> UnstableCount:
        """How much grows by more than rounding."""
        rates = (float(self.exponents[k[0]].real) if k else 0.0 for k in self.growing)
        return UnstableCount(*map(len, self.growing), *rates)

    @cached_property
    def bounds(self) -> tuple[int, int]:
        """At least and at most how many roots (two for a pair) grow, rounding considered."""
        z, rounding = self.roots, 2 * self.rounding  # those of two that are close, see `close`
        near = self.close.sum(axis=1) > 1
        if self.form == "damped":
            sure, near = z.real > rounding, z.real > -rounding
        elif self.form == "gyroscopic":
            sure = z.imag < -rounding
        else:  # each complex s and each negative one gives a growing root
            sure = (np.abs(z.imag) > rounding) | (z.real < -rounding)
            near = near | (z.real < rounding)
        return int(np.sum(sure)), int(np.sum(sure | near))

    @property
    def sure(self) -> bool:
        """True if rounding leaves no doubt about how many roots grow."""
        least, most = self.bounds
        return least == most

    @cached_property
    def couplings(self) -> tuple[NDArray, ...]:
        """Pairs (k, l) on the line or above it, or conjugate, and of each whether it is conjugate,
        W and T of kl and lk, and half of z_k'' - z_l'' by all others."""
        z, W, noise, own = self.roots, self.coupling, self.rounding, self.slopes
        apart, unsure = z[:, None] - z, np.add.outer(noise, noise)
        conjugate = np.abs(z[:, None] - z.conj()) <= unsure
        upper = z.imag >= -noise
        if self.form != "damped":
            positive = z.real > (0 if self.form == "undamped" else -noise)
            upper = self.real & positive
            conjugate &= positive
        if self.form == "gyroscopic":  # those that meet at zero
            conjugate |= (np.abs(z[:, None] + z) <= unsure) & self.real
        k, l = np.nonzero(np.triu((upper[:, None] & upper) | conjugate, 1))
        pairs = np.stack([k, l]), np.stack([l, k])
        with np.errstate(all="ignore"):
            inverse = np.where(np.abs(apart) > unsure, 1 / apart, 0.0)
            F = W * inverse
            T = (F @ W - W @ F + F * (own[:, None] - own)) / 2
            bend = np.einsum("km,mk->k", F, W)
            bend = bend[k] - bend[l] - 2 * W[k, l] * W[l, k] * inverse[k, l]
        return k, l, conjugate[k, l], W[pairs], T[pairs], bend


def exponents(roots: ComplexArray, form: str, rate: float) -> ComplexArray:
    """The eigenvalues lambda (rad/s) of roots; without damping those that do not decay."""
    if form == "undamped":
        return np.asarray(np.sqrt(-roots + 0j))
    return np.asarray((roots if form == "damped" else 1j * roots) * rate)


class Continuation:
    """The spectrum of system(p) -> (M, C, K), real and M regular, for low <= p <= high.

    Examples
    --------
    >>> import numpy as np
    >>> K = lambda p: np.array([[2.0, -1.0 + 4 * p / 3], [-1.0, 2.0]])
    >>> along = Continuation(lambda p: (np.eye(2), None, K(p)), 0.0, 2.0)
    >>> along.form, along.at(0.75).roots.real.round(6).tolist()
    ('undamped', [2.0, 2.0])
    """

    def __init__(
        self,
        system: SystemFunction,
        low: float,
        high: float,
        options: ContinuationOptions | None = None,
    ) -> None:
        self.system, self.low, self.high = system, low, high
        self.options = options or ContinuationOptions()
        if isinstance(system, TermSystem) and not system.real:
            raise InputError(
                "thresholds: complex matrices (structural damping) are not allowed; damping by "
                "rayleigh or ratios is"
            )
        inside = [low + x * (high - low) for x in (0.07, 0.31, 0.53, 0.71, 0.97)]
        each = matrices_of(system, inside)
        self._free = _free_motions(each)
        self.form = form_of(each)
        n = len(each[0][0]) if self._free is None else self._free[0].shape[1]
        self.size = n if self.form == "undamped" else 2 * n  # rows N of A
        self.rate: Any = 1.0 if self.form == "undamped" else None
        self._states: dict[float, State] = {}
        self._pattern = np.zeros((self.size, self.size), dtype=bool)
        self._parts: list[NDArray[np.intp]] = []  # strong components of A at all values so far
        for matrices in each:
            self._standard(matrices, (np.zeros_like(matrices[0]),) * 3)
        # of no value, but it sets the rate
        self._last = np.nan, *self._standard(each[2], (np.zeros_like(each[2][0]),) * 3)

    @property
    def states(self) -> list[State]:
        """All states so far, by rising value."""
        return [self._states[p] for p in sorted(self._states)]

    def _standard(self, matrices: Any, slopes: Any) -> tuple[NDArray, NDArray, Array]:
        """A(p), dA/dp and the sizes of what is rounded in the entries of A, without what one strong
        component does to another: that changes no eigenvalue and costs digits."""
        if self._free is not None:
            P, Q = self._free
            matrices, slopes = ([P.T @ X @ Q for X in part] for part in (matrices, slopes))
        M, C, K = matrices
        left, right = _normalising(M)
        A, B, mass, dA, dB = (left @ X @ right for X in (K, C, slopes[0], slopes[2], slopes[1]))
        dA, dB = dA - mass @ A, dB - mass @ B
        L, R = np.abs(left), np.abs(right)
        off = L @ np.abs(M) @ R  # what rounding makes of L M R = 1
        growth = getattr(self.system, "growth", 1.0)  # of what was eliminated before, see `light`
        E, F = (growth * (L @ np.abs(X) @ R + off @ np.abs(Y)) for X, Y in ((K, A), (C, B)))
        if self.form != "undamped":
            n = len(A)
            A, self.rate = first_order(A, B, self.rate)
            dA, E = (first_order(*part, self.rate)[0] for part in ((dA, dB), (-E, -F)))
            dA[:n] = E[:n] = 0.0
        if self.form == "gyroscopic":
            A, dA = -1j * A, -1j * dA
        pattern = self._pattern | (A != 0.0) | (dA != 0.0)
        if not np.array_equal(pattern, self._pattern):
            self._pattern, self._parts = pattern, components(reaches(pattern))
        if len(self._parts) > 1:
            within = np.zeros(A.shape)
            for part in self._parts:
                within[np.ix_(part, part)] = 1.0
            A, dA, E = A * within, dA * within, E * within
        return A, dA, E

    def _standards(self, ps: Sequence[float]) -> list[tuple[NDArray, NDArray, Array]]:
        both = with_slopes(self.system, ps, self.low, self.high, self.options.difference)
        return [self._standard(*each) for each in both]

    def both(self, p: float) -> tuple[NDArray, NDArray, Array]:
        """A(p), dA/dp, and the sizes of which the rounding of each entry is a part eps."""
        if self._last[0] != p:
            self._last = p, *self._standards([p])[0]
        return self._last[1:]

    def couplings(self, state: State, change: Any) -> NDArray:
        """What a change of M, C and K (n, n) is in the vectors of a state (m, m), the slopes of its
        roots on the diagonal."""
        (matrices,) = matrices_of(self.system, [state.value])
        dA = self._standard(matrices, change)[1]
        return _in_vectors(dA, state.left, state.right)

    def shaken(self, p: float) -> list[tuple[NDArray, NDArray, Array]]:
        """`both` with dA by relative changes of each thing that the system computes A from."""
        return [self._standard(*each) for each in getattr(self.system, "shaken", lambda _: [])(p)]

    def at(self, p: float) -> State:
        """The state at p, computed once."""
        if p not in self._states:
            A, slope, _ = self.both(p)
            self._add(p, A, slope, *_eigenvectors(A, self._parts))
        return self._states[p]

    def prepare(self, ps: Iterable[float]) -> None:
        """Compute the states at several values together, if that saves time."""
        ps = [p for p in dict.fromkeys(ps) if p not in self._states]
        if ps and self.size <= self.options.small:
            each = self._standards(ps)
            roots = _eigenvectors(np.array([A for A, _, _ in each]), self._parts)
            for p, (A, slope, _), z, X in zip(ps, each, *roots, strict=True):
                self._add(p, A, slope, z, X)

    def _add(self, p: float, A: NDArray, slope: NDArray, values: NDArray, right: NDArray) -> None:
        left, rounding = np.zeros_like(right), np.zeros(len(A))
        for part in self._parts:
            own = np.ix_(part, part)
            left[own] = left_vectors(A[own], values[part], right[own])
        across = np.sum(left.conj() * right, axis=0)
        with np.errstate(all="ignore"):
            condition = 1.0 / np.abs(across)
        coupling = _in_vectors(slope, left, right)
        for part in self._parts:
            size, error = norm_of(A[np.ix_(part, part)]), 2 * len(part) * EPS
            rounding[part] = root_rounding(values[part], condition[part], error, size)
        spectrum = values, right, left, coupling, rounding
        self._states[p] = State(p, *spectrum, self.form, self.rate)


def _in_vectors(slope: NDArray, left: NDArray, right: NDArray) -> NDArray:
    """left^H slope right (m, m), where left^H right = 1."""
    across = np.sum(left.conj() * right, axis=0)
    with np.errstate(all="ignore"):
        return np.asarray(np.nan_to_num(left.conj().T @ (slope @ right) / across[:, None]))


def _eigenvectors(A: NDArray, parts: Sequence[NDArray[np.intp]]) -> tuple[NDArray, NDArray]:
    """Eigenvalues (..., N) and unit vectors (..., N, N) of matrices (..., N, N), or of each of the
    `parts` that they fall into by itself: as many of its own as it has rows."""
    values, right = np.zeros(A.shape[:-1], complex), np.zeros(A.shape, complex)
    for part in parts:
        block = A[..., part[:, None], part]
        hermitian = np.array_equal(block, block.conj().swapaxes(-1, -2))
        z, x = np.linalg.eigh(block) if hermitian else np.linalg.eig(block)
        values[..., part], right[..., part[:, None], part] = z, x
    return values, right


def form_of(each: Sequence[tuple[Array, Array | None, Array]]) -> str:
    """undamped, gyroscopic or damped, of matrices M, C, K at some values."""
    if not any(C is not None and C.any() for _, C, _ in each):
        return "undamped"
    symmetric = all(
        np.abs(X - sign * X.T).max() <= 4 * EPS * len(X) * np.abs(X).max()
        for matrices in each
        for X, sign in zip(matrices, (1, -1, 1), strict=True)
        if X is not None
    )
    return "gyroscopic" if symmetric else "damped"


def _free_motions(each: Sequence[tuple[Array, Array, Array]]) -> tuple[Array, Array] | None:
    """P, Q (n, n - k), P' M Q q'' + ... without the k motions that neither K nor C ever acts on."""
    M = each[0][0]
    parts = [X for _, C, K in each for X in (K, C) if X.any()]
    if not parts or any(not np.array_equal(M, other) for other, _, _ in each):
        return None
    # along a unit diagonal of M, so that units do not matter
    scale = 1.0 / np.sqrt(divisor(np.diag(M)))[:, None]
    unit = [scale * X * scale.T for X in parts]
    unit = [X / np.abs(X).max() for X in unit]

    noise = 8 * EPS * len(M) * float(np.linalg.norm(np.hstack(unit), 2))
    right = scale * null_spaces(np.vstack(unit), noise)[0]
    left = scale * null_spaces(np.hstack(unit), noise)[1]
    k = right.shape[1]
    if not 0 < k < len(M) or left.shape[1] != k or np.linalg.cond(left.T @ M @ right) > 1 / ILL:
        return None
    beside = (np.linalg.qr(scale * X, "complete")[0][:, k:] for X in (M @ right, M.T @ left))
    P, Q = (scale * X for X in beside)
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


def near_coalescences(before: State, after: State) -> Iterator[Guess]:
    """Pairs that may meet, or exchange and cross the line, within a step; seen from both ends."""
    span = after.value - before.value
    for state, way in ((before, 1), (after, -1)):
        k, l, conjugate, direct, indirect, bend = state.couplings
        z, noise, own = state.roots, state.rounding, way * state.slopes
        with np.errstate(all="ignore"):
            u, v = z[k] - z[l], own[k] - own[l]
            x = np.nan_to_num((-u / v).real)
            crosses = (x > 0) & (x < span) & (state.form != "damped")
            x = np.clip(x, 0.0, span)
            v = v + x * bend
            a, b = way * direct + x * indirect
            s = 2 * np.sqrt(-a * b)
            ends = np.stack([-u / (v - s), -u / (v + s)]).real
            ends = np.where(np.isfinite(ends), ends, 1e9 * span)
            inside = np.abs(np.stack([*ends, ends.mean(axis=0)]) - span / 2) <= span / 2
            near = inside.any(axis=0) | crosses
            if not near.any():
                continue
            ends, inside = ends[:, near], inside[:, near]
            crosses, x_c, a, b = crosses[near], x[near, None], a[near], b[near]
            k, l, u, v, w = k[near], l[near], u[near], v[near], a * b
            conjugate = conjugate[near]
            centre, half = ends.mean(axis=0), np.abs(ends[0] - ends[1]) / 2
            # of a wide window the end that lies in the step
            at = np.clip(np.where(inside[2], centre, np.where(inside[0], *ends)), 0.0, span)
            width = np.abs(u * np.sqrt(w) / v**2) + 1e-6 * span  # also where both ends are one
            looks = 10.0 ** np.linspace(-1.0, 0.9, 12)  # of the half width of a close approach
            looks = np.concatenate([-looks, [0.0], looks])[:, None]
            x = np.clip(centre + looks * np.maximum(half, width), 0.0, span)
            # what others couple that are near where the two meet
            W, apart = state.coupling, z + x_c * own
            row = np.arange(len(k))
            apart = apart - (apart[row, k] + apart[row, l])[:, None] / 2
            apart[row, k] = apart[row, l] = np.inf
            there, back = (
                np.abs(x_c * W[i] * W[:, j].T / apart).sum(axis=1) for i, j in ((k, l), (l, k))
            )
            third = there * np.abs(b) + back * np.abs(a) + there * back
            d = (u + x * v) ** 2 / 4 + x**2 * w
            error = x**2 * (third + 0.1 * np.abs(w))  # of what both exchange a third may be wrong
            mean, mean_slope = (z[k] + z[l]) / 2, (own[k] + own[l]) / 2
            passes = _passes(d.real, error)
            if state.form == "damped":
                slack = np.minimum(np.sqrt(error), error / np.sqrt(np.abs(d))) + noise[k] + noise[l]
                same, apart = (mean + x * mean_slope).real, np.sqrt(d).real
                passes |= ~conjugate
                passes &= _passes(same + apart, slack) | _passes(same - apart, slack)
            # what rounding alone couples
            passes &= x.max(axis=0) ** 2 * (np.abs(w) + third) > noise[k] * noise[l]
            doubtful = third > np.abs(w)
            passes |= crosses & doubtful & (x_c[:, 0] ** 2 * third > noise[k] * noise[l])
        for n in np.flatnonzero(passes).tolist():
            middle, both = complex(mean[n] + at[n] * mean_slope[n]), [k[n], l[n]]
            vectors = state.right[:, both], state.left[:, both]
            value = state.value + way * float(at[n])
            yield Guess(value, middle, *vectors, True, float(half[n]), bool(doubtful[n]))


def may_swap(before: State, after: State) -> bool:
    """True if a root on the line may take the partner of a root off it; without damping.

    It passes so closely that coupling moves the root off the line by a quarter of its distance.
    """
    span = after.value - before.value
    for state, way in ((before, 1), (after, -1)):
        z, W, own = state.roots, state.coupling, way * state.slopes
        if state.form == "damped" or not (above := z.imag > state.rounding).any():
            continue
        both = np.ix_(above, state.on_line)
        u, v = z[:, None] - z, own[:, None] - own
        with np.errstate(all="ignore"):
            x = -(u * v.conj()).real / np.abs(v) ** 2
            moved = x**2 * np.abs(W * W.T) / np.abs(u + x * v)
            left = np.abs(z.imag[:, None] + x * own.imag[:, None])
            taken = (x > 0) & (x < span) & (4 * moved > left)
        if taken[both].any():
            return True
    return False


def _passes(values: Array, slack: Array) -> Bools:
    return np.asarray(((values - slack).min(axis=0) < 0) & ((values + slack).max(axis=0) > 0))


class Step:
    """Two neighbouring states.

    `order` is the index at `b` of each root of `a`; `ends` are the roots at `a`, their slopes over
    the step, and the same at `b`; `off` is by how much the slopes miss each root, `matched` which
    roots they foresee; `cubic` (4, m) goes through the real parts, from `least` to `most`.
    """

    def __init__(self, a: State, b: State, options: ContinuationOptions) -> None:
        self.a, self.b, self.options, h = a, b, options, b.value - a.value
        mean, bend = a.slopes[:, None] + b.slopes, a.slopes[:, None] - b.slopes
        missed = np.abs(b.roots - a.roots[:, None] - h / 2 * mean)
        # of two that cross in the middle those that turn back would fit as well
        self.missed = missed + 0.01 * np.abs(h * bend)
        k = self.order = assigned(self.missed)
        za, da, zb, db = self.ends = a.roots, h * a.slopes, b.roots[k], h * b.slopes[k]
        self.off = zb - za - (da + db) / 2
        self.rounding = np.maximum(a.rounding, b.rounding[k])
        allowed = np.maximum(options.doubt * np.abs(zb - za), options.near * np.abs(za))
        self.matched = np.abs(self.off) <= allowed + 4 * self.rounding
        c = self.cubic = hermite_cubic(za.real, da.real, zb.real, db.real)
        t = np.linspace(0.0, 1.0, 17)[:, None]
        values = c[0] + t * (c[1] + t * (c[2] + t * c[3]))
        self.least, self.most = values.min(axis=0), values.max(axis=0)

    @cached_property
    def links(self) -> Bools:
        """Which roots (m, m') of a and of b are one mode by their vectors, slopes considered.

        |left^H right| of both ends is near 1 of one mode, near 0 of any other; in a row its
        products with what it is the other way round add up to 1.
        """
        a, b, options = self.a, self.b, self.options
        with np.errstate(all="ignore"):
            there, back, *own = (
                np.abs(x.left.conj().T @ y.right) for x, y in ((a, b), (b, a), (a, a), (b, b))
            )
            alike = there * back.T / np.multiply.outer(*(X.diagonal() for X in own))
        allowed = options.doubt * np.abs(b.roots - a.roots[:, None])
        allowed = np.maximum(allowed, options.near * np.abs(a.roots)[:, None])
        same = (alike > options.alike) | ((alike > options.likely) & (self.missed <= allowed))
        return np.asarray(same & (same.sum(axis=0) == 1) & (same.sum(axis=1) == 1)[:, None])

    def vectors(self, t: float, roots: Sequence[int]) -> tuple[ComplexArray, ComplexArray]:
        """Right and left vectors of roots (indices at a) at the nearer end of the step."""
        at, k = (self.a, list(roots)) if t < 0.5 else (self.b, self.order[list(roots)].tolist())
        return at.right[:, k], at.left[:, k]

    def pairs(self, roots: Sequence[int]) -> Iterator[tuple[list[int], Array, Array]]:
        """Of roots (indices at a) the pairs, the closest first, that cubics (4,) of the mean and of
        the squared half difference fit, with these."""
        left, options = set(roots), self.options
        for both in sorted(
            map(list, itertools.combinations(roots, 2)),
            key=lambda p: min(abs(z[p[0]] - z[p[1]]) for z in self.ends[::2]),
        ):
            ends = np.array([x[both] for x in self.ends])
            mean, half = ends.mean(axis=1), (ends[:, 0] - ends[:, 1]) / 2
            square = half[0] ** 2, 2 * half[0] * half[1], half[2] ** 2, 2 * half[2] * half[3]
            sizes = abs(mean[0]), max(abs(square[0]), abs(square[2]))
            if left.issuperset(both) and all(
                abs(b - a - (da + db) / 2) <= options.doubt * max(abs(b - a), options.near * size)
                for (a, da, b, db), size in zip((mean, square), sizes, strict=True)
            ):
                left -= set(both)
                yield both, hermite_cubic(*mean), hermite_cubic(*square)
