"""Thresholds of a system in its parameter: all of a small one, those of a band of a large one."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.io.processes import counted, mapped
from squeal.io.system import SystemFile
from squeal.linear import thresholds
from squeal.linear.continuation import (
    Continuation,
    ContinuationOptions,
    ProblemClass,
    SpectrumAtParameter,
    problem_class_of,
)
from squeal.linear.eigen import ComplexArray, growing
from squeal.linear.events import Event
from squeal.linear.matrices import ILL, dense, unit_diagonal
from squeal.linear.search import SearchResult, cluster_events, search
from squeal.linear.system import TermSystem, matrices_of
from squeal.linear.thresholds import points_and_crossings
from squeal.queries.ranges import IS_VAGUE, vague_interval
from squeal.queries.systems.all_roots import NO_BAND, Changes, is_small, roots_of_all
from squeal.queries.systems.reduced import basis_of, served_for_thresholds
from squeal.queries.systems.verdicts import rounding_of, verdict_of
from squeal.results.columns import basis_text
from squeal.results.sources import EigenvalueSelection, SystemSource
from squeal.results.thresholds import MISSED, Thresholds
from squeal.sparse.crossings import (
    CrossingGuess,
    coalescences,
    crossings_along,
    singular_stiffness,
)
from squeal.sparse.dispersive import DispersiveReduction
from squeal.sparse.eigensolver import modes_in
from squeal.sparse.first_look import FirstLook
from squeal.sparse.quadratic import PROGRESS
from squeal.sparse.reduction import Reduction

STEPS = 13  # values at which a reduced system has to be good
Roots = Callable[[Changes], ComplexArray]
COUNTED_ROWS = 20_000  # larger systems are not counted again between their thresholds


def system_thresholds(
    system: TermSystem,
    high: float,
    low: float | None = None,
    wanted: EigenvalueSelection | None = None,
    workers: int = 1,
    served: Reduction | None = None,
    looked_at: Sequence[float] = (),
) -> Thresholds:
    """Every threshold of a system in low <= p <= high, of the band if one is wanted.

    Of a small system they are those of `linear.thresholds`. Of a large one, of a band of more than
    40 rows, and where M is singular or matrices are complex, they are found on a reduced system and
    confirmed on the full one. Then
    `certified` says that between neighbouring crossings a count of growing roots that needs no
    eigenvalue agrees, at one value each, and so do the roots at all values that were looked at;
    None if it was not made. It does not prove that no window lies between these values.

    Without `low` the range begins at 0, or at high / 1000 where a factor divides by the parameter.
    In the details `unconfirmed` names what the full system did not confirm, `left_out` what leaves
    the band while it grows, `doubts` why the answer is not certified. `served` is a large system as
    it was reduced already; nothing is counted then. At the values `looked_at` steps end. Raises
    InputError for an empty range, and for a large system or complex matrices without a band or
    region.
    """
    wanted, name = wanted or EigenvalueSelection(), system.parameter
    region = wanted.rectangle
    if not system.real and region is None:
        raise InputError(NO_BAND)
    if low is None:
        try:
            system.derivative(name, {name: 0.0})
            system.frozen()(low := 0.0)
        except InputError:
            low = high / 1000
    if not low < high:
        raise InputError(f"high: {high:g} is not allowed; it must exceed {low:g}")
    unconfirmed: list[str] = []
    unclear: list[str] = []
    doubts: list[str] = []
    left_out: list[str] = []
    rows: Sequence[Event] = []
    searched: Sequence[SearchResult] = ()
    reduction, outside, certified = None, None, None
    values = [low, *sorted(looked_at), high]
    roots: Roots = partial(roots_of_all, system, wanted)
    whole = is_small(system) and system.real
    if whole and region is not None:  # all roots cost more than its own, and M has to be inverted
        whole = system.n <= ContinuationOptions.small
        whole &= ILL * np.linalg.cond(unit_diagonal(dense(system(low)[0]))) < 1.0
    if whole:
        every = thresholds(system, high, looked_at, low)
        searched, certified = every.searched, every.certified
        points, crossings = every.points, every.crossings
    else:
        # inner values that thresholds do not like to lie at
        inner = [(k + 0.0371 * (1 + k % 3)) / (STEPS - 1) for k in range(1, STEPS - 1)]
        values = sorted([*values, *(low + x * (high - low) for x in inner)])
        reduction = served or served_for_thresholds(system, wanted, [{name: v} for v in values])
        roots, region = reduction.values, reduction.region
        still: list[CrossingGuess] = []
        if system.real and not served and region.low_imag < 0.0:
            still, unclear = singular_stiffness(reduction.scaled, values)
            for one in still:
                reduction.extend(np.column_stack([one.right, one.left]))
        PROGRESS.get()("following the roots of the reduced system")
        if isinstance(reduction, DispersiveReduction) and system.undamped:
            rows = coalescences(reduction, name, values)
        elif not system.real or problem_class_of(matrices_of(reduction.system, values)) == "damped":
            rows, unconfirmed = crossings_along(reduction, name, values, still)
        else:  # coalescences of the reduced system
            searched = (search(reduction.system, low, high),)
    doubts += [words for part in searched for words in part.doubts or ()]
    line = _Band(system, low, high, roots)
    if region is not None:
        for part in searched:
            events = itertools.chain(*part.clusters)
            inside = [c for c in events if region.low_imag <= c.omega <= region.high_imag]
            rows = [*rows, *inside]
        outside = len(crossings) - len(rows) if whole else None
        if reduction is not None and searched:
            rows = [replace(c, residual=reduction.worst) for c in rows]
        found, between, unexplained, left_out = _explained(line, rows, values, wanted.words())
        if isinstance(reduction, FirstLook):  # where a root crosses no sign is open
            for event in rows:
                line.see(event.value, reduction.compressed.roots({name: event.value}).values)
        points, crossings = points_and_crossings(found)
        unconfirmed = [*unconfirmed, *unexplained, *unclear]
        if whole:
            certified = bool(certified) and not unconfirmed
        elif served is None and system.n <= COUNTED_ROWS and not system.follows:
            tasks = [] if unconfirmed else [(p, line.at(p).unstable_count.roots) for p in between]
            agrees = mapped(_counted, tasks, workers, reduction)
            told = counted(agrees, len(tasks), PROGRESS.get(), "counts")
            wrong = [p for (p, _), agreed in zip(tasks, told, strict=True) if not agreed]
            doubts = [f"a count on the full system at {name} = {p:.9g} disagrees" for p in wrong]
            certified = not unconfirmed and not doubts
    vague = vague_interval((one.interval for one in crossings), high - low)
    if certified and vague is not None:
        certified = False
        doubts = [*doubts, f"{IS_VAGUE} ({name} = {vague[0]:.6g} to {vague[1]:.6g})"]
    notes = [f"not confirmed on the full system: {words}" for words in unconfirmed] + left_out
    notes += ["each root at its own frequency"] * bool(system.follows)
    if region is not None:
        beside = "not looked for" if outside is None else f"{outside}"
        notes.append(f"crossings outside {wanted.words()}: {beside}")
    if certified is not None:
        missed = "Very narrow unstable ranges" if system.real else "Narrow unstable ranges"
        notes.append(f"{missed} {MISSED}")
    basis = basis_of(reduction, wanted)
    doubts = [] if certified is None else doubts + unconfirmed
    details = {"parameters": system.given, "admissible_to": high, "unconfirmed": unconfirmed}
    details |= {"doubts": doubts, "left_out": left_out, "crossings_outside": outside}
    details |= {"basis": basis}
    notes += [basis_text(basis, counted=certified is not None)] if basis else []
    verdict = verdict_of(first := roots({name: low}), rounding_of(system, first))
    head = system.name, name, low, high, verdict, tuple(points), tuple(crossings)
    more: Any = {
        "notes": tuple(notes),
        "details": details,
        "source": SystemSource(SystemFile(system), wanted, reduction),
    }
    return Thresholds(*head, f"{name} = {high:g} is reached", certified, **more)


def _counted(reduction: Reduction, task: tuple[float, int]) -> bool:
    """True if as many roots of the full system in the region grow at a value as are expected."""
    value, expected = task
    name = reduction.system.parameter
    PROGRESS.get()(f"counting growing roots at {name} = {value:.6g}")
    if isinstance(reduction, FirstLook) and reduction.misses_none({name: value}, expected // 2):
        return True
    problem = reduction.scaled.at({name: value})
    try:
        full = modes_in(problem, reduction.region)
    except ComputationError:
        return False
    roots = sum(2 if mode.kind == "flutter" else 1 for mode in growing(full.eigenvalues))
    return full.certified and roots == expected


class _Band(Continuation):
    """What grows among the roots of a band alone, which `roots` gives."""

    def __init__(self, system: TermSystem, low: float, high: float, roots: Roots) -> None:
        self.name, self.low, self.high, self.roots = system.parameter, low, high, roots
        self.system: TermSystem = system
        self._states = {}
        self.options, self.problem = ContinuationOptions(), ProblemClass.DAMPED

    def at(self, p: float) -> SpectrumAtParameter:
        """The roots at p without vectors and slopes, those above the axis with their conjugates."""
        if p not in self._states:
            self.see(p, self.roots({self.name: p}))
        return self._states[p]

    def see(self, p: float, roots: ComplexArray) -> None:
        """Take these for the roots at p."""
        z = np.concatenate([roots[roots.imag >= 0.0], roots[roots.imag > 0.0].conj()])
        none, still = np.zeros((0, len(z)), complex), np.zeros((len(z), len(z)), complex)
        self._states[p] = SpectrumAtParameter(p, z, none, none, still, rounding_of(self.system, z))


def _explained(
    line: _Band, rows: Sequence[Event], values: Sequence[float], words: str
) -> tuple[SearchResult, list[float], list[str], list[str]]:
    """Events by rising value in their places, and what grows between these; values between them;
    what grows without an event, and what leaves the band, which `words` name, while it grows.

    `values` from the first to the last are looked at.
    """
    low, high, wide = line.low, line.high, line.high - line.low
    groups = cluster_events(rows, 1e-9 * wide)
    margin = 1e-6 * wide  # of verdicts that are of either side
    beyond = bool(groups) and high - groups[-1][-1].value <= margin  # what follows is seen
    edges = [low, *(group[0].value for group in groups), high + 2 * margin * beyond]
    inside = [v for v in values if all(abs(v - c.value) > margin for c in rows)]
    between = [(a + b) / 2 for a, b in itertools.pairwise(edges)]
    number, growths, first = line.at(between[0]).unstable_count.roots, [], []
    for k, (a, b) in enumerate(itertools.pairwise(edges)):
        if k:
            number += sum(c.direction * (2 if c.omega else 1) for c in groups[k - 1])
        tried = [between[k], *(v for v in inside if a < v < b), a + margin, b - margin]
        agrees = (v for v in tried if a < v < b and line.at(v).unstable_count.roots == number)
        first.append(next(agrees, between[k]))
        growths.append(line.at(first[k]).unstable_count)
    unexplained, left = [], dict[int, str]()
    for v in sorted({*inside, *between}):
        k, seen = sum(group[0].value < v for group in groups), line.at(v).unstable_count
        here, there = (f"{line.name} = {x:.6g}" for x in (v, first[k]))
        if seen.verdict != growths[k].verdict and seen.roots > growths[k].roots:
            unexplained.append(
                f"{seen.verdict} at {here} follows from no threshold that was located"
            )
        elif seen.verdict != growths[k].verdict and seen.roots < growths[k].roots:
            text = f"what grows at {there} leaves {words} by {here} and is left out there"
            left.setdefault(k, text)
    found = SearchResult(tuple(map(tuple, groups)), tuple(growths), line)
    return found, between, unexplained, list(left.values())
