"""Thresholds of a parametrised system: every change of verdict, every crossing of the axis.

The eigenvalues are followed along the parameter (`continuation`); where they cross the line between
growth and decay is located on the roots themselves, or on the pair that meets there (`events`), and
what grows is counted between these places (`search`). The verdict changes at events that
begin or end all growth, and where the faster growth passes from a pair to a real root or back.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from squeal.linear.continuation import (
    Continuation,
    ContinuationOptions,
    Guess,
    hermite_cubic,
)
from squeal.linear.eigen import GROWING, UnstableCount
from squeal.linear.events import Crossing, Event, hertz_of, located
from squeal.linear.matrices import LightMassError
from squeal.linear.search import (
    Counter,
    Searched,
    difference,
    fastest_first,
    growing,
    growing_pairs,
    growth_at,
    search,
)
from squeal.linear.system import Slow, System, check_range, check_system

# Changes of verdict, from what grows and what crosses


Count = Callable[[float], UnstableCount]
"""p -> what grows at p."""
Lead = Callable[[float], tuple[float, float, float] | None]
"""p -> by how much the fastest pair outgrows the fastest real root (1/s), slope and rounding."""
Meeting = Callable[[float, float], tuple[float, float] | None]
"""(low, high) -> where a growing pair meets on the real axis, and half its interval."""


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
class Place:
    """A place of crossings: its value, and what begins and ends there."""

    value: float
    begins: frozenset[str]
    ends: frozenset[str]


@dataclass(frozen=True)
class VerdictChange:
    """The verdict changes at `value`: at the place of that index, or at none."""

    value: float
    half: float
    below: str
    above: str
    place: int | None


class _Mark(NamedTuple):
    value: float
    growth: UnstableCount
    verdict: str

    @property
    def ahead(self) -> float:
        """By how much the fastest pair outgrows the fastest real root (1/s)."""
        return self.growth.pair_rate - self.growth.real_rate


@dataclass(frozen=True)
class Verdicts:
    """What the verdict along a parameter follows from.

    Parameters
    ----------
    count : callable
        p -> UnstableCount.
    lead : callable
        p -> (lead, slope, rounding) of the fastest pair over the fastest real root, or None.
    meeting : callable
        (low, high) -> value and half interval of a pair that meets on the real axis, or None.
    """

    count: Count
    lead: Lead = lambda _: None
    meeting: Meeting = lambda *_: None

    def changes(
        self,
        edges: Sequence[float],
        stretches: Sequence[UnstableCount],
        places: Sequence[Place],
        values: Sequence[float],
    ) -> list[VerdictChange]:
        """All changes of verdict by rising value.

        `stretches` grows between neighbouring `edges`, of which the inner ones are the places; at
        the rising `values` it is looked up. Next to rest the verdict is that of what crosses.
        Everywhere else it changes only where the faster growth changes hands.
        """
        changes: list[VerdictChange] = []
        before: _Mark | None = None
        for k, growth in enumerate(stretches):
            for n, mark in enumerate(self._marks(edges[k], edges[k + 1], growth, values)):
                if before is not None:
                    place = places[k - 1] if k and not n else None
                    changes += self._between_marks(before, mark, place, k - 1)
                before = mark
        return changes

    def _at(self, p: float) -> _Mark:
        growth = self.count(p)
        return _Mark(p, growth, growth.verdict)

    def _marks(
        self, low: float, high: float, growth: UnstableCount, values: Sequence[float]
    ) -> list[_Mark]:
        """Marks of a stretch, at those values where as many roots grow as in all of it."""
        own = [self._at(v) for v in values if low <= v <= high and growth.roots]
        marks = [mark for mark in own if mark.growth.roots == growth.roots]
        return marks or [_Mark((low + high) / 2, growth, growth.verdict)]

    def _between_marks(
        self, a: _Mark, b: _Mark, place: Place | None, index: int
    ) -> Iterator[VerdictChange]:
        """Changes from one mark to the next, which may lie beyond a place of crossings."""
        if "quiet" not in (a.verdict, b.verdict):
            yield from self._between(a, b)
        elif place is not None and a.verdict != "quiet":
            end = _Mark(place.value, a.growth, _only(place.ends, a.verdict))
            yield from self._between(a, end)
            yield VerdictChange(place.value, 0.0, end.verdict, b.verdict, index)
        elif place is not None and b.verdict != "quiet":
            start = _Mark(place.value, b.growth, _only(place.begins, b.verdict))
            yield VerdictChange(place.value, 0.0, "quiet", start.verdict, index)
            yield from self._between(start, b)

    def _between(self, a: _Mark, b: _Mark, depth: int = 5) -> Iterator[VerdictChange]:
        """Where growth changes hands between two marks."""
        if not b.value > a.value:
            return
        if a.verdict != b.verdict:
            value, half = self._exchange(a, b)
            yield VerdictChange(value, half, a.verdict, b.verdict, None)
            return
        both = (a.growth, b.growth)
        several = any(g.pairs for g in both) and any(g.reals for g in both)
        if depth and several and self._near(a, b):
            mark = self._at((a.value + b.value) / 2)
            if mark.verdict != "quiet":
                yield from self._between(a, mark, depth - 1)
                yield from self._between(mark, b, depth - 1)

    def _near(self, a: _Mark, b: _Mark) -> bool:
        """True if the cubic through both ends, and by what it may be off, leads to an exchange."""
        first, last = self.lead(a.value), self.lead(b.value)
        if first is None or last is None:
            return False
        way = b.value - a.value
        da, db = way * first[1], way * last[1]
        cubic = hermite_cubic(first[0], da, last[0], db)
        lead = np.polyval(cubic[::-1], np.linspace(0.0, 1.0, 17))
        sign = 1.0 if a.verdict == "flutter" else -1.0
        return bool((sign * lead).min() <= abs(last[0] - first[0] - (da + db) / 2))

    def _exchange(self, a: _Mark, b: _Mark) -> tuple[float, float]:
        """Where the verdict of b begins, and half the interval that holds it: by bisection, and by
        regula falsi (Illinois) once the same roots grow at both ends."""
        last, width, f, g = b.verdict, b.value - a.value, 1.0, 1.0
        a, b = self._at(a.value), self._at(b.value)
        p, moved = b.value, 0
        for k in range(120):
            low, high = a.value, b.value
            numbers = [(mark.growth.pairs, mark.growth.reals) for mark in (a, b)]
            level = numbers[0] == numbers[1] and a.verdict != b.verdict
            # a few halvings before a meeting of two roots is looked for
            if k == 8 and not level and (met := self.meeting(low, high)) is not None:
                return met
            if high - low <= 4 * np.spacing(max(abs(low), abs(high))):
                break
            x, y = f * a.ahead, g * b.ahead
            p = low - x * (high - low) / (y - x) if level and x != y else (low + high) / 2
            p = min(max(p, low), high)
            mark = self._at(p)
            if p in (low, high) or (level and mark.ahead == 0.0):
                break
            if mark.verdict == last:
                f, g, b = (f / 2 if moved > 0 and level else 1.0), 1.0, mark
            else:
                f, g, a = 1.0, (g / 2 if moved < 0 and level else 1.0), mark
            moved = 1 if mark.verdict == last else -1
        if not level:
            return (low + high) / 2, 1e-7 * width
        at = self.lead(p)
        half = at[2] / abs(at[1]) if at is not None and at[1] else np.inf
        return p, min(half, 1e-7 * width) + 1e-12 * abs(p)


def _only(kinds: frozenset[str], other: str) -> str:
    return next(iter(kinds)) if len(kinds) == 1 else other


# All thresholds


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
    system: System,
    mu_max: float,
    breakpoints: Iterable[float] = (),
    mu_min: float = 0.0,
    options: ContinuationOptions | None = None,
    counter: Counter | None = None,
) -> Thresholds:
    """All thresholds of system(mu) -> (M, C, K) for mu_min <= mu <= mu_max, sorted.

    A point at mu_min means that the system is quiet there and grows at once above it. A window of
    growth gives two points; one that opens and closes between two values that are looked at is
    predicted from how the roots are coupled there, to second order.

    Parameters
    ----------
    system : System
        Smooth between the `breakpoints`.
    mu_max, mu_min : float
        The range.
    breakpoints : iterable of float
        Values of mu where the system may jump, at a change of contact for instance; it is asked
        for values next to them, never at them.
    options : ContinuationOptions
        Steps, budget and tolerances.
    counter : callable
        (continuation, p) -> how many roots grow at p: the second count of a certificate. The sign
        function of the matrix if none is given.

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
    check_system(system, "thresholds")
    check_range("thresholds", mu_min, mu_max)
    inner = sorted({float(b) for b in breakpoints if mu_min < b < mu_max})
    try:
        return _along(system, mu_min, inner, mu_max, options, counter)
    except LightMassError:
        return _along(Slow(system, mu_min), mu_min, inner, mu_max, options, counter)


