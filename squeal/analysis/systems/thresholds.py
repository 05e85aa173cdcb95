"""Thresholds of a system in its parameter: all of a small one, those of a band of a large one."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from squeal.analysis.systems.roots import (
    TERMS,
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
from squeal.linear.matrices import ILL, unit_diagonal
from squeal.linear.search import search
from squeal.linear.system import TermSystem, dense
from squeal.linear.thresholds import Place, VerdictChange, Verdicts
from squeal.schema.values import takes
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
    band all is told of its roots; `crossings_outside` it, None if they are not known.
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


@takes(system=TERMS)
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
            return _all(system, low, high)
        if ILL * np.linalg.cond(unit_diagonal(dense(system(low)[0]))) < 1.0:  # M may be inverted
            return _small_band(system, low, high, wanted)
    return _large(system, low, high, wanted, progress)


def _all(system: TermSystem, low: float, high: float) -> SystemThresholds:
    located = thresholds(system, high, mu_min=low)
    start = verdict_of(roots_of_all(system, Wanted(), {system.parameter: low}), noise_of(system))
    points, crossings = tuple(located.points), tuple(located.crossings)
    return SystemThresholds(low, high, start, points, crossings, located.certified)


def _small_band(system: TermSystem, low: float, high: float, wanted: Wanted) -> SystemThresholds:
    """Of all crossings those in a band, and the verdicts on its roots."""
    rectangle, noise = wanted.rectangle, noise_of(system)
    assert rectangle is not None
    ends = np.array([rectangle.low_imag, rectangle.high_imag]) / (2 * math.pi)
    if wanted.band is not None:
        ends = np.array(wanted.band)
    located = thresholds(system, high, mu_min=low)
    rows = [c for c in located.crossings if ends[0] <= c.frequency_hz <= ends[1]]

    def roots(value: float) -> ComplexArray:
        return roots_of_all(system, wanted, {system.parameter: value})

    band = _Band(roots, noise).placed(rows, (low, high))
    return SystemThresholds(
        low,
        high,
        verdict_of(roots(low), noise),
        band.points,
        band.crossings,
        located.certified,
        left_out=_left_out(band, system.parameter, wanted),
        crossings_outside=len(located.crossings) - len(rows),
    )


def _large(
    system: TermSystem,
    low: float,
    high: float,
    wanted: Wanted,
    progress: Progress,
) -> SystemThresholds:
    name, noise = system.parameter, noise_of(system)
    # inner values that thresholds do not like to lie at
    inner = [(k + 0.0371 * (1 + k % 3)) / (STEPS - 1) for k in range(1, STEPS - 1)]
    values = [low, *(low + x * (high - low) for x in inner), high]
    changes = [{name: v} for v in values]
    reduction, region = reduced_for(system, wanted, changes, progress=progress)
    unconfirmed: tuple[str, ...] = ()
    progress("following the roots of the reduced system")
    if system.C or not system.real:
        located = crossings_along(reduction, region, name, values)
        unconfirmed = located.unconfirmed
        rows = [
            Crossing(c.value, c.kind, c.direction, c.frequency_hz, c.interval, 0, False, c.residual)
            for c in located.crossings
        ]
    else:  # coalescences of the reduced system
        rows = [
            c.crossing(0, False, reduction.worst)
            for place in search(reduction.system, low, high).places
            for c in place
            if region.low_imag <= c.omega <= region.high_imag
        ]

    def roots(value: float) -> ComplexArray:
        return reduction.values(region, {name: value})

    band = _Band(roots, noise)
    placed = band.placed(rows, values)
    unconfirmed += tuple(
        f"{band.growth(value).verdict} at {name} = {value:.6g} follows from no threshold that "
        "was located"
        for value in placed.unexplained
    )
    certified = None
    if system.n <= COUNTED_ROWS:
        certified = not unconfirmed and all(
            _counted(reduction, region, p, band.growth(p).roots, progress) for p in placed.between
        )
    return SystemThresholds(
        low,
        high,
        verdict_of(roots(low), noise),
        placed.points,
        placed.crossings,
        certified,
        unconfirmed,
        _left_out(placed, name, wanted),
        reduction,
    )


def _left_out(band: _Placed, name: str, wanted: Wanted) -> tuple[str, ...]:
    """Sentences on roots that leave the band or region while they grow."""
    assert wanted.rectangle is not None
    return tuple(
        f"what grows at {name} = {first:.6g} leaves {wanted.words()} by {name} = {value:.6g} and "
        f"is left out there, as are roots that grow by more than {wanted.rectangle.high_real:.4g} "
        "1/s"
        for first, value in band.left
    )


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


@dataclass(frozen=True)
class _Placed:
    """Crossings with modes and verdicts, changes of verdict, and values between the crossings.

    `unexplained` are values at which what grows follows from no crossing, `left`, by stretches
    between crossings, values by which a root that grows has left the band, and one before.
    """

    crossings: tuple[Crossing, ...]
    points: tuple[CriticalPoint, ...]
    between: tuple[float, ...]
    unexplained: tuple[float, ...]
    left: tuple[tuple[float, float], ...]


@dataclass
class _Band:
    """What grows among the roots of a band, by more than `noise` |lambda|; `roots` gives them."""

    roots: Callable[[float], ComplexArray]
    noise: float
    known: dict[float, UnstableCount] = field(default_factory=dict)

    def growth(self, p: float) -> UnstableCount:
        """What grows at p, of pairs the upper roots."""
        if p not in self.known:
            z = self.roots(p)
            self.known[p] = unstable_count(z, self.noise * np.abs(z))
        return self.known[p]

    def placed(self, rows: Sequence[Crossing], values: Sequence[float]) -> _Placed:
        """Crossings by rising value; `values` from the first to the last are looked at."""
        low, high = values[0], values[-1]
        groups = _together(rows, 1e-9 * (high - low))
        margin = 1e-6 * (high - low)  # where the verdict may be that of either side
        beyond = bool(groups) and high - groups[-1][-1].mu <= margin  # what follows is seen there
        edges = [low, *(group[0].mu for group in groups), high + 2 * margin * beyond]
        inside = [v for v in values if all(abs(v - c.mu) > margin for c in rows)]
        between = [(a + b) / 2 for a, b in itertools.pairwise(edges)]
        number, stretches, first = self.growth(between[0]).roots, [], []
        for k, (a, b) in enumerate(itertools.pairwise(edges)):
            number += sum(map(_net, groups[k - 1])) if k else 0
            tried = [between[k], *(v for v in inside if a < v < b), a + margin, b - margin]
            agrees = (v for v in tried if a < v < b and self.growth(v).roots == number)
            first.append(next(agrees, between[k]))
            stretches.append(self.growth(first[k]))
        places = [Place(group[0].mu, *_kinds(group)) for group in groups]
        changes = Verdicts(self.growth).changes(edges, stretches, places, sorted(self.known))
        unexplained: list[float] = []
        left: dict[int, tuple[float, float]] = {}
        for v in sorted({*inside, *between}):
            k = sum(group[0].mu < v for group in groups)
            seen = self.growth(v)
            if seen.verdict == stretches[k].verdict:
                continue
            if seen.roots < stretches[k].roots:
                left.setdefault(k, (first[k], v))
            elif seen.roots > stretches[k].roots:
                unexplained.append(v)
        crossings = tuple(
            replace(
                c,
                mode=self._mode(c),
                changes_verdict=any(x.place == k and c in _leads(group, x) for x in changes),
            )
            for k, group in enumerate(groups)
            for c in group
        )
        points = tuple(self._point(change, groups) for change in changes)
        return _Placed(crossings, points, tuple(between), tuple(unexplained), tuple(left.values()))

    def _mode(self, c: Crossing) -> int:
        at, omega = self.roots(c.mu).imag, 2 * math.pi * c.frequency_hz
        return 1 + int(np.sum((at > 0) & (at < omega * (1 - 1e-6))))

    def _point(self, change: VerdictChange, groups: Sequence[Sequence[Crossing]]) -> CriticalPoint:
        """A change of verdict at a crossing, or where growth changes hands, with the pair's
        frequency there."""
        kind = change.above if change.above in GROWING else "restabilised"
        if change.place is not None:
            c = _leads(groups[change.place], change)[0]
            tight = c.interval[1] - c.interval[0] <= ContinuationOptions.same * abs(c.mu)
            return CriticalPoint(c.mu, kind, c.frequency_hz, c.interval, tight, c.residual)
        hertz = 0.0
        if kind == "flutter":
            at = self.roots(change.value)
            pairs = at.imag > self.noise * np.abs(at)
            fastest = at[np.argmax(np.where(pairs, at.real, -np.inf))]
            hertz = float(abs(fastest.imag)) / (2 * math.pi)
        interval = (change.value - change.half, change.value + change.half)
        return CriticalPoint(change.value, kind, hertz, interval, True)


def _together(rows: Sequence[Crossing], near: float) -> list[list[Crossing]]:
    """Crossings, by rising value, those at one place in one list."""
    groups: list[list[Crossing]] = []
    for c in rows:
        if groups and c.mu - groups[-1][-1].mu <= near:
            groups[-1].append(c)
        else:
            groups.append([c])
    return groups


def _leads(group: Sequence[Crossing], change: VerdictChange) -> list[Crossing]:
    """The crossings at a place that begin what grows above or end what grew below; of several that
    do the fastest, which stands first."""
    leads = []
    for alike in ((change.above, "up"), (change.below, "down")):
        leading = [c for c in group if (c.kind, c.direction) == alike]
        leads += sorted(leading, key=lambda c: not c.changes_verdict)[:1]
    return leads or list(group)


def _net(c: Crossing) -> int:
    return (1 if c.direction == "up" else -1) * (2 if c.kind == "flutter" else 1)


def _kinds(group: Sequence[Crossing]) -> tuple[frozenset[str], frozenset[str]]:
    """What begins and what ends at a place."""
    begins, ends = (
        frozenset(c.kind for c in group if c.direction == way) for way in ("up", "down")
    )
    return begins, ends
