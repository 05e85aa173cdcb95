"""Thresholds of a system over its parameter: all of a small one, those of a band of a large one.

Small systems: all roots are followed by continuation. Large ones: the roots of a reduced system are
followed, and their crossings of the imaginary axis located on the full one by Newton's method.
Either way the located events are compared with what grows at values between them, see
`squeal.queries.systems.band_comparison`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.io.processes import with_progress
from squeal.io.system import SystemFile
from squeal.linear import CriticalPoint, Crossing, thresholds
from squeal.linear.bends import undersampled_factor
from squeal.linear.continuation import DAMPED, SMALL_ROWS, problem_class_of
from squeal.linear.eigen import growing
from squeal.linear.events import Event
from squeal.linear.functions import matrices_of
from squeal.linear.matrices import EPS, applied, dense, is_regular
from squeal.linear.roots import ComplexArray
from squeal.linear.search import SearchResult, cluster_events, hull, search
from squeal.linear.system import TermSystem
from squeal.linear.thresholds import points_and_crossings
from squeal.numerics.differentiation import Parameters
from squeal.numerics.threads import side_by_side
from squeal.queries.ranges import IS_VAGUE, vague_interval
from squeal.queries.systems.all_roots import NO_BAND, is_small, roots_of_all
from squeal.queries.systems.band_comparison import BandContinuation, Roots, compare
from squeal.queries.systems.reduced import basis_of, first_look_for_thresholds, reduced_for
from squeal.queries.systems.verdicts import rounding_of, verdict_of
from squeal.results.columns import basis_text
from squeal.results.sources import EigenvalueSelection, SystemSource
from squeal.results.thresholds import MISSED, Thresholds
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.axis_crossing import CrossingGuess
from squeal.sparse.crossings import coalescences, crossings_along
from squeal.sparse.dispersive import DispersiveReduction
from squeal.sparse.first_look import FirstLook
from squeal.sparse.quadratic import PROGRESS, ScaledSystem
from squeal.sparse.reduction import Reduction
from squeal.sparse.region_roots import modes_in
from squeal.sparse.singular_stiffness import singular_stiffness, without_zeros

if TYPE_CHECKING:  # few systems need the referee
    from squeal.proof.polynomials import Change, ExactRange

STEPS = 13  # values at which a reduced system has to be good
COUNTED_ROWS = 50_000  # larger systems are not counted again between their thresholds
ROUNDINGS = 2  # of |P|, in units of the machine precision: of entries, their scaling and products
SINGULAR = 1e3  # times its rounding: a singular value of P that counts as zero
SAME_MODE = 1e-6  # of a frequency: crossings so near in frequency may be of one mode


@dataclass(frozen=True, eq=False)
class _LocatedThresholds:
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
    shared_reduction: Reduction | None = None,
    step_ends: Sequence[float] = (),
    exact_range: ExactRange | None = None,
) -> SystemThresholds:
    """Locate every threshold of a system over its free parameter p.

    Of a small system all roots are followed; with a band or region only if it has at most
    `SMALL_ROWS` rows and a regular M. Other thresholds are searched on a reduced system and located
    on the full one. Growing roots are then counted on the full system, at one value between each
    two neighbouring crossings. `certified` says whether the counts, and the roots at all computed
    values, agree with the list. This does not prove that no interval of instability lies between
    two such values.

    Parameters
    ----------
    system : TermSystem
        The system.
    high, low : float
        The range of p. Without `low` it begins at 0, or at high / 100 where a factor divides by p.
    selection : EigenvalueSelection, optional
        The band or region whose roots are judged; all roots if left out.
    shared_reduction : Reduction, optional
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
        For an empty range, for a large system or complex matrices without a band or region, and for
        a region that holds no part of the imaginary axis.
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
        located = _located_in_band(system, selection, values, shared_reduction)
        assert located.reduction is not None
        roots = located.reduction.values
    located = _without_vague_certificate(located, system.parameter, high - low)
    at_start = roots({system.parameter: low})
    doubts: list[str] = []
    if located.certified is not None:  # if nothing was counted no reason is needed
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
            "basis": basis_of(located.reduction, selection),
        },
        source=SystemSource(SystemFile(system), selection, located.reduction),
    )
    return SystemThresholds(answer, located.all_crossings)


def start_of_range(system: TermSystem, high: float) -> float:
    """The lower end of a range up to `high` for which none is given.

    It is 0, or high / 100 where the matrices have no value or no derivative at 0: beside such a
    pole roots move so fast that a search would compute most of its values there.
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

    They are spaced unevenly, so that few of them are round shares of the range: thresholds often
    lie at round numbers, where rounding hides the verdict.
    """
    k = np.arange(1, STEPS - 1)
    # 4, 7 or 11 % of a step above equally spaced values
    shares = (k + 0.0371 * (1 + k % 3)) / (STEPS - 1)
    inner = low + shares * (high - low)
    return sorted([low, *step_ends, *inner.tolist(), high])


