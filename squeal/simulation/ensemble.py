"""Ensembles: motions of many pads, by heyoka's batch mode and in several processes."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from squeal.errors import ComputationError
from squeal.io.processes import mapped
from squeal.io.scene import Scene
from squeal.model.contact import CONSISTENT, Formulation, contact_law
from squeal.model.equations import PadModel
from squeal.model.law import ContactLaw
from squeal.model.mechanics import coefficients, pose
from squeal.model.pad import PARAMETERS, Model, Pad
from squeal.model.states import State
from squeal.model.units import Units, natural_units
from squeal.simulation.hybrid import (
    DEFAULT,
    LIMITS,
    Course,
    Courses,
    ModelEnd,
    Options,
    first_state,
    integrate,
    off_level,
)

DONE, REFUSED = 0, 1 + len(LIMITS)  # outcomes; those between are 1 + the index into `LIMITS`

Arrays = dict[str, np.ndarray]
Measure = Callable[[Course, Units], Arrays]
"""Arrays (n, ...) in the units of the pads, from n motions side by side and their units (n,)."""


def stack(pads: Sequence[Pad]) -> Pad:
    """Many pads as one whose parameters are arrays (n,); None where the first pad has None."""
    columns: dict[str, Any] = {
        name: None
        if getattr(pads[0], name) is None
        else np.array([getattr(pad, name) for pad in pads], dtype=float)
        for name in PARAMETERS
    }
    return Pad(**columns)


def _each(value: Any, count: int) -> Any:
    """The numbers (count,) of all pads; those that are so already are not touched."""
    return value if getattr(value, "shape", ()) == (count,) else np.broadcast_to(value, count)


def _part(pads: Pad, first: int, size: int, count: int) -> Pad:
    if size >= count:
        return pads
    columns = {n: _each(v, count)[first : first + size] for n, v in pads.given().items()}
    return pads.replace(**columns)


@dataclasses.dataclass(frozen=True)
class _Task:
    """A chunk of pads with all that a process needs; `pads` is a stack, `initial` (n, 6) in SI,
    `damping` (3, 3, n) or None."""

    model: Model
    formulation: Formulation
    pads: Pad
    damping: np.ndarray | None
    initial: np.ndarray
    stop: np.ndarray
    tolerance: float
    measure: Measure | None
    events: bool
    options: Options


@dataclasses.dataclass(frozen=True)
class _Natural:
    """A chunk in natural units: stacked units and pads, coefficients (names, n), states (6, n),
    numbers of the terms with velocities (m, n)."""

    units: Units
    model: PadModel
    terms: np.ndarray
    coefficients: np.ndarray
    touching: np.ndarray
    state: np.ndarray
    stop: np.ndarray

    def units_of(self, pads: np.ndarray) -> Units:
        """The units, arrays (n,), of some pads (indices)."""
        return Units(*(value[pads] for value in vars(self.units).values()))


def _in_natural_units(task: _Task, law: ContactLaw) -> _Natural:
    from squeal.simulation.taylor import NAMES

    count = len(task.stop)
    rows = None if task.damping is None else tuple(map(tuple, task.damping))
    model = PadModel(task.model, task.pads, task.formulation, rows)
    each = vars(natural_units(model, task.initial.T)).values()
    units = Units(*(_each(v, count) for v in each))
    scaled = units.scaled(model)
    c = coefficients(np, scaled.pad, law.absolute_gap)
    numbers = np.array([_each(getattr(c, name), count) for name in NAMES])
    state = units.to_scaled(task.initial.T)
    heights = np.array(law.gaps(c, pose(np, c.place(state))))
    touching = (heights < 0.0).astype(int)
    # on the switching surface, or too near to tell, the first motion decides
    for i in np.flatnonzero((np.abs(heights) < 1e-9 * (1.0 + c.w + c.h)).any(axis=0)):
        one = _single(scaled, count, int(i))
        touching[:, i] = first_state(one, state[:, i])
        state[:, i] = off_level(one, state[:, i], State(*touching[:, i].astype(bool).tolist()))
    terms = np.array(np.broadcast_arrays(*scaled.term_values, state[0])[:-1]).reshape(-1, count)
    return _Natural(units, scaled, terms, numbers, touching, state, task.stop / units.time)


def _single(scaled: PadModel, count: int, i: int) -> PadModel:
    def own(value: Any) -> Any:
        return _each(value, count)[i].item()

    rows = scaled.damping and tuple(tuple(map(own, row)) for row in scaled.damping)
    numbers = {name: own(value) for name, value in scaled.pad.given().items()}
    return dataclasses.replace(scaled, pad=scaled.pad.replace(**numbers), damping=rows)


class _Results:
    """Arrays over the pads of a chunk, filled block by block."""

    def __init__(self, task: _Task, natural: _Natural) -> None:
        self._task, self._natural = task, natural
        self._count = len(task.stop)
        self.arrays: Arrays = {}

    def _put(self, name: str, pads: np.ndarray, values: np.ndarray) -> None:
        if name not in self.arrays:
            shape = (self._count, *values.shape[1:])
            blank = np.nan if values.dtype == float else None if values.dtype == object else 0
            self.arrays[name] = np.full(shape, blank, dtype=values.dtype)
        self.arrays[name][pads] = values

    def add(self, pads: np.ndarray, whole: np.ndarray, course: Course) -> None:
        """Keep what is wanted of the motions of these pads (indices); measures of `whole` ones."""
        n, units = len(pads), self._natural.units_of(pads)
        time = np.asarray(units.time)
        self._put("outcome", pads, course.limit + 1)
        self._put("ended", pads, course.t1 * time)
        self._put("final", pads, np.where(course.limit < 0, course.end, np.nan).T)
        self._put("steps", pads, course.steps)
        self._put("changes", pads, np.bincount(course.lane, minlength=n))
        if self._task.events:
            lists = np.empty(n, dtype=object)
            table = np.array([course.t * time[course.lane], course.point]).T
            lists[:] = np.split(table, np.searchsorted(course.lane, np.arange(1, n)))
            self._put("events", pads, lists)
        if self._task.measure is not None:
            for name, values in self._task.measure(course, units).items():
                self._put(name, pads[whole], values[whole])

    def end(self, pad: int, outcome: int, time: float) -> None:
        """A pad that was not carried to the end, but to a time."""
        self.arrays["outcome"][pad], self.arrays["ended"][pad] = outcome, time
        self.arrays["final"][pad] = np.nan


def _work(task: _Task) -> Arrays:
    from squeal.simulation.taylor import run_together, unsure

    law, options, n = contact_law(task.model, task.formulation), task.options, len(task.stop)
    natural = _in_natural_units(task, law)
    p = natural.model.pad
    # motions of like length side by side, and of like length looked at together
    rates = np.maximum(np.sqrt(p.m * (p.w**2 + p.h**2) / p.I), 1.0)
    order = np.argsort(-natural.stop * rates, kind="stable")
    results, dense = _Results(task, natural), task.measure is not None
    size = options.looked_at_together if dense else n
    for begin in range(0, n, size):
        block = order[begin : begin + size]
        course = run_together(
            law,
            natural.model.terms,
            task.tolerance,
            natural.coefficients[:, block],
            natural.terms[:, block],
            natural.touching[:, block],
            natural.state[:, block],
            natural.stop[block],
            dense,
            options,
        )
        doubt = unsure(course, options)
        results.add(block, ~doubt & (course.limit < 0), course)
        for i in block[doubt].tolist():
            _alone(task, natural, results, i)
    arrays = results.arrays
    arrays["final"] = natural.units.to_si(arrays["final"].T).T
    return arrays


def _alone(task: _Task, natural: _Natural, results: _Results, i: int) -> None:
    """A pad that had better not run side by side with others."""
    from squeal.simulation.taylor import TaylorIntegrator

    one, model = np.array([i]), _single(natural.model, len(task.stop), i)
    courses = Courses(task.measure is not None)
    integrator = TaylorIntegrator(model, task.tolerance, options=task.options)
    units = Units(*(float(v[0]) for v in vars(natural.units_of(one)).values()))
    state, stop = natural.state[:, i], float(natural.stop[i])
    try:
        integrate(model, integrator, units, state, stop, [courses], task.options)
    except ModelEnd as end:
        results.end(i, 1 + end.limit, end.time)
    except ComputationError:
        results.end(i, REFUSED, math.nan)
    else:
        results.add(one, np.array([True]), courses.whole)


def simulate_starts(
    scene: Scene, starts: np.ndarray, stop: float | np.ndarray, tolerance: float, **more: Any
) -> Arrays:
    """`simulate_many` of a scene's pad from starts (n, 6); more: further arguments of it."""
    pads = stack([scene.pad] * len(starts))
    return simulate_many(scene.model, pads, starts, stop, tolerance, scene.formulation, **more)


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
    initial : (n, 6) array
        First states.
    stop : float or (n,) array
        Length of time.
    measure : callable, optional
        What is measured of the motions, see `Measure`; a function of a module if there are several
        processes.
    events : bool
        Whether the contact changes are wanted.
    workers : int
        Processes, which start anew by import: a script that asks for several must guard its main
        part by `if __name__ == "__main__"`.
    damping : (3, 3) or (n, 3, 3) array, optional
        The damping matrix of all or of each.

    Returns
    -------
    dict of arrays
        outcome (`DONE`, 1 + the index into `LIMITS`, or `REFUSED`), ended (time), final (n, 6),
        steps, changes (number of contact changes), with `events` also events (arrays (changes, 2)
        of time and contact point), and what `measure` gives. Values of pads that did not reach the
        end are NaN, their measures None or 0 where there is no NaN.

    Raises
    ------
    ComputationError
        Where heyoka is not installed or a number is not finite.
    """
    try:
        import squeal.simulation.taylor  # noqa: F401
    except ImportError:
        raise ComputationError(
            "ensembles of simulations need heyoka, which is not installed on this machine"
        ) from None
    count = len(initial)
    stops = _each(np.asarray(stop, dtype=float), count)
    numbers = [_each(v, count) for v in pads.given().values()]
    C = None if damping is None else np.moveaxis(np.zeros((count, 3, 3)) + damping, 0, -1)
    drags = [] if C is None else [*C.reshape(9, count)]
    every = [*numbers, *drags, stops, *np.transpose(initial)]
    wrong = np.flatnonzero(~np.isfinite(every).all(axis=0))
    if wrong.size:
        raise ComputationError(f"the numbers of pad {wrong[0]} of the ensemble are not finite")
    size = min(options.chunk, -(-count // workers)) if count else 1
    starts, settings = np.asarray(initial, dtype=float), (tolerance, measure, events, options)

    def task(i: int) -> _Task:
        part, some = slice(i, i + size), _part(pads, i, size, count)
        drag = None if C is None else C[..., part]
        return _Task(model, formulation, some, drag, starts[part], stops[part], *settings)

    tasks = map(task, range(0, count, size))
    chunks = list(mapped(_work, tasks, workers))
    return {name: np.concatenate([chunk[name] for chunk in chunks]) for name in chunks[0]}