def crossings(
    system: System, mu_max: float, breakpoints: Iterable[float] = (), mu_min: float = 0.0
) -> list[Crossing]:
    """All crossings of the imaginary axis by any pair or real root, as `thresholds` finds them.

    Unlike the changes of verdict they list what happens while other modes grow. A pair without
    damping crosses where two frequencies coalesce or part. Divergent roots that join to a growing
    pair, or come from one, cross nothing.
    """
    return thresholds(system, mu_max, breakpoints, mu_min).crossings


def _along(
    system: System,
    mu_min: float,
    inner: Sequence[float],
    mu_max: float,
    options: ContinuationOptions | None,
    counter: Counter | None,
) -> Thresholds:
    points: list[CriticalPoint] = []
    crossed: list[Crossing] = []
    searched: list[Searched] = []
    edges = [mu_min, *inner, mu_max]
    for a, b in itertools.pairwise(edges):
        low = float(np.nextafter(a, b)) if a in inner else a
        high = float(np.nextafter(b, a)) if b in inner else b
        part = search(system, low, high, options, counter)
        if searched:
            point, rows = _jump(a, searched[-1], part)
            points += point
            crossed += rows
        changes = list(_changes(part))
        points += [_point(part, c) for c in changes]
        crossed += _crossings(part, {c.place: c for c in changes})
        searched.append(part)
    answers = [part.certified for part in searched]
    certified = None if None in answers else all(answers)
    return Thresholds(points, crossed, certified, tuple(searched))


