"""Thresholds of a parametrised system: every change of verdict, every crossing of the axis.

The eigenvalues are followed along the parameter (`continuation`); where they cross the line between
growth and decay is located on the roots themselves, or on the pair that meets there (`events`), and
what grows is counted between these places (`search`). The verdict changes at events that
begin or end all growth, and where the faster growth passes from a pair to a real root or back.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from squeal.errors import InputError
from squeal.linear.continuation import (
    Continuation,
    ContinuationOptions,
    Guess,
    State,
    hermite_cubic,
)
from squeal.linear.eigen import GROWING
from squeal.linear.events import Crossing, Event, hertz_of, located
from squeal.linear.matrices import LightMassError
from squeal.linear.search import Searched, difference, fastest_first, search
from squeal.linear.system import Slow, SystemFunction


@dataclass(frozen=True)
class CriticalPoint:
    """A change of verdict on the way up in mu.

    `converged`: the interval is no wider than 1e-9 of mu, and a root was seen to make the change.
    Where it is not the interval holds the change all the same: rounding leaves it more where growth
    hardly changes with mu, as at a window that almost closes.
    """

    mu: float
    kind: str  # flutter, divergence: what follows; restabilised: neither follows any more
    frequency_hz: float  # of the mode concerned, at mu; 0 where a real root is
    interval: tuple[float, float]  # bracket of mu; the point itself at a breakpoint
    converged: bool
    residual: float | None = None  # backward error of the root there, if it is known

    def __str__(self) -> str:
        return f"{self.kind} at mu = {self.mu:.9g}{hertz_of(self.frequency_hz)}"


@dataclass(frozen=True)
class Thresholds:
    """What happens over a range of mu: `points` are the changes of verdict among the crossings."""

    points: list[CriticalPoint]
    crossings: list[Crossing]
    # a second count agrees between all crossings, and no step leaves room for more; None where
    # nothing is known between the values looked at, as of a plain function
    certified: bool | None = None
    # the eigenvalues along mu that all this was read off, in parts between jumps
    searched: tuple[Searched, ...] = field(default=(), repr=False, compare=False)


def thresholds(
    system: SystemFunction,
    mu_max: float,
    breakpoints: Iterable[float] = (),
    mu_min: float = 0.0,
    options: ContinuationOptions | None = None,
) -> Thresholds:
    """All thresholds of system(mu) -> (M, C, K) for mu_min <= mu <= mu_max, sorted.

    A point at mu_min means that the system is quiet there and grows at once above it. A window of
    growth gives two points; one that opens and closes between two values that are looked at is
    predicted from how the roots are coupled there, to second order. The crossings of the imaginary
    axis list what happens while other modes grow, too. A pair without damping crosses where two
    frequencies coalesce or part; divergent roots that join or part in a growing pair cross nothing.

    Parameters
    ----------
    system : SystemFunction
        Smooth between the `breakpoints`.
    mu_max, mu_min : float
        The range.
    breakpoints : iterable of float
        Values of mu where the system may jump, at a change of contact for instance; it is asked
        for values next to them, never at them.
    options : ContinuationOptions
        Steps, budget and tolerances.

    Returns
    -------
    Thresholds
        `certified` is None for a plain function, of which nothing is known between the values.

    Raises
    ------
    InputError
        For an empty range, a singular M whose massless motions cannot be eliminated, and whatever
        `system` raises.

    Examples
    --------
    >>> import numpy as np
    >>> K = lambda mu: np.array([[2.0, -1.0 + 4 * mu / 3], [-1.0, 2.0]])
    >>> result = thresholds(lambda mu: (np.eye(2), None, K(mu)), 2.0)
    >>> print(*result.points)
    flutter at mu = 0.75, 0.225079 Hz
    """
    mu_min, mu_max = float(mu_min), float(mu_max)
    if not -math.inf < mu_min < mu_max < math.inf:
        words = "is not allowed; it must be finite numbers, the first below the last"
        raise InputError(f"thresholds: mu_min, mu_max = {mu_min, mu_max} {words}")
    edges = [mu_min, *sorted({float(b) for b in breakpoints if mu_min < b < mu_max}), mu_max]
    points: list[CriticalPoint] = []
    crossings: list[Crossing] = []
    parts: list[Searched] = []
    for a, b in itertools.pairwise(edges):
        low = float(np.nextafter(a, b)) if parts else a
        high = b if b == edges[-1] else float(np.nextafter(b, a))
        try:
            part = search(system, low, high, options)
        except LightMassError:
            system = Slow(system, mu_min)
            part = search(system, low, high, options)
        if parts:
            jumps = _jump(a, parts[-1].line.at(parts[-1].line.high), part.line.at(low))
            points, crossings = points + jumps[0], crossings + jumps[1]
        found = points_and_crossings(part)
        points, crossings = points + found[0], crossings + found[1]
        parts.append(part)
    certified = None
    if all(part.doubts is not None for part in parts):
        certified = not any(part.doubts for part in parts)
    return Thresholds(points, crossings, certified, tuple(parts))


def points_and_crossings(part: Searched) -> tuple[list[CriticalPoint], list[Crossing]]:
    """The changes of verdict and the crossings of a part without a jump."""
    changes = [(c, _leads(part, c)) for c in _changes(part)]
    crossings = []
    for k, place in enumerate(part.places):
        leads = [lead for c, lead in changes if c.place == k]
        for c in place:
            changing = any(c in lead or not any(lead) for lead in leads)
            mode = _mode(part.line.at(c.value), c.omega, 2 if c.coalesces else 1)
            crossings.append(c.crossing(mode, changing))
    return [_point(part, *change) for change in changes], crossings


def _jump(at: float, below: State, above: State) -> tuple[list[CriticalPoint], list[Crossing]]:
    """What changes at a breakpoint, of which only the states on both sides are known."""
    before, after = below.growth.verdict, above.growth.verdict
    points = []
    if before != after:
        grown, kind = (above, after) if after in GROWING else (below, "restabilised")
        omega = _leading(grown) if grown.growth.verdict == "flutter" else 0.0
        points = [CriticalPoint(at, kind, omega / (2 * math.pi), (at, at), True)]
    crossings = [
        Event(at, omega, way, (at, at)).crossing(
            _mode(above if way > 0 else below, omega), before != after
        )
        for omega, way in difference(below, above)
    ]
    return points, crossings


def _mode(state: State, omega: float, members: int = 1) -> int:
    """Number of a mode by rising frequency, from 1; of several that are one there the first."""
    each = 1 if state.form == "undamped" else 2
    others = state.omegas[np.argsort(np.abs(state.omegas - omega))][each * members :]
    near = 1e-6 if members > 1 else 1e-9
    return 1 + int(np.sum(others < omega * (1 - near))) // each


def _leading(state: State) -> float:
    """Angular frequency of the pair that grows fastest (rad/s), 0 if none does."""
    return float(state.omegas[state.growing[0][0]]) if state.growing[0] else 0.0


# Changes of verdict, from what grows and what crosses


class VerdictChange(NamedTuple):
    """The verdict changes at `value` +- `half`: at the place of that index, or at none."""

    value: float
    half: float
    below: str
    above: str
    place: int | None


class _Mark(NamedTuple):
    value: float
    verdict: str
    place: int | None = None


def _changes(part: Searched) -> Iterator[VerdictChange]:
    """All changes of verdict by rising value.

    Next to rest the verdict is that of what crosses. Everywhere else it changes only where the
    faster growth changes hands; where that is at a place of crossings it belongs to the place.
    """
    line, places, edges, marks = part.line, part.places, part.edges, list[_Mark]()
    values = [s.value for s in line.states]
    near = 4 * line.options.same * (line.high - line.low)
    for k, growth in enumerate(part.growths):
        low, high = edges[k : k + 2]
        states = [line.at(v) for v in values if low <= v <= high and growth.roots]
        own = [_Mark(s.value, s.growth.verdict) for s in states if s.growth.roots == growth.roots]
        own = own or [_Mark((low + high) / 2, growth.verdict)]
        quiet = [mark.verdict == "quiet" for mark in (*marks[-1:], own[0])]
        if k and quiet[0] != quiet[1]:
            grown, way = (own[0], 1) if quiet[0] else (marks[-1], -1)
            kinds = {c.kind for c in places[k - 1] if c.direction == way}
            kind = kinds.pop() if len(kinds) == 1 else grown.verdict
            marks += [_Mark(low, v, k - 1) for v in ("quiet", kind)][::way]
        marks += own
    for a, b in itertools.pairwise(marks):
        if a.place is not None and a.place == b.place:
            yield VerdictChange(a.value, 0.0, a.verdict, b.verdict, a.place)
        elif a.value < b.value and "quiet" not in (a.verdict, b.verdict):
            for change in _between(line, a, b):
                ways = {(change.below, -1), (change.above, 1)}
                at = [
                    change._replace(value=place[0].value, place=k)
                    for k, place in enumerate(places)
                    if abs(place[0].value - change.value) <= near
                    and ways <= {(c.kind, c.direction) for c in place}
                ]
                yield at[0] if at else change


def _between(line: Continuation, a: _Mark, b: _Mark, depth: int = 5) -> Iterator[VerdictChange]:
    """Where growth changes hands between two marks."""
    if a.verdict != b.verdict:
        yield VerdictChange(*_exchange(line, a, b), a.verdict, b.verdict, None)
    elif depth and _near(line.at(a.value), line.at(b.value), a.verdict):
        middle = (a.value + b.value) / 2
        mark = _Mark(middle, line.at(middle).growth.verdict)
        if mark.verdict != "quiet":
            yield from _between(line, a, mark, depth - 1)
            yield from _between(line, mark, b, depth - 1)


def _near(a: State, b: State, verdict: str) -> bool:
    """True if the cubic through both ends, and by what it may be off, leads to an exchange."""
    both = a.growth, b.growth
    if not (any(g.pairs for g in both) and any(g.reals for g in both)):
        return False
    (x, dx, _), (y, dy, _) = _lead(a), _lead(b)
    dx, dy = dx * (b.value - a.value), dy * (b.value - a.value)
    lead = np.polyval(hermite_cubic(x, dx, y, dy)[::-1], np.linspace(0.0, 1.0, 17))
    lead = lead if verdict == "flutter" else -lead
    return bool(lead.min() <= abs(y - x - (dx + dy) / 2))


def _exchange(line: Continuation, a: _Mark, b: _Mark) -> tuple[float, float]:
    """Where the verdict of b begins, and half the interval that holds it: by Ridders's method."""
    low, high, p, half = a.value, b.value, math.inf, 1e-7 * (b.value - a.value)
    least = 4 * np.spacing(max(abs(low), abs(high)))
    for k in range(100):
        before, p = p, (low + high) / 2
        first, middle, last = (line.at(v).growth for v in (low, p, high))
        level = (first.pairs, first.reals) == (last.pairs, last.reals)
        # a few halvings before a meeting of two roots is looked for
        if k == 6 and not level and (met := _meeting(line, low, high)) is not None:
            return met
        x, m, y = (g.pair_rate - g.real_rate for g in (first, middle, last))
        tried = [p]
        if x * y < 0.0:
            p += (p - low) * np.sign(x) * m / math.sqrt(m**2 - x * y)
            tried = sorted({*tried, p})
        if high - low <= least or abs(p - before) <= least:
            break
        for v in tried:
            if line.at(v).growth.verdict == b.verdict:
                high = v
                break
            low = v
    if level:
        _, slope, rounding = _lead(line.at(p))
        half = min(rounding / abs(slope) if slope else math.inf, half) + 1e-12 * abs(p)
    return p, half


