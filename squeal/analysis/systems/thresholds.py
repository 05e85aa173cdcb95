"""Thresholds of a system in its parameter: all of a small one, those of a band of a large one."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from squeal.analysis.answers import Thresholds, basis_text
from squeal.analysis.systems.roots import (
    Changes,
    Wanted,
    basis_of,
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
from squeal.linear.search import Searched, fastest_first, search, together
from squeal.linear.system import TermSystem
from squeal.linear.thresholds import VerdictChange, Verdicts
from squeal.sparse.crossings import crossings_along
from squeal.sparse.eigensolver import OPTIONS, modes_in
from squeal.sparse.quadratic import PROGRESS
from squeal.sparse.reduction import Reduction

STEPS = 13  # values at which a reduced system has to be good
COUNTED_ROWS = 20_000  # larger systems are not counted again between their thresholds


def system_thresholds(
    system: TermSystem, high: float, low: float | None = None, wanted: Wanted | None = None
) -> Thresholds:
    """Every threshold of a system in low <= p <= high, of the band if one is wanted.

    Of a small system they are those of `linear.thresholds`. Of a large one, and where M is singular
    or matrices are complex, they are found on a reduced system and confirmed on the full one. Then
    `certified` says that between neighbouring crossings a count of growing roots that needs no
    eigenvalue agrees, at one value each, and so do the roots at all values that were looked at;
    None if it was not made. It does not prove that no window lies between these values.

    Without `low` the range begins at 0, or at high / 1000 where a factor divides by the parameter.
    In the details `unconfirmed` names what the full system did not confirm, `left_out` what leaves
    the band while it grows. Raises InputError for an empty range, and for a large system or complex
    matrices without a band or region.
    """
    wanted, name = wanted or Wanted(), system.parameter
    region = wanted.rectangle
    if not system.real and region is None:
        raise InputError(
            "band: is missing; thresholds with a structural loss factor (complex matrices) need "
            "a band or a region"
        )
    if low is None:
        try:
            system.derivative(name, {name: 0.0})
            system(low := 0.0)
        except InputError:
            low = high / 1000
    if not low < high:
        raise InputError(f"high: {high:g} is not allowed; it must exceed {low:g}")
    unconfirmed: list[str] = []
    left_out: list[str] = []
    rows: Sequence[Event] = []
    searched: Sequence[Searched] = ()
    reduction, outside, certified = None, None, None
    values = [low, high]
    roots: Callable[[Changes], ComplexArray] = partial(roots_of_all, system, wanted)
    whole = is_small(system) and system.real
    if whole and region is not None:  # M has to be inverted
        whole = ILL * np.linalg.cond(unit_diagonal(dense(system(low)[0]))) < 1.0
    if whole:
        every = thresholds(system, high, mu_min=low)
        searched, certified = every.searched, every.certified
        points, crossings = every.points, every.crossings
    else:
        # inner values that thresholds do not like to lie at
        inner = [(k + 0.0371 * (1 + k % 3)) / (STEPS - 1) for k in range(1, STEPS - 1)]
        values[1:1] = [low + x * (high - low) for x in inner]
        reduction = reduced_for(system, wanted, [{name: v} for v in values])
        roots, region = reduction.values, reduction.region
        PROGRESS.get()("following the roots of the reduced system")
        if system.C or not system.real:
            rows, unconfirmed = crossings_along(reduction, name, values)
        else:  # coalescences of the reduced system
            searched = (search(reduction.system, low, high),)
    band = _Band(system, wanted, lambda p: roots({name: p}))
    if region is not None:
        for part in searched:
            for place, way in itertools.product(part.places, (1, -1)):
                own = fastest_first(part.line, [c for c in place if c.direction == way])
                own = [c for c in own if region.low_imag <= c.omega <= region.high_imag]
                rows = [*rows, *own]
        outside = len(crossings) - len(rows) if whole else None
        if reduction is not None and searched:
            rows = [replace(c, residual=reduction.worst) for c in rows]
        points, crossings, between, unexplained, left_out = band.thresholds(rows, values)
        unconfirmed = [*unconfirmed, *unexplained]
        if whole:
            certified = bool(certified) and not unconfirmed
        elif reduction is not None and system.n <= COUNTED_ROWS:
            counts = (_counted(reduction, p, band.growth(p).roots) for p in between)
            certified = not unconfirmed and all(counts)
    notes = [f"not confirmed on the full system: {words}" for words in unconfirmed] + left_out
    if outside:
        notes.append(f"crossings outside {wanted.words()}: {outside}")
    if certified is not None:
        foreseen = "foreseen, not excluded by proof" if system.real else "not foreseen"
        notes.append(f"windows between the computed values are {foreseen}")
    basis = basis_of(reduction, wanted)
    details = {
        "parameters": dict(system.parameters),
        "admissible_to": high,
        "unconfirmed": unconfirmed,
        "left_out": left_out,
        "crossings_outside": outside,
        "basis": basis,
    }
    return Thresholds(
        system.name,
        name,
        low,
        high,
        verdict_of(band.roots(low), band.noise),
        tuple(points),
        tuple(crossings),
        f"{name} = {high:g} is reached",
        certified,
        notes=(*notes, *([basis_text(basis)] if basis else [])),
        details=details,
        source=(system, wanted, reduction),
    )


def _counted(reduction: Reduction, value: float, growing: int) -> bool:
    """True if as many roots of the full system in the region grow as are expected."""
    name, noise = reduction.system.parameter, noise_of(reduction.system)
    PROGRESS.get()(f"counting growing roots at {name} = {value:.6g}")
    problem = reduction.scaled.at({name: value})
    try:
        full = modes_in(problem, reduction.region, start=reduction.vectors, exact=OPTIONS.accepted)
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
    ) -> tuple[list[CriticalPoint], list[Crossing], list[float], list[str], list[str]]:
        """Changes of verdict and crossings from events by rising value, of one place the fastest
        first; values between them; and what grows without an event, or ceases to.

        `values` from the first to the last are looked at.
        """
        low, high = values[0], values[-1]
        groups = together(rows, 1e-9 * (high - low))
        margin = 1e-6 * (high - low)  # where the verdict may be that of either side
        beyond = bool(groups) and high - groups[-1][-1].value <= margin  # what follows is seen
        edges = [low, *(group[0].value for group in groups), high + 2 * margin * beyond]
        inside = [v for v in values if all(abs(v - c.value) > margin for c in rows)]
        between = [(a + b) / 2 for a, b in itertools.pairwise(edges)]
        number, growths, first = self.growth(between[0]).roots, [], []
        for k, (a, b) in enumerate(itertools.pairwise(edges)):
            if k:
                number += sum(c.direction * (2 if c.omega else 1) for c in groups[k - 1])
            tried = [between[k], *(v for v in inside if a < v < b), a + margin, b - margin]
            agrees = (v for v in tried if a < v < b and self.growth(v).roots == number)
            first.append(next(agrees, between[k]))
            growths.append(self.growth(first[k]))
        seen_at = sorted(self.known)
        changes = list(Verdicts(self.growth).changes(edges, growths, groups, seen_at))
        unexplained, left = [], dict[int, str]()
        for v in sorted({*inside, *between}):
            k, seen = sum(group[0].value < v for group in groups), self.growth(v)
            here = f"{self.name} = {v:.6g}"
            if seen.verdict == growths[k].verdict:
                continue
            if seen.roots > growths[k].roots:
                words = f"{seen.verdict} at {here} follows from no threshold that was located"
                unexplained.append(words)
            elif seen.roots < growths[k].roots:
                left.setdefault(
                    k,
                    f"what grows at {self.name} = {first[k]:.6g} leaves {self.wanted.words()} by "
                    f"{here} and is left out there, as are roots that grow faster than it holds",
                )
        crossings = [
            c.crossing(self._mode(c), any(x.place == k and c in _leads(group, x) for x in changes))
            for k, group in enumerate(groups)
            for c in group
        ]
        points = [self._point(change, groups) for change in changes]
        return points, crossings, between, unexplained, list(left.values())

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
            fastest = at[np.argmax(np.where(at.imag > self.noise * np.abs(at), at.real, -np.inf))]
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
