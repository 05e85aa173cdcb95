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
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.linear.continuation import (
    Continuation,
    Guess,
    Step,
    exponents,
    hermite_cubic,
    zeros_between,
)
from squeal.linear.matrices import EPS, Array, norm_of


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
    """A crossing of the line: value of the parameter, rad/s, direction, interval, residual."""

    value: float
    omega: float
    direction: int  # +1: growth begins with rising value
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
        way, hertz = "up" if self.direction > 0 else "down", self.omega / (2 * math.pi)
        ends = (float(self.interval[0]), float(self.interval[1]))
        value = float(self.value)
        return Crossing(value, self.kind, way, hertz, ends, mode, changes, self.residual)


# Guesses


def guesses_of(step: Step, ends: tuple[bool, bool]) -> tuple[list[Guess], float | None]:
    """Where roots may cross the line within a step, whose `ends` may be those of the range, and the
    share at which it has to be divided first, None if the matches are good enough to tell."""
    form, (za, _, zb, _) = step.a.form, step.ends
    on_a, on_b = step.a.on_line, step.b.on_line[step.order]
    low, high = step.least, step.most
    unsure = 2 * np.abs(step.off.real)
    real = step.a.real & step.b.real[step.order]
    passes = np.zeros(len(za), dtype=bool)
    if form == "damped":
        unsure = unsure + step.rounding
        clear = (high + unsure < 0.0) | (low - unsure > 0.0)
    else:  # pairs off the line stay such; real roots of s = -lambda^2 may pass zero
        if form == "undamped":
            still = (np.abs(za) <= step.rounding) & (np.abs(zb) <= step.rounding)
            passes = real & (low - unsure <= 0.0) & (high + unsure >= 0.0) & ~still
        apart = np.minimum(np.abs(za.imag), np.abs(zb.imag))
        clear = (apart > 2 * np.abs(step.off.imag)) | (real & ~passes)
    # what lies on the line at one end alone has met another one, unless the range ends there, or it
    # is a real root that passes zero, perhaps with a twin
    known = step.matched & ((on_a == on_b) | passes | (ends[0] & on_a) | (ends[1] & on_b))
    settled = known & (clear | (on_a & on_b & ~passes))
    reach = np.maximum(np.abs((zb - za).real), high - low)
    single = known & ~settled & (np.abs(step.off.real) <= step.options.doubt * reach)
    left = np.flatnonzero(~settled & ~single).tolist()
    guesses = [g for k in np.flatnonzero(single).tolist() for g in _singles(step, k, True)]
    pairs = [pair for pair in step.pairs(left) if form != "damped" or _tells(step, *pair[1:])]
    guesses += [g for pair in pairs for g in _of_pair(step, *pair)]
    doubtful = set(left).difference(*(both for both, _, _ in pairs))
    for k in doubtful:  # the best there is if no step can be halved any more
        guesses += _singles(step, k, False)
    touches = known if form == "damped" else known & real
    return guesses, step.options.aside if doubtful else _touch(step, touches, high - low)


def _touch(step: Step, some: NDArray[np.bool_], reach: Array) -> float | None:
    """Where a root turns back so close to the line that its cubic does not tell if it passes."""
    c = step.cubic  # its error is t^2 (1 - t)^2 times a constant: none is left where it turns
    with np.errstate(all="ignore"):  # where c' = 0
        q = -c[2] - np.copysign(np.sqrt(c[2] ** 2 - 3 * c[1] * c[3]), c[2])
        t = np.stack([q / (3 * c[3]), c[1] / q])
        off = 1.6 * (t * (1 - t)) ** 2 * np.maximum(reach, np.abs(step.off.real))
        near = np.abs(c[0] + t * (c[1] + t * (c[2] + t * c[3]))) <= off
    near &= some & (t > 0) & (t < 1) & (off > step.rounding)
    return float(t[near][0]) if near.any() else None


def _tells(step: Step, means: Array, squares: Array) -> bool:
    """True if the cubics of a pair tell on which side of the axis both roots are."""
    t, off = np.linspace(0.0, 1.0, 17), abs(squares[3])  # twice what the slopes miss
    mean, half = (np.polyval(c[::-1].astype(complex), t) for c in (means, squares))
    half = np.sqrt(half)
    with np.errstate(divide="ignore", invalid="ignore"):
        slack = abs(means[3].real) + np.fmin(np.sqrt(off), off / np.abs(half))
    paths = ((mean + way * half).real for way in (1, -1))
    enough = 2 * step.options.doubt
    return all((abs(x) > slack).all() or slack.max() <= enough * np.ptp(x) for x in paths)


