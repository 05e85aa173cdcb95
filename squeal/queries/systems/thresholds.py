"""Thresholds of a system over its parameter: all of a small one, those of a band of a large one.

Small systems: all roots are followed by continuation. Large ones: the roots of a reduced system are
followed, and their crossings of the imaginary axis located on the full one by Newton's method.
Either way the located events are compared with what grows at values between them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.io.processes import counted, mapped
from squeal.io.system import SystemFile
from squeal.linear import CriticalPoint, Crossing, thresholds
from squeal.linear.bends import unseen_factor
from squeal.linear.continuation import (
    SMALL_ROWS,
    Continuation,
    ProblemClass,
    SpectrumAtParameter,
    problem_class_of,
)
from squeal.linear.eigen import growing
from squeal.linear.events import Event
from squeal.linear.functions import matrices_of
from squeal.linear.matrices import EPS, applied, dense, is_regular
from squeal.linear.roots import ComplexArray
from squeal.linear.search import SearchResult, cluster_events, hull, search
from squeal.linear.system import TermSystem
from squeal.linear.thresholds import points_and_crossings
from squeal.numerics.differentiation import Parameters
from squeal.queries.ranges import IS_VAGUE, vague_interval
from squeal.queries.systems.all_roots import NO_BAND, is_small, roots_of_all
from squeal.queries.systems.reduced import basis_of, first_look_for_thresholds, reduced_for
from squeal.queries.systems.verdicts import rounding_of, verdict_of
from squeal.results.columns import basis_text
from squeal.results.sources import EigenvalueSelection, SystemSource
from squeal.results.thresholds import MISSED, Thresholds
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.crossings import CrossingGuess, coalescences, crossings_along
from squeal.sparse.dispersive import DispersiveReduction
from squeal.sparse.eigensolver import modes_in
from squeal.sparse.first_look import FirstLook
from squeal.sparse.quadratic import PROGRESS
from squeal.sparse.reduction import Reduction
from squeal.sparse.singular_stiffness import singular_stiffness

if TYPE_CHECKING:  # few systems need the referee
    from squeal.proof.polynomials import Change, ExactRange

STEPS = 13  # values at which a reduced system has to be good
COUNTED_ROWS = 50_000  # larger systems are not counted again between their thresholds
SAME = 1e-9  # of the range: events no further apart are one cluster
ROUNDINGS = 2  # of |P|, in units of the machine precision: of entries, their scaling and products
SINGULAR = 1e3  # times its rounding: a singular value of P that counts as zero
MARGIN = 1e-6  # of the range: closer to an event the verdicts of both its sides count as right

Roots = Callable[[Parameters], ComplexArray]
"""The selected roots (m,) of a system with some parameters changed."""


@dataclass(frozen=True, eq=False)
class _Located:
    """Thresholds and crossings in the range, and what speaks against the list.

    Attributes
    ----------
    points, crossings
        Changes of the verdict, and crossings of the imaginary axis, by rising parameter.
    certified : bool or None
        Whether counts of growing roots agree with the list; None where nothing was counted.
    doubts : sequence of str
        Why it is not certified, apart from `unconfirmed`.
    unconfirmed : sequence of str
        Events of the reduced system, and growth, that the full system did not confirm.
    left_out : sequence of str
        Roots that leave the band while they grow, in sentences.
    all_crossings : sequence of Crossing or None
        All crossings, also those outside of the band; None if they were not searched.
    reduction : Reduction or None
        The reduced system that served.
    """

    points: Sequence[CriticalPoint]
    crossings: Sequence[Crossing]
    certified: bool | None
    doubts: Sequence[str] = ()
    unconfirmed: Sequence[str] = ()
    left_out: Sequence[str] = ()
    all_crossings: Sequence[Crossing] | None = None
    reduction: Reduction | None = None


class SystemThresholds(NamedTuple):
    """The answer about a system, and all its crossings, also those outside of the band or region;
    None if they were not searched."""

    answer: Thresholds
    all_crossings: Sequence[Crossing] | None


def system_thresholds(
    system: TermSystem,
    high: float,
    low: float | None = None,
    selection: EigenvalueSelection | None = None,
    workers: int = 1,
    served: Reduction | None = None,
    step_ends: Sequence[float] = (),
    exact_range: ExactRange | None = None,
) -> SystemThresholds:
    """Locate every threshold of a system over its free parameter p.

    All roots are followed of a small system, and of a band of up to 40 rows with a regular M. Other
    thresholds are searched on a reduced system and located on the full one. Growing roots are then
    counted on the full system, at one value between each two neighbouring crossings. `certified`
    says whether the counts, and the roots at all computed values, agree with the list. This does
    not prove that no interval of instability lies between two such values.

    Parameters
    ----------
    system : TermSystem
        The system.
    high, low : float
        The range of p. Without `low` it begins at 0, or at high / 100 where a factor divides by p.
    selection : EigenvalueSelection, optional
        The band or region whose roots are judged; all roots if left out.
    workers : int
        Processes that count roots.
    served : Reduction, optional
        A reduced system that was made for several systems, this system among them. Nothing is
        counted then.
    step_ends : sequence of float
        Values of p at which steps of the search end.
    exact_range : ExactRange, optional
        The exact thresholds of all roots; nothing is searched then.

    Returns
    -------
    SystemThresholds
        In the details of the answer `unconfirmed` names what the full system did not confirm,
        `left_out` what grows outside of the band for a while, and `doubts` why it is not certified.

    Raises
    ------
    InputError
        For an empty range, and for a large system or complex matrices without a band or region.
    """
    selection = selection or EigenvalueSelection()
    if not system.real and selection.rectangle is None:
        raise InputError(NO_BAND)
    if low is None:
        low = start_of_range(system, high)
    if not low < high:
        raise InputError(f"high: {high:g} is not allowed; it must exceed {low:g}")
    region = selection.region
    if region is not None and not region.low_real < 0.0 < region.high_real:
        raise InputError(
            f"region: {region} holds no part of the imaginary axis, which thresholds cross; it "
            "must be RE0:RE1:IM0:IM1 with RE0 < 0 < RE1"
        )
    roots: Roots = partial(roots_of_all, system, selection)
    if exact_range is not None:
        roots = partial(_exact_roots, system, exact_range)
        located = _located_exactly(system, exact_range, low, high, roots)
    elif _all_roots_are_followed(system, selection, low):
        located = _located_among_all(system, selection, low, high, step_ends, roots)
    else:
        values = _values_of_reduction(low, high, step_ends)
        located = _located_in_band(system, selection, values, workers, served)
        assert located.reduction is not None
        roots = located.reduction.values
    located = _without_vague_certificate(located, system.parameter, high - low)
    at_start = roots({system.parameter: low})
    basis = basis_of(located.reduction, selection)
    doubts: list[str] = []
    if located.certified is not None:
        doubts = [*located.doubts, *located.unconfirmed]
    answer = Thresholds(
        name=system.name,
        parameter=system.parameter,
        low=low,
        high=high,
        verdict=verdict_of(at_start, rounding_of(system, at_start)),
        points=tuple(located.points),
        crossings=tuple(located.crossings),
        end=f"{system.parameter} = {high:g} is reached",
        certified=located.certified,
        notes=tuple(_notes(system, selection, located)),
        details={
            "parameters": system.given,
            "admissible_to": high,
            "unconfirmed": list(located.unconfirmed),
            "doubts": doubts,
            "left_out": list(located.left_out),
            "crossings_outside": _number_outside(located),
            "basis": basis,
        },
        source=SystemSource(SystemFile(system), selection, located.reduction),
    )
    return SystemThresholds(answer, located.all_crossings)


def start_of_range(system: TermSystem, high: float) -> float:
    """The lower end of a range that has none: 0, or high / 100 where the matrices have no value or
    no derivative at 0: beside a pole roots move so fast that a search computes most values there.
    """
    try:
        system.derivative(system.parameter, {system.parameter: 0.0})
        system.frozen()(0.0)  # computes the matrices at 0
    except InputError:
        return high / 100
    return 0.0


def _all_roots_are_followed(system: TermSystem, selection: EigenvalueSelection, low: float) -> bool:
    """True if thresholds are searched among all roots of the system, not on a reduced one."""
    if not is_small(system):
        return False
    if selection.rectangle is None:
        return True
    if system.n > SMALL_ROWS:
        return False  # to follow all roots would cost more than to follow those of the band
    M, _, _ = system(low)
    return is_regular(dense(M))  # else a root may pass through infinity, which is refused


def _values_of_reduction(low: float, high: float, step_ends: Sequence[float]) -> list[float]:
    """Rising values of p at which a reduced system has to be good, both ends among them.

    They are spaced unevenly: thresholds often lie at round numbers, where a verdict is not decided.
    """
    values = [low, *step_ends, high]
    for k in range(1, STEPS - 1):
        # 4, 7 or 11 % of a step beside equal steps
        share = (k + 0.0371 * (1 + k % 3)) / (STEPS - 1)
        values.append(low + share * (high - low))
    return sorted(values)


def _located_among_all(
    system: TermSystem,
    selection: EigenvalueSelection,
    low: float,
    high: float,
    step_ends: Sequence[float],
    roots: Roots,
) -> _Located:
    """Locate the thresholds of a small system by following all its roots.

    Of a band or region only crossings whose frequency lies inside are thresholds. step_ends: values
    of the parameter at which steps of the search end; roots: the selected roots at a value.
    """
    # after a list was refuted, where steps end, fast roots may have been missed
    of_all_roots = thresholds(system.balanced, high, step_ends, low, all_roots=bool(step_ends))
    doubts: list[str] = []
    for part in of_all_roots.searched:
        doubts += part.doubts or ()  # None of plain functions, which no system of terms is
    region = selection.rectangle
    located = _Located(
        points=of_all_roots.points,
        crossings=of_all_roots.crossings,
        certified=of_all_roots.certified,
        doubts=doubts,
        all_crossings=of_all_roots.crossings,
    )
    if region is None:
        return located
    events = _events_inside(of_all_roots.searched, region)
    values = [low, *sorted(step_ends), high]
    continuation = BandContinuation(system, low, high, roots)
    comparison = _compare(continuation, events, values, selection.words())
    points, crossings = points_and_crossings(comparison.result)
    return replace(
        located,
        points=points,
        crossings=crossings,
        certified=bool(of_all_roots.certified) and not comparison.unexplained,
        unconfirmed=comparison.unexplained,
        left_out=comparison.left_out,
    )


def _located_exactly(
    system: TermSystem, exact_range: ExactRange, low: float, high: float, roots: Roots
) -> _Located:
    """The thresholds of a small system that are known exactly; roots: gives all at a value."""
    is_undamped = not system.C

    def event_of(change: Change) -> Event:
        return Event(
            value=min((change.low + change.high) / 2.0, high),
            omega=change.omega,
            direction=int(np.sign(change.rise)),
            interval=(change.low, change.high),
            coalesces=is_undamped and change.omega > 0.0,
        )

    continuation = BandContinuation(system, low, high, roots, is_exact=True)
    clusters = cluster_events([event_of(change) for change in exact_range.changes], distance=0.0)
    hulls = [hull(cluster) for cluster in clusters]
    starts = [low, *(stop for _, stop in hulls)]
    stops = [*(start for start, _ in hulls), high]
    counts = []
    for start, stop in zip(starts, stops, strict=True):
        # where the interval of the last change reaches beyond `high`, stop lies below start
        middle = max(start, (start + stop) / 2.0)
        counts.append(continuation.at(middle).unstable_count)
    result = SearchResult(tuple(map(tuple, clusters)), tuple(counts), continuation)
    points, crossings = points_and_crossings(result)
    return _Located(points, crossings, certified=True, all_crossings=crossings)


def _exact_roots(system: TermSystem, exact_range: ExactRange, changes: Parameters) -> ComplexArray:
    """All roots at a value of the parameter, to which a range of exact thresholds belongs."""
    return exact_range.roots_at(changes[system.parameter])


def _events_inside(searched: Iterable[SearchResult], region: Rectangle) -> list[Event]:
    """The events of searches whose frequency lies in a region, by rising parameter."""
    inside = []
    for part in searched:
        for event in itertools.chain(*part.clusters):
            if region.low_imag <= event.omega <= region.high_imag:
                inside.append(event)
    return inside


def _located_in_band(
    system: TermSystem,
    selection: EigenvalueSelection,
    values: Sequence[float],
    workers: int,
    served: Reduction | None,
) -> _Located:
    """Locate the thresholds of a band on the cheapest reduced system that serves.

    That is the reduced system `served`, if one is given, else a projection onto real modes if
    counts on the full system certify its list, else a projection onto full solutions.

    values: rising values of the parameter at which the reduced system has to be good.
    """
    if served is not None:
        return _located_on_reduction(system, selection, served, values, workers, was_served=True)
    changes = [{system.parameter: value} for value in values]
    if system.n <= COUNTED_ROWS:
        first_look = first_look_for_thresholds(system, selection, changes)
        if first_look is not None:
            located = _located_on_reduction(system, selection, first_look, values, workers)
            if located.certified:
                return located
    reduction = reduced_for(system, selection, changes)
    return _located_on_reduction(system, selection, reduction, values, workers)


def _located_on_reduction(
    system: TermSystem,
    selection: EigenvalueSelection,
    reduction: Reduction,
    values: Sequence[float],
    workers: int,
    was_served: bool = False,
) -> _Located:
    """Search the thresholds of a band on a reduced system, and locate them on the full one.

    Parameters
    ----------
    system : TermSystem
        The full system.
    selection : EigenvalueSelection
        The band or region.
    reduction : Reduction
        The reduced system.
    values : sequence of float
        Rising values of the parameter at which the reduced system is good.
    workers : int
        Processes that count growing roots of the full system.
    was_served : bool
        Whether the reduced system was made for several systems, this system among them. The reduced
        system is not changed then, and nothing is counted.
    """
    name = system.parameter
    unconfirmed: list[str] = []
    unclear: list[str] = []
    zero_roots: list[CrossingGuess] = []
    region = reduction.region
    if system.real and not was_served and region.low_imag < 0.0:
        # static losses of stability: the region holds roots that pass through zero, where K is
        # singular; their vectors are added to the basis
        zero_roots, unclear = singular_stiffness(reduction.scaled, values)
        for guess in zero_roots:
            reduction.extend(np.column_stack([guess.right, guess.left]))
    PROGRESS.get()("following the roots of the reduced system")
    events: Sequence[Event]
    if isinstance(reduction, DispersiveReduction) and system.undamped and not system.C:
        # each root at its own frequency stays on the axis until two coalesce
        events = coalescences(reduction, name, values)
    elif not system.real or problem_class_of(matrices_of(reduction.system, values)) == "damped":
        events, unconfirmed = crossings_along(reduction, name, values, zero_roots)
    else:  # undamped: coalescences of the reduced system, which are not located on the full one
        searched = search(reduction.system, values[0], values[-1])
        on_reduced = _events_inside([searched], region)
        events = [_with_rounding(reduction, name, event, values[0]) for event in on_reduced]
    continuation = BandContinuation(system, values[0], values[-1], reduction.values)
    comparison = _compare(continuation, events, values, selection.words())
    if isinstance(reduction, FirstLook):
        # `points_and_crossings` reads the roots at thresholds, which the small basis estimates
        # cheaply. The comparison above is made without these roots: at a crossing the sign of a
        # growth rate is rounding
        for event in events:
            continuation.set_roots(event.value, reduction.basis_values({name: event.value}))
    points, crossings = points_and_crossings(comparison.result)
    unconfirmed = [*unconfirmed, *comparison.unexplained, *unclear]
    certified = None  # nothing is counted
    doubts: list[str] = []
    depends_on_frequency = bool(system.follows)
    if not was_served and system.n <= COUNTED_ROWS and not depends_on_frequency:
        if not unconfirmed:  # a list with unconfirmed events is not certified by any count
            doubts = _disagreeing_counts(reduction, continuation, comparison.midpoints, workers)
        unseen = unseen_factor(system, sorted({*values, *comparison.midpoints}))
        if unseen is not None:
            doubts.append(
                f"the factor {unseen} may rise and fall between the values of {name} that were "
                "looked at"
            )
        certified = not unconfirmed and not doubts
    return _Located(
        points=points,
        crossings=crossings,
        certified=certified,
        doubts=doubts,
        unconfirmed=unconfirmed,
        left_out=comparison.left_out,
        reduction=reduction,
    )


def _with_rounding(reduction: Reduction, name: str, event: Event, low: float) -> Event:
    """An undamped event of a reduced system with the rounding of the full one in its interval.

    With unit vectors x, y for which P x and y^H P vanish a change dP of P moves the parameter p of
    the event by y^H dP x / (y^H dP/dp x): also where two roots meet, since a change of the root
    changes y^H P x in second order only. Of several such vectors the steepest count. Where K x
    vanishes at `low` already, as of a free motion, a root that passes zero keeps its interval.
    `name` is that of the parameter, `low` its first value.
    """
    at = {name: event.value}
    system = reduction.system
    root = np.array(1j * event.omega)
    rounding = ROUNDINGS * EPS * reduction.scaled.at(at).size(root)
    if not event.omega:
        stiffness = applied(system.at({name: low}), root, np.eye(system.n))
        if np.linalg.norm(stiffness, -2) <= SINGULAR * rounding:
            return replace(event, residual=reduction.worst_residual)
    left, sizes, right = np.linalg.svd(applied(system.at(at), root, np.eye(system.n)))
    vanishes = sizes <= max(sizes[-1], SINGULAR * rounding)
    change = applied(system.derivative(name, at), root, right[vanishes].conj().T)
    slope = np.linalg.norm(left[:, vanishes].conj().T @ change, 2)
    margin = float(rounding / slope)
    first, last = event.interval
    return replace(
        event, interval=(first - margin, last + margin), residual=reduction.worst_residual
    )


def _disagreeing_counts(
    reduction: Reduction,
    continuation: BandContinuation,
    values: Sequence[float],
    workers: int,
) -> list[str]:
    """A sentence for each value at which the full system does not have as many growing roots as the
    reduced one."""
    tasks = [(value, continuation.at(value).growing_roots) for value in values]
    agreements = counted(
        mapped(_count_agrees, tasks, workers, reduction), len(tasks), PROGRESS.get(), "counts"
    )
    doubts = []
    for value, agrees in zip(values, agreements, strict=True):
        if not agrees:
            at = f"{continuation.name} = {value:.9g}"
            doubts.append(f"a count on the full system at {at} disagrees")
    return doubts


def _without_vague_certificate(located: _Located, parameter: str, extent: float) -> _Located:
    """Withdraw the certificate if the interval of a crossing is so wide that it may hold several,
    or meets that of another one in which the same growth ends: there may be neither.

    extent: of the range of the parameter.
    """
    for one, other in itertools.pairwise(located.crossings):
        is_same_mode = math.isclose(one.frequency_hz, other.frequency_hz, rel_tol=MARGIN)
        is_touch = one.direction != other.direction and one.interval[1] >= other.interval[0]
        if located.certified and is_same_mode and is_touch:
            doubt = f"growth that begins and ends at {parameter} = {one.mu:.9g} may be rounding"
            return replace(located, certified=False, doubts=[*located.doubts, doubt])
    vague = vague_interval((crossing.interval for crossing in located.crossings), extent)
    if not located.certified or vague is None:
        return located
    low, high = vague
    doubt = f"{IS_VAGUE} ({parameter} = {low:.6g} to {high:.6g})"
    return replace(located, certified=False, doubts=[*located.doubts, doubt])


def _number_outside(located: _Located) -> int | None:
    """How many crossings lie outside of the band; None if they were not searched."""
    if located.all_crossings is None:
        return None
    return len(located.all_crossings) - len(located.crossings)


def _notes(system: TermSystem, selection: EigenvalueSelection, located: _Located) -> list[str]:
    """The lines below the list of thresholds."""
    notes = [f"not confirmed on the full system: {words}" for words in located.unconfirmed]
    notes += located.left_out
    if system.follows:
        notes.append("each root at its own frequency")
    if not system.real:
        notes.append("roots on the real axis, a static loss of stability, are not looked for")
    if selection.rectangle is not None or located.reduction is not None:
        outside = _number_outside(located)
        words = "not looked for" if outside is None else f"{outside}"
        notes.append(f"crossings outside {selection.words()}: {words}")
    # a certified list has this note too: counts at some values miss an unstable range between two
    # values. Of real systems, whose roots are continued, only a very narrow range is missed
    if located.certified is not None:
        missed = "Very narrow unstable ranges" if system.real else "Narrow unstable ranges"
        notes.append(f"{missed} {MISSED}")
    basis = basis_of(located.reduction, selection)
    if basis:
        notes.append(basis_text(basis, counted=located.certified is not None))
    return notes


def _count_agrees(reduction: Reduction, task: tuple[float, int]) -> bool:
    """True if as many roots of the full system in the region grow as are expected.

    task: the value of the parameter and the expected number, where a pair counts as two.
    """
    value, expected = task
    name = reduction.system.parameter
    PROGRESS.get()(f"counting growing roots at {name} = {value:.6g}")
    if isinstance(reduction, FirstLook):
        # its region lies above the real axis: one root of each pair, and no real root
        return reduction.misses_none({name: value}, growing=expected // 2)
    problem = reduction.scaled.at({name: value})
    try:
        full = modes_in(problem, reduction.region)
    except ComputationError:
        return False
    growing_roots = 0
    for mode in growing(full.eigenvalues):  # each pair once
        growing_roots += 2 if mode.kind == "flutter" else 1
    return full.certified and growing_roots == expected


class BandContinuation(Continuation):
    """A continuation that knows the roots of a band at each value, and nothing between values.

    A function gives the roots, without vectors, derivatives or couplings: it serves to compare what
    grows at some values with events that were located by other means.
    """

    def __init__(
        self, system: TermSystem, low: float, high: float, roots: Roots, is_exact: bool = False
    ) -> None:
        """is_exact: whether the real parts of the roots have the right signs, and 0 on the axis."""
        self.is_exact = is_exact
        self.system: TermSystem = system
        self.name = system.parameter
        self.low = low
        self.high = high
        self.roots = roots
        self.problem = ProblemClass.DAMPED
        self._spectra = {}

    def at(self, p: float) -> SpectrumAtParameter:
        """The roots at p, those above the real axis with their conjugates."""
        if p not in self._spectra:
            self.set_roots(p, self.roots({self.name: p}))
        return self._spectra[p]

    def set_roots(self, p: float, selected: ComplexArray) -> None:
        """Set the roots (m,) of the band at p, of which those with Im < 0 are ignored."""
        upper = selected[selected.imag >= 0.0]
        roots = np.concatenate([upper, selected[selected.imag > 0.0].conj()])
        m = len(roots)
        rounding = np.zeros(m) if self.is_exact else rounding_of(self.system, roots)
        no_vectors = np.zeros((0, m), complex)
        self._spectra[p] = SpectrumAtParameter(
            value=p,
            z=roots,
            right=no_vectors,
            left=no_vectors,
            coupling=np.zeros((m, m), complex),
            rounding=rounding,
        )


@dataclass(frozen=True, eq=False)
class _Comparison:
    """Located events compared with what grows at computed values.

    Attributes
    ----------
    result : SearchResult
        The events by rising value, in clusters of coincident ones, and what grows between these.
    midpoints : list of float
        The middle of each interval between two clusters, or between one and an end of the range.
    unexplained : list of str
        A sentence for each value at which more roots grow than follows from the events, or, before
        the first event, than at a lower value.
    left_out : list of str
        A sentence for each interval between clusters in which fewer roots grow somewhere than
        follows from them, if that changes the verdict: a growing root lies outside of the band.
    """

    result: SearchResult
    midpoints: list[float]
    unexplained: list[str]
    left_out: list[str]


def _typical_values(
    continuation: BandContinuation,
    clusters: Sequence[Sequence[Event]],
    intervals: Sequence[tuple[float, float]],
    computed: Sequence[float],
    margin: float,
) -> list[float]:
    """Of each interval between clusters of events a value that shows what grows in the interval.

    That is a value with as many growing roots as are expected: those in the middle of the first
    interval, and what the events since then bring. The middle is tried first, then the computed
    values, then values next to both ends of the interval. Where no value has the expected number
    the middle stands for the interval.
    """
    typical = []
    expected = 0
    for k, (start, stop) in enumerate(intervals):
        middle = (start + stop) / 2
        if k == 0:
            expected = continuation.at(middle).growing_roots
        else:  # the events at the start of the interval
            for event in clusters[k - 1]:
                expected += event.rise
        typical_value = middle
        for value in (middle, *computed, start + margin, stop - margin):
            if start < value < stop and continuation.at(value).growing_roots == expected:
                typical_value = value
                break
        typical.append(typical_value)
    return typical


def _left_between(continuation: BandContinuation, first: float, second: float) -> int:
    """How many roots fewer the band has at a second value than at a first one."""
    return max(0, len(continuation.at(first).z) - len(continuation.at(second).z))


def _compare(
    continuation: BandContinuation, events: Sequence[Event], values: Sequence[float], band: str
) -> _Comparison:
    """Compare what grows at computed values with what follows from the located events.

    The clusters of events cut the range into intervals. On each interval as many roots must grow as
    in the middle of the first interval plus what the events bring, see `_typical_values`. A value

    - with more growing roots is unexplained;
    - with fewer, if that changes the verdict, has a growing root outside of the band; but if so
      many roots have not left the band, and in the first interval below the typical value, growth
      at the typical value is unexplained;
    - with as many and another verdict crosses nothing: a pair became two real roots or the reverse,
      or another root grows fastest.

    Parameters
    ----------
    continuation : BandContinuation
        The roots of the band over the parameter.
    events : sequence of Event
        Crossings that were located, by rising value.
    values : sequence of float
        The computed values of the parameter, from the first to the last of the range.
    band : str
        The band in words, for sentences.
    """
    low = continuation.low
    high = continuation.high
    margin = MARGIN * (high - low)
    clusters = cluster_events(events, SAME * (high - low))
    end = high
    # what an event at the end of the range brings shows beyond the end
    if clusters and high - clusters[-1][-1].value <= margin:
        end = high + 2 * margin
    edges = [low, *(cluster[0].value for cluster in clusters), end]
    intervals = list(itertools.pairwise(edges))
    midpoints = [(start + stop) / 2 for start, stop in intervals]
    computed = []  # without values next to an event, where the verdict of either side may be found
    for value in values:
        if all(abs(value - event.value) > margin for event in events):
            computed.append(value)
    typical = _typical_values(continuation, clusters, intervals, computed, margin)
    counts = [continuation.at(value).unstable_count for value in typical]
    unexplained = []
    for cluster, (below, above) in zip(clusters, itertools.pairwise(typical), strict=True):
        least_below, most_below = continuation.at(below).count_bounds
        least_above, most_above = continuation.at(above).count_bounds
        rise = sum(event.rise for event in cluster)
        at_cluster = f"{continuation.name} = {cluster[0].value:.6g}"
        # what grows above and did not below has crossed; where a real root crosses another one may
        # have come from above the band
        if most_below + rise < least_above and all(event.omega > 0.0 for event in cluster):
            unexplained.append(
                f"what grows beside {at_cluster} does not follow from what crosses there; a "
                f"growing mode may have entered {band}"
            )
        # what grows just above the cluster and no longer further up has left the band. Just above
        # it growth may hide in rounding: it is what grows just below, and what crosses
        before = max(low, cluster[0].value - margin)
        after = cluster[-1].value + margin
        if least_below + rise > most_above and after < above:
            least_before, _ = continuation.at(before).count_bounds
            if least_before + rise - most_above > _left_between(continuation, after, above):
                unexplained.append(f"growth at {at_cluster} ends at no threshold")
    left_out: dict[int, str] = {}  # by the number of the interval
    for value in sorted({*computed, *midpoints}):
        k = sum(cluster[0].value < value for cluster in clusters)  # the number of its interval
        count = continuation.at(value).unstable_count
        typical_count = counts[k]
        is_other_verdict = count.verdict != typical_count.verdict
        _, most_growing = continuation.at(value).count_bounds
        is_fewer = most_growing < typical_count.growing_roots
        here = f"{continuation.name} = {value:.6g}"
        if count.growing_roots > typical_count.growing_roots:
            what = count.verdict if is_other_verdict else f"{count.verdict} of one more mode"
            unexplained.append(f"{what} at {here} follows from no threshold that was located")
        elif is_fewer:
            grows_at = f"{continuation.name} = {typical[k]:.6g}"
            missing = typical_count.growing_roots - most_growing
            has_left = missing <= _left_between(continuation, typical[k], value)
            # in the first interval growth begins without an event; it is not hidden by rounding,
            # since the value is not next to an event
            if not has_left or (k == 0 and value < typical[k]):
                what = f"{typical_count.verdict} at {grows_at}"
                unexplained.append(f"{what} follows from no threshold that was located")
                continue
            words = (
                f"fewer modes are found to grow in {band} at {here} than at {grows_at}, with no "
                "threshold between; where they leave or enter is not listed"
            )
            left_out.setdefault(k, words)
    result = SearchResult(tuple(map(tuple, clusters)), tuple(counts), continuation)
    distinct = list(dict.fromkeys(unexplained))
    return _Comparison(result, midpoints, distinct, list(left_out.values()))