def _meeting(line: Continuation, low: float, high: float) -> tuple[float, float] | None:
    """Where a growing pair, as it is on one side, meets on the real axis, and half the interval."""
    sides = [line.at(p) for p in (low, high) if line.at(p).growth.verdict == "flutter"]
    if line.form not in ("damped", "undamped") or not sides:
        return None
    state, k = sides[0], sides[0].growing[0][0]
    z = state.roots
    both = [k, int(np.argmin(np.abs(z - z[k].conj())))]
    vectors = state.right[:, both], state.left[:, both]
    guess = Guess((low + high) / 2, complex(z[k].real), *vectors, True, high - low)
    event = located(line, guess, crosses=False)
    if event is None or not low - event.width <= event.value <= high + event.width:
        return None
    met = line.at(float(np.clip(event.value, low, high)))
    k = int(np.argmax(met.exponents.real))
    if abs(met.roots[k].imag) > 2 * met.rounding[k]:  # one that meets while another pair leads
        return None
    return event.value, event.width / 2


def _lead(state: State) -> tuple[float, float, float]:
    """By how much the fastest pair outgrows the fastest real root (1/s, 0 without one), the slope
    of that and its rounding."""
    z, rates = state.roots, np.zeros((2, 3))
    for own, rate in zip(state.growing, rates, strict=True):
        for k in own[:1]:
            exponent = state.exponents[k]  # lambda
            turn = -0.5 / exponent if state.form == "undamped" else exponent / z[k]  # d lambda / dz
            slope = (turn * state.slopes[k]).real
            rate[:] = exponent.real, slope, abs(turn) * state.rounding[k]
    value, slope, _ = rates[0] - rates[1]
    return float(value), float(slope), float(rates[:, 2].sum())


