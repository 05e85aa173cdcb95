"""Ensembles: motions of many pads, side by side in heyoka's batch mode and in several processes."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from squeal.errors import ComputationError
from squeal.io.processes import mapped
from squeal.model.contact import CONSISTENT, Formulation
from squeal.model.equations import PadModel, Units, natural_units
from squeal.model.pad import Model, Pad, pose
from squeal.simulation.hybrid import (
    DEFAULT,
    LIMITS,
    Limit,
    ModelEnd,
    Options,
    Segment,
    first_contact,
    integrate,
    off_level,
)
from squeal.simulation.run import heyoka

MEASURED_AT_ONCE = 800.0  # natural time, in each lane, of motions whose steps are stored meanwhile
DONE = 0
REFUSED = 1 + len(LIMITS)  # outcomes; those between are 1 + the index into `LIMITS`

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


def _some(model: PadModel, which: Any) -> PadModel:
    """Some of a stack of pads, all of whose numbers are arrays (n,): by a slice or by numbers."""
    pad = model.pad.replace(**{name: v[which] for name, v in model.pad.given().items()})
    damping: Any = model.damping  # entries are arrays (n,) too
    rows = damping and tuple(tuple(v[which] for v in row) for row in damping)
    return dataclasses.replace(model, pad=pad, damping=rows)


def _unsure(segment: Segment, options: Options) -> np.ndarray:
    """True (n,) for motions side by side that had better be run alone.

    They could not be carried to the end, a gap has the wrong sign there, or several points may have
    changed in one instant.
    """
    missed = (segment.beyond > options.missed).any(axis=0)
    unsure = (segment.limit == Limit.FAILED) | (missed & (segment.limit == Limit.NONE))
    at = segment.coefficients(segment.motion)
    heights = np.array(segment.law.gaps(at, pose(np, at.place(segment.state))))
    # at each change, how far each point is from the surface on its own side
    distance = np.where(segment.on > 0, -heights, heights)
    is_near = distance < options.clear * (1.0 + at.w + at.h)
    is_near[segment.point, np.arange(len(segment.t))] = False  # the point that changes
    unsure[segment.motion[is_near.any(axis=0)]] = True
    return unsure


def _motions(
    task: tuple[PadModel, np.ndarray, np.ndarray],
    tolerance: float,
    measure: Measure | None,
    events: bool,
    options: Options,
) -> Arrays:
    """What is wanted of the motions of some pads, as `simulate_many` returns it.

    task : the pads, first states (n, 6) and lengths of time (n,)
    """
    pads_in_si, initial, duration = task
    n = len(duration)
    taylor = heyoka()
    from squeal.article.identify.batch import TaylorBatch  # where heyoka is installed

    of_unit = vars(natural_units(pads_in_si, initial.T)).values()
    units = Units(*(np.broadcast_to(v, n) for v in of_unit))  # type: ignore[arg-type]
    model = units.scaled(pads_in_si)
    placed = units.to_scaled(initial.T)
    stop = duration / units.time
    contact = first_contact(model, placed, options)
    state = off_level(model, placed, contact, options)
    results: Arrays = {}

    def store(pads: np.ndarray, segment: Segment) -> None:
        """Store what is wanted of the motions of some pads; measures of those that are whole."""
        own = Units(*(v[pads] for v in vars(units).values()))
        ended = segment.limit != Limit.NONE
        failed = segment.limit == Limit.FAILED
        time = segment.t1 * own.time
        final = np.array(segment.end)
        time[failed] = np.nan
        final[:, ended] = np.nan
        values = {
            "outcome": np.where(failed, REFUSED, segment.limit + 1),
            "ended": time,
            "final": own.to_si(final).T,
            "steps": segment.count,
            "changes": np.bincount(segment.motion, minlength=len(pads)),
        }
        if events:
            table = np.array([segment.t * np.asarray(own.time)[segment.motion], segment.point]).T
            values["events"] = np.empty(len(pads), dtype=object)
            begin = np.searchsorted(segment.motion, np.arange(1, len(pads)))
            values["events"][:] = np.split(table, begin)
        for name, measured in measure(segment, own).items() if measure else ():
            blank = {"f": np.nan, "O": None}.get(measured.dtype.kind, 0)  # by floats, objects
            values[name] = measured.copy()
            values[name][ended] = blank
        for name, each in values.items():
            results.setdefault(name, np.empty((n, *each.shape[1:]), each.dtype))[pads] = each

    # long motions first: those side by side are alike then; the last lanes repeat a motion
    c = model.c
    dense = measure is not None
    lengths = stop * np.maximum(np.sqrt(c.m * (c.w**2 + c.h**2) / c.I), 1.0)
    order = np.argsort(-lengths, kind="stable")
    to_fill = -n % options.lanes
    order = np.append(order, order[-1:].repeat(to_fill))
    while order.size:
        # of long motions fewer are measured at once: their steps are stored meanwhile
        groups = n
        if dense:
            groups = min(int(MEASURED_AT_ONCE / lengths[order[0]]) + 1, 8)
        block, order = np.split(order, [groups * options.lanes])
        side_by_side = TaylorBatch(_some(model, block), tolerance, options=options)
        begin = np.zeros(len(block))
        segment = side_by_side.run(contact[:, block], begin, state[:, block], stop[block], dense)
        unsure = _unsure(segment, options)
        limit = np.where(unsure, Limit.FAILED, segment.limit)
        store(block, dataclasses.replace(segment, limit=limit))
        for i in np.unique(block[unsure]).tolist():
            one = _some(model, i)
            own = Units(*(float(v[i]) for v in vars(units).values()))
            segments = list[Segment]()
            alone = taylor.TaylorIntegrator(one, tolerance, options=options)
            end = float(stop[i])
            observers = [segments.append]
            try:
                integrate(one, alone, own, state[:, i], end, observers, dense, options)
            except ModelEnd:
                pass  # as the last segment says
            except ComputationError:
                continue
            store(np.array([i]), Segment.joined(segments))
    return results


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
    options: Options = DEFAULT,
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
        outcome (`DONE`, 1 + the index into `LIMITS`, or `REFUSED`), ended (time), final (n, 6),
        steps, changes (number of contact changes), with `events` events (arrays (changes, 2) of
        time and contact point), and what `measure` gives. Where a pad did not reach the end, final
        states and measures are NaN, None or 0.

    Raises
    ------
    ComputationError
        Where heyoka is not installed or a number is not finite.
    """
    heyoka()
    starts = np.asarray(initial, dtype=float)
    # all numbers as arrays (n,), of which each process takes a part
    count = len(starts)
    numbers = {name: np.broadcast_to(v, count) for name, v in pads.given().items()}
    stops = np.broadcast_to(np.asarray(stop, dtype=float), count)
    rows = None
    if damping is not None:
        C = np.broadcast_to(damping, (count, 3, 3))
        rows = tuple(tuple(C[:, i, j] for j in range(3)) for i in range(3))
    entries = [] if rows is None else [entry for row in rows for entry in row]
    finite = np.isfinite([*numbers.values(), *entries, stops, *starts.T]).all(axis=0)
    if not finite.all():
        raise ComputationError(
            f"the numbers of pad {np.argmin(finite)} of the ensemble are not finite"
        )
    whole = PadModel(model, pads.replace(**numbers), formulation, rows)  # type: ignore[arg-type]
    size = math.ceil(count / workers)
    parts = [slice(i, i + size) for i in range(0, count, size)]
    tasks = [(_some(whole, part), starts[part], stops[part]) for part in parts]
    motions = partial(
        _motions, tolerance=tolerance, measure=measure, events=events, options=options
    )
    chunks = list(mapped(motions, tasks, workers))
    return {name: np.concatenate([chunk[name] for chunk in chunks]) for name in chunks[0]}