def _singles(step: Step, k: int, sure: bool) -> Iterator[Guess]:
    z = np.array([x[k] for x in step.ends])
    real = step.a.real[k] and step.b.real[step.order[k]]
    if step.a.form == "gyroscopic" or (step.a.form == "undamped" and not real):
        return
    path = z.real.copy()
    if sure:  # on the line at an end of the range: what is beside it follows from the slope
        path[[0, 2]] = np.where(np.abs(path[[0, 2]]) <= step.rounding[k], 0.0, path[[0, 2]])
    h = step.b.value - step.a.value
    for t in zeros_between(hermite_cubic(*path)):
        root = complex(np.polyval(hermite_cubic(*z)[::-1], t))
        yield Guess(step.a.value + t * h, root, *step.vectors(t, [k]), False, h)


def _of_pair(step: Step, both: list[int], means: Array, squares: Array) -> Iterator[Guess]:
    """What two roots do that coalesce or part in the step."""
    form, h, t = step.a.form, step.b.value - step.a.value, np.linspace(0.0, 1.0, 101)
    m, d = (np.polyval(c[::-1].astype(complex), t) for c in (means, squares))
    on = step.a.on_line[both].all(), step.b.on_line[step.order[both]].all()
    ways = [False] * (form == "damped" and not all(on)) + [True] * (form != "damped" or any(on))
    for i, z, coalesces in (place for meets in ways for place in _changes(m, d, meets)):
        vectors = step.vectors(t[i], both)
        yield Guess(step.a.value + t[i] * h, z, *vectors, coalesces, h)
    if form == "undamped":
        product = (m * m - d).real  # of the two roots: one of them passes zero
        for n in np.flatnonzero((product[1:] * product[:-1] < 0) & (d.real[1:] >= 0)):
            right, left = step.vectors(t[n], both)
            for one in ([0], [1]):  # either may be the one
                yield Guess(step.a.value + t[n] * h, 0j, right[:, one], left[:, one], False, h)


def _changes(m: NDArray, d: NDArray, meets: bool) -> Iterator[tuple[int, complex, bool]]:
    """Where one root of a pair with this mean and d crosses the axis, or both meet on the line."""
    half = np.sqrt(d)
    state = d.real > 0.0 if meets else np.sum(np.stack([m - half, m + half]).real > 0.0, axis=0)
    for n in np.flatnonzero(state[1:] != state[:-1]).tolist():
        nearer = n + int(meets and abs(d[n + 1]) < abs(d[n]))
        yield nearer, complex(m[nearer]), meets


# One root or two, next to a guess


class Near(NamedTuple):
    """One root (d = 0), or the mean of two and d = ((z1 - z2) / 2)^2, at a value of the parameter,
    with slopes, half of d'' where they are close, and errors by rounding and of the subspaces."""

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

    def ahead(self, step: Any) -> tuple[Any, Any]:
        """Mean and d at values beyond this one by `step`."""
        d = self.d + step * self.d_slope + step**2 * self.d_bend
        return self.mean + step * self.mean_slope, d

    def approach(self, form: str) -> tuple[float, float]:
        """How far away two roots come closest, and half of how long they stay there."""
        c = np.array([self.d_bend, self.d_slope, self.d])
        ends = np.roots(c if form == "damped" else c.real)
        if len(ends) < 2:
            return np.inf, 0.0
        centre = float(ends.real.mean())
        return centre, float(np.abs(ends - centre).max())

    def moved(self, along: Continuation, p: float) -> Near:
        """The same at p."""
        root = self.mean + (p - self.value) * self.mean_slope
        return roots_near(along, p, root, self.right, self.left)

    def vanishing(self, coalesces: bool) -> tuple[float, float, float, float]:
        """What vanishes at an event: its value, slope, half its second derivative, rounding."""
        m, dm, d, dd = self.mean.real, self.mean_slope.real, self.d, self.d_slope
        if self.right.shape[1] == 1:
            return m, dm, 0.0, self.mean_noise
        if coalesces:
            return d.real, dd.real, self.d_bend.real, self.noise
        value = m**2 * d.real + d.imag**2 / 4 - m**4
        slope = 2 * m * dm * d.real + m**2 * dd.real + d.imag * dd.imag / 2 - 4 * m**3 * dm
        noise = abs(2 * m * d.real - 4 * m**3) * self.mean_noise
        return value, slope, 0.0, noise + (m**2 + abs(d.imag) / 2) * self.noise


