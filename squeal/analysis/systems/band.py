"""Crossings in a band: their mode numbers, the verdicts between them, and roots that leave it."""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from squeal.linear import CriticalPoint, Crossing
from squeal.linear.changes import TIGHT, Place, VerdictChange, Verdicts
from squeal.linear.eigen import ComplexArray
from squeal.linear.verdict import GROWING, UnstableCount, unstable_count
from squeal.numerics.grouping import together

BESIDE = 1e-6  # of the range: next to a crossing the verdict may be that of either side
SAME = 1e-9  # of the range: crossings closer than this are at one place
WAYS = ("up", "down")


@dataclass
class BandRates:
    """What grows among the roots of a band, by more than `noise` |lambda|; `roots` gives them."""

    roots: Callable[[float], ComplexArray]
    noise: float
    _known: dict[float, UnstableCount] = field(default_factory=dict)

    def growth(self, p: float) -> UnstableCount:
        """What grows at p, of pairs the upper roots."""
        if p not in self._known:
            z = self.roots(p)
            self._known[p] = unstable_count(z, self.noise * np.abs(z))
        return self._known[p]

    @property
    def known(self) -> list[float]:
        """Values that were looked at, rising."""
        return sorted(self._known)


@dataclass(frozen=True)
class Placed:
    """Crossings with modes and verdicts, changes of verdict, and values between the crossings.

    `unexplained` are values at which what grows follows from no crossing, by stretches between
    crossings `left` values by which a root that grows has left the band, and one before.
    """

    crossings: tuple[Crossing, ...]
    points: tuple[CriticalPoint, ...]
    between: tuple[float, ...]
    unexplained: tuple[float, ...]
    left: tuple[tuple[float, float], ...]


def placed(rates: BandRates, rows: Sequence[Crossing], values: Sequence[float]) -> Placed:
    """Crossings of a band by rising value; `values` from the first to the last are looked at."""
    low, high = values[0], values[-1]
    groups = together(rows, SAME * (high - low), lambda c: c.mu)
    margin = BESIDE * (high - low)
    beyond = bool(groups) and high - groups[-1][-1].mu <= margin  # what follows is seen there
    edges = [low, *(group[0].mu for group in groups), high + 2 * margin * beyond]
    inside = [v for v in values if all(abs(v - c.mu) > margin for c in rows)]
    between = [(a + b) / 2 for a, b in itertools.pairwise(edges)]
    number, stretches, first = rates.growth(between[0]).roots, [], []
    for k, (a, b) in enumerate(itertools.pairwise(edges)):
        number += sum(map(_net, groups[k - 1])) if k else 0
        tried = [between[k], *(v for v in inside if a < v < b), a + margin, b - margin]
        agrees = (v for v in tried if a < v < b and rates.growth(v).roots == number)
        first.append(next(agrees, between[k]))
        stretches.append(rates.growth(first[k]))
    places = [Place(group[0].mu, *_kinds(group)) for group in groups]
    changes = Verdicts(rates.growth).changes(edges, stretches, places, rates.known)
    unexplained: list[float] = []
    left: dict[int, tuple[float, float]] = {}
    for v in sorted({*inside, *between}):
        k = sum(group[0].mu < v for group in groups)
        seen = rates.growth(v)
        if seen.roots < stretches[k].roots and seen.verdict != stretches[k].verdict:
            left.setdefault(k, (first[k], v))
        elif seen.roots > stretches[k].roots and seen.verdict != stretches[k].verdict:
            unexplained.append(v)
    return Placed(
        tuple(
            replace(
                c,
                mode=_mode(rates.roots(c.mu), c),
                changes_verdict=any(x.place == k and c in _leads(group, x) for x in changes),
            )
            for k, group in enumerate(groups)
            for c in group
        ),
        tuple(_point(rates, change, groups) for change in changes),
        tuple(between),
        tuple(unexplained),
        tuple(left.values()),
    )


def _leads(group: Sequence[Crossing], change: VerdictChange) -> list[Crossing]:
    """The crossings at a place that begin what grows above or end what grew below; of several that
    do the fastest, which stands first."""
    found = []
    for alike in ((change.above, "up"), (change.below, "down")):
        leading = [c for c in group if (c.kind, c.direction) == alike]
        found += sorted(leading, key=lambda c: not c.changes_verdict)[:1]
    return found or list(group)


def _net(c: Crossing) -> int:
    return (1 if c.direction == "up" else -1) * (2 if c.kind == "flutter" else 1)


def _kinds(group: Sequence[Crossing]) -> tuple[frozenset[str], frozenset[str]]:
    """What begins and what ends at a place."""
    begins, ends = (frozenset(c.kind for c in group if c.direction == way) for way in WAYS)
    return begins, ends


def _mode(at: ComplexArray, c: Crossing) -> int:
    omega = 2 * math.pi * c.frequency_hz
    return 1 + int(np.sum((at.imag > 0) & (at.imag < omega * (1 - 1e-6))))


def _point(
    rates: BandRates, change: VerdictChange, groups: Sequence[Sequence[Crossing]]
) -> CriticalPoint:
    """A change of verdict at a crossing, or where growth changes hands, with the pair's frequency
    there."""
    kind = change.above if change.above in GROWING else "restabilised"
    if change.place is not None:
        c = _leads(groups[change.place], change)[0]
        tight = c.interval[1] - c.interval[0] <= TIGHT * abs(c.mu)
        return CriticalPoint(c.mu, kind, c.frequency_hz, c.interval, tight, c.residual)
    hertz = 0.0
    if kind == "flutter":
        at = rates.roots(change.value)
        pairs = at.imag > rates.noise * np.abs(at)
        fastest = at[np.argmax(np.where(pairs, at.real, -np.inf))]
        hertz = float(abs(fastest.imag)) / (2 * math.pi)
    interval = (change.value - change.half, change.value + change.half)
    return CriticalPoint(change.value, kind, hertz, interval, True)
