"""Many pads at once: simulations for searches and statistics, spread over lanes and processes."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.io.processes import mapped
from squeal.io.scene import Scene
from squeal.model.contact import CONSISTENT, Formulation, contact_law
from squeal.model.equations import PadModel
from squeal.model.law import ContactLaw
from squeal.model.mechanics import Coefficients, coefficients, pose
from squeal.model.pad import PARAMETERS, Model, Pad
from squeal.model.states import State
from squeal.model.units import Units, natural_units
from squeal.simulation.legs import LIMITS
from squeal.simulation.run import first_state, off_level

if TYPE_CHECKING:
    from squeal.simulation.batch.motion import Motion

CHUNK = 4096  # pads that one process works on at a time; bounds the memory
KEPT = 1_000_000  # samples, 48 bytes each, that are kept at a time
BLOCK = 64  # pads that are measured together: fewer calls, and arrays that stay in the cache
PHASE = 0.25  # rad of the pad's fast rotation from one sample to the next
LEVELS = 8  # numbers of samples in each octave
MOST_SAMPLES = 100_000
DONE, REFUSED = 0, 1 + len(LIMITS)  # outcomes; those between are 1 + the index into `LIMITS`

Arrays = dict[str, np.ndarray]


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
    measured: bool
    events: bool
    phase: float
    calm: bool


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

    def of(self, pads: np.ndarray) -> Coefficients:
        """Coefficients of some pads (indices)."""
        return Coefficients(*self.coefficients[:, pads])


def _in_natural_units(task: _Task, law: ContactLaw) -> _Natural:
    from squeal.simulation.integrators.symbols import NAMES

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
    """Arrays over the pads of a chunk, filled group by group."""

    def __init__(self, task: _Task, natural: _Natural) -> None:
        self._task, self._natural = task, natural
        self._count = len(task.stop)
        self.arrays: Arrays = {}
        self._theta0 = _each(task.pads.theta0, self._count)

    def _put(self, name: str, pads: np.ndarray, values: np.ndarray) -> None:
        if name not in self.arrays:
            shape = (self._count, *values.shape[1:])
            blank = np.nan if values.dtype == float else None if values.dtype == object else 0
            self.arrays[name] = np.full(shape, blank, dtype=values.dtype)
        self.arrays[name][pads] = values

    def add(self, pads: np.ndarray, whole: np.ndarray, motion: Motion) -> None:
        """Keep what is wanted of the motions of these pads (indices); all of the `whole` ones."""
        n = len(pads)
        time = self._natural.units.time[pads]  # type: ignore[index]
        self._put("outcome", pads, motion.limit + 1)
        self._put("ended", pads, np.where(motion.limit < 0, motion.stop, motion.limit_t) * time)
        self._put("final", pads, np.where(motion.limit < 0, motion.end, np.nan).T)
        self._put("steps", pads, motion.steps)
        self._put("changes", pads, np.bincount(motion.lane, minlength=n))
        if self._task.events:
            lists = np.empty(n, dtype=object)
            table = np.array([motion.t * time[motion.lane], motion.point]).T
            lists[:] = np.split(table, np.searchsorted(motion.lane, np.arange(1, n)))
            self._put("events", pads, lists)
        if self._task.measured:
            from squeal.simulation.batch.measures import measures
            from squeal.simulation.batch.seen import seen

            natural = self._natural
            s = seen(natural.model.law, natural.of(pads), motion, natural.terms[:, pads])
            for name, values in measures(s, self._theta0[pads], self._task.calm).items():
                if name in ("duration", "separated"):
                    values = (values.T * time).T
                elif name in ("fastest", "face"):
                    values = values * self._natural.units.velocity[pads]  # type: ignore[index]
                self._put(name, pads[whole], values[whole])

    def refuse(self, pad: int) -> None:
        """A pad that no path carries to the end."""
        self.arrays["outcome"][pad] = REFUSED
        for name in ("ended", "final"):
            self.arrays[name][pad] = np.nan


def _samples(task: _Task, natural: _Natural) -> np.ndarray:
    """How many samples each pad needs, (n,); also a guess of how long it takes."""
    p = natural.model.pad
    speed = np.sqrt(p.m * (p.w**2 + p.h**2) / p.I)
    wanted = natural.stop * np.maximum(speed, 1.0) / task.phase + 2.0
    # one of few numbers for a pad, whichever others it is measured with
    needed = np.ceil(2.0 ** (np.ceil(LEVELS * np.log2(wanted)) / LEVELS)).astype(int)
    if task.measured and needed.max() > MOST_SAMPLES:
        raise ComputationError(
            f"measures of {needed.max()} samples are asked for; at most {MOST_SAMPLES} are kept, "
            "choose a shorter time"
        )
    return needed


def _work(task: _Task) -> Arrays:
    from squeal.simulation.batch.lanes import lanes
    from squeal.simulation.batch.measures import doubtful

    law = contact_law(task.model, task.formulation)
    natural = _in_natural_units(task, law)
    machines = lanes(law, task.tolerance, natural.model.terms)
    results = _Results(task, natural)
    needed = _samples(task, natural)
    margin = max(1e-6, 100.0 * task.tolerance)
    # pads of like length are measured together; the longest motions come first
    order = np.argsort(needed, kind="stable")
    size = BLOCK if task.measured else CHUNK
    levels = np.split(order, np.flatnonzero(np.diff(needed[order])) + 1)
    alike = levels if task.measured else [order]
    blocks = [part[i : i + size] for part in alike for i in range(0, len(part), size)][::-1]
    for group in _groups(blocks, needed if task.measured else np.zeros_like(needed)):
        pads, counts = np.concatenate(group), [needed[block[0]] for block in group]
        samples = np.repeat(counts, [len(block) for block in group]) * task.measured
        n = natural
        given = (n.coefficients[:, pads], n.touching[:, pads], n.state[:, pads], n.stop[pads])
        with machines.lease() as machine:
            course = machine.run(*given, samples, natural.terms[:, pads])
        first = 0
        for block in group:
            motion = course.part(first, first + len(block))
            first += len(block)
            doubt = doubtful(law, natural.of(block), motion, margin)
            results.add(block, ~doubt & (motion.limit < 0), motion)
            for i in block[doubt].tolist():
                _alone(task, natural, results, i)
    arrays = results.arrays
    arrays["final"] = natural.units.to_si(arrays["final"].T).T
    return arrays


def _groups(blocks: list[np.ndarray], needed: np.ndarray) -> Iterator[list[np.ndarray]]:
    """Blocks of pads whose samples, as many for each as the first block needs, are kept at once."""
    some: list[np.ndarray] = []
    kept = 0
    for block in blocks:
        wanted = len(block) * int(needed[block[0]])
        if some and kept + wanted > KEPT:
            yield some
            some, kept = [], 0
        some, kept = [*some, block], kept + wanted
    yield some


def _alone(task: _Task, natural: _Natural, results: _Results, i: int) -> None:
    """A pad that the lanes could not carry to the end."""
    from squeal.simulation.batch.alone import run_alone

    one, model = np.array([i]), _single(natural.model, len(task.stop), i)
    units = Units(*(float(v[i]) for v in vars(natural.units).values()))
    state, stop = natural.state[:, i], float(natural.stop[i])
    try:
        motion = run_alone(model, task.tolerance, "heyoka", units, state, stop, task.measured)
    except ComputationError:
        results.refuse(i)
    else:
        results.add(one, motion.whole, motion)


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
    measured: bool = False,
    events: bool = False,
    workers: int = 1,
    damping: np.ndarray | None = None,
    phase: float = PHASE,
    calm: bool = True,
) -> Arrays:
    """Simulate n pads of a model; all units follow those of the pads.

    pads: a `Pad` whose parameters are numbers or arrays (n,), see `stack`; initial (n, 6);
    stop: a number or (n,); damping: a matrix C (3, 3) for all pads or (n, 3, 3). Arrays over the
    pads come back: outcome (`DONE`, 1 + the index into `LIMITS`, or `REFUSED`), ended (time), final
    (n, 6), steps, changes (number of contact changes), with `events` also events (arrays
    (changes, 2) of time and contact point), with `measured` also those of
    `squeal.simulation.batch.measures.measures`. Values of pads that did not reach the end are NaN,
    their measures None or 0 where there is no NaN. A pad whose batch run may have missed
    a contact change is run again alone. phase: of the pad's fast rotation from one sample to the
    next, in rad; calm: whether that measure is wanted, which needs all accelerations.

    With `workers` above 1 chunks of pads go to that many processes, which start anew by import:
    a script must guard its main part by `if __name__ == "__main__"`. Raises ComputationError
    where heyoka is not installed or a number is not finite, InputError for measures of a model
    with other contact points than the two edges.
    """
    try:
        import squeal.simulation.batch.lanes  # noqa: F401
    except ImportError:
        raise ComputationError(
            "batches of simulations need heyoka, which is not installed on this machine"
        ) from None
    if measured and contact_law(model, formulation).points != 2:
        raise InputError(
            f"measured: not allowed with model {model}; measures are those of two edges"
        )
    count = len(initial)
    stops = _each(np.asarray(stop, dtype=float), count)
    numbers = [_each(v, count) for v in pads.given().values()]
    C = None if damping is None else np.moveaxis(np.zeros((count, 3, 3)) + damping, 0, -1)
    drags = [] if C is None else [*C.reshape(9, count)]
    every = [*numbers, *drags, stops, *np.transpose(initial)]
    wrong = np.flatnonzero(~np.isfinite(every).all(axis=0))
    if wrong.size:
        raise ComputationError(f"the numbers of pad {wrong[0]} of the batch are not finite")
    size = min(CHUNK, -(-count // workers)) if count else 1
    starts, settings = np.asarray(initial, dtype=float), (tolerance, measured, events, phase, calm)

    def task(i: int) -> _Task:
        part, some = slice(i, i + size), _part(pads, i, size, count)
        drag = None if C is None else C[..., part]
        return _Task(model, formulation, some, drag, starts[part], stops[part], *settings)

    tasks = map(task, range(0, count, size))
    chunks = list(mapped(_work, tasks, workers))
    return {name: np.concatenate([chunk[name] for chunk in chunks]) for name in chunks[0]}
