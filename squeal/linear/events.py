"""Where eigenvalues cross the line between growth and decay: guesses along a step, made exact.

One root passes at a zero of its real part, with the derivative from left and right vectors. Two
that come close are examined in the 2 x 2 problem of their invariant subspace. Its mean and the
squared half difference d = ((z1 - z2) / 2)^2 stay smooth where the two coalesce, and are well
conditioned there although neither root is. On the line they meet where d vanishes; with m the real
part of the mean one of them passes it where m^2 Re d + (Im d)^2 / 4 - m^4 does: the product of
their real parts times what does not vanish.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.linear.continuation import (
    DAMPED,
    GYROSCOPIC,
    UNDAMPED,
    Bools,
    ComplexArray,
    Continuation,
    ProblemClass,
    StandardProblem,
    exponents,
    hermite_cubic,
    zeros_between,
)
from squeal.linear.matrices import EPS, Array, norm_of
from squeal.linear.steps import Guess, RootPair, Step


@dataclass(frozen=True)
class Crossing:
    """A pair or a real root that crosses the imaginary axis on the way up in mu."""

    mu: float
    kind: str  # flutter: a pair; divergence: a real root
    direction: str  # up: it starts to grow; down: it ceases
    frequency_hz: float  # at mu; 0 for divergence
    interval: tuple[float, float]  # bracket of mu, rounding included; the point itself at a jump
    mode: int  # by rising frequency at mu, from 1; of a coalescing pair the first
    changes_verdict: bool  # false where other modes grow all the same, and faster
    residual: float | None = None  # backward error of the root there, if it is known

    def __str__(self) -> str:
        return f"{self.kind} {self.direction} at mu = {self.mu:.9g}{hertz_of(self.frequency_hz)}"


def hertz_of(frequency: float) -> str:
    """A frequency in words, nothing for 0."""
    return f", {frequency:.6g} Hz" if frequency else ""


@dataclass(frozen=True)
class Event:
    """A root, or two that meet, crosses the line between growth and decay.

    Attributes
    ----------
    value : float
        The parameter there.
    omega : float
        Angular frequency, rad/s; 0 of a real root.
    direction : int
        1 if growth begins with rising parameter, -1 if it ends.
    interval : (float, float)
        Holds the parameter, rounding included.
    residual : float, optional
        Backward error of the root there, as a share of the norm of the matrix.
    coalesces : bool
        True if two roots meet on the line.
    converged : bool
        False if only a count of growing roots tells of the event.
    """

    value: float
    omega: float
    direction: int
    interval: tuple[float, float]
    residual: float | None = None
    coalesces: bool = False
    converged: bool = True

    @property
    def kind(self) -> str:
        """flutter for a pair, divergence for a real root."""
        return "flutter" if self.omega else "divergence"

    @property
    def width(self) -> float:
        """Of the interval."""
        return self.interval[1] - self.interval[0]

    def crossing(self, mode: int, changes: bool) -> Crossing:
        """The same for callers, with the number of the mode and whether the verdict changes."""
        low, high = self.interval
        return Crossing(
            mu=float(self.value),
            kind=self.kind,
            direction="up" if self.direction > 0 else "down",
            frequency_hz=self.omega / (2 * math.pi),
            interval=(float(low), float(high)),
            mode=mode,
            changes_verdict=changes,
            residual=self.residual,
        )


def guesses_of(step: Step, ends: tuple[bool, bool]) -> tuple[list[Guess], float | None]:
    """Where roots may cross the line within a step, and where to divide it if that is in doubt.

    Parameters
    ----------
    step : Step
        The step, with its roots matched.
    ends : (bool, bool)
        Whether its two ends are those of the whole range.

    Returns
    -------
    guesses : list of Guess
        The best there are.
    division : float or None
        The share of the step at which to divide it first; None if the matches are good enough.
    """
    problem = step.before.problem
    z = step.ends.z
    later_z = step.ends.later_z
    on_before = step.before.on_line
    on_after = step.after.on_line[step.order]
    real = step.before.real & step.after.real[step.order]
    # how far a path may be from its cubic, towards the line
    unsure = 2 * np.abs(step.deviation.real)
    passes_zero = np.zeros(len(z), dtype=bool)
    if problem is DAMPED:
        unsure = unsure + step.rounding
        clear = (step.highest + unsure < 0.0) | (step.lowest - unsure > 0.0)
    else:  # pairs off the line stay such; real roots of s = -lambda^2 may pass zero
        if problem is UNDAMPED:
            resting = (np.abs(z) <= step.rounding) & (np.abs(later_z) <= step.rounding)
            around_zero = (step.lowest - unsure <= 0.0) & (step.highest + unsure >= 0.0)
            passes_zero = real & around_zero & ~resting
        distance = np.minimum(np.abs(z.imag), np.abs(later_z.imag))
        clear = (distance > 2 * np.abs(step.deviation.imag)) | (real & ~passes_zero)
    # what lies on the line at one end alone has met another one, unless the range ends there, or it
    # is a real root that passes zero, perhaps with a twin
    range_end = (ends[0] & on_before) | (ends[1] & on_after)
    known = step.matched & ((on_before == on_after) | passes_zero | range_end)
    settled = known & (clear | (on_before & on_after & ~passes_zero))
    change = np.maximum(np.abs((later_z - z).real), step.highest - step.lowest)
    single = known & ~settled & (np.abs(step.deviation.real) <= step.options.doubt * change)
    guesses: list[Guess] = []
    for k in np.flatnonzero(single).tolist():
        guesses += _crossings_of_one(step, k, known=True)
    doubtful = set(np.flatnonzero(~settled & ~single).tolist())
    for pair in list(step.pairs(sorted(doubtful))):
        guesses += _events_of_pair(step, pair)
        doubtful.difference_update(pair.indices)
    for k in doubtful:  # the best there is if no step can be divided any more
        guesses += _crossings_of_one(step, k, known=False)
    if doubtful:
        return guesses, step.options.aside
    turning = known if problem is DAMPED else known & real
    return guesses, _doubtful_turn(step, turning, step.highest - step.lowest)


def _doubtful_turn(step: Step, roots: Bools, change: Array) -> float | None:
    """Where a root turns back so close to the line that its cubic does not tell whether it crosses.

    The cubic c0 + c1 t + c2 t^2 + c3 t^3 through values and slopes at both ends is off by
    t^2 (1 - t)^2 times a constant.

    Parameters
    ----------
    step : Step
        The step.
    roots : array of bool (m,)
        Which roots are looked at.
    change : array (m,)
        By how much the real part of each changes within the step.

    Returns
    -------
    float or None
        The share of the step at the first such turn.
    """
    # damping that passes zero for a ten-thousandth of the range needs it: else it is missed
    c = step.cubic
    with np.errstate(all="ignore"):
        # both zeros of the derivative c1 + 2 c2 t + 3 c3 t^2, without cancellation
        q = -c[2] - np.copysign(np.sqrt(c[2] ** 2 - 3 * c[1] * c[3]), c[2])
        t = np.stack([q / (3 * c[3]), c[1] / q])
        deviation = np.maximum(change, np.abs(step.deviation.real))
        error = 1.6 * (t * (1 - t)) ** 2 * deviation
        is_near = np.abs(c[0] + t * (c[1] + t * (c[2] + t * c[3]))) <= error
    is_near &= roots & (t > 0) & (t < 1) & (error > step.rounding)
    return float(t[is_near][0]) if is_near.any() else None


def _crossings_of_one(step: Step, k: int, known: bool) -> Iterator[Guess]:
    """Where one root crosses the line: zeros of the cubic of its real part over the step.

    k: the index of the root before the step; known: whether it is certain on which side of the line
    the root is at both ends.
    """
    before = step.before
    after = step.after
    is_real = before.real[k] and after.real[step.order[k]]
    if before.problem is GYROSCOPIC or (before.problem is UNDAMPED and not is_real):
        return
    ends = np.array([values[k] for values in step.ends])
    path = ends.real.copy()
    if known:  # on the line at an end of the range: the slope tells where it comes from
        path[[0, 2]] = np.where(np.abs(path[[0, 2]]) <= step.rounding[k], 0.0, path[[0, 2]])
    length = after.value - before.value
    for t in zeros_between(hermite_cubic(*path)):
        root = complex(np.polyval(hermite_cubic(*ends)[::-1], t))
        right, left = step.vectors(t, [k])
        yield Guess(
            value=before.value + t * length,
            root=root,
            right=right,
            left=left,
            coalesces=False,
            width=length,
        )


def _events_of_pair(step: Step, pair: RootPair) -> Iterator[Guess]:
    """Where two roots that coalesce or separate in a step cross the line or meet on it.

    The roots are mean +- sqrt(square). Damped roots that lie off the line at both ends of the step
    cross it; where both lie on it at one end they meet on it, as undamped ones always do.
    """
    before = step.before
    after = step.after
    problem = before.problem
    length = after.value - before.value
    t = np.linspace(0.0, 1.0, 101)
    mean = np.polyval(pair.mean[::-1].astype(complex), t)
    square = np.polyval(pair.square[::-1].astype(complex), t)

    def guess(i: int, root: complex, columns: list[int], coalesces: bool) -> Guess:
        right, left = step.vectors(t[i], pair.indices)
        return Guess(
            value=before.value + t[i] * length,
            root=root,
            right=right[:, columns],
            left=left[:, columns],
            coalesces=coalesces,
            width=length,
        )

    both_on_before = before.on_line[pair.indices].all()
    both_on_after = after.on_line[step.order[pair.indices]].all()
    if problem is DAMPED and not (both_on_before and both_on_after):
        for i, root in _crossings(mean, square):
            yield guess(i, root, [0, 1], coalesces=False)
    if problem is not DAMPED or both_on_before or both_on_after:
        for i, root in _meetings(mean, square):
            yield guess(i, root, [0, 1], coalesces=True)
    if problem is UNDAMPED:
        product = (mean * mean - square).real  # of the two roots: one of them passes zero
        passes_zero = (product[1:] * product[:-1] < 0) & (square.real[1:] >= 0)
        for i in np.flatnonzero(passes_zero).tolist():
            for either in (0, 1):
                yield guess(i, 0j, [either], coalesces=False)


def _crossings(mean: ComplexArray, square: ComplexArray) -> Iterator[tuple[int, complex]]:
    """Where one root of a pair crosses the imaginary axis: the index before it, and the mean there.

    mean, square: mean and squared half difference of the two roots at successive values (k,).
    """
    half = np.sqrt(square)
    positive = np.sum(np.stack([mean - half, mean + half]).real > 0.0, axis=0)
    for n in np.flatnonzero(positive[1:] != positive[:-1]).tolist():
        yield n, complex(mean[n])


def _meetings(mean: ComplexArray, square: ComplexArray) -> Iterator[tuple[int, complex]]:
    """Where both roots of a pair meet on the line: the nearest index, and the mean there.

    mean, square: mean and squared half difference of the two roots at successive values (k,).
    """
    separate = square.real > 0.0
    for n in np.flatnonzero(separate[1:] != separate[:-1]).tolist():
        nearer = n + int(abs(square[n + 1]) < abs(square[n]))
        yield nearer, complex(mean[nearer])


class EventFunction(NamedTuple):
    """A real function f of the parameter that vanishes at an event, at one value of it.

    value: f; slope: f'; bend: f''/2; noise: how far rounding moves f.
    """

    value: float
    slope: float
    bend: float
    noise: float


class LocalRoots(NamedTuple):
    """One root, or two that are close, at a value of the parameter, by quantities that are smooth.

    These are the mean of the two and d, the square of half their difference; of one root itself and
    d = 0.

    Attributes
    ----------
    value : float
        The parameter.
    mean, mean_slope : complex
        The mean and its derivative by the parameter.
    mean_noise : float
        How far rounding moves the mean.
    d, d_slope : complex
        d and its derivative by the parameter.
    d_bend : complex
        Half of the second derivative of d, by the coupling of the two roots alone.
    noise : float
        How far rounding moves d.
    right, left : array (N, 1) or (N, 2)
        Orthonormal bases of the right and the left invariant subspace.
    """

    value: float
    mean: complex
    mean_slope: complex
    mean_noise: float
    d: complex
    d_slope: complex
    d_bend: complex
    noise: float
    right: NDArray
    left: NDArray

    @property
    def is_single(self) -> bool:
        """True of one root."""
        return self.right.shape[1] == 1

    def extrapolate(self, step: Array) -> tuple[NDArray, NDArray]:
        """Mean and d at values beyond this one by `step` (...)."""
        d = self.d + step * self.d_slope + step**2 * self.d_bend
        return self.mean + step * self.mean_slope, d

    def closest_approach(self, problem: ProblemClass) -> tuple[float, float]:
        """Where two roots come closest, as a distance from here, and half of how long they stay
        close; inf and 0 where they do not."""
        coefficients = np.array([self.d_bend, self.d_slope, self.d])
        zeros = np.roots(coefficients if problem is DAMPED else coefficients.real)
        if len(zeros) < 2:
            return np.inf, 0.0
        centre = float(zeros.real.mean())
        return centre, float(np.abs(zeros - centre).max())

    def at(self, continuation: Continuation, p: float) -> LocalRoots:
        """The same roots at p."""
        root = self.mean + (p - self.value) * self.mean_slope
        return roots_near(continuation, p, root, self.right, self.left)

    def event_function(self, coalesces: bool) -> EventFunction:
        """What vanishes at the event.

        Of one root its real part m. Of two roots m + i w +- sqrt(d): where they meet on the line d,
        and where one of them crosses it, so that (Re sqrt(d))^2 = m^2, the function
        m^2 Re d + (Im d)^2 / 4 - m^4, by Re(sqrt(d))^2 Im(sqrt(d))^2 = (Im d)^2 / 4.
        """
        m = self.mean.real
        dm = self.mean_slope.real
        d = self.d
        dd = self.d_slope
        if self.is_single:
            return EventFunction(m, dm, 0.0, self.mean_noise)
        if coalesces:
            return EventFunction(d.real, dd.real, self.d_bend.real, self.noise)
        value = m**2 * d.real + d.imag**2 / 4 - m**4
        slope = 2 * m * dm * d.real + m**2 * dd.real + d.imag * dd.imag / 2 - 4 * m**3 * dm
        noise = abs(2 * m * d.real - 4 * m**3) * self.mean_noise
        return EventFunction(value, slope, 0.0, noise + (m**2 + abs(d.imag) / 2) * self.noise)


def roots_near(
    continuation: Continuation,
    p: float,
    near: complex,
    right: NDArray,
    left: NDArray,
    perturbed: StandardProblem | None = None,
) -> LocalRoots:
    """The root, or the two roots, of A(p) next to a given number, with slopes and errors.

    On the invariant subspaces X and Y the matrix is the block (Y^H X)^-1 Y^H A X of one or two
    rows, of which mean and squared half difference are traces.

    Parameters
    ----------
    continuation : Continuation
        The system along its parameter.
    p : float
        The parameter.
    near : complex
        An approximate root, or the mean of two.
    right, left : array (N, 1) or (N, 2)
        Approximate right and left eigenvectors of the one or the two.
    perturbed : StandardProblem, optional
        The problem at p with derivatives by something else than the parameter.
    """
    A, derivative, sizes = perturbed or continuation.matrix_and_derivative(p)
    size = norm_of(A) or 1.0
    nudge = 1e-7 * max(abs(near), 1e-4 * size)
    shift = near + nudge
    if continuation.problem is UNDAMPED and abs(near.imag) <= nudge:
        shift = shift.real
        # two conjugate columns have one real part
        right = np.asarray(right.real + right.imag)
        left = np.asarray(left.real + left.imag)
    shifted = A - shift * np.eye(len(A))
    # not by the inverse: next to a coalescence its rounding hides the second vector
    solve = partial(np.linalg.solve, shifted)
    solve_adjoint = partial(np.linalg.solve, shifted.conj().T)
    if len(A) > continuation.options.small:
        from scipy.linalg import lu_factor, lu_solve

        factor = lu_factor(shifted, check_finite=False)
        solve = partial(lu_solve, factor)
        solve_adjoint = partial(lu_solve, factor, trans=2)
    rounds = continuation.options.rounds
    X = _invariant_subspace(A, size, right, solve, rounds)
    Y = _invariant_subspace(A.conj().T, size, left, solve_adjoint, rounds)
    inverse = np.linalg.inv(Y.conj().T @ X) @ Y.conj().T
    block = inverse @ (A @ X)
    block_slope = inverse @ (derivative @ X)
    # what the subspaces miss, to second order
    correction = solve(A @ X - X @ block)
    missed = np.abs(inverse @ (A @ (correction - X @ (inverse @ correction))))
    # independent roundings in the entries of A
    entries = np.sqrt(np.abs(inverse) ** 2 @ (sizes**2 @ np.abs(X) ** 2))
    error = continuation.options.sure * (EPS * entries + missed)
    count = len(block)
    mean = np.trace(block) / count
    mean_slope = np.trace(block_slope) / count
    deviator = block - mean * np.eye(count)  # its square is d times the identity
    deviator_slope = block_slope - mean_slope * np.eye(count)
    return LocalRoots(
        value=p,
        mean=complex(mean),
        mean_slope=complex(mean_slope),
        mean_noise=float(error.trace() / count),
        d=complex(np.trace(deviator @ deviator) / 2),
        d_slope=complex(np.trace(2 * deviator @ deviator_slope) / 2),
        d_bend=complex(np.trace(deviator_slope @ deviator_slope) / 2),
        noise=float(np.linalg.norm(np.abs(deviator.T) * error) + np.linalg.norm(error) ** 2),
        right=X,
        left=Y,
    )


def _invariant_subspace(
    A: NDArray, size: float, start: NDArray, solve: Callable[[NDArray], NDArray], rounds: int
) -> NDArray:
    """An orthonormal basis (N, 1) or (N, 2) of the invariant subspace of A next to `start`.

    One step of inverse iteration, then corrections by the residual: further steps of inverse
    iteration would make both columns one vector next to a coalescence.

    Parameters
    ----------
    A : array (N, N)
        The matrix.
    size : float
        A norm of it.
    start : array (N, 1) or (N, 2)
        Columns near the subspace.
    solve : function
        x of (A - s) x = b, for a fixed s next to the roots.
    rounds : int
        Half of the steps at most.
    """
    X = np.linalg.qr(solve(np.linalg.qr(start)[0]))[0]
    before = np.inf
    for _ in range(2 * rounds):
        image = A @ X
        block = X.conj().T @ image
        residual = image - X @ block
        remaining = float(np.linalg.norm(residual))
        if remaining <= 64 * EPS * size or remaining > 0.9 * before:
            break
        correction = solve(residual)
        X = np.linalg.qr(X - correction + X @ (X.conj().T @ correction))[0]
        before = remaining
    return X


def located(continuation: Continuation, guess: Guess, crosses: bool = True) -> Event | None:
    """The event next to a guess, None if there is none that is known to within its width.

    `crosses` is False where two divergent roots may join, too, which crosses no line.
    """
    with suppress(np.linalg.LinAlgError, ValueError):
        return _located(continuation, guess, crosses)
    return None


class _Zero(NamedTuple):
    """Where Newton's method ends.

    p: the parameter; roots, function: at the last value before it; move: how far p is from there.
    """

    p: float
    move: float
    roots: LocalRoots
    function: EventFunction


def _newton(continuation: Continuation, guess: Guess) -> _Zero | None:
    """The zero of the event function next to a guess; None if it leaves the width of the guess."""
    low = continuation.low
    high = continuation.high
    start = p = min(max(guess.value, low), high)
    roots = roots_near(continuation, p, guess.root, guess.right, guess.left)
    for _ in range(continuation.options.rounds):
        function = roots.event_function(guess.coalesces)
        slope = function.slope
        if not slope or not np.isfinite(slope):
            return None
        move = -function.value / slope
        p = float(np.clip(p + move, low, high))
        if abs(p - start) > 1.5 * guess.width:
            return None
        if abs(move) <= max(4 * EPS * abs(p), function.noise / abs(slope) / 4):
            return _Zero(p, move, roots, function)
        roots = roots.at(continuation, p)
    return None


def _located(continuation: Continuation, guess: Guess, crosses: bool) -> Event | None:
    """As `located`; raises LinAlgError or ValueError where a matrix is singular."""
    zero = _newton(continuation, guess)
    if zero is None:
        return None
    p = zero.p
    roots = zero.roots
    function = zero.function
    coalesces = guess.coalesces
    slope = abs(function.slope)
    half_width = 2 * function.noise / slope + abs(zero.move) + 2 * EPS * abs(p)
    # rounding hides whether d vanishes twice, or not at all
    hidden = coalesces and slope**2 <= 16 * abs(function.bend) * function.noise
    if half_width > guess.width or hidden:
        return None
    root = _root_at_event(continuation, guess, zero, crosses)
    if root is None:
        return None
    direction = root.direction
    first = p - half_width
    last = p + half_width
    if half_width > 1e-9 * guess.width:  # the slope may change within

        def sign(x: float) -> int:
            nonlocal roots
            roots = roots.at(continuation, x)
            there = roots.event_function(coalesces)
            return int(np.sign(there.value)) if abs(there.value) > there.noise else 0

        bracket = bracket_by_sign(sign, (p, p), half_width, continuation.low, continuation.high)
        if bracket is None:
            return None
        first, last, rise = bracket
        if rise and (coalesces or roots.is_single):
            direction = rise if continuation.problem is DAMPED else -rise
    if last - first > guess.width:
        return None
    # rounding in the equilibrium of a pad moves entries together, which their sizes do not show
    slopes = 0.0
    for perturbed in continuation.perturbed_by_rounding(p):
        local = roots_near(continuation, p, roots.mean, roots.right, roots.left, perturbed)
        slopes += abs(local.event_function(coalesces).slope)
    margin = 2 * EPS * slopes / slope
    interval = max(first - margin, continuation.low), last + margin
    return Event(p, root.omega, direction, interval, root.residual, coalesces)


class _RootAtEvent(NamedTuple):
    """Angular frequency (rad/s), direction and residual of what crosses or meets."""

    omega: float
    direction: int
    residual: float


class _Extrapolated(NamedTuple):
    """A root at an event.

    root: its value z there; computed: that at the last computed parameter before; slope: of its
    real part, or of d where two meet; is_real: whether lambda is real.
    """

    root: complex
    computed: complex
    slope: float
    is_real: bool


def _root_at_event(
    continuation: Continuation, guess: Guess, zero: _Zero, crosses: bool
) -> _RootAtEvent | None:
    """The root at the zero of an event function; None if it does not cross the line there."""
    roots = zero.roots
    problem = continuation.problem
    A, derivative, _ = continuation.matrix_and_derivative(roots.value)
    if guess.coalesces:
        end = _met(problem, zero, crosses)
    elif guess.right.shape[1] == 1:
        bound = norm_of(A) + norm_of(derivative) * guess.width
        end = _alone(problem, zero, bound)
    else:
        end = _one_of_two(zero)
    if end is None:
        return None
    is_complex = problem is DAMPED and np.iscomplexobj(A)
    if is_complex and not end.is_real and end.root.imag < 0.0:
        return None
    omega = 0.0
    if not end.is_real:
        exponent = exponents(np.array(end.root), problem, continuation.frequency_scale or 1.0)
        omega = abs(exponent.item().imag)
    singular = np.linalg.svd(A @ roots.right - end.computed * roots.right, compute_uv=False)
    # off the axis d > 0 if damped
    direction = 1 if (end.slope > 0) == (problem is DAMPED) else -1
    return _RootAtEvent(omega, direction, float(singular[-1]) / (norm_of(A) or 1.0))


def _met(problem: ProblemClass, zero: _Zero, crosses: bool) -> _Extrapolated | None:
    """Two that coalesce; None if they do not do so on the line."""
    roots = zero.roots
    z = roots.mean + zero.move * roots.mean_slope
    is_zero = abs(z) <= 2 * math.sqrt(abs(roots.noise)) + roots.mean_noise
    if crosses and problem is UNDAMPED and z.real < 0:
        return None
    if problem is GYROSCOPIC and abs(z.imag) > abs(z.real) and not is_zero:
        return None
    return _Extrapolated(z, roots.mean, zero.function.slope, is_zero and problem is not UNDAMPED)


def _alone(problem: ProblemClass, zero: _Zero, bound: float) -> _Extrapolated | None:
    """A single root; None next to a coalescence, where the slope is without bound: no zero."""
    roots = zero.roots
    if abs(zero.move * zero.function.slope) > 1e-8 * bound:
        return None
    z = roots.mean + zero.move * roots.mean_slope
    is_real = problem is not DAMPED or abs(z.imag) <= 4 * roots.mean_noise
    return _Extrapolated(z, roots.mean, zero.function.slope, is_real)


def _one_of_two(zero: _Zero) -> _Extrapolated:
    """The one of a pair that is nearer to the axis."""
    roots = zero.roots
    move = zero.move
    mean = roots.mean + move * roots.mean_slope
    d = roots.d + move * roots.d_slope + move**2 * roots.d_bend
    root_of_d = np.sqrt(d)
    if not abs((mean + root_of_d).real) < abs((mean - root_of_d).real):
        root_of_d = -root_of_d
    half_difference = complex(root_of_d) or 1e-300
    half_slope = (roots.d_slope + 2 * move * roots.d_bend) / (2 * half_difference)
    root = mean + half_difference
    noise = roots.mean_noise + abs(roots.noise / (2 * half_difference))
    noise = max(noise, 1e-9 * (abs(mean) + abs(half_difference)))
    return _Extrapolated(
        root=root,
        computed=roots.mean + half_difference,
        slope=(roots.mean_slope + half_slope).real,
        is_real=abs(root.imag) <= noise,
    )


def bracket_by_sign(
    sign: Callable[[float], int], at: tuple[float, float], half: float, low: float, high: float
) -> tuple[float, float, int] | None:
    """The nearest values around a zero at which the sign of a function is certain.

    Of a function that is flat these hold the zero where noise / slope does not.

    Parameters
    ----------
    sign : function
        1 or -1 where the sign is certain at a value, else 0.
    at : (float, float)
        Where the zero is taken to be.
    half : float
        The distance from there that is tried first, then multiples by powers of two.
    low, high : float
        Limits, of which one is taken as it is if no nearer value is certain.

    Returns
    -------
    (float, float, int) or None
        The values below and above, and 1 if the function rises between them, -1 if it falls, 0 if
        neither is certain; None if the sign is the same on both sides.
    """
    smallest = 2 * float(np.spacing(max(abs(low), abs(high))))
    below, sign_below = _certain_sign(sign, at[0], -1, at[0] - low, half, smallest)
    above, sign_above = _certain_sign(sign, at[1], 1, high - at[1], half, smallest)
    if sign_below * sign_above > 0:
        return None
    return (
        below if sign_below else low,
        above if sign_above else high,
        sign_above or -sign_below,
    )


def _certain_sign(
    sign: Callable[[float], int],
    start: float,
    direction: int,
    room: float,
    half: float,
    smallest: float,
) -> tuple[float, int]:
    """The value nearest to `start` at which a sign is certain, and the sign; 0 if there is none.

    Tried are distances from `smallest` to `room`, upwards (`direction` 1) or downwards (-1): `half`
    first, then its halves while they are certain, or its doubles until one is.
    """
    step = max(min(half, room / 2), smallest)
    found = sign(start + direction * step) if step < room else 0
    while found and step > smallest and sign(start + direction * step / 2) == found:
        step /= 2
    while not found and step < room:
        step *= 2
        found = sign(start + direction * step) if step < room else 0
    return float(start + direction * step), found


def window_guesses(continuation: Continuation, met: Guess, width: float) -> Iterator[Guess]:
    """Where two roots that may meet within a step cross the line, around their closest approach.

    A window of growth that opens and closes within a step has two such places.

    Parameters
    ----------
    continuation : Continuation
        The system along its parameter.
    met : Guess
        Where the two are predicted to meet.
    width : float
        Length of the step.
    """
    problem = continuation.problem
    pair = roots_near(continuation, met.value, met.root, met.right, met.left)
    for _ in range(3):  # go to the closest approach itself
        centre, half = pair.closest_approach(problem)
        if abs(centre) <= 4 * half or half >= width / 8:
            break
        if not abs(centre) <= width:
            return
        p = float(np.clip(pair.value + centre, continuation.low, continuation.high))
        pair = pair.at(continuation, p)
    centre, half = pair.closest_approach(problem)
    if half == 0.0 or not np.isfinite(centre):
        return
    if problem is DAMPED:
        offsets = centre + np.linspace(-8.0, 8.0, 404) * half
        offsets = offsets[np.abs(offsets) < width]
        offsets = np.unique(np.concatenate([offsets, np.linspace(-width, width, 101)]))
        places = list(_crossings(*pair.extrapolate(offsets)))
    else:
        bend = pair.d_bend.real
        slope = pair.d_slope.real
        if slope**2 - 4 * bend * pair.d.real <= 16 * abs(bend) * pair.noise:
            return  # beyond rounding d has the other sign between its zeros
        offsets = np.array([centre - half, centre + half])
        places = []
        for n in (0, 1):
            if abs(offsets[n]) <= width:
                places.append((n, complex(pair.extrapolate(offsets[n])[0])))
    for n, root in places:
        yield Guess(
            value=pair.value + offsets[n],
            root=root,
            right=pair.right,
            left=pair.left,
            coalesces=problem is not DAMPED,
            width=min(4 * half, width),
        )
