"""Where the verdict changes: at crossings that begin or end all growth, and where the faster growth
passes from a pair to a real root or back, whatever crosses the axis meanwhile."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from squeal.linear.cubic import Value
from squeal.linear.following.steps import hermite_cubic
from squeal.linear.growth import Growth
from squeal.linear.roots import refine

HIDDEN = 1e-7  # of a step: how far rounding may shift what bisection finds
HALVINGS = 5  # of a step in which growth may change hands twice
COARSE = 8  # halvings before a meeting of two roots is looked for
ASIDE = 0.4837  # of a step: where it is divided
STEPS = 120  # of a bisection


@dataclass(frozen=True)
class Lead:
    """By how much the fastest pair outgrows the fastest real root (1/s), its derivative, error."""

    value: float
    slope: float
    noise: float


class Rates(Protocol):
    """What the verdict follows from along a parameter."""

    def growth(self, p: float) -> Growth:
        """What grows at p."""

    def lead(self, p: float) -> Lead | None:
        """Who leads at p, None if the derivative is not known or not worth it any more."""

    def meeting(self, low: float, high: float) -> tuple[float, float] | None:
        """Value, and half its interval, at which a growing pair meets on the real axis; None if
        that is not known."""


@dataclass(frozen=True)
class Place:
    """A place of crossings: its value, and what begins and ends there."""

    value: float
    begins: frozenset[str]
    ends: frozenset[str]


@dataclass(frozen=True)
class Mark:
    """A value at which the verdict is known."""

    value: float
    growth: Growth
    verdict: str


@dataclass(frozen=True)
class VerdictChange:
    """The verdict changes at `value`: at the place of that index, or at none."""

    value: float
    half: float
    below: str
    above: str
    place: int | None


def marks_of(
    rates: Rates, edges: Sequence[float], stretches: Sequence[Growth], values: Sequence[float]
) -> list[list[Mark]]:
    """For each stretch between neighbouring edges, in which `stretches` grows, marks at those of
    the rising values where as many roots grow as in the whole stretch; one mark at least."""
    found = []
    for low, high, growth in zip(edges, edges[1:], stretches, strict=False):
        own = [(v, rates.growth(v)) for v in values if low <= v <= high and growth.roots]
        marks = [Mark(v, g, g.verdict) for v, g in own if g.roots == growth.roots]
        found.append(marks or [Mark((low + high) / 2, growth, growth.verdict)])
    return found


def verdict_changes(
    rates: Rates, places: Sequence[Place], marks: Sequence[Sequence[Mark]]
) -> Iterator[VerdictChange]:
    """All changes of verdict by rising value: `marks` of the stretches around the places.

    Next to rest the verdict is that of what crosses. Everywhere else it changes only where the
    faster growth changes hands.
    """
    before = marks[0][0]
    for k, row in enumerate(marks):
        for mark in row:
            quiet = "quiet" in (before.verdict, mark.verdict)
            if k and mark is row[0] and quiet:
                place = places[k - 1]
                start = Mark(place.value, mark.growth, _only(place.begins, mark.verdict))
                end = Mark(place.value, before.growth, _only(place.ends, before.verdict))
                if before.verdict != "quiet":
                    yield from _between(rates, before, end, HALVINGS)
                    yield VerdictChange(place.value, 0.0, end.verdict, mark.verdict, k - 1)
                elif mark.verdict != "quiet":
                    yield VerdictChange(place.value, 0.0, "quiet", start.verdict, k - 1)
                    yield from _between(rates, start, mark, HALVINGS)
            elif mark is not before and not quiet:
                yield from _between(rates, before, mark, HALVINGS)
            before = mark


def _only(kinds: frozenset[str], other: str) -> str:
    return next(iter(kinds)) if len(kinds) == 1 else other


def _between(rates: Rates, a: Mark, b: Mark, depth: int) -> Iterator[VerdictChange]:
    """Where growth changes hands between two marks."""
    if not b.value > a.value:
        return
    if a.verdict != b.verdict:
        value, half = _exchange(rates, a, b)
        yield VerdictChange(value, half, a.verdict, b.verdict, None)
        return
    both = (a.growth, b.growth)
    if depth and any(g.pairs for g in both) and any(g.reals for g in both) and _near(rates, a, b):
        middle = a.value + ASIDE * (b.value - a.value)
        growth = rates.growth(middle)
        if growth.verdict != "quiet":
            mark = Mark(middle, growth, growth.verdict)
            yield from _between(rates, a, mark, depth - 1)
            yield from _between(rates, mark, b, depth - 1)


def _near(rates: Rates, a: Mark, b: Mark) -> bool:
    """True if the cubic through both ends, and by what it may be off, leads to an exchange."""
    first, last = rates.lead(a.value), rates.lead(b.value)
    if first is None or last is None:
        return False
    da, db = (b.value - a.value) * first.slope, (b.value - a.value) * last.slope
    cubic = hermite_cubic(first.value, da, last.value, db)
    way = np.polyval(cubic[::-1], np.linspace(0.0, 1.0, 17))
    sign = 1.0 if a.verdict == "flutter" else -1.0
    return bool((sign * way).min() <= abs(last.value - first.value - (da + db) / 2))


def _exchange(rates: Rates, a: Mark, b: Mark) -> tuple[float, float]:
    """Where the verdict of b begins, and half the interval that holds it."""
    low, high, width = a.value, b.value, b.value - a.value
    for k in range(STEPS):
        x, y = rates.growth(low), rates.growth(high)
        if x.numbers == y.numbers and (x.verdict, y.verdict) == (a.verdict, b.verdict):

            def lead(p: float) -> Value:
                growth = rates.growth(p)
                return Value(growth.pair_rate - growth.real_rate, 0.0)

            value = refine(lead, low, high, lead(low).value, lead(high).value).mu
            at = rates.lead(value)
            error = at.noise / abs(at.slope) if at is not None and at.slope else HIDDEN * width
            return value, min(error, HIDDEN * width) + 1e-12 * abs(value)
        if k == COARSE and (met := rates.meeting(low, high)) is not None:
            return met
        if high - low <= 4 * np.spacing(max(abs(low), abs(high))):
            break
        middle = (low + high) / 2
        if rates.growth(middle).verdict == b.verdict:
            high = middle
        else:
            low = middle
    return (low + high) / 2, HIDDEN * width