# Changes of verdict


def _changes(part: Searched) -> Iterator[VerdictChange]:
    """Changes of verdict; an exchange at a place of crossings belongs to that."""
    line = part.line
    places = [
        Place(p[0].value, *(frozenset(c.kind for c in p if c.direction == way) for way in (1, -1)))
        for p in part.places
    ]
    verdicts = Verdicts(
        lambda p: growth_at(line, p), lambda p: _lead(line, p), lambda a, b: _meeting(line, a, b)
    )
    edges = [line.low, *(p.value for p in places), line.high]
    values = [s.value for s in line.states]
    near = 4 * line.options.same * (line.high - line.low)
    for change in verdicts.changes(edges, [s.growth for s in part.stretches], places, values):
        at = [
            replace(change, value=p.value, place=k)
            for k, p in enumerate(places)
            if abs(p.value - change.value) <= near
            and (change.below, change.above) in itertools.product(p.ends, p.begins)
        ]
        yield at[0] if at and change.place is None else change


def _lead(line: Continuation, p: float) -> tuple[float, float, float]:
    """By how much the fastest pair outgrows the fastest real root at p (1/s), the slope of that and
    its rounding; a root of which there is none grows by 0."""
    state = line.at(p)
    z, (some, pairs) = line.exponents(state.roots), growing(line, p)
    with np.errstate(all="ignore"):  # d lambda / dz
        turn = -0.5 / z if line.form == "undamped" else z / state.roots
    slopes, rounding = turn * state.slopes, np.abs(turn) * state.rounding
    rates = []
    for own in (some & pairs, some & ~pairs):
        k = int(np.argmax(np.where(own, np.abs(z.real), -np.inf)))
        rate = np.array([abs(z[k].real), np.sign(z[k].real) * slopes[k].real, rounding[k]])
        rates.append(rate if own[k] else np.zeros(3))
    value, slope, _ = rates[0] - rates[1]
    return float(value), float(slope), float(rates[0][2] + rates[1][2])


def _meeting(line: Continuation, low: float, high: float) -> tuple[float, float] | None:
    """Where a growing pair meets on the real axis, from the side on which it is one."""
    sides = [p for p in (low, high) if growth_at(line, p).verdict == "flutter"]
    if line.form != "damped" or not sides:
        return None
    state = line.at(sides[0])
    z = state.roots
    k = int(np.argmax(np.where(~state.real, z.real, -np.inf)))
    both = [k, int(np.argmin(np.abs(z - z[k].conj())))]
    vectors = state.right[:, both], state.left[:, both]
    event = located(line, Guess((low + high) / 2, complex(z[k].real), *vectors, True, high - low))
    if event is None or not low - event.width <= event.value <= high + event.width:
        return None
    met = line.at(float(np.clip(event.value, low, high)))
    k = int(np.argmax(met.roots.real))
    if abs(met.roots[k].imag) > 2 * met.rounding[k]:  # one that meets while another pair leads
        return None
    return event.value, event.width / 2