def roots_near(
    along: Continuation, p: float, near: complex, right: NDArray, left: NDArray, by: Any = None
) -> Near:
    """The root at p next to `near`, or two, from right and left vectors (N, 1) or (N, 2), with
    slopes by p or, if `by` replaces `along.both`, by something else."""
    A, derivative, sizes = by or along.both(p)
    size = norm_of(A) or 1.0
    nudge = 1e-7 * max(abs(near), 1e-4 * size)
    shift = near + nudge
    if along.form == "undamped" and abs(near.imag) <= nudge:
        shift = shift.real
        # two conjugate columns have one real part
        right, left = np.asarray(right.real + right.imag), np.asarray(left.real + left.imag)
    P = A - shift * np.eye(len(A))
    # not by the inverse: next to a coalescence its rounding hides the second vector
    solves = partial(np.linalg.solve, P), partial(np.linalg.solve, P.conj().T)
    if len(A) > along.options.small:
        from scipy.linalg import lu_factor, lu_solve

        factor = lu_factor(P, check_finite=False)
        solves = partial(lu_solve, factor), partial(lu_solve, factor, trans=2)
    X = _subspace(A, size, right, solves[0], along.options.rounds)
    Y = _subspace(A.conj().T, size, left, solves[1], along.options.rounds)
    inverse = np.linalg.inv(Y.conj().T @ X) @ Y.conj().T
    small, slope = inverse @ (A @ X), inverse @ (derivative @ X)
    # what the subspaces miss, to second order
    beside = solves[0](A @ X - X @ small)
    missed = np.abs(inverse @ (A @ (beside - X @ (inverse @ beside))))
    # independent roundings in the entries of A
    entries = np.sqrt(np.abs(inverse) ** 2 @ (sizes**2 @ np.abs(X) ** 2))
    error = along.options.sure * (EPS * entries + missed)
    m = len(small)
    mean, mean_slope = np.trace(small) / m, np.trace(slope) / m
    N, S = small - mean * np.eye(m), slope - mean_slope * np.eye(m)
    means = complex(mean), complex(mean_slope), float(error.trace() / m)
    d, d_slope, d_bend = (complex(np.trace(X) / 2) for X in (N @ N, 2 * N @ S, S @ S))
    noise = float(np.linalg.norm(np.abs(N.T) * error) + np.linalg.norm(error) ** 2)
    return Near(p, *means, d, d_slope, d_bend, noise, X, Y)


def _subspace(A: NDArray, size: float, start: NDArray, solve: Callable, rounds: int) -> NDArray:
    """The invariant subspace (N, 1) or (N, 2) next to `start`, by Newton's method."""
    # inverse iteration would make both columns one vector next to a coalescence
    X, before = np.linalg.qr(solve(np.linalg.qr(start)[0]))[0], np.inf
    for _ in range(2 * rounds):
        image = A @ X
        rest = image - X @ (X.conj().T @ image)
        left = float(np.linalg.norm(rest))
        if left <= 64 * EPS * size or left > 0.9 * before:
            break
        beside = solve(rest)
        X, before = np.linalg.qr(X - beside + X @ (X.conj().T @ beside))[0], left
    return X


# From a guess to an event


def located(along: Continuation, guess: Guess, crosses: bool = True) -> Event | None:
    """The event next to a guess, None if there is none that is known to within its width. Without
    `crosses` it may be where two divergent roots join, which crosses no line."""
    with suppress(np.linalg.LinAlgError, ValueError):
        return _located(along, guess, crosses)
    return None


def _located(along: Continuation, guess: Guess, crosses: bool) -> Event | None:
    p, coalesces = min(max(guess.value, along.low), along.high), guess.coalesces
    start, near = p, roots_near(along, p, guess.root, guess.right, guess.left)
    for _ in range(along.options.rounds):
        value, slope, bend, noise = near.vanishing(coalesces)
        if not slope or not np.isfinite(slope):
            return None
        move = -value / slope
        p = float(np.clip(p + move, along.low, along.high))
        if abs(p - start) > 1.5 * guess.width:
            return None
        if abs(move) <= max(4 * EPS * abs(p), noise / abs(slope) / 4):
            break
        near = near.moved(along, p)
    else:
        return None
    half = 2 * noise / abs(slope) + abs(move) + 2 * EPS * abs(p)
    if half > guess.width or (coalesces and slope**2 <= 16 * abs(bend) * noise):
        return None  # two roots that only cross, or rounding hides all
    if (known := _details(along, guess, near, move, slope, crosses)) is None:
        return None
    omega, direction, residual = known
    interval = p - half, p + half
    if half > 1e-9 * guess.width:  # the slope may change within

        def sign(x: float) -> int:
            nonlocal near
            near = near.moved(along, x)
            value, _, _, noise = near.vanishing(coalesces)
            return int(np.sign(value)) if abs(value) > noise else 0

        ends = certain(sign, (p, p), half, along.low, along.high)
        if ends is None:
            return None
        interval, rise = ends[:2], ends[2]
        if rise and (coalesces or guess.right.shape[1] == 1):
            direction = rise if along.form == "damped" else -rise
    if interval[1] - interval[0] > guess.width:
        return None
    # rounding of a pad's place moves entries together, which their sizes do not show
    each = (roots_near(along, p, near.mean, near.right, near.left, by) for by in along.shaken(p))
    off = 2 * EPS * sum(abs(one.vanishing(coalesces)[1]) for one in each) / abs(slope)
    interval = max(interval[0] - off, along.low), interval[1] + off
    return Event(p, omega, direction, interval, residual, coalesces)


