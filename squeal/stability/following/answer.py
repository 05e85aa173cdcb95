"""Thresholds of systems with more than three degrees of freedom, in the words of all others."""

import itertools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from squeal.stability.crossing import CriticalPoint, Crossing, Thresholds
from squeal.stability.following.line import Line
from squeal.stability.following.locate import Located
from squeal.stability.following.search import Searched, Stretch, search
from squeal.stability.growth import GROWING, Growth
from squeal.stability.matrices import System

HIDDEN = 1e-7  # of a step: how far rounding may shift what bisection finds
TIGHT = 1e-9  # of mu: an interval shorter than this has converged


@dataclass(frozen=True)
class _Event:
    """A place with what grows below and above it; `located` is empty at a jump or an exchange."""

    mu: float
    located: tuple[Located, ...]
    below: Growth
    above: Growth
    interval: tuple[float, float]
    line: Line


def followed(
    system: System, mu_max: float, breakpoints: Iterable[float] = (), mu_min: float = 0.0
) -> Thresholds:
    """All thresholds for mu_min <= mu <= mu_max, as `thresholds` gives them."""
    inner = sorted({float(b) for b in breakpoints if mu_min < b < mu_max})
    edges = [mu_min, *inner, mu_max]
    events: list[_Event] = []
    before: Growth | None = None
    certified = True
    for a, b in itertools.pairwise(edges):
        low = a if a == mu_min else float(np.nextafter(a, b))
        high = b if b == mu_max else float(np.nextafter(b, a))
        found = search(system, low, high)
        certified &= found.certified
        first = _next_to(found.line, found.stretches[0], True)
        if before is not None and before != first:
            events.append(_Event(a, (), before, first, (a, a), found.line))
        events += _events(found)
        before = _next_to(found.line, found.stretches[-1], False)
    points = [p for e in events if (p := _point(e)) is not None]
    return Thresholds(points, [c for e in events for c in _crossings(e)], certified)


def _events(found: Searched) -> Iterator[_Event]:
    line = found.line
    for k, stretch in enumerate(found.stretches):
        yield from _exchanges(line, stretch.low, stretch.high)
        if k < len(found.places):
            place = found.places[k]
            low, high = (f(c.interval[i] for c in place) for i, f in ((0, min), (1, max)))
            yield _Event(
                float(place[0].value),
                place,
                _next_to(line, stretch, False),
                _next_to(line, found.stretches[k + 1], True),
                (float(low), float(high)),
                line,
            )


def _next_to(line: Line, stretch: Stretch, first: bool) -> Growth:
    """What grows at the end of a stretch, inside which growth rates may change hands and a growing
    pair may become two real roots."""
    inside = [s.value for s in line.states if stretch.low < s.value < stretch.high]
    if not inside:
        return stretch.growth
    found = line.growth(inside[0] if first else inside[-1])
    return found if found.roots == stretch.growth.roots else stretch.growth


def _exchanges(line: Line, low: float, high: float) -> Iterator[_Event]:
    """Places where the faster growth passes from a pair to a real root or back."""
    inside = [s.value for s in line.states if low < s.value < high]
    for a, b in itertools.pairwise(inside):
        x, y = line.growth(a), line.growth(b)
        if x.verdict == y.verdict or "quiet" in (x.verdict, y.verdict):
            continue
        if x.numbers == y.numbers:
            from scipy.optimize import brentq

            def lead(p: float) -> float:
                g = line.growth(p)
                return g.pair_rate - g.real_rate

            mu = float(brentq(lead, a, b, xtol=1e-13 * abs(b), rtol=1e-13))
            half = 1e-9 * abs(mu)
        else:  # two divergent roots join to a growing pair, or come from one
            mu, half = _joined(line, a, b, x.verdict)
        yield _Event(mu, (), x, y, (mu - half, mu + half), line)


def _joined(line: Line, a: float, b: float, verdict: str) -> tuple[float, float]:
    """Where the verdict changes between a and b, bisected, and how far rounding may shift it."""
    start = b - a
    while b - a > 4 * np.spacing(max(abs(a), abs(b))):
        middle = (a + b) / 2
        if line.growth(middle).verdict == verdict:
            a = middle
        else:
            b = middle
    return (a + b) / 2, HIDDEN * start


def _point(event: _Event) -> CriticalPoint | None:
    below, above = event.below.verdict, event.above.verdict
    if below == above:
        return None
    grows = above in GROWING
    kind = above if grows else "restabilised"
    concerned = above if grows else below
    way = 1 if grows else -1
    leading = [c for c in event.located if c.kind == concerned and c.direction == way]
    omega = leading[0].omega if leading else _fastest(event, concerned, grows)
    if concerned == "divergence":
        omega = 0.0
    settled = all(c.converged for c in event.located)
    tight = event.interval[1] - event.interval[0] <= TIGHT * max(abs(event.mu), 1e-300)
    return CriticalPoint(
        event.mu,
        kind,
        omega / (2 * math.pi),
        event.interval,
        bool(settled and (tight or not event.located)),
        _residual(leading[0]) if leading else None,
    )


def _residual(one: Located) -> float | None:
    return one.residual if math.isfinite(one.residual) else None


def _fastest(event: _Event, kind: str, above: bool) -> float:
    """Angular frequency (rad/s) of the fastest growing pair beside an event, on one side of it."""
    if kind == "divergence":
        return 0.0
    low, high = event.interval
    beside = [s for s in event.line.states if (s.value > high if above else s.value < low)]
    state = min(beside or event.line.states, key=lambda s: abs(s.value - event.mu))
    z = state.roots
    rates = z.real if event.line.damped else np.abs(np.sqrt(-z + 0j).real)
    pairs = np.abs(z.imag) > state.noise
    k = int(np.argmax(np.where(pairs, rates, -np.inf)))
    return event.line.omega(complex(z[k]))


def _crossings(event: _Event) -> Iterator[Crossing]:
    changes = event.below.verdict != event.above.verdict
    pairs = event.above.pairs - event.below.pairs
    reals = event.above.reals - event.below.reals
    # two divergent roots for a growing pair: nothing crosses
    joined = min(abs(pairs), abs(reals) // 2) * int(np.sign(pairs)) if pairs * reals < 0 else 0
    rises = {"flutter": pairs - joined, "divergence": reals + 2 * joined}
    located = dict.fromkeys(rises, 0)
    for c in event.located:
        located[c.kind] += int(c.direction)
    if event.located and located == rises:
        for c in event.located:
            yield c.crossing(_mode(event.line, c), changes, _residual(c))
        return
    for kind, rise in rises.items():
        omega = _fastest(event, kind, rise > 0)
        for _ in range(abs(rise)):
            way = "up" if rise > 0 else "down"
            yield Crossing(
                event.mu, kind, way, omega / (2 * math.pi), event.interval, 1, changes, None
            )


def _mode(line: Line, c: Located) -> int:
    """Number of the mode by rising frequency, from 1; of a coalescing pair the first."""
    state = min(line.states, key=lambda s: abs(s.value - c.value))
    omega = np.array([line.omega(complex(z)) for z in state.roots])
    gap = 1e-6
    if c.coalesces:  # its two members lie on both sides: the closest one below belongs to it
        gap = max(gap, float(np.sort(np.abs(omega / (c.omega or 1.0) - 1.0))[1]) * (1 + 1e-9))
    slower = int(np.sum(omega < c.omega * (1 - gap)))
    return 1 + (slower // 2 if line.damped else slower)