def _point(part: Searched, change: VerdictChange) -> CriticalPoint:
    line, at = part.line, () if change.place is None else part.places[change.place]
    grows = change.above in GROWING
    concerned = change.above if grows else change.below
    lead = _leads(line, at, change)[concerned]
    interval = _interval(at) or (change.value - change.half, change.value + change.half)
    side = change.value if change.place is None else _beside(line, interval, grows)
    growth = growth_at(line, change.value)
    # without a place a pair and a real root grow alike, or a pair is about to be two real roots
    alike = abs(growth.pair_rate - growth.real_rate) <= 1e-6 * growth.real_rate
    omega = 0.0
    if lead is not None:
        omega = lead.omega
    elif concerned == "flutter" and (change.place is not None or alike):
        omega = next(iter(growing_pairs(line, side)), 0.0)
    tight = interval[1] - interval[0] <= line.options.same * max(abs(change.value), 1e-300)
    settled = all(c.converged for c in at) and (tight or not at)
    kind = change.above if grows else "restabilised"
    hertz = omega / (2 * math.pi)
    residual = None if lead is None else _residual(lead)
    return CriticalPoint(float(change.value), kind, hertz, interval, settled, residual)


def _leads(
    line: Continuation, at: Sequence[Event], change: VerdictChange
) -> dict[str, Event | None]:
    """The fastest of the events at a place that begin what grows above or end what grew below, if
    there are such."""
    leads = {}
    for kind, way in ((change.below, -1), (change.above, 1)):
        alike = [c for c in at if c.kind == kind and c.direction == way]
        leads[kind] = next(iter(fastest_first(line, alike)), None)
    return leads


def _interval(at: Sequence[Event]) -> tuple[float, float] | None:
    if not at:
        return None
    return float(min(c.interval[0] for c in at)), float(max(c.interval[1] for c in at))


def _residual(one: Event) -> float | None:
    return one.residual if math.isfinite(one.residual) else None


def _beside(line: Continuation, interval: tuple[float, float], above: bool) -> float:
    """The nearest value looked at on one side of an interval."""
    low, high = interval
    values = [s.value for s in line.states]
    beside = [v for v in values if (v > high if above else v < low)]
    return min(beside or values, key=lambda v: abs(v - (low + high) / 2))


# Crossings


def _crossings(part: Searched, changes: Mapping[int | None, VerdictChange]) -> Iterator[Crossing]:
    for k, place in enumerate(part.places):
        change = changes.get(k)
        leads = tuple(_leads(part.line, place, change).values()) if change else ()
        for c in place:
            changing = change is not None and (c in leads or not any(leads))
            yield c.crossing(_mode(part.line, c), changing, _residual(c))


def _jump(
    at: float, before: Searched, after: Searched
) -> tuple[list[CriticalPoint], list[Crossing]]:
    """What changes at a breakpoint, of which only the numbers on both sides are known."""
    sides = (before.line, before.line.high), (after.line, after.line.low)
    below, above = (growth_at(*side).verdict for side in sides)
    points = []
    if below != above:
        grows = above in GROWING
        omegas = growing_pairs(*sides[grows]) if (above if grows else below) == "flutter" else []
        hertz = next(iter(omegas), 0.0) / (2 * math.pi)
        points = [CriticalPoint(at, above if grows else "restabilised", hertz, (at, at), True)]
    crossed = []
    for omega, way in difference(*sides):
        mode = _number(*sides[way > 0], omega, 1e-6)
        crossed.append(Event(at, omega, way, (at, at)).crossing(mode, below != above, None))
    return points, crossed


def _mode(line: Continuation, c: Event) -> int:
    """Number of the mode by rising frequency, from 1; of a coalescing pair the first."""
    gap = 1e-6
    if c.coalesces:  # its two members lie on both sides: the closest one below belongs to it
        omega = _frequencies(line, c.value)
        apart = np.sort(np.abs(omega / (c.omega or 1.0) - 1.0))
        gap = max(gap, float(apart[1]) * (1 + 1e-9))
    return _number(line, c.value, c.omega, gap)


def _number(line: Continuation, p: float, omega: float, gap: float) -> int:
    slower = int(np.sum(_frequencies(line, p) < omega * (1 - gap)))
    return 1 + (slower if line.form == "undamped" else slower // 2)


def _frequencies(line: Continuation, p: float) -> np.ndarray:
    return np.array([line.omega(complex(z)) for z in line.at(p).roots])
