"""Guesses made exact: on the root itself with its derivative, on the pair where two coalesce."""

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from squeal.linear.crossing import Crossing
from squeal.linear.cubic import Value
from squeal.linear.following.coupling import ComplexArray
from squeal.linear.following.line import Line
from squeal.linear.following.pairs import SURE, pair_at
from squeal.linear.following.windows import Guess
from squeal.linear.matrices import EPS, norm_of
from squeal.linear.roots import Function, certain
from squeal.numerics.inverse import near_singular

STEPS = 25
CONVERGED = 4 * EPS
WAYS = np.geomspace(1e-13, 1.0, 120)  # of the width of a guess
APART = 1e-9  # of the parameter: a pair that leaves more in doubt is looked at root by root
ASIDE = 1e-5  # of the width of a guess
NOT_ZERO = 1e-8  # of |A|
SLACK = 1.5  # steps beyond the width of a guess before it is given up
STRAIGHT = 1e-9  # of the width of a guess: next to a zero with no slope more is within rounding


@dataclass(frozen=True)
class Located:
    """A crossing of the line: value of the parameter, rad/s, direction, interval, error."""

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
    def half(self) -> float:
        """Half the interval's width."""
        return (self.interval[1] - self.interval[0]) / 2

    def crossing(self, mode: int, changes: bool, residual: float | None) -> Crossing:
        """The same for callers: number of the mode, whether the verdict changes, error."""
        way, hertz = "up" if self.direction > 0 else "down", self.omega / (2 * math.pi)
        ends = (float(self.interval[0]), float(self.interval[1]))
        value = float(self.value)
        return Crossing(value, self.kind, way, hertz, ends, mode, changes, residual)


def _refined_vectors(
    A: np.ndarray, z: complex, right: ComplexArray, left: ComplexArray
) -> tuple[complex, ComplexArray, ComplexArray]:
    """The root of A next to z with unit vectors, by inverse iteration and Rayleigh quotients."""
    from scipy.linalg import lu_solve

    x, y = right, left
    size = norm_of(A)
    for _ in range(3):
        shift = z + 1e-14 * size * (1 + 1j)
        factor = near_singular(A - shift * np.eye(len(A)))
        x = lu_solve(factor, x, check_finite=False)
        y = lu_solve(factor, y, trans=2, check_finite=False)
        x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
        across = y.conj() @ x
        if abs(across) < 1e-13:
            break
        moved = complex(y.conj() @ (A @ x) / across)
        if abs(moved - z) <= 4 * EPS * size:
            z = moved
            break
        z = moved
    return z, x, y


def located(line: Line, guess: Guess) -> Located | None:
    """The crossing next to a guess, None if there is none that is told to within its width."""
    guess = replace(guess, value=min(max(guess.value, line.low), line.high))
    if guess.coalesces:
        found = _coalescence(line, guess)
        beside = ASIDE * guess.width
        if found is not None and found.half > beside:  # subspaces of other roots, or rounding
            again = _coalescence(line, replace(guess, value=found.value + beside))
            found = min(filter(None, (found, again)), key=lambda one: one.half)
    elif guess.right.ndim == 2:
        found = _beside(line, guess)
    else:
        found = _passing(line, guess)
    if found is None:
        return None
    inside = line.low <= found.value <= line.high
    low, high = found.interval
    if not inside or high - low > guess.width:
        return None
    return replace(found, interval=(max(low, line.low), high))