def _located_among_all(
    system: TermSystem,
    selection: EigenvalueSelection,
    low: float,
    high: float,
    step_ends: Sequence[float],
    roots: Roots,
) -> _LocatedThresholds:
    """Locate the thresholds of a small system by following all its roots.

    Of a band or region only crossings whose frequency lies inside are thresholds. step_ends: values
    of the parameter at which steps of the search end; roots: a function that gives the selected
    roots (m,), rad/s, at some parameters.
    """
    # `step_ends` are the values at which an earlier list was refuted: it may have missed fast roots
    was_refuted = bool(step_ends)
    of_all_roots = thresholds(system.balanced, high, step_ends, low, all_roots=was_refuted)
    doubts: list[str] = []
    for part in of_all_roots.searched:  # of the range, between the ends of steps
        doubts += part.doubts or ()  # None only where matrices are plain functions, not terms
    region = selection.rectangle
    located = _LocatedThresholds(
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
    comparison = compare(continuation, events, values, selection.words())
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
) -> _LocatedThresholds:
    """The thresholds of a small system, between `low` and `high`, as an exact range has them.

    exact_range: the changes of the number of growing roots, each in an interval of the parameter;
    roots: gives all roots (m,), rad/s, at a value of the parameter.
    """
    is_undamped = not system.C

    def event_of(change: Change) -> Event:
        is_pair = abs(change.rise) == 2
        return Event(
            value=min((change.low + change.high) / 2.0, high),
            omega=change.omega,
            direction=int(np.sign(change.rise)),
            interval=(change.low, change.high),
            coalesces=is_undamped and is_pair,  # as every undamped flutter begins
            is_pair_at_zero=is_pair and change.omega == 0.0,
        )

    continuation = BandContinuation(system, low, high, roots, is_exact=True)
    clusters = cluster_events([event_of(change) for change in exact_range.changes], distance=0.0)
    # what grows is counted in the middle between the intervals of neighbouring clusters
    starts = [low]
    stops = []
    for cluster in clusters:
        cluster_low, cluster_high = hull(cluster)
        stops.append(cluster_low)
        starts.append(cluster_high)
    stops.append(high)
    counts = []
    for start, stop in zip(starts, stops, strict=True):
        # where the interval of the last change reaches beyond `high`, stop lies below start
        middle = max(start, (start + stop) / 2.0)
        counts.append(continuation.at(middle).unstable_count)
    result = SearchResult(tuple(map(tuple, clusters)), tuple(counts), continuation)
    points, crossings = points_and_crossings(result)
    return _LocatedThresholds(points, crossings, certified=True, all_crossings=crossings)


def _exact_roots(system: TermSystem, exact_range: ExactRange, changes: Parameters) -> ComplexArray:
    """All roots at a value of the parameter, to which a range of exact thresholds belongs."""
    return exact_range.roots_at(changes[system.parameter])


def _events_inside(searched: Iterable[SearchResult], region: Rectangle) -> list[Event]:
    """The events of searches, by rising parameter, whose frequency lies in a region."""
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
    shared: Reduction | None,
) -> _LocatedThresholds:
    """Locate the thresholds of a band on the cheapest reduced system that serves.

    The system `shared` with others is taken if it is given. Otherwise a projection onto real modes
    is tried, which serves if counts on the full system certify its list. The last one is a
    projection onto full solutions.

    values: rising values of the parameter at which the reduced system has to be good.
    """
    if shared is not None:
        return _located_on_reduction(system, selection, shared, values, is_shared=True)
    changes = [{system.parameter: value} for value in values]
    if system.n <= COUNTED_ROWS:
        first_look = first_look_for_thresholds(system, selection, changes)
        if first_look is not None:
            trained = [point[system.parameter] for point in first_look.trained]
            values = sorted({*values, *trained})
            located = _located_on_reduction(system, selection, first_look, values)
            if located.certified:
                return located
    reduction = reduced_for(system, selection, changes)
    return _located_on_reduction(system, selection, reduction, values)


