"""Where the verdict changes: at events that begin or end all growth, and where the faster growth
passes from a pair to a real root or back, whatever crosses the axis meanwhile."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from squeal.linear.continuation import hermite_cubic
from squeal.linear.events import ASIDE
from squeal.linear.verdict import UnstableCount

HALVINGS = 5  # of a step in which growth may change hands twice
COARSE = 8  # halvings before a meeting of two roots is looked for

Count = Callable[[float], UnstableCount]
"""p -> what grows at p."""
Lead = Callable[[float], tuple[float, float, float] | None]
"""p -> by how much the fastest pair outgrows the fastest real root (1/s), slope and rounding."""
Meeting = Callable[[float, float], tuple[float, float] | None]
"""(low, high) -> where a growing pair meets on the real axis, and half its interval."""


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


@dataclass(frozen=True)
class _Mark:
    value: float
    growth: UnstableCount
    verdict: str


def _unknown(*_: float) -> None:
    return None


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
    lead: Lead = _unknown
    meeting: Meeting = _unknown

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
        return list(self._changes(places, list(self._marks(edges, stretches, values))))

    def _marks(
        self, edges: Sequence[float], stretches: Sequence[UnstableCount], values: Sequence[float]
    ) -> Iterator[list[_Mark]]:
        """For each stretch marks at those values where as many roots grow as in all of it."""
        for low, high, growth in zip(edges, edges[1:], stretches, strict=False):
            own = [(v, self.count(v)) for v in values if low <= v <= high and growth.roots]
            marks = [_Mark(v, g, g.verdict) for v, g in own if g.roots == growth.roots]
            yield marks or [_Mark((low + high) / 2, growth, growth.verdict)]

    def _changes(
        self, places: Sequence[Place], marks: Sequence[Sequence[_Mark]]
    ) -> Iterator[VerdictChange]:
        before = marks[0][0]
        for k, row in enumerate(marks):
            for mark in row:
                quiet = "quiet" in (before.verdict, mark.verdict)
                if k and mark is row[0] and quiet:
                    place = places[k - 1]
                    start = _Mark(place.value, mark.growth, _only(place.begins, mark.verdict))
                    end = _Mark(place.value, before.growth, _only(place.ends, before.verdict))
                    if before.verdict != "quiet":
                        yield from self._between(before, end, HALVINGS)
                        yield VerdictChange(place.value, 0.0, end.verdict, mark.verdict, k - 1)
                    elif mark.verdict != "quiet":
                        yield VerdictChange(place.value, 0.0, "quiet", start.verdict, k - 1)
                        yield from self._between(start, mark, HALVINGS)
                elif mark is not before and not quiet:
                    yield from self._between(before, mark, HALVINGS)
                before = mark

    def _between(self, a: _Mark, b: _Mark, depth: int) -> Iterator[VerdictChange]:
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
            middle = a.value + ASIDE * (b.value - a.value)
            growth = self.count(middle)
            if growth.verdict != "quiet":
                mark = _Mark(middle, growth, growth.verdict)
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
        """Where the verdict of b begins, and half the interval that holds it."""
        low, high, width = a.value, b.value, b.value - a.value
        for k in range(120):
            x, y = self.count(low), self.count(high)
            if x.numbers == y.numbers and (x.verdict, y.verdict) == (a.verdict, b.verdict):
                value, half = self._level(low, high)
                return value, min(half, 1e-7 * width) + 1e-12 * abs(value)
            if k == COARSE and (met := self.meeting(low, high)) is not None:
                return met
            if high - low <= 4 * np.spacing(max(abs(low), abs(high))):
                break
            middle = (low + high) / 2
            if self.count(middle).verdict == b.verdict:
                high = middle
            else:
                low = middle
        return (low + high) / 2, 1e-7 * width

    def _level(self, low: float, high: float) -> tuple[float, float]:
        """Where a pair and a real root grow alike (regula falsi, Illinois), and the rounding."""

        def lead(p: float) -> float:
            growth = self.count(p)
            return growth.pair_rate - growth.real_rate

        f, g, p = lead(low), lead(high), low
        for _ in range(100):
            if high - low <= 4 * np.spacing(max(abs(low), abs(high))) or f == g:
                break
            p = min(max(low - f * (high - low) / (g - f), low), high)
            at = lead(p)
            if at == 0.0 or p in (low, high):
                break
            if (at > 0) == (f > 0):
                low, f, g = p, at, g / 2 if (g > 0) != (at > 0) else g
            else:
                high, g, f = p, at, f / 2
        at_level = self.lead(p)
        exact = at_level is not None and at_level[1]
        return p, at_level[2] / abs(at_level[1]) if exact and at_level else np.inf


def _only(kinds: frozenset[str], other: str) -> str:
    return next(iter(kinds)) if len(kinds) == 1 else other