def _beside(line: Line, guess: Guess) -> Located | None:
    """One of two close roots passes the line: zeros of the pair's own model, renewed at each."""
    p, near, right, left = guess.value, guess.root, guess.right, guess.left
    steps = guess.width * np.concatenate([-WAYS[::-1], [0.0], WAYS])
    for _ in range(STEPS):
        try:
            pair = pair_at(line, p, near, right, left)
        except np.linalg.LinAlgError:
            return None
        right, left = pair.right, pair.left
        number = (pair.roots(steps).real > 0.0).sum(axis=1)
        changes = np.flatnonzero(number[1:] != number[:-1])
        if not len(changes):
            return None
        n = int(changes[np.argmin(np.abs(steps[changes] + steps[changes + 1]))])
        low, high = float(steps[n]), float(steps[n + 1])
        while high - low > EPS * abs(p) + 1e-3 * abs(low + high) * EPS:
            middle = (low + high) / 2
            if not low < middle < high:
                break
            if (pair.roots(np.array(middle)).real > 0.0).sum() == number[n]:
                low = middle
            else:
                high = middle
        move = float(np.clip(p + (low + high) / 2, line.low, line.high)) - p
        p, near = p + move, pair.mean + move * pair.mean_slope
        if abs(p - guess.value) > SLACK * guess.width:
            return None
        if abs(move) <= 1e2 * CONVERGED * max(abs(p), 1e-3 * guess.width):
            roots = pair.roots(np.array(move))
            z = complex(roots[np.argmin(np.abs(roots.real))])
            half = (z - near) or 1e-300
            slope = complex(pair.mean_slope + (pair.d_slope + 2 * move * pair.d_bend) / (2 * half))
            size = norm_of(line.both(p)[0])
            noise = abs(pair.noise / (2 * half)) + EPS * size
            real = bool(abs(z.imag) <= max(1e-9 * float(np.abs(roots).max()), noise))
            wide = 2 * noise / max(abs(slope.real), 1e-300) + abs(move) + 2 * EPS * abs(p)
            direction = 1 if slope.real > 0 else -1
            omega = 0.0 if real else line.omega(z)
            found = Located(p, omega, direction, (p - wide, p + wide), noise / size, False)
            if wide <= APART * abs(p):
                return found
            # a third root is as close as these are, so one of them by itself is known better
            alone = Guess(p, z, right.sum(axis=1), left.sum(axis=1), False, guess.width)
            single = _passing(line, alone)
            return single if single and single.half <= found.half else found
    return None


def _passing(line: Line, guess: Guess) -> Located | None:
    """Newton's method on Re z(p) = 0, with the derivative from left and right vectors."""
    p, limit = guess.value, SLACK * guess.width
    z, x, y = guess.root, guess.right, guess.left
    for _ in range(STEPS):
        A, derivative, _ = line.both(p)
        try:
            z, x, y, noise = _root_at(line, p, z, x, y)
        except (np.linalg.LinAlgError, ValueError):
            return None
        across = y.conj() @ x
        slope = complex(y.conj() @ (derivative @ x) / across) if across else 0j
        if not slope.real or not np.isfinite(slope):
            return None
        move = float(-z.real / slope.real)
        if abs(move) > guess.width:
            move = math.copysign(guess.width / 2, move)
        p = float(np.clip(p + move, line.low, line.high))
        z += move * slope
        if abs(p - guess.value) > limit:
            return None
        if abs(move) <= max(CONVERGED * abs(p), noise / abs(slope.real) / 4):
            if abs(move * slope.real) > NOT_ZERO * norm_of(A):
                return None  # where two roots coalesce the slope is without bound, and this no zero
            real = not line.damped or abs(z.imag) <= 4 * noise
            half = float(2 * noise / abs(slope.real) + abs(move) + 2 * EPS * abs(p))
            beside = partial(_real_part, line, (p, z, slope), x, y)
            interval = _interval(line, beside, p, half, guess.width)
            if interval is None:
                return None
            direction = 1 if (slope.real > 0) == line.damped else -1
            rest = A @ x - z * x
            residual = float(np.linalg.norm(rest) / norm_of(A))
            omega = 0.0 if real else line.omega(z)
            return Located(p, omega, direction, interval, residual, False)
    return None


