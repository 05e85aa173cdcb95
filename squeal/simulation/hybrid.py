"""The hybrid run: smooth steps joined at the contact changes (Table 1, Fig. 3, Fig. 8).

An integrator carries one motion, or several side by side, through contact changes and hands over a
`Course`. Observers look at courses as they come, so that memory does not grow with the time.
"""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from squeal.errors import ComputationError
from squeal.model.contact import ContactLaw, State
from squeal.model.equations import PadModel, Units
from squeal.model.pad import Coefficients, pose
from squeal.numerics.differentiation import complex_step

# Where the model ends: what has happened when a limit is reached.
LIMITS = (
    "the pad has turned past 90 degrees",
    "spring 1 has collapsed to zero length",
    "spring 2 has collapsed to zero length",
    "the pad has reached the speed V of the surface, beyond which friction that falls with speed "
    "means nothing,",
)
# Share of its free length at which a spring counts as collapsed: the direction of its force, and
# with it the motion, jumps at zero.
COLLAPSED = 1e-6


class ModelEnd(ComputationError):
    """A motion leaves the model's range: at the entry `limit` of `LIMITS`, at a time (s)."""

    def __init__(self, limit: int, time: float) -> None:
        super().__init__(f"{LIMITS[limit]} at t = {time:.9g} s; the model ends there")
        self.limit, self.time = limit, time


@dataclass(frozen=True)
class Options:
    """How motions are integrated and looked at, beside the tolerance of a scene.

    Lengths and times are in natural units, see `squeal.model.equations.natural_units`.
    """

    # steps of one motion after which observers look at it; bounds the memory of a run
    steps_at_once: int = 5000
    # steps of a motion of an ensemble; one that needs more is given up
    most_steps: int = 1_000_000
    # gap, over 1 + w + h, below which a contact point may change together with another one
    clear: float = 1e-9
    # gap of the wrong sign that shows a missed contact change
    missed: float = 1e-6
    # time in which a point that starts on the surface shows to which side it goes
    first_step: float = 1e-3
    # angle (rad) by which a level pad on the surface is turned: no length has no centre
    least_turn: float = 1e-15
    # tolerance above which the compiler may regroup sums: a step is a third cheaper, but rounding
    # drifts, which a hundred scenes' energy shows at finer tolerances
    regrouped_above: float = 1e-14
    # motions of an ensemble side by side; steps after which free lanes take up others; how many are
    # measured at once; and how many one process works on at a time
    lanes: int = 8
    refilled_after: int = 100
    looked_at_together: int = 64
    chunk: int = 4096
    # places in each step at which signals are read first, at most 20
    samples: int = 8
    # longest step of SciPy's integrator, which sees contact changes at the ends of steps only, and
    # the time after which observers look at its motion
    scipy_step: float = 0.2
    scipy_time: float = 2000.0


DEFAULT = Options()


@dataclass(frozen=True)
class Steps:
    """Smooth steps of n motions, those of the first motion first, each in order of time.

    lane (s,): the motion of each; t, h (s,): its begin and length; series (p, 6, s): coefficients
    of the state in powers of the share of the step; on (points, s): 1.0 for a point that touches.
    """

    lane: np.ndarray
    t: np.ndarray
    h: np.ndarray
    series: np.ndarray
    on: np.ndarray

    def some(self, which: np.ndarray) -> "Steps":
        """Some of the steps (k,)."""
        parts = (self.lane, self.t, self.h, self.series, self.on)
        return Steps(*(part.take(which, axis=-1) for part in parts))

    @staticmethod
    def joined(parts: Sequence["Steps"]) -> "Steps":
        """Steps of several parts that follow each other, in order of motion and time."""
        names = ("lane", "t", "h", "series", "on")
        all_of = (np.concatenate([getattr(p, name) for p in parts], axis=-1) for name in names)
        whole = Steps(*all_of)
        ordered = np.all(whole.lane[1:] >= whole.lane[:-1])
        return whole if ordered else whole.some(np.argsort(whole.lane, kind="stable"))

    def states(self, share: np.ndarray) -> np.ndarray:
        """States (6, s) at a share (s,) of each step."""
        states = self.series[-1]
        for coefficient in self.series[-2::-1]:
            states = states * share + coefficient
        return np.asarray(states)


