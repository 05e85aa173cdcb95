"""Where the verdict changes: at events that begin or end all growth, and where the faster growth
passes from a pair to a real root or back, whatever crosses the axis meanwhile."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from squeal.linear.continuation import hermite_cubic
from squeal.linear.events import hertz_of
from squeal.linear.verdict import UnstableCount

TIGHT = 1e-9  # of mu: an interval shorter than this has converged

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
        found: list[VerdictChange] = []
        before: _Mark | None = None
        for k, growth in enumerate(stretches):
            for n, mark in enumerate(self._marks(edges[k], edges[k + 1], growth, values)):
                if before is not None:
                    place = places[k - 1] if k and not n else None
                    found += self._between_marks(before, mark, place, k - 1)
                before = mark
        return found

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
            level = a.growth.numbers == b.growth.numbers and a.verdict != b.verdict
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
