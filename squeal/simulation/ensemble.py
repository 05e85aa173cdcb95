"""Ensembles: motions of many pads, side by side in heyoka's batch mode and in several processes."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from squeal.errors import ComputationError
from squeal.io.processes import mapped
from squeal.io.scene import Scene
from squeal.model.contact import CONSISTENT, Formulation, State
from squeal.model.equations import PadModel, Units, natural_units
from squeal.model.pad import Model, Pad, pose
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
from squeal.simulation.run import heyoka

DONE, REFUSED = 0, 1 + len(LIMITS)  # outcomes; those between are 1 + the index into `LIMITS`

Arrays = dict[str, np.ndarray]
Measure = Callable[[Course, Units], Arrays]
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


Task = tuple[PadModel, np.ndarray, np.ndarray]
"""Some pads with their first states (n, 6) and lengths of time (n,), in SI units."""


@dataclasses.dataclass(frozen=True)
class _Chunks:
    """How the motions of chunks of pads are computed, in any process."""

    tolerance: float
    measure: Measure | None
    events: bool
    options: Options

    def __call__(self, task: Task) -> Arrays:
        """What is wanted of the motions of a chunk."""
        taylor, options, n = heyoka(), self.options, len(task[2])
        each = vars(natural_units(task[0], task[1].T)).values()
        units = Units(*(np.broadcast_to(v, n) for v in each))  # type: ignore[arg-type]
        model, state, stop = units.scaled(task[0]), units.to_scaled(task[1].T), task[2] / units.time
        c = model.c
        heights = np.array(model.law.gaps(c, pose(np, c.place(state))))
        touching = (heights < 0.0).astype(int)
        # on the switching surface, or too near to tell, the first motion decides
        near = np.abs(heights) < options.clear * (1.0 + c.w + c.h)
        for i in np.flatnonzero(near.any(axis=0)).tolist():
            one = _some(model, i)
            touching[:, i] = first_state(one, state[:, i])
            state[:, i] = off_level(one, state[:, i], State(*touching[:, i].astype(bool).tolist()))
        results: Arrays = {}

        def put(pads: np.ndarray, course: Course, whole: np.ndarray) -> None:
            """Store what is wanted of the motions of some pads; measures of the `whole` ones."""
            own = Units(*(v[pads] for v in vars(units).values()))
            for name, values in self._values(course, own, whole).items():
                if name not in results:
                    blank = np.full((n, *values.shape[1:]), _blank(values), dtype=values.dtype)
                    results[name] = blank
                results[name][pads] = values

        # long motions first: their lanes take up short ones at the end
        lengths = stop * np.maximum(np.sqrt(c.m * (c.w**2 + c.h**2) / c.I), 1.0)
        order = np.argsort(-lengths, kind="stable")
        while order.size:
            size = n
            if self.measure is not None:
                # of long motions fewer are measured at once: their steps are stored meanwhile
                most = options.looked_at_together
                size = min(max(int(100 * most / lengths[order[0]]), 2 * options.lanes), most)
            block, order = order[:size], order[size:]
            start = _some(model, block), touching[:, block], state[:, block], stop[block]
            course = taylor.run_together(*start, self.tolerance, self.measure is not None, options)
            doubt = taylor.unsure(course, options)
            put(block, course, ~doubt & (course.limit < 0))
            for i in block[doubt].tolist():
                own = Units(*(float(v[i]) for v in vars(units).values()))
                try:
                    alone = self._alone(_some(model, i), own, state[:, i], float(stop[i]))
                except ModelEnd as end:
                    results["outcome"][i], results["ended"][i] = 1 + end.limit, end.time
                    results["final"][i] = np.nan
                except ComputationError:
                    results["outcome"][i], results["ended"][i] = REFUSED, math.nan
                    results["final"][i] = np.nan
                else:
                    put(np.array([i]), alone, np.array([True]))
        return results

    def _alone(self, model: PadModel, units: Units, state: np.ndarray, stop: float) -> Course:
        """The motion of a pad that had better not run side by side with others."""
        courses = Courses(self.measure is not None)
        integrator = heyoka().TaylorIntegrator(model, self.tolerance, options=self.options)
        integrate(model, integrator, units, state, stop, [courses], self.options)
        return courses.whole

    def _values(self, course: Course, units: Units, whole: np.ndarray) -> Arrays:
        """Arrays (n, ...) of n motions; blank where a motion is not whole, so without measures."""
        time, n = np.asarray(units.time), len(course.t1)
        values = {
            "outcome": course.limit + 1,
            "ended": course.t1 * time,
            "final": units.to_si(np.where(course.limit < 0, course.end, np.nan)).T,
            "steps": course.steps,
            "changes": np.bincount(course.lane, minlength=n),
        }
        if self.events:
            table = np.array([course.t * time[course.lane], course.point]).T
            values["events"] = np.empty(n, dtype=object)
            values["events"][:] = np.split(table, np.searchsorted(course.lane, np.arange(1, n)))
        for name, measures in self.measure(course, units).items() if self.measure else ():
            values[name] = measures.copy()
            values[name][~whole] = _blank(measures)
        return values


def _blank(values: np.ndarray) -> float | None:
    return np.nan if values.dtype == float else None if values.dtype == object else 0


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
    heyoka()
    starts = np.asarray(initial, dtype=float)
    count = len(starts)
    numbers = {name: np.broadcast_to(v, count) for name, v in pads.given().items()}
    stops = np.broadcast_to(np.asarray(stop, dtype=float), count)
    rows = None
    if damping is not None:
        C = np.broadcast_to(damping, (count, 3, 3))
        rows = tuple(tuple(C[:, i, j] for j in range(3)) for i in range(3))
    drags = [] if rows is None else [v for row in rows for v in row]
    finite = np.isfinite([*numbers.values(), *drags, stops, *starts.T]).all(axis=0)
    if not finite.all():
        raise ComputationError(
            f"the numbers of pad {np.argmin(finite)} of the ensemble are not finite"
        )
    whole = PadModel(model, pads.replace(**numbers), formulation, rows)  # type: ignore[arg-type]
    size = min(options.chunk, -(-count // workers)) if count else 1
    parts = (slice(i, i + size) for i in range(0, count, size))
    tasks = ((_some(whole, part), starts[part], stops[part]) for part in parts)
    chunks = list(mapped(_Chunks(tolerance, measure, events, options), tasks, workers))
    return {name: np.concatenate([chunk[name] for chunk in chunks]) for name in chunks[0]}
