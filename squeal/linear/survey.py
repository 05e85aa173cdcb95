"""Where anything may happen along a family of systems, and what grows between these places.

What grows is asked for between neighbouring places, far from both, and never decides where a
threshold lies. What no function announced (an exchange of growth rates, two crossings at once) is
noticed at the points that were sampled, and bisected.
"""

import itertools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.linear.cubic import Value
from squeal.linear.family import Family
from squeal.linear.roots import Root, sign_changes
from squeal.linear.searches import Search, coalescing, searches
from squeal.linear.system import System

MERGE = 1e-12  # of the range: candidates closer than this are one place


@dataclass(frozen=True)
class Candidate:
    """A root of a function that may announce a threshold; `search` is None if there is none."""

    root: Root
    search: Search | None = None
    jump: bool = False


class State(NamedTuple):
    """How many pairs and real modes grow, and what grows fastest (or quiet)."""

    pairs: int
    reals: int
    verdict: str


@dataclass(frozen=True)
class Change:
    """A place where what grows changes: mu, the candidates there, what grows below and above."""

    mu: float
    candidates: list[Candidate]
    below: State
    above: State


class Survey:
    """A range of mu, searched: `changes` are all places where what grows changes.

    Raises UnsuitedError for a system that its family is not for, InputError for an empty range.
    """

    def __init__(
        self, system: System, mu_max: float, breakpoints: Iterable[float], mu_min: float
    ) -> None:
        self.family = Family(system)
        self.low, self.high = mu_min, mu_max
        inner = sorted({float(b) for b in breakpoints if mu_min < b < mu_max})
        self.points: set[float] = {mu_min}
        found = [Candidate(Root(b, (b, b), True), jump=True) for b in inner]
        for low, high in itertools.pairwise([mu_min, *inner, mu_max]):
            start = low if low == mu_min else float(np.nextafter(low, high))
            stop = high if high == mu_max else float(np.nextafter(high, low))
            found += self._searched(start, stop)
        self._places = self._merged(found)
        self._places = self._merged(found + list(self._unannounced()))

    def _searched(self, low: float, high: float) -> Iterator[Candidate]:
        found = []
        for search in searches(self.family, low, high):
            roots, sampled = sign_changes(
                search.function, search.low, search.high, self.family.prepare
            )
            self.points.update(sampled)
            found += [Candidate(root, search) for root in roots]
        yield from found

        # between those places no mode changes its kind, but the faster growth may change hands
        def difference(mu: float) -> Value:
            pair, real = self.family.rates(mu)
            return Value(pair - real, 0.0)

        for a, b in itertools.pairwise([low, *sorted(c.root.mu for c in found), high]):
            margin = 1e-9 * (b - a)
            if margin > 0 and min(self.family.rates((a + b) / 2)) > 0:
                roots, sampled = sign_changes(
                    difference, a + margin, b - margin, self.family.prepare
                )
                self.points.update(sampled)
                yield from (Candidate(root) for root in roots)

    def _merged(self, candidates: list[Candidate]) -> list[list[Candidate]]:
        """Candidates by place, sorted; a breakpoint wins over roots next to it."""
        width = MERGE * (self.high - self.low)
        places: list[list[Candidate]] = []
        for candidate in sorted(candidates, key=lambda c: c.root.mu):
            if not places or candidate.root.mu - places[-1][-1].root.mu > width:
                places.append([candidate])
            elif candidate.jump:
                places[-1] = [candidate]
            elif not places[-1][0].jump:
                places[-1].append(candidate)
        return places

    def state(self, mu: float) -> State:
        """What grows at mu, by more than rounding."""
        found = self.family.growth(mu)
        return State(found.pairs, found.reals, self.family.verdict(mu))

    def _middles(self) -> list[float]:
        """A value of mu below, between and above the places, far from them."""
        at = [place[0].root.mu for place in self._places]
        found = [(a + b) / 2 for a, b in itertools.pairwise([self.low, *at, self.high])]
        if at and self.high - at[-1] <= 1e-9 * (self.high - self.low):
            beyond = self.high + 1e-6 * (self.high - self.low)
            try:
                self.family.growth(beyond)
                found[-1] = beyond
            except (InputError, ComputationError, ValueError, ArithmeticError):
                pass
        return found

    def _unannounced(self) -> Iterator[Candidate]:
        """Changes between the places, seen at sampled points that differ from their middle."""
        at = np.array([-np.inf, *(place[0].root.mu for place in self._places), np.inf])
        middles = self._middles()
        sampled: dict[int, list[float]] = {}
        for mu in sorted(self.points):
            if np.abs(at - mu).min() > 1e-9 * (self.high - self.low):
                sampled.setdefault(int(np.searchsorted(at, mu)) - 1, []).append(mu)
        for place, (a, b) in zip(self._places, itertools.pairwise(middles), strict=True):
            before, after = self.state(a), self.state(b)
            size = abs(after.pairs - before.pairs) + abs(after.reals - before.reals)
            if size > len(place) and not place[0].jump:
                several = self._together(a, b)
                yield from several if len(several) > 1 else []
        for k, points in sampled.items():
            middle = middles[k]
            row = [(mu, self.state(mu)) for mu in (middle, *points)]
            if len({state for _, state in row}) > 1:
                row = [one for one in row if not self._hidden(k, one[0])]
            for (a, before), (b, after) in itertools.pairwise(sorted(row)):
                if before != after:
                    yield self._bisected(a, b, before)

    def _hidden(self, k: int, mu: float) -> bool:
        """True if rounding hides, up to mu, what changes at a place beside gap k."""
        beside = itertools.chain(*self._places[max(k - 1, 0) : k + 1])
        spans = (c.search.interval(c.root) for c in beside if c.search)
        return any(low <= mu <= high for low, high in spans)

    def _together(self, low: float, high: float) -> list[Candidate]:
        """Several changes that were taken for one, each by itself; one alone if they are."""
        below, above = self.state(low), self.state(high)
        size = abs(above.pairs - below.pairs) + abs(above.reals - below.reals)
        if below == above:
            return []
        if size <= 1 or high - low <= 1e-9 * max(abs(low), abs(high)):
            return [self._bisected(low, high, below)]
        middle = (low + high) / 2
        return self._together(low, middle) + self._together(middle, high)

    def _bisected(self, low: float, high: float, before: State) -> Candidate:
        while high - low > 4 * np.spacing(max(abs(low), abs(high))):
            middle = (low + high) / 2
            if self.state(middle) == before:
                low = middle
            else:
                high = middle
        mu = (low + high) / 2
        return Candidate(Root(mu, (low, high), high - low <= 1e-12 * max(abs(low), abs(high))))

    def changes(self) -> Iterator[Change]:
        """Places where what grows changes, by rising mu."""
        states = [self.state(mu) for mu in self._middles()]
        for place, (below, above) in zip(self._places, itertools.pairwise(states), strict=True):
            if below != above:
                yield Change(place[0].root.mu, place, below, above)

    def frequency(self, change: Change, kind: str, above: bool) -> float:
        """Angular frequency (rad/s) of what starts or ceases there.

        `above` tells on which side of the place it grows.
        """
        if kind == "divergence":
            return 0.0
        meets = any(c.search and c.search.source == "coalescence" for c in change.candidates)
        same = change.below.pairs == change.above.pairs
        if not meets and (same or change.candidates[0].jump):
            return self.family.growing_frequency(change.mu, kind, above) * 2 * math.pi
        return coalescing(self.family.roots(change.mu))
