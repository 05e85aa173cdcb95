"""Thresholds of a system in its parameter: all of a small one, those of a band of a large one."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from squeal.analysis.systems.roots import (
    Wanted,
    is_small,
    noise_of,
    reduced_for,
    roots_of_all,
    verdict_of,
)
from squeal.errors import ComputationError, InputError
from squeal.linear import CriticalPoint, Crossing, thresholds
from squeal.linear.continuation import ContinuationOptions
from squeal.linear.eigen import GROWING, ComplexArray, UnstableCount, unstable_count
from squeal.linear.events import Event
from squeal.linear.matrices import ILL, dense, unit_diagonal
from squeal.linear.search import fastest_first, search, together
from squeal.linear.system import TermSystem
from squeal.linear.thresholds import VerdictChange, Verdicts
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.crossings import crossings_along
from squeal.sparse.eigensolver import OPTIONS, modes_in
from squeal.sparse.quadratic import Progress, quiet
from squeal.sparse.reduction import Reduction

STEPS = 13  # values at which a reduced system has to be good
COUNTED_ROWS = 20_000  # larger systems are not counted again between their thresholds


@dataclass(frozen=True)
class SystemThresholds:
    """Every change of verdict and every crossing of the axis in low <= p <= high.

    `certified`: between neighbouring crossings a count of growing roots that needs no eigenvalue
    agrees, at one value each, and so do the roots at all values that were looked at; None if it
    was not made. It does not prove that no window lies between these values. `unconfirmed` names
    what the full system did not confirm, `left_out` what leaves the band while it grows. With a
    band the list is of its roots; `crossings_outside` it, None if they are not known.
    """

    low: float
    high: float
    verdict: str  # at the lower end
    points: tuple[CriticalPoint, ...]
    crossings: tuple[Crossing, ...]
    certified: bool | None
    unconfirmed: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    reduction: Reduction | None = field(default=None, repr=False)
    crossings_outside: int | None = None


def system_thresholds(
    system: TermSystem,
    high: float,
    low: float | None = None,
    wanted: Wanted | None = None,
    progress: Progress = quiet,
) -> SystemThresholds:
    """Every threshold of a system in low <= p <= high, of the band if one is wanted.

    Without `low` the range begins at 0, or at high / 1000 where a factor divides by the parameter.
    Raises InputError for an empty range, and for a large system or complex matrices without a band
    or region.
    """
    wanted = wanted or Wanted()
    if not system.real and wanted.rectangle is None:
        raise InputError(
            "band: is missing; thresholds with a structural loss factor (complex matrices) need "
            "a band or a region"
        )
    if low is None:
        try:
            system.derivative(system.parameter, {system.parameter: 0.0})
            system(low := 0.0)
        except InputError:
            low = high / 1000
    if not low < high:
        raise InputError(f"high: {high:g} is not allowed; it must exceed {low:g}")
    if is_small(system) and system.real:
        if wanted.rectangle is None:
            every, start = thresholds(system, high, mu_min=low), {system.parameter: low}
            verdict = verdict_of(roots_of_all(system, wanted, start), noise_of(system))
            lists = tuple(every.points), tuple(every.crossings)
            return SystemThresholds(low, high, verdict, *lists, every.certified)
        if ILL * np.linalg.cond(unit_diagonal(dense(system(low)[0]))) < 1.0:  # M may be inverted
            return _small_band(system, low, high, wanted)
    return _large(system, low, high, wanted, progress)


def _small_band(system: TermSystem, low: float, high: float, wanted: Wanted) -> SystemThresholds:
    """Of all crossings those in a band, and the verdicts on its roots."""
    every, region = thresholds(system, high, mu_min=low), wanted.rectangle
    assert region is not None
    ends = wanted.band or (region.low_imag / (2 * math.pi), region.high_imag / (2 * math.pi))
    rows = [
        c
        for part in every.searched
        for place in part.places
        for way in (1, -1)
        for c in fastest_first(part.line, [c for c in place if c.direction == way])
        if ends[0] <= c.omega / (2 * math.pi) <= ends[1]
    ]
    band = _Band(system, wanted, lambda p: roots_of_all(system, wanted, {system.parameter: p}))
    answer, _ = band.thresholds(rows, (low, high))
    outside = len(every.crossings) - len(rows)
    certified = every.certified and not answer.unconfirmed
    return replace(answer, certified=certified, crossings_outside=outside)


def _large(
    system: TermSystem, low: float, high: float, wanted: Wanted, progress: Progress
) -> SystemThresholds:
    """On a reduced system, each crossing confirmed and growing roots counted on the full one."""
    name = system.parameter
    # inner values that thresholds do not like to lie at
    inner = [(k + 0.0371 * (1 + k % 3)) / (STEPS - 1) for k in range(1, STEPS - 1)]
    values = [low, *(low + x * (high - low) for x in inner), high]
    reduction, region = reduced_for(system, wanted, [{name: v} for v in values], progress=progress)
    progress("following the roots of the reduced system")
    rows: Sequence[Event]
    doubts: list[str] = []
    if system.C or not system.real:
        rows, doubts = crossings_along(reduction, region, name, values)
    else:  # coalescences of the reduced system
        rows = [
            replace(c, residual=reduction.worst)
            for place in search(reduction.system, low, high).places
            for c in place
            if region.low_imag <= c.omega <= region.high_imag
        ]
    band = _Band(system, wanted, lambda p: reduction.values(region, {name: p}))
    answer, between = band.thresholds(rows, values)
    unconfirmed, certified = (*doubts, *answer.unconfirmed), None
    if system.n <= COUNTED_ROWS:
        certified = not unconfirmed and all(
            _counted(reduction, region, p, band.growth(p).roots, progress) for p in between
        )
    return replace(answer, certified=certified, unconfirmed=unconfirmed, reduction=reduction)


def _counted(
    reduction: Reduction, region: Rectangle, value: float, growing: int, progress: Progress
) -> bool:
    """True if as many roots of the full system in the region grow as are expected."""
    name, noise = reduction.system.parameter, noise_of(reduction.system)
    progress(f"counting growing roots at {name} = {value:.6g}")
    problem = reduction.basis.scaled.at({name: value})
    try:
        full = modes_in(problem, region, progress=progress, exact=OPTIONS.accepted)
    except ComputationError:
        return False
    z = full.values
    return full.certified and unstable_count(z, noise * np.abs(z)).roots == growing


class _Band:
    """What grows among the roots of a band, by more than rounding; `roots` gives them."""

    def __init__(
        self, system: TermSystem, wanted: Wanted, roots: Callable[[float], ComplexArray]
    ) -> None:
        self.name, self.wanted, self.roots = system.parameter, wanted, roots
        self.noise = noise_of(system)
        self.known: dict[float, UnstableCount] = {}

    def growth(self, p: float) -> UnstableCount:
        """What grows at p, of pairs the upper roots."""
        if p not in self.known:
            z = self.roots(p)
            self.known[p] = unstable_count(z, self.noise * np.abs(z))
        return self.known[p]

    def thresholds(
        self, rows: Sequence[Event], values: Sequence[float]
    ) -> tuple[SystemThresholds, list[float]]:
        """The answer from crossings by rising value, of one place the fastest first, and values
        between them; `values` from the first to the last are looked at."""
        low, high = values[0], values[-1]
        groups = together(rows, 1e-9 * (high - low))
        margin = 1e-6 * (high - low)  # where the verdict may be that of either side
        beyond = bool(groups) and high - groups[-1][-1].value <= margin  # what follows is seen
        edges = [low, *(group[0].value for group in groups), high + 2 * margin * beyond]
        inside = [v for v in values if all(abs(v - c.value) > margin for c in rows)]
        between = [(a + b) / 2 for a, b in itertools.pairwise(edges)]
        number, stretches, first = self.growth(between[0]).roots, [], []
        for k, (a, b) in enumerate(itertools.pairwise(edges)):
            if k:
                number += sum(c.direction * (2 if c.omega else 1) for c in groups[k - 1])
            tried = [between[k], *(v for v in inside if a < v < b), a + margin, b - margin]
            agrees = (v for v in tried if a < v < b and self.growth(v).roots == number)
            first.append(next(agrees, between[k]))
            stretches.append(self.growth(first[k]))
        seen_at = sorted(self.known)
        changes = list(Verdicts(self.growth).changes(edges, stretches, groups, seen_at))
        unexplained, left = [], dict[int, str]()
        for v in sorted({*inside, *between}):
            k, seen = sum(group[0].value < v for group in groups), self.growth(v)
            if seen.verdict == stretches[k].verdict:
                continue
            if seen.roots > stretches[k].roots:
                unexplained.append(
                    f"{seen.verdict} at {self.name} = {v:.6g} follows from no threshold that was "
                    "located"
                )
            elif seen.roots < stretches[k].roots:
                left.setdefault(k, self._leaving(first[k], v))
        crossings = (
            c.crossing(self._mode(c), any(x.place == k and c in _leads(group, x) for x in changes))
            for k, group in enumerate(groups)
            for c in group
        )
        answer = SystemThresholds(
            low,
            high,
            verdict_of(self.roots(low), self.noise),
            tuple(self._point(change, groups) for change in changes),
            tuple(crossings),
            None,
            tuple(unexplained),
            tuple(left.values()),
        )
        return answer, between

    def _leaving(self, first: float, value: float) -> str:
        region = self.wanted.rectangle
        assert region is not None
        return (
            f"what grows at {self.name} = {first:.6g} leaves {self.wanted.words()} by {self.name} "
            f"= {value:.6g} and is left out there, as are roots that grow by more than "
            f"{region.high_real:.4g} 1/s"
        )

    def _mode(self, c: Event) -> int:
        at = self.roots(c.value).imag
        return 1 + int(np.sum((at > 0) & (at < c.omega * (1 - 1e-6))))

    def _point(self, change: VerdictChange, groups: Sequence[Sequence[Event]]) -> CriticalPoint:
        """A change of verdict at a crossing, or where growth changes hands, with the pair's
        frequency there."""
        kind = change.above if change.above in GROWING else "restabilised"
        if change.place is not None:
            c = _leads(groups[change.place], change)[0]
            tight, hertz = c.width <= ContinuationOptions.same * abs(c.value), c.omega / 2 / math.pi
            return CriticalPoint(c.value, kind, hertz, c.interval, tight, c.residual)
        hertz = 0.0
        if kind == "flutter":
            at = self.roots(change.value)
            pairs = at.imag > self.noise * np.abs(at)
            fastest = at[np.argmax(np.where(pairs, at.real, -np.inf))]
            hertz = float(abs(fastest.imag)) / (2 * math.pi)
        interval = (change.value - change.half, change.value + change.half)
        return CriticalPoint(change.value, kind, hertz, interval, True)


def _leads(group: Sequence[Event], change: VerdictChange) -> list[Event]:
    """Of the crossings at a place the first that begins what grows above, and that ends what grew
    below; all of them if there is none."""
    leads = []
    for alike in ((change.above, 1), (change.below, -1)):
        leads += [c for c in group if (c.kind, c.direction) == alike][:1]
    return leads or list(group)
