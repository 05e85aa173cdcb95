"""Crossings and coalescences on the imaginary axis along a parameter: from a reduced system.

A reduced system is cheap at each value of the parameter. On it all crossings in a region are
searched (`crossing_search`); each is a guess from which Newton's method locates the crossing of the
full system (`axis_crossing`). The reduced vectors are accurate enough for that, since their errors
count in second order.

Where matrices depend on the frequency of each root, a reduced system is frozen at several
frequencies, and the crossings of each of these start Newton's method with the matrices at the
root's own frequency. A guess that leads to no crossing of the full system is reported, unless
another frozen frequency is nearer and gives it again.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from squeal.errors import ComputationError
from squeal.linear.continuation import Continuation
from squeal.linear.events import Event, locate_event
from squeal.linear.search import search
from squeal.linear.steps import meeting_at
from squeal.linear.system import System
from squeal.numerics.threads import side_by_side
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.axis_crossing import (
    CONVERGED_STEP,
    NEWTON_STEPS,
    SAME_SHARE,
    AxisCrossing,
    CrossingGuess,
    axis_crossing,
    is_same_crossing,
)
from squeal.sparse.crossing_search import SHORTEST_STEP, CrossingSearch
from squeal.sparse.dispersive import NEAR_INTERVALS, DispersiveReduction, around, frequencies
from squeal.sparse.quadratic import ScaledSystem, multiply
from squeal.sparse.reduced_basis import COARSE_ERROR, ReducedBasis
from squeal.sparse.reduction import Reduction


class _FrozenPart(NamedTuple):
    """A reduced system frozen at one of several frequencies, in a region around that frequency."""

    path_reduction: ReducedBasis | Reduction
    omega: float  # rad/s
    spacing: float  # between frozen frequencies, rad/s


def _frozen_parts(reduction: Reduction) -> Iterator[_FrozenPart]:
    """The reduced system frozen at evenly spaced frequencies of its band, in regions that overlap;
    one part for the whole band if matrices do not depend on the frequency of each root."""
    if not isinstance(reduction, DispersiveReduction):
        # roots are followed around the region too: they may enter, cross and leave within a step
        followed = copy(reduction.path_reduction)
        followed.region = reduction.region.surroundings
        yield _FrozenPart(followed, 0.0, math.inf)
        return
    region = reduction.region
    grid = frequencies(reduction.system, region)
    spacing = float(np.diff(grid).max())
    for omega in grid.tolist():
        # roots start within NEAR_INTERVALS of a frozen frequency, and move by half an interval more
        near = around(omega, region, reduction.system, NEAR_INTERVALS + 0.5)
        yield _FrozenPart(reduction.frozen(omega, near), omega, spacing)


def _may_lie_in(region: Rectangle, omega: float) -> bool:
    """Whether a crossing lies in a region whose frequency is known as well as a basis gives it."""
    error = COARSE_ERROR * omega
    return region.low_imag - error <= omega <= region.high_imag + error


class _ReducedCrossing(NamedTuple):
    """A crossing of the reduced system, frozen at a frequency if it depends on it."""

    guess: CrossingGuess  # vectors in the scaled coordinates of the full system
    is_near_part: bool  # False if its omega is nearer to another of the frozen frequencies


def _crossings_of_reduced(
    reduction: Reduction, name: str, values: Sequence[float], bordered: ScaledSystem | None
) -> Iterator[_ReducedCrossing]:
    """The crossings of each frozen part of the reduced system, as `crossings_along` is called."""
    shortest = SHORTEST_STEP * (values[-1] - values[0])
    for part in _frozen_parts(reduction):
        reduced = part.path_reduction
        search_on_part = CrossingSearch(reduced, name, bordered)
        scale = search_on_part.scaled.scale
        for a, b in itertools.pairwise(values):
            for guess in search_on_part.between(a, b, shortest):
                # vectors of the guess: from the scaled coordinates of the search to those of the
                # part, then to the coordinates of the basis of the reduction, and then to the
                # scaled coordinates of the full system
                vectors = reduced.in_projection(scale * guess.right, scale * guess.left)
                right, left = multiply(reduction.vectors, np.array(vectors, dtype=complex).T).T
                is_near_part = abs(guess.omega - part.omega) <= part.spacing / 2
                yield _ReducedCrossing(guess._replace(right=right, left=left), is_near_part)


def crossings_along(
    reduction: Reduction,
    name: str,
    values: Sequence[float],
    zero_roots: Sequence[CrossingGuess] = (),
    bordered: ScaledSystem | None = None,
) -> tuple[list[AxisCrossing], list[str]]:
    """All crossings of the imaginary axis by roots in the region of a reduction, while the
    parameter goes from its first to its last value.

    Crossings of the reduced system are located on the full one. Where matrices depend on the
    frequency of each root, the crossings of systems frozen at several frequencies start the search
    for those of the full system with matrices at the root's frequency.

    Parameters
    ----------
    reduction : Reduction
        The reduced system, good at all values.
    name : str
        The parameter.
    values : sequence of float
        Its values, rising: the ends of the first steps.
    zero_roots : sequence of CrossingGuess
        All crossings by real roots, with vectors in the scaled coordinates of `bordered`.
    bordered : ScaledSystem, optional
        The full system, bordered so that it lacks the zeros of free motions, see `without_zeros`.
        Left out, crossings by real roots are searched on the reduced system.

    Returns
    -------
    crossings : list of AxisCrossing
        By rising value of the parameter.
    unconfirmed : list of str
        A sentence for each guess at which no crossing of the full system was located. There is none
        for a guess that is nearer to another frozen frequency, whose system gives it again.

    Raises
    ------
    InputError
        If the region contains no part of the upper imaginary axis.
    """
    region = reduction.region
    guesses = [_ReducedCrossing(guess, is_near_part=True) for guess in zero_roots]
    for reduced in _crossings_of_reduced(reduction, name, values, bordered):
        # with `bordered` all real roots that pass zero are among the zero_roots
        if bordered is None or reduced.guess.omega:
            guesses.append(reduced)
    full = reduction.scaled
    full_of_real_roots = bordered or full  # on which crossings by real roots are located

    def locate(reduced: _ReducedCrossing) -> AxisCrossing | ComputationError:
        guess = reduced.guess
        try:
            return axis_crossing(full if guess.omega else full_of_real_roots, name, guess)
        except ComputationError as error:
            return error

    crossings: list[AxisCrossing] = []  # each once
    unconfirmed: list[str] = []
    for reduced, crossing in zip(guesses, side_by_side(locate, guesses), strict=True):
        if isinstance(crossing, ComputationError):
            if reduced.is_near_part and _may_lie_in(region, reduced.guess.omega):
                unconfirmed.append(str(crossing))
            continue
        is_inside = region.low_imag <= crossing.omega <= region.high_imag
        if is_inside and not any(is_same_crossing(crossing, other) for other in crossings):
            crossings.append(crossing)
    inside: list[AxisCrossing] = []
    for crossing in crossings:
        in_range = _in_range(crossing, values[0], values[-1])
        if in_range is not None:
            inside.append(in_range)
    # of crossings at one value the one whose growth rate changes fastest comes first
    inside.sort(key=lambda crossing: (crossing.value, -abs(crossing.slope)))
    return inside, unconfirmed


def coalescences(reduction: DispersiveReduction, values: Sequence[float]) -> list[Event]:
    """Where two roots meet on the imaginary axis, by rising value of the parameter.

    The reduced system is undamped, and its real matrices depend on the frequency of each root. With
    matrices frozen at omega two roots meet at a frequency omega_c(omega). If the matrices are
    those at the frequency of the two roots, these meet where omega_c(omega) = omega; the secant
    method solves that from each frozen frequency. Two roots that meet at 0 Hz are no flutter, and
    are left out. The `residual` is the worst backward error of the reduced system's roots in the
    full system, in which a coalescence is not located.

    values: of the parameter, rising; only the first and the last one count.
    """
    low = values[0]
    high = values[-1]
    meetings: list[Event] = []
    for part in _frozen_parts(reduction):
        clusters = search(part.path_reduction.system, low, high).clusters
        for event in itertools.chain(*clusters):
            # left out: meetings at 0 Hz, and those beyond the neighbouring frozen frequencies
            if not event.omega or abs(event.omega - part.omega) > part.spacing:
                continue
            meeting = _at_own_frequency(reduction.system, event, part.omega, low, high)
            if meeting and not any(_is_same_meeting(meeting, other) for other in meetings):
                meetings.append(replace(meeting, residual=reduction.worst_residual))
    return sorted(meetings, key=lambda meeting: meeting.value)


def _is_same_meeting(meeting: Event, other: Event) -> bool:
    """Whether two coalescences agree in parameter and frequency, to `SAME_SHARE` of each."""
    return (
        abs(meeting.value - other.value) <= SAME_SHARE * abs(meeting.value)
        and abs(meeting.omega - other.omega) <= SAME_SHARE * meeting.omega
    )


def _at_own_frequency(
    system: System, start: Event, frozen: float, low: float, high: float
) -> Event | None:
    """The coalescence with matrices at its own frequency: the zero of the excess
    omega_c(omega) - omega, where omega_c is the frequency at which two roots meet if matrices are
    frozen at omega.

    By the secant method. None if it does not converge, if at one of its steps no two roots meet at
    a frequency above 0, or if the excess of a step is that of the step before to rounding. `start`
    is the coalescence with matrices at `frozen` (rad/s); the parameter runs from `low` to `high`.
    """
    event = start
    omega_before = frozen
    excess_before = event.omega - frozen
    omega = event.omega  # where the matrices are frozen next
    for _ in range(NEWTON_STEPS):
        continuation = Continuation(system.frozen(omega), low, high)
        spectrum = continuation.at(event.value)  # its roots are omega^2, of the undamped system
        pair = np.argsort(np.abs(spectrum.z - event.omega**2))[:2]
        guess = meeting_at(spectrum, pair, width=high - low)
        meeting = locate_event(continuation, guess)
        if meeting is None or not meeting.omega:
            return None
        event = meeting
        excess = event.omega - omega
        if abs(excess) <= CONVERGED_STEP * omega:
            return event
        if abs(excess - excess_before) <= CONVERGED_STEP * omega:
            return None
        # to the zero of the line through the last two excesses
        step = excess * (omega - omega_before) / (excess_before - excess)
        omega_before = omega
        excess_before = excess
        omega = omega + step
    return None


def _in_range(crossing: AxisCrossing, low: float, high: float) -> AxisCrossing | None:
    """The crossing if it lies in the range of the parameter from `low` to `high`, otherwise None.

    If its interval, which holds rounding, contains an end of the range, the crossing is placed at
    that end, and its interval ends there. But a root whose growth ends at `low` grows nowhere in
    the range: None.
    """
    first, last = crossing.interval
    if first <= low <= last:
        if crossing.direction < 0:
            return None
        return replace(crossing, value=low, interval=(low, last))
    if first <= high <= last:
        return replace(crossing, value=high, interval=(first, high))
    if low <= crossing.value <= high:
        return crossing
    return None
