"""All sign changes of a smooth function of one variable, found by way of its extrema.

The function is interpolated at Chebyshev points, on panels that are halved until the series has
converged. Between neighbouring extrema of the interpolant (eigenvalues of its derivative's
companion matrix) it is monotone and changes sign at most once, so two roots close to each other
are kept apart by the extremum between them, however fine: no grid has to hit the gap.
"""

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from squeal.linear.cubic import Value
from squeal.linear.matrices import Array

Function = Callable[[float], Value]
Prepare = Callable[[list[float]], None]  # told of all places before a function is asked there

DEGREES = (16, 32)
RESOLVED = 1e-9  # size of the last coefficients, relative: the extrema are then good to 1e-4 or so
NOISE = 1e-5  # of the size: more in the last coefficients is no rounding
DEPTH = 5


@dataclass(frozen=True)
class Root:
    """A sign change: its place, the bracket that was left of it, and whether that is tight."""

    mu: float
    interval: tuple[float, float]
    converged: bool


def _interpolated(f: Function, low: float, high: float, prepare: Prepare) -> tuple[Array, int, str]:
    """Chebyshev series of f on [low, high], its degree, and whether it is far from zero (far),
    resolved (smooth) or neither (rough)."""
    centre, half, tail = (low + high) / 2, (high - low) / 2, math.inf

    def sampled(x: np.ndarray) -> np.ndarray:
        mus = (centre + half * x).tolist()
        prepare(mus)
        return np.array([f(mu).value for mu in mus])

    for degree in DEGREES:
        series: Array = chebyshev.chebinterpolate(sampled, degree)  # type: ignore
        size, before, tail = np.abs(series).max(), tail, np.abs(series[-3:]).max()
        if abs(series[0]) > 1.2 * np.abs(series[1:]).sum():
            return series, degree, "far"
        if tail <= RESOLVED * size:
            return series, degree, "smooth"
    # what a higher degree does not lessen is rounding, and so would be what panels add
    noise = tail <= NOISE * size and tail > 0.1 * before
    return series, degree, "smooth" if noise else "rough"


def _panels(
    f: Function, low: float, high: float, prepare: Prepare, depth: int = 0
) -> Iterator[list[float]]:
    """Points of [low, high] between which f is monotone or far from zero, panel by panel."""
    centre, half = (low + high) / 2, (high - low) / 2
    series, degree, kind = _interpolated(f, low, high, prepare)
    if kind == "rough" and depth < DEPTH:
        yield from _panels(f, low, centre, prepare, depth + 1)
        yield from _panels(f, centre, high, prepare, depth + 1)
        return
    inside = np.array([])
    if kind != "far":
        slope = chebyshev.chebtrim(chebyshev.chebder(series), 1e-14 * np.abs(series).max())
        turning = chebyshev.chebroots(slope) if len(slope) > 1 else inside
        real = turning.real[np.abs(turning.imag) <= 1e-6]
        inside = centre + half * real[np.abs(real) < 1]
    nodes = centre + half * chebyshev.chebpts1(degree + 1)
    yield sorted([low, high, *map(float, nodes), *map(float, inside)])


def refine(f: Function, low: float, high: float, f_low: float, f_high: float) -> Root:
    """Bracketed root by inverse quadratic steps or bisection (Chandrupatla 1997)."""
    a, b, fa, fb = high, low, f_high, f_low
    c, fc = a, fa
    t = 0.5
    for _ in range(200):
        x = a + t * (b - a)
        fx = f(x).value
        if math.copysign(1, fx) == math.copysign(1, fa):
            c, fc = a, fa
        else:
            c, b, fc, fb = b, a, fb, fa
        a, fa = x, fx
        best = a if abs(fa) < abs(fb) else b
        resolution = 2 * float(np.spacing(abs(best)))
        if fa == 0 or abs(b - a) <= 2 * resolution:
            break
        xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
        t = 0.5
        if phi**2 < xi and (1 - phi) ** 2 < 1 - xi:
            t = fa / (fb - fa) * fc / (fb - fc)
            t += (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        edge = resolution / abs(b - a)
        t = min(1 - edge, max(edge, t))
    best = float(best)
    ends = (best, best) if fa == 0 else (float(min(a, b)), float(max(a, b)))
    return Root(best, ends, bool(ends[1] - ends[0] <= 1e-12 * abs(best)))


def certain(
    f: Function, mu: float, half: float, low: float, high: float
) -> tuple[float, float] | None:
    """The nearest values below and above mu at which the sign of f is certain, by factors of two
    from `half`; an end of [low, high] is taken as it is.

    None if the sign is the same on both sides. Where f is flat next to its zero these hold the
    zero, and bound over slope does not.
    """
    least = 2 * float(np.spacing(max(abs(low), abs(high))))

    def sign(x: float) -> float:
        at = f(x)
        return math.copysign(1.0, at.value) if abs(at.value) > at.bound else 0.0

    ends, signs = [], []
    for way, last in ((-1, low), (1, high)):
        room = way * (last - mu)
        step = max(min(half, room / 2), least)
        found = sign(mu + way * step) if step < room else 0.0
        if found:
            while step > least and sign(mu + way * step / 2) == found:
                step /= 2
        while not found and step < room:
            step *= 2
            found = sign(mu + way * step) if step < room else 0.0
        ends.append(float(mu + way * step if found else last))
        signs.append(found)
    return None if signs[0] * signs[1] > 0 else (ends[0], ends[1])


def sign_changes(
    f: Function, low: float, high: float, prepare: Prepare = lambda mus: None
) -> tuple[list[Root], list[float]]:
    """Roots of f in [low, high] and the points at which f was sampled.

    f gives a value and a bound of its rounding error. A point where f is smaller than its bound
    and not next to another such point is returned as a root too, so that one exactly at an end,
    or of even order, is not lost; a sign change need not follow from it.
    """
    points = sorted({mu for panel in _panels(f, low, high, prepare) for mu in panel})
    prepare(points)
    sampled = [f(mu) for mu in points]
    zero = [abs(v.value) <= v.bound for v in sampled]
    roots = []
    for k, (left, right) in enumerate(itertools.pairwise(sampled)):
        if left.value * right.value < 0 and not (zero[k] and zero[k + 1]):
            roots.append(refine(f, points[k], points[k + 1], left.value, right.value))
    for k, (mu, v) in enumerate(zip(points, sampled, strict=True)):
        beside = zero[max(0, k - 1) : k] + zero[k + 1 : k + 2]
        if zero[k] and (v.value == 0 or not any(beside)):
            roots.append(Root(mu, (mu, mu), True))
    return sorted(roots, key=lambda root: root.mu), points