@dataclass(frozen=True)
class Course:
    """A part of n motions in natural units, one after the other.

    law: the contact law; c: coefficients, numbers or arrays (n,); t0, t1 (n,): begin and end; first
    (points, n): contact at the begin, 0 or 1; end (6, n): state at the end; lane, point, t (e,),
    state (6, e): contact changes, in order of motion and time; steps (n,): integration steps; limit
    (n,): the entry of `LIMITS` that ended it, or -1; smooth: its steps, None without dense output.
    """

    law: ContactLaw
    c: Coefficients
    t0: np.ndarray
    t1: np.ndarray
    first: np.ndarray
    end: np.ndarray
    lane: np.ndarray
    point: np.ndarray
    t: np.ndarray
    state: np.ndarray
    steps: np.ndarray
    limit: np.ndarray
    smooth: Steps | None = None

    @cached_property
    def on(self) -> np.ndarray:
        """Contact (points, e) of 0 or 1 after each change."""
        flips = np.zeros((len(self.first), len(self.lane) + 1), dtype=int)
        flips[self.point, np.arange(1, flips.shape[1])] = 1
        flips = flips.cumsum(axis=1)
        before = flips[:, np.searchsorted(self.lane, self.lane)]
        return np.asarray((self.first[:, self.lane] + flips[:, 1:] - before) & 1)

    @cached_property
    def last(self) -> np.ndarray:
        """Contact (points, n) of 0 or 1 at the end."""
        contact = self.first.copy()
        np.add.at(contact, (self.point, self.lane), 1)
        return contact & 1

    def coefficients(self, lane: np.ndarray) -> Coefficients:
        """Coefficients of some motions (k,)."""
        return Coefficients(*(v if np.ndim(v) == 0 else v[lane] for v in self.c))

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """States (k, 6) and contact (points, k) of a single motion at times (k,)."""
        steps = self.dense
        steps = steps.some(np.searchsorted(steps.t[1:], t))
        share = np.where(steps.h > 0.0, (t - steps.t) / np.where(steps.h > 0.0, steps.h, 1.0), 0.0)
        return steps.states(share).T, steps.on

    @property
    def dense(self) -> Steps:
        """Its steps, where there is dense output."""
        assert self.smooth is not None
        return self.smooth

    def with_changes(self, points: Sequence[int]) -> "Course":
        """This course of a single motion, in whose last instant more points change."""
        more = len(points)
        return dataclasses.replace(
            self,
            lane=np.append(self.lane, [0] * more).astype(int),
            point=np.append(self.point, points).astype(int),
            t=np.append(self.t, self.t[-1:].repeat(more)),
            state=np.append(self.state, self.state[:, -1:].repeat(more, axis=1), axis=1),
        )


class Integrator(Protocol):
    """Carries the motion on, at a tolerance."""

    method: str
    tolerance: float

    def run(self, contact: State, t: float, state: np.ndarray, stop: float, dense: bool) -> Course:
        """A course from (t, state) on: to `stop`, to a limit, for a bounded number of steps, or to
        a change of contact beside which another point is near the surface.

        Raises ComputationError if the motion leaves all bounds.
        """


class Observer:
    """Sees a motion course by course; a `dense` one needs the motion between changes."""

    dense = False

    def see(self, course: Course) -> None:
        """The next course of the motion."""

    def result(self) -> dict[str, Any]:
        """Fields of `Simulation` that this observer fills."""
        return {}


class Courses(Observer):
    """All courses of a motion as one, `whole`."""

    def __init__(self, dense: bool) -> None:
        self.dense = dense
        self._courses: list[Course] = []

    def see(self, course: Course) -> None:
        self._courses.append(course)

    @property
    def whole(self) -> Course:
        """What was seen of the motion, coefficients as arrays (1,)."""
        first, last = self._courses[0], self._courses[-1]
        changes: dict[str, Any] = {
            name: np.concatenate([getattr(one, name) for one in self._courses], axis=-1)
            for name in ("lane", "point", "t", "state")
        }
        changes["steps"] = np.sum([one.steps for one in self._courses], axis=0)
        if self.dense:
            changes["smooth"] = Steps.joined([one.dense for one in self._courses])
        c = Coefficients(*(np.array([v]) for v in first.c))
        return dataclasses.replace(last, c=c, t0=first.t0, first=first.first, **changes)


def state_of(contact: np.ndarray) -> State:
    """The contact state of a column (points,) of zeros and ones."""
    return State(*(value > 0 for value in contact.tolist()))


def _place(model: PadModel, state: np.ndarray) -> np.ndarray:
    return np.array(model.c.place(np.asarray(state[:3], dtype=float)))


def state_rates(model: PadModel, state: np.ndarray) -> np.ndarray:
    """Rates (6,) of a scaled state in the contact state of its gaps."""
    loads = model.physical_loads(_place(model, state), _place(model, state[3:]))
    pad = model.pad
    return np.concatenate([state[3:], loads * [1.0, 1.0, pad.w] / [pad.m, pad.m, pad.I]])