def _leads(part: Searched, change: VerdictChange) -> list[Event | None]:
    """At the place of a change the fastest event that ends, and that begins, what it concerns."""
    at = () if change.place is None else part.places[change.place]
    ways = (change.below, -1), (change.above, 1)
    alike = ([c for c in at if (c.kind, c.direction) == way] for way in ways)
    return [next(iter(fastest_first(part.line, own)), None) for own in alike]


def _point(part: Searched, change: VerdictChange, leads: Sequence[Event | None]) -> CriticalPoint:
    line, at = part.line, () if change.place is None else part.places[change.place]
    grows = change.above in GROWING
    concerned, lead = change.above if grows else change.below, leads[grows]
    low = min([c.interval[0] for c in at], default=change.value - change.half)
    high = max([c.interval[1] for c in at], default=change.value + change.half)
    omega = 0.0
    if lead is not None:
        omega = lead.omega
    elif concerned == "flutter" and at:  # of the nearest value looked at on that side
        beside = [s for s in line.states if (s.value > high if grows else s.value < low)]
        omega = _leading(min(beside or line.states, key=lambda s: abs(s.value - change.value)))
    elif concerned == "flutter":
        # a pair and a real root grow alike, or a pair is about to be two real roots
        growth = line.at(change.value).growth
        if abs(growth.pair_rate - growth.real_rate) <= 1e-6 * growth.real_rate:
            omega = _leading(line.at(change.value))
    tight = not at or high - low <= line.options.same * max(abs(change.value), 1e-300)
    return CriticalPoint(
        float(change.value),
        change.above if grows else "restabilised",
        omega / (2 * math.pi),
        (float(low), float(high)),
        tight and all(c.converged for c in at),
        None if lead is None else lead.residual,
    )