def _located_on_reduction(
    system: TermSystem,
    selection: EigenvalueSelection,
    reduction: Reduction,
    values: Sequence[float],
    is_shared: bool = False,
) -> _LocatedThresholds:
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
    is_shared : bool
        Whether the reduced system was made for several systems, this system among them. The reduced
        system is not changed then, and nothing is counted. Else the vectors of roots that pass
        through zero are added to its basis.
    """
    name = system.parameter
    low = values[0]
    high = values[-1]
    unconfirmed: list[str] = []
    unclear_static: list[str] = []
    zero_roots: list[CrossingGuess] = []
    bordered: ScaledSystem | None = None
    region = reduction.region
    if system.real and not is_shared and region.low_imag < 0.0:
        # static losses of stability: the region holds roots that pass through zero, where K is
        # singular; their vectors are added to the basis
        bordered = without_zeros(reduction.scaled, values)
        zero_roots, unclear_static = singular_stiffness(bordered, values)
        for guess in zero_roots:
            # the first n rows: those behind them border the system, see `without_zeros`
            reduction.extend(np.column_stack([guess.right, guess.left])[: system.n])
    PROGRESS.get()("following the roots of the reduced system")
    events: Sequence[Event]
    is_conservative = system.undamped and not system.C  # neither damped nor gyroscopic
    if isinstance(reduction, DispersiveReduction) and is_conservative:
        # each root at its own frequency stays on the axis until two coalesce
        events = coalescences(reduction, values)
    elif not system.real or problem_class_of(matrices_of(reduction.system, values)) is DAMPED:
        events, unconfirmed = crossings_along(reduction, name, values, zero_roots, bordered)
    else:  # undamped: coalescences of the reduced system, which are not located on the full one
        on_reduced = _events_inside([search(reduction.system, low, high)], region)
        events = [_with_rounding(reduction, name, event, low) for event in on_reduced]
    continuation = BandContinuation(system, low, high, reduction.values)
    comparison = compare(continuation, events, values, selection.words())
    if isinstance(reduction, FirstLook):
        # `points_and_crossings` reads the roots at thresholds, which the small basis estimates
        # cheaply. The comparison above is made without these roots: at a crossing the sign of a
        # growth rate is rounding
        for event in events:
            continuation.set_roots(event.value, reduction.basis_values({name: event.value}))
    points, crossings = points_and_crossings(comparison.result)
    unconfirmed = [*unconfirmed, *comparison.unexplained, *unclear_static]
    certified = None  # until roots are counted
    doubts: list[str] = []
    # more rows cost too much; roots of matrices that follow the frequency cannot be counted
    is_counted = not is_shared and system.n <= COUNTED_ROWS and not system.follows
    if is_counted:
        if not unconfirmed:  # a list with unconfirmed events is not certified by any count
            doubts = _disagreeing_counts(reduction, continuation, comparison.midpoints)
        unseen = undersampled_factor(system, sorted({*values, *comparison.midpoints}))
        if unseen is not None:
            doubts.append(
                f"the factor {unseen} may rise and fall between the values of {name} that were "
                "looked at"
            )
        certified = not unconfirmed and not doubts
    return _LocatedThresholds(
        points=points,
        crossings=crossings,
        certified=certified,
        doubts=doubts,
        unconfirmed=unconfirmed,
        left_out=comparison.left_out,
        reduction=reduction,
    )


def _with_rounding(reduction: Reduction, name: str, event: Event, low: float) -> Event:
    """An event of an undamped reduced system, its interval widened by rounding of the full system.

    At a root z let P = z^2 M + z C + K, and x, y unit vectors with P x = 0 and y^H P = 0. A change
    dP of P moves the parameter p of the event by y^H dP x / (y^H dP/dp x): also where two roots
    meet, since a change of the root changes y^H P x in second order only. Here |dP| is rounding of
    the full system. Of several x and y those with the largest |y^H dP/dp x| count.

    Parameters
    ----------
    reduction : Reduction
        The reduced system.
    name : str
        The parameter p.
    event : Event
        Located on the reduced system. A root that passes zero keeps its interval if K is singular
        at `low` already, as with a free motion.
    low : float
        The first value of p.
    """
    event = replace(event, residual=reduction.worst_residual)
    at_event = {name: event.value}
    system = reduction.system
    root = np.array(1j * event.omega)
    identity = np.eye(system.n)  # to which P is applied, to have it as an array (n, n)
    rounding = ROUNDINGS * EPS * reduction.scaled.at(at_event).size(root)
    if not event.omega:
        K_at_low = applied(system.at({name: low}), root, identity)
        least_singular_value = np.linalg.norm(K_at_low, -2)
        if least_singular_value <= SINGULAR * rounding:
            return event
    P = applied(system.at(at_event), root, identity)
    left, singular_values, right = np.linalg.svd(P)  # P = left @ diag(singular_values) @ right
    is_null = singular_values <= max(singular_values[-1], SINGULAR * rounding)
    x = right[is_null].conj().T  # columns (n, k), as those of y
    y = left[:, is_null]
    slope = np.linalg.norm(y.conj().T @ applied(system.derivative(name, at_event), root, x), 2)
    margin = float(rounding / slope)
    first, last = event.interval
    return replace(event, interval=(first - margin, last + margin))


def _disagreeing_counts(
    reduction: Reduction, continuation: BandContinuation, values: Sequence[float]
) -> list[str]:
    """A sentence for each value at which the full system does not have as many growing roots as the
    reduced one."""
    expected = [continuation.at(value).growing_roots for value in values]
    counts = side_by_side(partial(_count_agrees, reduction), values, expected)
    agreements = with_progress(counts, len(values), PROGRESS.get(), "counts")
    doubts = []
    for value, agrees in zip(values, agreements, strict=True):
        if not agrees:
            at = f"{continuation.name} = {value:.9g}"
            doubts.append(f"a count on the full system at {at} disagrees")
    return doubts


def _without_vague_certificate(
    located: _LocatedThresholds, parameter: str, extent: float
) -> _LocatedThresholds:
    """Withdraw a certificate that the intervals of crossings do not support.

    - Two neighbouring crossings of one mode, at which growth begins and ends, have intervals that
      overlap: by rounding there may be neither crossing.
    - An interval is so wide that it may hold several crossings.

    extent: of the range of the parameter.
    """
    if not located.certified:
        return located
    doubt = ""
    vague = vague_interval((crossing.interval for crossing in located.crossings), extent)
    if vague is not None:
        low, high = vague
        doubt = f"{IS_VAGUE} ({parameter} = {low:.6g} to {high:.6g})"
    for lower, upper in itertools.pairwise(located.crossings):
        is_same_mode = math.isclose(lower.frequency_hz, upper.frequency_hz, rel_tol=SAME_MODE)
        overlap = lower.interval[1] >= upper.interval[0]
        if is_same_mode and overlap and lower.direction != upper.direction:
            doubt = f"growth that begins and ends at {parameter} = {lower.mu:.9g} may be rounding"
            break
    if not doubt:
        return located
    return replace(located, certified=False, doubts=[*located.doubts, doubt])


def _number_outside(located: _LocatedThresholds) -> int | None:
    """How many crossings lie outside of the band; None if they were not searched."""
    if located.all_crossings is None:
        return None
    return len(located.all_crossings) - len(located.crossings)


def _notes(
    system: TermSystem, selection: EigenvalueSelection, located: _LocatedThresholds
) -> list[str]:
    """The lines below the list of thresholds."""
    notes = [f"not confirmed on the full system: {event}" for event in located.unconfirmed]
    notes += located.left_out
    if system.follows:
        notes.append("each root at its own frequency")
    if not system.real:
        notes.append("roots on the real axis, a static loss of stability, are not looked for")
    # the list holds those of a band or region alone; a reduced system has no others
    if selection.rectangle is not None or located.reduction is not None:
        outside = _number_outside(located)
        count = "not looked for" if outside is None else f"{outside}"
        notes.append(f"crossings outside {selection.words()}: {count}")
    # a certified list has this note too: counts at some values miss an unstable range between two
    # values. Of real systems, whose roots are continued, only a very narrow range is missed
    if located.certified is not None:
        missed = "Very narrow unstable ranges" if system.real else "Narrow unstable ranges"
        notes.append(f"{missed} {MISSED}")
    basis = basis_of(located.reduction, selection)
    if basis:
        notes.append(basis_text(basis, counted=located.certified is not None))
    return notes


def _count_agrees(reduction: Reduction, value: float, expected: int) -> bool:
    """True if as many roots of the full system in the region grow as are expected at a value of the
    parameter, where a pair counts as two. reduction: the reduced system, which knows both."""
    name = reduction.system.parameter
    PROGRESS.get()(f"counting growing roots at {name} = {value:.6g}")
    if isinstance(reduction, FirstLook):
        # its region lies above the real axis: it holds one root of each pair, and no real root
        expected_pairs = expected // 2
        if reduction.misses_none({name: value}, growing=expected_pairs):
            return True
        # between two thresholds close together a root of the projected problem may have the other
        # sign than that of the full one
    problem = reduction.scaled.at({name: value})
    try:
        full = modes_in(problem, reduction.region)
    except ComputationError:
        return False
    growing_roots = 0
    for mode in growing(full.eigenvalues):  # each pair once
        growing_roots += 2 if mode.kind == "flutter" else 1
    return full.certified and growing_roots == expected
