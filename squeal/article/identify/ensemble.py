"""Ensembles: motions of many pads, side by side in heyoka's batch mode and in several processes."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from squeal.errors import ComputationError
from squeal.io.processes import mapped
from squeal.model.contact import CONSISTENT, Formulation
from squeal.model.equations import PadModel, Units, natural_units
from squeal.model.pad import Model, Pad, pose_of
from squeal.numerics.threads import threads_of_a_verb
from squeal.simulation.hybrid import (
    CLEAR,
    MISSED,
    Limit,
    ModelEnd,
    Segment,
    first_contact,
    integrate,
    off_level,
)
from squeal.simulation.run import heyoka

# motions whose steps are stored: natural time of those in one lane, which bounds memory, and how
# many run in one lane at most, however short they are
MEASURED_AT_ONCE = 800.0
MOST_IN_LANE = 8

Arrays = dict[str, np.ndarray]
Measure = Callable[[Segment, Units], Arrays]
"""Arrays (n, ...) in the units of the pads, from n motions side by side and their units (n,)."""


def stack(pads: Sequence[Pad]) -> Pad:
    """Many pads as one whose parameters are arrays (n,); None where the first pad has None."""
    columns: dict[str, Any] = {
        name: np.array([getattr(pad, name) for pad in pads], dtype=float)
        for name in pads[0].given()
    }
    return Pad(**columns)


def single(stack: PadModel, index: int) -> PadModel:
    """One pad of an undamped stack, its parameters as numbers."""
    pad = {name: float(values[index]) for name, values in stack.pad.given().items()}
    return dataclasses.replace(stack, pad=Pad(**pad))


def some_pads(model: PadModel, which: Any) -> PadModel:
    """Some of a stack of pads, all of whose numbers are arrays (n,): by a slice or by numbers."""
    pad = model.pad.replace(**{name: v[which] for name, v in model.pad.given().items()})
    damping: Any = model.damping  # entries are arrays (n,) too
    rows = damping and tuple(tuple(v[which] for v in row) for row in damping)
    return dataclasses.replace(model, pad=pad, damping=rows)


def _unsure(segment: Segment) -> np.ndarray:
    """True (n,) for motions side by side that are run again alone, since they may be wrong.

    A motion is unsure that could not be carried to the end, that ends with a gap of the wrong sign,
    or in which several points may have changed in one instant.
    """
    # at the end of the motion a point has passed the surface, but its contact has not changed
    # `overshoot` (points, n): how far each is beyond the surface, in natural units
    has_wrong_gap = (segment.overshoot > MISSED).any(axis=0)
    unsure = (segment.limit == Limit.FAILED) | (has_wrong_gap & (segment.limit == Limit.NONE))
    changes = segment.changes
    c = segment.coefficients(changes.motion)
    gaps = np.array(segment.law.gaps(c, pose_of(np, c.xy_theta(changes.state))))  # (point, change)
    # how far a point is from changing its contact: its gap if it is separated, minus it if it
    # touches
    distance = np.where(segment.contact_after_changes > 0, -gaps, gaps)
    is_near = distance < CLEAR * (1.0 + c.w + c.h)  # lengths in natural units
    is_near[changes.point, np.arange(len(changes.t))] = False  # the point that changes itself
    unsure[changes.motion[is_near.any(axis=0)]] = True
    return unsure


def _blocks(lengths: np.ndarray, lanes: int, dense: bool) -> Iterator[np.ndarray]:
    """Indices of the motions that are run at once, block by block, a multiple of `lanes` in each.

    Long motions come first, so that those side by side are alike; the last lanes repeat a motion.
    Without `dense`, all motions are one block. With `dense`, which stores steps, a block gives each
    lane as many motions, one after the other, as fill the natural time `MEASURED_AT_ONCE`, but at
    most `MOST_IN_LANE`. lengths (n,): natural times of the motions.
    """
    n = len(lengths)
    remaining = np.argsort(-lengths, kind="stable")
    to_fill = -n % lanes
    # the last motion is repeated (none if there is no motion)
    remaining = np.append(remaining, remaining[-1:].repeat(to_fill))
    while remaining.size:
        in_lane = n  # motions in a lane of this block: as many are enough for all motions
        if dense:
            longest = lengths[remaining[0]]
            in_lane = MOST_IN_LANE
            if longest * MOST_IN_LANE > MEASURED_AT_ONCE:
                in_lane = int(MEASURED_AT_ONCE / longest) + 1
        # the second part is empty where fewer motions remain
        block, remaining = np.split(remaining, [in_lane * lanes])
        yield block


def _results(segment: Segment, units: Units, measure: Measure | None, events: bool) -> Arrays:
    """What `simulate_many` returns of the motions of a segment, in the units (n,) of their pads.

    A motion that does not reach its end has blanks in place of a final state and of measures.
    measure, events: as `simulate_many` takes them.
    """
    n = len(segment.t0)
    valid = segment.limit == Limit.NONE
    time = segment.t1 * units.time
    final = np.array(segment.end)
    time[segment.limit == Limit.FAILED] = np.nan
    final[:, ~valid] = np.nan
    results = {  # a row for each motion
        "limit": segment.limit,
        "valid": valid,
        "ended": time,
        "final": units.to_si(final).T,
        "steps": segment.step_count,
        "changes": np.bincount(segment.changes.motion, minlength=n),
    }
    if events:
        changes = segment.changes  # in order of the motions
        times = changes.t * np.asarray(units.time)[changes.motion]
        table = np.array([times, changes.point]).T
        results["events"] = np.empty(n, dtype=object)
        first_change = np.searchsorted(changes.motion, np.arange(1, n))  # of motions 1 to n - 1
        results["events"][:] = np.split(table, first_change)
    if measure is not None:
        for name, measured in measure(segment, units).items():
            # NaN in place of floats ("f"), None of objects ("O"), 0 of whole numbers
            blank = {"f": np.nan, "O": None}.get(measured.dtype.kind, 0)
            results[name] = measured.copy()
            results[name][~valid] = blank
    return results


def _motions(
    task: tuple[PadModel, np.ndarray, np.ndarray],
    tolerance: float,
    measure: Measure | None,
    events: bool,
) -> Arrays:
    """The arrays that `simulate_many` returns, of the motions of some pads.

    task: the pads, first states (n, 6) and lengths of time (n,), in the units of the pads. The
    motions run side by side; those that may be wrong, see `_unsure`, are run again alone.
    """
    pads_as_given, initial, duration = task
    n = len(duration)
    from squeal.article.identify.batch import LANES, TaylorBatch  # where heyoka is installed

    # natural units of each pad, (n,), in which all motions are computed
    unit_arrays = vars(natural_units(pads_as_given, initial.T)).values()
    units = Units(*(np.broadcast_to(v, n) for v in unit_arrays))  # type: ignore[arg-type]
    model = units.scaled(pads_as_given)
    scaled_initial = units.to_scaled(initial.T)
    stop = duration / units.time
    contact = first_contact(model, scaled_initial)
    state = off_level(model, scaled_initial, contact)
    dense = measure is not None
    results: Arrays = {}

    def store(pads: np.ndarray, segment: Segment) -> None:
        """Put the motions of the pads with these indices into `results`."""
        their_units = Units(*(v[pads] for v in vars(units).values()))
        for name, values in _results(segment, their_units, measure, events).items():
            if name not in results:
                results[name] = np.empty((n, *values.shape[1:]), values.dtype)
            results[name][pads] = values

    c = model.c
    # motions are sorted by their number of steps, roughly their time times the highest frequency:
    # where the pad turns easily (I below m (w^2 + h^2)) its rotation is the fastest motion
    lengths = stop * np.maximum(np.sqrt(c.m * (c.w**2 + c.h**2) / c.I), 1.0)
    for block in _blocks(lengths, LANES, dense):
        side_by_side = TaylorBatch(some_pads(model, block), tolerance)
        begin = np.zeros(len(block))
        segment = side_by_side.run(contact[:, block], begin, state[:, block], stop[block], dense)
        unsure = _unsure(segment)
        limit = np.where(unsure, Limit.FAILED, segment.limit)
        store(block, dataclasses.replace(segment, limit=limit))
        for i in np.unique(block[unsure]).tolist():
            its_units = Units(*(float(v[i]) for v in vars(units).values()))
            alone = _alone(some_pads(model, i), its_units, state[:, i], stop[i], tolerance, dense)
            if alone is not None:  # else it stays stored as failed
                store(np.array([i]), alone)
    return results


def _alone(
    model: PadModel,
    units: Units,
    state: np.ndarray,
    stop: float,
    tolerance: float,
    dense: bool,
) -> Segment | None:
    """The motion of one pad in natural units, from a state (6,); None where it cannot be computed.

    Where it leaves the model, the segment ends there and holds the limit. stop: the time at its
    end; dense: whether the segment gives states within its steps.
    """
    segments = list[Segment]()
    integrator = heyoka().TaylorIntegrator(model, tolerance)
    try:
        integrate(model, integrator, units, state, float(stop), [segments.append], dense)
    except ModelEnd:
        pass
    except ComputationError:
        return None
    return Segment.joined(segments)


def simulate_many(
    model: Model,
    pads: Pad,
    initial: np.ndarray,
    stop: float | np.ndarray,
    tolerance: float = 1e-8,
    formulation: Formulation = CONSISTENT,
    measure: Measure | None = None,
    events: bool = False,
    workers: int = 1,
    damping: np.ndarray | None = None,
) -> Arrays:
    """Simulate n pads of a model; all units follow those of the pads.

    A motion whose points may change contact in one instant, or that may have missed a contact
    change, is run again alone.

    Parameters
    ----------
    pads : Pad
        Its parameters are numbers or arrays (n,), see `stack`.
    initial, stop : (n, 6) array, float or (n,) array
        First states and lengths of time.
    tolerance : float
        Of the integrator.
    formulation : Formulation
        Of the line contact.
    measure : callable, optional
        What is measured, see `Measure`; a function of a module if there are several processes.
    events : bool
        Whether the contact changes are wanted.
    workers : int
        Processes, which start anew by import, see `mapped`.
    damping : (3, 3) or (n, 3, 3) array, optional
        The damping matrix of all or of each.

    Returns
    -------
    dict of arrays
        limit (`Limit`), valid (bools: no limit was reached), ended (time), final (n, 6), steps,
        changes (number of contact changes), with `events` events (arrays (changes, 2) of
        time and contact point), and what `measure` gives. Where a pad did not reach the end, final
        states and measures are NaN, None or 0.

    Raises
    ------
    ComputationError
        Where heyoka is not installed, a number is not finite or a length of time below 0.
    """
    heyoka()  # raises where it is not installed
    starts = np.asarray(initial, dtype=float)
    # all numbers as arrays (n,), of which each process takes a part; so also each entry of the
    # damping matrix, in `rows` for the model and in `entries` to be checked
    count = len(starts)
    numbers = {name: np.broadcast_to(v, count) for name, v in pads.given().items()}
    stops = np.broadcast_to(np.asarray(stop, dtype=float), count)
    rows = None
    entries: list[np.ndarray] = []
    if damping is not None:
        C = np.broadcast_to(damping, (count, 3, 3))
        rows = tuple(tuple(C[:, i, j] for j in range(3)) for i in range(3))
        entries = [*C.reshape(count, 9).T]
    finite = np.isfinite([*numbers.values(), *entries, stops, *starts.T]).all(axis=0)
    for is_valid, reason in ((finite, "are not finite"), (stops >= 0.0, "end before time 0")):
        if not is_valid.all():
            raise ComputationError(
                f"the numbers of pad {np.argmin(is_valid)} of the ensemble {reason}"
            )
    whole = PadModel(model, pads.replace(**numbers), formulation, rows)  # type: ignore[arg-type]
    size = math.ceil(count / workers)
    parts = [slice(i, i + size) for i in range(0, count, size)]
    tasks = [(some_pads(whole, part), starts[part], stops[part]) for part in parts]
    motions = partial(_motions, tolerance=tolerance, measure=measure, events=events)
    with threads_of_a_verb(workers):
        chunks = list(mapped(motions, tasks))
    return {name: np.concatenate([chunk[name] for chunk in chunks]) for name in chunks[0]}


def simulate_stacks(
    stacks: Sequence[PadModel],
    states: np.ndarray,
    stop: float,
    tolerance: float,
    measure: Measure,
    workers: int = 1,
) -> tuple[Arrays, np.ndarray]:
    """Simulate k stacks of n pads of one model and formulation, all motions in one batch.

    states (k, n, 6): first states, NaN for a pad without one, whose motion is left out.

    Returns
    -------
    arrays : dict of arrays
        As of `simulate_many`, of all motions but those left out; "valid" alone if none is there.
    row : (k, n)
        Where in the arrays each motion stands, -1 for one that is left out.
    """
    flat = states.reshape(-1, 6)
    with_start = np.flatnonzero(np.isfinite(flat).all(axis=1))
    row_of_motion = np.full(len(flat), -1)
    row_of_motion[with_start] = np.arange(len(with_start))
    row = row_of_motion.reshape(states.shape[:2])
    if not with_start.size:
        return {"valid": np.empty(0, dtype=bool)}, row
    given = [stack.pad.given() for stack in stacks]
    columns: dict[str, Any] = {}  # parameters of the pads with a start, in order of stack and pad
    for name in given[0]:
        columns[name] = np.concatenate([parameters[name] for parameters in given])[with_start]
    first = stacks[0]  # whose model and formulation all have
    arrays = simulate_many(
        first.name,
        Pad(**columns),
        flat[with_start],
        stop,
        tolerance,
        first.formulation,
        measure,
        workers=workers,
    )
    return arrays, row


def simulate_damped(
    pads: Sequence[PadModel],
    states: np.ndarray,
    stop: float | np.ndarray,
    tolerance: float,
    measure: Measure | None = None,
) -> Arrays:
    """Simulate damped pads of one model and formulation.

    pads: models of one pad each; states (n, 6): first states; stop: length of time, in the units of
    the pads as all else; tolerance, measure and the returned arrays: as those of `simulate_many`.
    """
    first = pads[0]
    return simulate_many(
        first.name,
        stack([model.pad for model in pads]),
        states,
        stop,
        tolerance,
        first.formulation,
        measure,
        damping=np.array([model.damping for model in pads]),
    )