def _root_at(
    line: Line, p: float, near: complex, right: ComplexArray, left: ComplexArray
) -> tuple[complex, ComplexArray, ComplexArray, float]:
    """The root at p next to `near` with unit vectors, and how far rounding moves it."""
    A, _, rounding = line.both(p)
    z, x, y = _refined_vectors(A, near, right, left)
    entries = float(np.sqrt(np.abs(y) ** 2 @ (A**2 @ np.abs(x) ** 2)))
    across = max(float(abs(y.conj() @ x)), float(np.finfo(float).tiny))
    return z, x, y, float(SURE * max(rounding, EPS) * entries / across)


def _real_part(
    line: Line, start: tuple[float, complex, complex], x: ComplexArray, y: ComplexArray, p: float
) -> Value:
    """Re z at p of the root that has a value, and a slope, where it starts."""
    at, z, slope = start
    root, *_, noise = _root_at(line, p, z + (p - at) * slope, x, y)
    return Value(root.real, noise)


def _difference(
    line: Line, near: complex, right: ComplexArray, left: ComplexArray, p: float
) -> Value:
    """Re d at p of a pair."""
    pair = pair_at(line, p, near, right, left)
    return Value(pair.d.real, pair.noise)


def _interval(
    line: Line, f: Function, p: float, half: float, width: float
) -> tuple[float, float] | None:
    """The interval of a zero of f at p, next to a guess of that width: `half`, which follows from
    rounding over slope, to each side unless the slope may change within; None if f turns back."""
    if half <= STRAIGHT * width:
        return p - half, p + half
    try:
        return certain(f, p, half, line.low, line.high)
    except (np.linalg.LinAlgError, ValueError):
        return None


def _coalescence(line: Line, guess: Guess) -> Located | None:
    """Newton's method on d(p) = 0 of a pair that meets on the line."""
    p, limit, near = guess.value, SLACK * guess.width, guess.root
    right, left = guess.right, guess.left
    sign = -1.0 if not line.damped else 1.0  # of d where the pair grows
    for _ in range(STEPS):
        try:
            pair = pair_at(line, p, near, right, left)
        except np.linalg.LinAlgError:
            return None
        right, left = pair.right, pair.left
        d, slope, bend = pair.d.real, pair.d_slope.real, pair.d_bend.real
        # the nearer zero of d + slope h + bend h^2
        inner = slope * slope - 4 * bend * d
        if inner >= 0.0 and slope:
            move = -2 * d / (slope + np.sign(slope) * np.sqrt(inner))
        elif slope:
            move = -d / slope
        else:
            return None
        move = float(np.clip(move, -guess.width / 2, guess.width / 2))
        p = float(np.clip(p + move, line.low, line.high))
        near = pair.mean + move * pair.mean_slope
        if abs(p - guess.value) > limit:
            return None
        if abs(move) <= max(CONVERGED * abs(p), pair.noise / abs(slope) / 4):
            if slope**2 <= 16 * abs(bend) * pair.noise:  # two roots that only cross
                return None
            half = 2 * pair.noise / abs(slope) + abs(move) + 2 * EPS * abs(p)
            if half > guess.width:  # these are not the pair's subspaces: begin again beside
                right, left, near = guess.right, guess.left, guess.root
                p = float(np.clip(p + ASIDE * guess.width, line.low, line.high))
                continue
            beside = partial(_difference, line, near, right, left)
            interval = _interval(line, beside, p, half, guess.width)
            if interval is None:
                return None
            direction = int(np.sign(sign * slope))
            on_zero = abs(pair.mean) <= np.sqrt(abs(pair.noise))
            omega = 0.0 if line.damped and on_zero else line.omega(pair.mean)
            grows = not line.damped and pair.mean.real < 0
            if grows:  # two divergent roots join: nothing crosses
                return None
            A = line.both(p)[0]
            least = np.linalg.svd(A - pair.mean * np.eye(len(A)), compute_uv=False)
            residual = float(least[-1] / least[0])
            return Located(p, omega, direction, interval, residual, True)
    return None