def first_state(model: PadModel, state: np.ndarray, options: Options = DEFAULT) -> State:
    """Contact state of the first motion from a scaled state.

    A point that starts on the switching surface, to rounding, belongs to the side to which the
    first motion takes it; a short Runge-Kutta step tells which, since the loads are continuous.
    """
    heights = model.gaps(_place(model, state))
    pad, step = model.pad, options.first_step
    rounding = 8 * np.finfo(float).eps * (pad.h + pad.w + abs(pad.y0) + abs(state[1]))
    if np.any(np.abs(heights) <= rounding):
        k1 = state_rates(model, state)
        k2 = state_rates(model, state + step / 2 * k1)
        k3 = state_rates(model, state + step / 2 * k2)
        moved = state[:3] + step * state[3:] + step**2 / 6 * (k1 + k2 + k3)[3:]
        # the change of the gap, not the gap: an offset of rounding size must not decide
        change = model.gaps(_place(model, moved)) - heights
        heights = np.where(np.abs(heights) > rounding, heights, change)
    return State(*(bool(g < 0.0) for g in heights))


def off_level(
    model: PadModel, state: np.ndarray, contact: State, options: Options = DEFAULT
) -> np.ndarray:
    """A scaled state from which partial contact can go on.

    A level pad exactly on the surface that turns leaves the contact length 0/0: it is turned by
    less than anything that is computed from it is rounded by.
    """
    if model.law.points > 2 or sum(contact) != 1:
        return state
    gaps = _heights(model, state)
    if abs(gaps[0] - gaps[1]) >= options.least_turn * model.pad.w:
        return state
    turned = [state + way * options.least_turn * np.eye(6)[2] for way in (1.0, -1.0)]
    touching = contact.index(True)
    return min(turned, key=lambda one: _heights(model, one)[touching])


def _heights(model: PadModel, state: np.ndarray) -> tuple[float, ...]:
    """Gaps of a scaled state as plain numbers, which are faster than arrays."""
    y, turn = float(state[1]), float(state[2])  # the surface is level: x plays no part
    return model.law.gaps(model.c, pose(math, model.c.place((0.0, y, turn))))


def _late(
    model: PadModel, state: np.ndarray, contact: State, point: int, heights: tuple[float, ...]
) -> list[int]:
    """The other points that have passed their switching surface in the same instant as `point`.

    Such a crossing lies behind the located one by rounding and would not be seen again: its gap
    is as far beyond zero as that of the located point, which rounding may leave just before it.
    `contact` is that before the change.
    """
    beyond = [gap if touches else -gap for touches, gap in zip(contact, heights, strict=True)]
    limit = min(beyond[point], 0.0)
    near = [i for i, height in enumerate(beyond) if i != point and height >= limit]
    if not near:
        return []
    rates = complex_step(model.gaps, _place(model, state), along=_place(model, state[3:]))
    return [i for i in near if (rates[i] if contact[i] else -rates[i]) > 0.0]


def integrate(
    model: PadModel,
    integrator: Integrator,
    units: Units,
    state: np.ndarray,
    stop: float,
    observers: Sequence[Observer],
    options: Options = DEFAULT,
) -> tuple[float, np.ndarray, int, int]:
    """Run a scaled pad to `stop` (natural units), showing each course to the observers.

    Returns the final time and state (6,), the number of steps and the number of contact changes.
    Raises ModelEnd after the last course before the model ends, and ComputationError where a
    contact change was missed.
    """
    dense = any(observer.dense for observer in observers)
    contact = first_state(model, np.asarray(state, dtype=float), options)
    state = off_level(model, state, contact, options)
    t, steps, changes = 0.0, 0, 0
    while t < stop:
        course = integrator.run(contact, t, state, stop, dense)
        begun, t, state = t, course.t1[0], course.end[:, 0]
        seconds = float(t) * units.time
        heights, contact = _heights(model, state), state_of(course.last[:, 0])
        point = int(course.point[-1]) if course.t.size and course.t[-1] == t else -1
        for i, (touches, gap) in enumerate(zip(contact, heights, strict=True)):
            if i != point and (gap > options.missed if touches else gap < -options.missed):
                raise ComputationError(
                    f"a contact change was missed before t = {seconds:.9g} s; ask for a smaller "
                    "tolerance"
                )
        if point >= 0 and t < stop:
            late = _late(model, state, contact.flip(point), point, heights)
            course = course.with_changes(late) if late else course
            contact = state_of(course.last[:, 0])
            state = off_level(model, state, contact, options)
        elif course.limit[0] < 0 and t < stop and t - begun < 1e-9 * stop:
            raise ComputationError(
                f"no progress beyond t = {seconds:.9g} s; a spring may have collapsed to zero "
                "length there"
            )
        steps, changes = steps + int(course.steps[0]), changes + len(course.t)
        for observer in observers:
            observer.see(course)
        if course.limit[0] >= 0:
            raise ModelEnd(int(course.limit[0]), seconds)
    return t, state, steps, changes