def _details(
    along: Continuation, guess: Guess, near: Near, move: float, slope: float, crosses: bool
) -> tuple[float, int, float] | None:
    """Frequency, direction and residual of the event that a last step `move` leads to."""
    A, derivative, _ = along.both(near.value)
    damped, noise, rate = along.form == "damped", near.mean_noise, slope
    z, root = near.mean + move * near.mean_slope, near.mean
    if guess.coalesces:
        zero = abs(z) <= 2 * math.sqrt(abs(near.noise)) + noise
        if crosses and along.form == "undamped" and z.real < 0:
            return None
        if along.form == "gyroscopic" and abs(z.imag) > abs(z.real) and not zero:
            return None
        real = zero and along.form != "undamped"
    elif guess.right.shape[1] == 1:
        if abs(move * slope) > 1e-8 * (norm_of(A) + norm_of(derivative) * guess.width):
            return None  # where two roots coalesce the slope is without bound, and this no zero
        real = not damped or abs(z.imag) <= 4 * noise
    else:  # one of the pair
        d = np.sqrt(near.ahead(move)[1])
        half = complex(d if abs((z + d).real) < abs((z - d).real) else -d) or 1e-300
        rate = (near.mean_slope + (near.d_slope + 2 * move * near.d_bend) / (2 * half)).real
        noise = max(noise + abs(near.noise / (2 * half)), 1e-9 * (abs(z) + abs(half)))
        z, root = z + half, root + half
        real = abs(z.imag) <= noise
    least = np.linalg.svd(A @ near.right - root * near.right, compute_uv=False)[-1]
    direction = 1 if (rate > 0) == damped else -1  # off the axis d > 0 if damped
    omega = 0.0 if real else abs(exponents(np.array(z), along.form, along.rate).item().imag)
    return omega, direction, float(least) / (norm_of(A) or 1.0)


def certain(
    sign: Callable[[float], int], at: tuple[float, float], half: float, low: float, high: float
) -> tuple[float, float, int] | None:
    """The nearest values below and above a range at which a sign is certain, by factors of two
    from `half`, and its rise; an end of [low, high] is taken as it is. None if the sign is
    the same on both sides. Of a function that is flat these hold the zero, noise / slope does not.
    """
    least = 2 * float(np.spacing(max(abs(low), abs(high))))
    ends, signs = [], []
    for p, way, last in ((at[0], -1, low), (at[1], 1, high)):
        room = way * (last - p)
        step = max(min(half, room / 2), least)
        here = sign(p + way * step) if step < room else 0
        while here and step > least and sign(p + way * step / 2) == here:
            step /= 2
        while not here and step < room:
            step *= 2
            here = sign(p + way * step) if step < room else 0
        ends.append(float(p + way * step if here else last))
        signs.append(here)
    if signs[0] * signs[1] > 0:
        return None
    return ends[0], ends[1], signs[1] or -signs[0]


# Windows


def windows(along: Continuation, met: Guess, width: float) -> Iterator[Guess]:
    """Where two roots that are predicted to meet within a step of that width cross the line, around
    their closest approach."""
    pair = roots_near(along, met.value, met.root, met.right, met.left)
    for _ in range(3):
        centre, half = pair.approach(along.form)
        if abs(centre) <= 4 * half or half >= width / 8:
            break
        if not abs(centre) <= width:
            return
        pair = pair.moved(along, float(np.clip(pair.value + centre, along.low, along.high)))
    centre, half = pair.approach(along.form)
    if half == 0.0 or not np.isfinite(centre):
        return
    bend, slope = pair.d_bend.real, pair.d_slope.real
    if along.form != "damped":  # beyond rounding d has the other sign there
        if slope**2 - 4 * bend * pair.d.real <= 16 * abs(bend) * pair.noise:
            return
        x = np.array([centre - half, centre + half])
        places = [(n, complex(pair.ahead(x[n])[0]), True) for n in (0, 1) if abs(x[n]) <= width]
    else:
        x = centre + np.linspace(-8.0, 8.0, 404) * half
        x = np.unique(np.concatenate([x[np.abs(x) < width], np.linspace(-width, width, 101)]))
        places = list(_changes(*pair.ahead(x), False))
    least = min(4 * half, width)
    for n, z, coalesces in places:
        yield Guess(pair.value + x[n], z, pair.right, pair.left, coalesces, least)
