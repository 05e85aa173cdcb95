"""Where eigenvalues cross the line between growth and decay: guesses along a step, made exact.

One root passes at a zero of its real part, with the derivative from left and right vectors. Two
that come close are looked at in the 2 x 2 problem of their invariant subspace. Its mean and the
squared half difference d = ((z1 - z2) / 2)^2 stay smooth where the two coalesce, and are well
conditioned there although neither root is. On the line they meet where d vanishes; with m the real
part of the mean one of them passes it where m^2 Re d + (Im d)^2 / 4 - m^4 does: the product of
their real parts times what does not vanish.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.linear.continuation import (
    ComplexArray,
    Continuation,
    Guess,
    Meeting,
    State,
    Step,
    hermite_cubic,
    zeros_between,
)
from squeal.linear.crossing import Crossing
from squeal.linear.matrices import EPS, Array, norm_of

ASIDE = 0.4837  # of a step: where it is divided
FINE = 101  # points at which a pair's roots are looked at
ROUNDS = 25  # of Newton's method, and of inverse iteration
SMALL = 40  # rows up to which loading SciPy costs more than it saves
NUDGE = 1e-7  # of a shift, so that the matrix is regular


@dataclass(frozen=True)
class Event:
    """A crossing of the line: value of the parameter, rad/s, direction, interval, residual."""

    value: float
    omega: float
    direction: int  # +1: growth begins with rising value
    interval: tuple[float, float]
    residual: float
    coalesces: bool
    converged: bool = True

    @property
    def kind(self) -> str:
        """flutter for a pair, divergence for a real root."""
        return "flutter" if self.omega else "divergence"

    @property
    def width(self) -> float:
        """Of the interval."""
        return self.interval[1] - self.interval[0]

    def crossing(self, mode: int, changes: bool, residual: float | None) -> Crossing:
        """The same for callers: number of the mode, whether the verdict changes, error."""
        way, hertz = "up" if self.direction > 0 else "down", self.omega / (2 * math.pi)
        ends = (float(self.interval[0]), float(self.interval[1]))
        value = float(self.value)
        return Crossing(value, self.kind, way, hertz, ends, mode, changes, residual)


# Guesses


def guesses_of(step: Step, form: str, ends: tuple[bool, bool]) -> tuple[list[Guess], float | None]:
    """Where roots may cross the line within a step, and the share of the step at which it has to be
    divided first, None if all roots are matched well enough to tell.

    `ends`: whether the step begins and ends at an end of the range.
    """
    za, da, zb, db = step.ends
    on_a, on_b = step.a.on_line, step.b.on_line[step.order]
    # what lies on the line at one end alone has met another one, unless the range ends there
    known = step.matched & ((on_a == on_b) | (ends[0] & on_a) | (ends[1] & on_b))
    low, high = step.extremes
    unsure = 2 * np.abs(step.off.real)
    real = step.a.real & step.b.real[step.order]
    if form == "damped":
        unsure = unsure + step.rounding
        clear = (high + unsure < 0.0) | (low - unsure > 0.0)
        passes = np.zeros(len(za), dtype=bool)
    else:  # pairs off the line stay such; real roots of s = -lambda^2 may pass zero
        still = (np.abs(za) <= step.rounding) & (np.abs(zb) <= step.rounding)
        passes = real & (low - unsure <= 0.0) & (high + unsure >= 0.0) & ~still
        passes &= form == "undamped"
        apart = np.minimum(np.abs(za.imag), np.abs(zb.imag))
        clear = (apart > 2 * np.abs(step.off.imag) + 4 * step.rounding) | (real & ~passes)
    settled = known & (clear | (on_a & on_b & ~passes))
    reach = high - low
    surely = np.abs(step.off.real) <= step.doubt * np.maximum(np.abs((zb - za).real), reach)
    single = known & ~settled & surely
    guesses: list[Guess] = []
    for k in np.flatnonzero(single).tolist():
        guesses += _singles(step, k, form, True)
    far = np.zeros(len(za), dtype=bool)
    if form == "damped":  # whichever of them is which, they stay on their side
        way = np.abs(step.off) + np.abs(zb - za)
        way = np.maximum(way, np.minimum(np.abs(da), np.abs(db)))
        far = np.sign(za.real) == np.sign(zb.real)
        far &= np.minimum(np.abs(za.real), np.abs(zb.real)) > 2 * way
    left = np.flatnonzero(~settled & ~single & ~far).tolist()
    taken: set[int] = set()
    for k, other in _partners(step, left):
        if not taken & {k, other} and (cubics := step.pair(k, other)) is not None:
            guesses += _of_pair(step, k, other, *cubics, form)
            taken |= {k, other}
    doubtful = [k for k in left if k not in taken]
    for k in doubtful:  # the best there is if no step can be halved any more
        guesses += _singles(step, k, form, False)
    touches = known if form == "damped" else known & real
    return guesses, ASIDE if doubtful else _touch(step, touches, reach)


def _touch(step: Step, some: NDArray[np.bool_], reach: Array) -> float | None:
    """Where a root turns back so close to the line that its cubic does not tell if it passes.

    The cubic's error is t^2 (1 - t)^2 times a constant: none is left next to where it turns.
    """
    c = step.cubic
    with np.errstate(all="ignore"):  # where c' = 0
        q = -c[2] - np.copysign(np.sqrt(c[2] ** 2 - 3 * c[1] * c[3]), c[2])
        t = np.stack([q / (3 * c[3]), c[1] / q])
        off = 1.6 * (t * (1 - t)) ** 2 * np.maximum(reach, np.abs(step.off.real))
        part = np.abs(c[0] + t * (c[1] + t * (c[2] + t * c[3]))) / off
    near = some & (t > 0) & (t < 1) & (part <= 1) & (off > step.rounding)
    return float(t[near][np.argmin(part[near])]) if near.any() else None


def _singles(step: Step, k: int, form: str, sure: bool) -> Iterator[Guess]:
    z = np.array([x[k] for x in step.ends])
    real = step.a.real[k] and step.b.real[step.order[k]]
    if form == "gyroscopic" or (form == "undamped" and not real):
        return
    cubic = hermite_cubic(*z.real)
    if sure:  # on the line at an end of the range: what is beside it follows from the slope
        ends = np.where(np.abs(z.real) <= step.rounding[k], 0.0, z.real)
        cubic = hermite_cubic(ends[0], z[1].real, ends[2], z[3].real)
    h = step.b.value - step.a.value
    for t in zeros_between(cubic):
        right, left = step.vectors(t, [k])
        root = complex(np.polyval(hermite_cubic(*z)[::-1], t))
        yield Guess(step.a.value + t * h, root, right[:, 0], left[:, 0], False, h)


def _partners(step: Step, left: list[int]) -> list[tuple[int, int]]:
    """Pairs among roots in doubt, the closest first."""
    za, _, zb, _ = step.ends
    pairs = [(k, other) for n, k in enumerate(left) for other in left[n + 1 :]]
    return sorted(pairs, key=lambda p: min(abs(za[p[0]] - za[p[1]]), abs(zb[p[0]] - zb[p[1]])))


def _of_pair(
    step: Step, k: int, other: int, means: Array, squares: Array, form: str
) -> Iterator[Guess]:
    """What two roots do that coalesce or part in the step."""
    h, t = step.b.value - step.a.value, np.linspace(0.0, 1.0, FINE)
    m, d = (np.polyval(c[::-1].astype(complex), t) for c in (means, squares))

    def guess(place: float, root: complex, coalesces: bool) -> Guess:
        right, left = step.vectors(place, [k, other])
        return Guess(step.a.value + place * h, complex(root), right, left, coalesces, h)

    on = (step.a.on_line[[k, other]].all(), step.b.on_line[step.order[[k, other]]].all())
    if form != "damped" or any(on):
        for n in np.flatnonzero(d.real[1:] * d.real[:-1] < 0):
            place = t[n] + (t[n + 1] - t[n]) * abs(d[n]) / (abs(d[n]) + abs(d[n + 1]))
            yield guess(float(place), m[n], True)
    if form == "damped" and not all(on):
        half = np.sqrt(d)
        turned = np.where((half[1:] * half[:-1].conj()).real < 0, -1, 1)
        half[1:] *= np.cumprod(turned)  # a branch that does not jump
        for z in (m + half, m - half):
            for n in np.flatnonzero(z.real[1:] * z.real[:-1] < 0):
                yield guess(float(t[n]), m[n], False)
    elif form == "undamped":
        product = (m * m - d).real  # of the two roots: one of them passes zero
        for n in np.flatnonzero((product[1:] * product[:-1] < 0) & (d.real[1:] >= 0)):
            both = guess(float(t[n]), 0j, False)
            for i in (0, 1):  # either may be the one
                yield replace(both, right=both.right[:, i], left=both.left[:, i])


# Roots and pairs next to a guess


class Smooth(NamedTuple):
    """A function that vanishes at an event: value, slope, half its second derivative, rounding."""

    value: float
    slope: float
    bend: float
    noise: float


@dataclass(frozen=True)
class Pair:
    """Mean and d = ((z1 - z2) / 2)^2 at a value of the parameter, their slopes, and half of d''.

    The second derivative holds where the pair is close, which is where it is used; `noise` is the
    error of d, `mean_noise` of the mean, by rounding and by what the subspaces are off.
    """

    value: float
    mean: complex
    mean_slope: complex
    d: complex
    d_slope: complex
    d_bend: complex
    noise: float
    mean_noise: float
    right: NDArray = field(repr=False)
    left: NDArray = field(repr=False)

    def roots(self, step: NDArray) -> NDArray:
        """Both roots, (..., 2), at values beyond this one by `step`."""
        d = self.d + step * self.d_slope + step**2 * self.d_bend
        mean, half = self.mean + step * self.mean_slope, np.sqrt(np.asarray(d) + 0j)
        return np.stack([mean - half, mean + half], axis=-1)

    def approach(self, form: str) -> tuple[float, float]:
        """How far away two roots come closest, and half of how long they stay there."""
        c = np.array([self.d_bend, self.d_slope, self.d])
        ends = np.roots(c if form == "damped" else c.real)
        if len(ends) < 2:
            return np.inf, 0.0
        centre = float(ends.real.mean())
        return centre, float(np.abs(ends - centre).max())


Solve = Callable[[NDArray], NDArray]


def _solvers(A: NDArray, shift: complex) -> tuple[Solve, Solve]:
    """X -> (A - shift)^-1 X and Y -> (A - shift)^-H Y. The explicit inverse would not do: next to a
    coalescence its rounding hides the second vector."""
    P = A - shift * np.eye(len(A))
    if len(A) <= SMALL:
        return partial(np.linalg.solve, P), partial(np.linalg.solve, P.conj().T)
    from scipy.linalg import lu_factor, lu_solve

    factor = lu_factor(P, check_finite=False)
    return partial(lu_solve, factor), partial(lu_solve, factor, trans=2)


def pair_at(along: Continuation, p: float, near: complex, right: NDArray, left: NDArray) -> Pair:
    """The pair of roots next to `near` at p; right, left (N, 2) are vectors that it begins from."""
    A, derivative, sizes = along.both(p)
    size = norm_of(A)
    shift = near + NUDGE * max(abs(near), 1e-4 * size) * (1 + 1j)
    if along.form == "undamped" and abs(near.imag) <= NUDGE * max(abs(near), 1e-4 * size):
        shift = shift.real
        # two conjugate columns have one real part
        right, left = np.asarray(right.real + right.imag), np.asarray(left.real + left.imag)
    solve, transposed = _solvers(A, shift)
    X = _subspace(A, size, right, solve)
    Y = _subspace(A.conj().T, size, left, transposed)
    inverse = np.linalg.inv(Y.conj().T @ X) @ Y.conj().T
    small, slope = inverse @ (A @ X), inverse @ (derivative @ X)
    mean, mean_slope = np.trace(small) / 2, np.trace(slope) / 2
    N, S = small - mean * np.eye(2), slope - mean_slope * np.eye(2)
    # independent roundings in the entries of A, and what the subspaces miss, to second order
    entries = np.sqrt(np.abs(inverse) ** 2 @ (sizes**2 @ np.abs(X) ** 2))
    beside = solve(A @ X - X @ small)
    missed = np.abs(inverse @ (A @ (beside - X @ (inverse @ beside))))
    error = along.options.sure * (EPS * entries + missed)
    return Pair(
        p,
        complex(mean),
        complex(mean_slope),
        complex(-np.linalg.det(N)),
        complex(np.trace(N @ S)),
        complex(np.trace(S @ S) / 2),
        float(np.linalg.norm(np.abs(N.T) * error) + np.linalg.norm(error) ** 2),
        float(error.trace() / 2),
        X,
        Y,
    )


def _subspace(A: NDArray, size: float, start: NDArray, solve: Solve) -> NDArray:
    """The invariant subspace (N, 2) that inverse iteration turns `start` to.

    Next to a coalescence both columns become one vector but for half the digits; what these leave
    is lessened by Newton's steps.
    """
    X, before, step = np.linalg.qr(solve(np.linalg.qr(start)[0]))[0], np.inf, False
    for _ in range(2 * ROUNDS):
        image = A @ X
        rest = image - X @ (X.conj().T @ image)
        left = float(np.linalg.norm(rest))
        if left <= 64 * EPS * size or (step and left > 0.9 * before):
            break
        step = step or left > 0.9 * before
        if step:
            beside = solve(rest)
            X = np.linalg.qr(X - beside + X @ (X.conj().T @ beside))[0]
        else:
            X = np.linalg.qr(solve(X))[0]
        before = left
    return X


class Root(NamedTuple):
    """One root with unit vectors, its slope, and how far rounding moves it."""

    z: complex
    slope: complex
    noise: float
    right: ComplexArray
    left: ComplexArray


def root_at(
    along: Continuation, p: float, near: complex, right: ComplexArray, left: ComplexArray
) -> Root:
    """The root at p next to `near`, by inverse iteration and Rayleigh quotients."""
    A, derivative, sizes = along.both(p)
    size: float = norm_of(A) or 1.0
    x, y, z = right, left, near
    for _ in range(3):
        solve, transposed = _solvers(A, z + 1e-14 * size * (1 + 1j))
        x, y = solve(x), transposed(y)
        x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
        across = y.conj() @ x
        if abs(across) < 1e-13:
            break
        moved = complex(y.conj() @ (A @ x) / across)
        z, way = moved, abs(moved - z)
        if way <= 4 * EPS * size:
            break
    across = y.conj() @ x
    entries = float(np.sqrt(np.abs(y) ** 2 @ (sizes**2 @ np.abs(x) ** 2)))
    noise = along.options.sure * EPS * entries / (float(abs(across)) or 1e-300)
    slope = complex(y.conj() @ (derivative @ x) / across) if across else 0j
    return Root(z, slope, float(noise), x, y)


# From a guess to an event


class _Search:
    """The function that vanishes at the event of a guess, with the vectors of the last value."""

    def __init__(self, along: Continuation, guess: Guess) -> None:
        self.along, self.guess = along, guess
        self.right, self.left, self.near = guess.right, guess.left, guess.root
        self.at, self.slope = guess.value, 0j
        self.pair: Pair | None = None
        self.root: Root | None = None

    def __call__(self, p: float) -> Smooth:
        near = self.near + (p - self.at) * self.slope
        if self.guess.right.ndim == 1:
            root = root_at(self.along, p, near, self.right, self.left)
            self.root, self.right, self.left = root, root.right, root.left
            self.at, self.near, self.slope = p, root.z, root.slope
            return Smooth(root.z.real, root.slope.real, 0.0, root.noise)
        pair = pair_at(self.along, p, near, self.right, self.left)
        self.pair, self.right, self.left = pair, pair.right, pair.left
        self.at, self.near, self.slope = p, pair.mean, pair.mean_slope
        if self.guess.coalesces:
            return Smooth(pair.d.real, pair.d_slope.real, pair.d_bend.real, pair.noise)
        m, dm, d, dd = pair.mean.real, pair.mean_slope.real, pair.d, pair.d_slope
        value = m**2 * d.real + d.imag**2 / 4 - m**4
        slope = 2 * m * dm * d.real + m**2 * dd.real + d.imag * dd.imag / 2 - 4 * m**3 * dm
        noise = abs(2 * m * d.real - 4 * m**3) * pair.mean_noise
        noise += (m**2 + abs(d.imag) / 2) * pair.noise
        return Smooth(value, slope, 0.0, noise)


def located(along: Continuation, guess: Guess) -> Event | None:
    """The event next to a guess, None if there is none that is known to within its width.

    Parameters
    ----------
    along : Continuation
        The parametrised eigenproblem.
    guess : Guess
        One root that may cross the line (vectors (N,)), two that may meet on it, or two of which
        one may cross (vectors (N, 2)).
    """
    guess = replace(guess, value=min(max(guess.value, along.low), along.high))
    try:
        found = _located(along, guess)
        aside = 1e-5 * guess.width
        if found is not None and guess.coalesces and found.width > 2 * aside:
            # the subspaces are those of other roots: from beside they may be the right ones
            again = _located(along, replace(guess, value=found.value + aside))
            found = min(filter(None, (found, again)), key=lambda one: one.width)
    except (np.linalg.LinAlgError, ValueError):
        return None
    if found is None or found.width > guess.width:
        return None
    low, high = found.interval
    return replace(found, interval=(max(low, along.low), high))


def _located(along: Continuation, guess: Guess) -> Event | None:
    f, p = _Search(along, guess), guess.value
    for _ in range(ROUNDS):
        at = f(p)
        if not at.slope or not np.isfinite(at.slope):
            return None
        move = -at.value / at.slope
        inner = at.slope**2 - 4 * at.bend * at.value
        if inner >= 0.0:  # the nearer zero of the parabola
            move = -2 * at.value / (at.slope + math.copysign(math.sqrt(inner), at.slope))
        move = float(np.clip(move, -guess.width / 2, guess.width / 2))
        p = float(np.clip(p + move, along.low, along.high))
        if abs(p - guess.value) > 1.5 * guess.width:
            return None
        if abs(move) <= max(4 * EPS * abs(p), at.noise / abs(at.slope) / 4):
            break
    else:
        return None
    if guess.coalesces and at.slope**2 <= 16 * abs(at.bend) * at.noise:
        return None  # two roots that only cross
    half = 2 * at.noise / abs(at.slope) + abs(move) + 2 * EPS * abs(p)
    if guess.coalesces and half > guess.width:
        return None
    told = _of_root(f, move, at) if guess.right.ndim == 1 else _of_pair_at(f, move)
    if told is None:
        return None
    omega, direction, residual = told
    interval: tuple[float, float] | None = (p - half, p + half)
    if half > 1e-9 * guess.width:  # the slope may change within
        interval = certain(f, p, half, along.low, along.high)
    if interval is None:
        return None
    return Event(p, omega, direction, interval, residual, guess.coalesces)


def _of_root(f: _Search, move: float, at: Smooth) -> tuple[float, int, float] | None:
    along, root = f.along, f.root
    assert root is not None
    A, derivative, _ = along.both(f.at)
    if abs(move * at.slope) > 1e-8 * (norm_of(A) + norm_of(derivative) * f.guess.width):
        return None  # where two roots coalesce the slope is without bound, and this no zero
    z = root.z + move * root.slope
    real = along.form != "damped" or abs(z.imag) <= 4 * root.noise
    direction = 1 if (at.slope > 0) == (along.form == "damped") else -1
    rest = float(np.linalg.norm(A @ root.right - root.z * root.right) / (norm_of(A) or 1.0))
    return 0.0 if real else along.omega(z), direction, rest


def _of_pair_at(f: _Search, move: float) -> tuple[float, int, float] | None:
    along, pair = f.along, f.pair
    assert pair is not None
    A = along.both(f.at)[0]
    mean = pair.mean + move * pair.mean_slope
    least = np.linalg.svd(A - mean * np.eye(len(A)), compute_uv=False)
    residual = float(least[-1] / least[0])
    on_zero = abs(mean) <= 2 * math.sqrt(abs(pair.noise)) + pair.mean_noise
    if f.guess.coalesces:
        if along.form == "undamped" and mean.real < 0:
            return None  # two divergent roots join: nothing crosses
        if along.form == "gyroscopic" and abs(mean.imag) > abs(mean.real) and not on_zero:
            return None
        sign = 1.0 if along.form == "damped" else -1.0  # of d where the pair grows
        direction = int(np.sign(sign * pair.d_slope.real))
        zero = on_zero and along.form != "undamped"
        return 0.0 if zero else along.omega(mean), direction, residual
    roots = pair.roots(np.array(move))
    z = complex(roots[np.argmin(np.abs(roots.real))])
    half = (z - mean) or 1e-300
    slope = complex(pair.mean_slope + (pair.d_slope + 2 * move * pair.d_bend) / (2 * half))
    noise = abs(pair.noise / (2 * half)) + pair.mean_noise
    real = abs(z.imag) <= max(1e-9 * float(np.abs(roots).max()), noise)
    return 0.0 if real else along.omega(z), 1 if slope.real > 0 else -1, residual


def certain(
    f: Callable[[float], Smooth], p: float, half: float, low: float, high: float
) -> tuple[float, float] | None:
    """The nearest values below and above p at which the sign of f is certain, by factors of two
    from `half`; an end of [low, high] is taken as it is.

    None if the sign is the same on both sides. Where f is flat next to its zero these hold the
    zero, and rounding over slope does not.
    """
    least = 2 * float(np.spacing(max(abs(low), abs(high))))

    def sign(x: float) -> float:
        at = f(x)
        return math.copysign(1.0, at.value) if abs(at.value) > at.noise else 0.0

    ends, signs = [], []
    for way, last in ((-1, low), (1, high)):
        room = way * (last - p)
        step = max(min(half, room / 2), least)
        found = sign(p + way * step) if step < room else 0.0
        if found:
            while step > least and sign(p + way * step / 2) == found:
                step /= 2
        while not found and step < room:
            step *= 2
            found = sign(p + way * step) if step < room else 0.0
        ends.append(float(p + way * step if found else last))
        signs.append(found)
    return None if signs[0] * signs[1] > 0 else (ends[0], ends[1])


# Windows


def windows(along: Continuation, met: list[tuple[State, Meeting]], width: float) -> Iterator[Guess]:
    """Where two roots that are predicted to meet within a step cross the line.

    Parameters
    ----------
    along : Continuation
        The parametrised eigenproblem.
    met : list of (State, Meeting)
        What `near_coalescences` predicts for the step.
    width : float
        Of the step.
    """
    seen: list[tuple[float, complex]] = []
    for state, one in met:
        both, p = [one.first, one.second], state.value + one.step
        start = state.right[:, both], state.left[:, both]
        pair = _nearest(along, p, one.mean, *start, width)
        if pair is None:
            continue
        x, half = pair.approach(along.form)
        place, mean = pair.value + x, pair.mean + x * pair.mean_slope
        if not any(abs(place - q) <= half and abs(mean - z) <= 1e-6 * abs(z) for q, z in seen):
            seen.append((place, mean))
            yield from _window(pair, along.form, width)


def _nearest(
    along: Continuation, p: float, near: complex, right: NDArray, left: NDArray, width: float
) -> Pair | None:
    """The pair at its closest approach."""
    pair = None
    for _ in range(4):
        try:
            pair = pair_at(along, p, near, right, left)
        except np.linalg.LinAlgError:
            return None
        right, left = pair.right, pair.left
        centre, half = pair.approach(along.form)
        if abs(centre) <= 4 * half or half >= width / 8:
            break
        if not abs(centre) <= width:
            return None
        p = float(np.clip(p + centre, along.low, along.high))
        near = pair.mean + (p - pair.value) * pair.mean_slope
    return pair


def _window(pair: Pair, form: str, width: float) -> Iterator[Guess]:
    """Crossings of the line around the closest approach of a pair, if there are any."""
    right, left = pair.right, pair.left
    centre, half = pair.approach(form)
    if half == 0.0 or not np.isfinite(centre):
        return
    if form != "damped":
        bend, slope = pair.d_bend.real, pair.d_slope.real
        # beyond rounding d has the other sign there
        if slope**2 - 4 * bend * pair.d.real <= 16 * abs(bend) * pair.noise:
            return
        for x in (centre - half, centre + half):
            if abs(x) <= width:
                z = complex(pair.mean + x * pair.mean_slope)
                yield Guess(pair.value + x, z, right, left, True, min(4 * half, width))
        return
    steps = centre + np.linspace(-8.0, 8.0, 4 * FINE) * half
    steps = steps[np.abs(steps) < width]
    steps = np.unique(np.concatenate([steps, np.linspace(-width, width, FINE)]))
    both = pair.roots(steps)
    number = (both.real > 0.0).sum(axis=1)
    for n in np.flatnonzero(number[1:] != number[:-1]):
        low, high = float(steps[n]), float(steps[n + 1])
        for _ in range(60):  # where the pair's own model crosses
            middle = (low + high) / 2
            if (pair.roots(np.array(middle)).real > 0.0).sum() == number[n]:
                low = middle
            else:
                high = middle
        mean = complex(pair.mean + low * pair.mean_slope)
        yield Guess(pair.value + low, mean, right, left, False, min(4 * half, width))
