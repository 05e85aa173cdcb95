"""The hybrid run: smooth steps joined at the contact changes (Table 1, Fig. 3, Fig. 8).

An integrator carries one motion, or several side by side, through contact changes and hands over a
`Course`. Functions see courses as they come, so that memory does not grow with the time.
"""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np

from squeal.errors import ComputationError
from squeal.model.contact import ContactLaw, State, Touching
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
    """A motion leaves the model's range, at the entry `limit` of `LIMITS`."""


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
    # motions of an ensemble side by side
    lanes: int = 8
    # places in each step at which signals are read first, at most 20
    samples: int = 8
    # longest step of SciPy's integrator, which sees contact changes at the ends of steps only, and
    # the time after which observers look at its motion
    scipy_step: float = 0.2
    scipy_time: float = 2000.0


DEFAULT = Options()


class Steps(NamedTuple):
    """Smooth steps of n motions, those of the first motion first, each in order of time.

    lane (s,): the motion of each; t, h (s,): its begin and length; series (p, 6, s): coefficients
    of the state in powers of the share of the step; on (points, s): 1 for a point that touches.
    """

    lane: np.ndarray
    t: np.ndarray
    h: np.ndarray
    series: np.ndarray
    on: np.ndarray

    def some(self, which: np.ndarray) -> "Steps":
        """Some of the steps (k,)."""
        return Steps(*(part.take(which, axis=-1) for part in self))

    def states(self, share: np.ndarray) -> np.ndarray:
        """States (6, s) at a share (s,) of each step."""
        states = self.series[-1]
        for coefficient in self.series[-2::-1]:
            states = states * share + coefficient
        return np.asarray(states)


@dataclass(frozen=True)
class Course:
    """A part of n motions in natural units, one after the other.

    law: the contact law; c: coefficients (n,); t0, t1 (n,): begin and end; first (points, n):
    contact at the begin, 0 or 1; end (6, n): state at the end; lane, point, t (e,), state (6, e):
    contact changes, in order of motion and time; count (n,): integration steps; limit (n,): the
    entry of `LIMITS` that ended it, -1 for none, -2 where it could not be carried on; smooth: as
    in `Steps`, without contact, empty without dense output.
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
    count: np.ndarray
    limit: np.ndarray
    smooth: tuple[np.ndarray, ...] = ()

    def _contact(self, lane: np.ndarray, changes: Any) -> np.ndarray:
        """Contact (points, k) of motions (k,) after so many (k,) of all changes."""
        flips = np.zeros((len(self.first), len(self.lane) + 1), dtype=int)
        flips[self.point, np.arange(1, flips.shape[1])] = 1
        flips = flips.cumsum(axis=1)
        before = np.searchsorted(self.lane, lane)
        return np.asarray((self.first[:, lane] ^ flips[:, changes] ^ flips[:, before]) & 1)

    @cached_property
    def on(self) -> np.ndarray:
        """Contact (points, e) of 0 or 1 after each change."""
        return self._contact(self.lane, np.arange(1, len(self.lane) + 1))

    @cached_property
    def last(self) -> np.ndarray:
        """Contact (points, n) of 0 or 1 at the end."""
        lane = np.arange(len(self.t0))
        return self._contact(lane, np.searchsorted(self.lane, lane, side="right"))

    @cached_property
    def steps(self) -> Steps:
        """Its steps, where there is dense output."""
        lane, t, h, series = self.smooth
        changes = np.searchsorted(self.lane + 1j * self.t, lane + 1j * t, side="right")
        return Steps(lane, t, h, series, self._contact(lane, changes))

    @cached_property
    def wrong(self) -> np.ndarray:
        """How far (points, n) each gap is on the wrong side of zero at the end."""
        end = np.asarray(self.end, dtype=float)
        heights = np.array(self.law.gaps(self.c, pose(np, self.c.place(end))))
        return np.where(self.last > 0, heights, -heights)

    def coefficients(self, lane: np.ndarray) -> Coefficients:
        """Coefficients of some motions (k,), of a single one (1,)."""
        return Coefficients(*(v[lane] for v in self.c)) if len(self.t0) > 1 else self.c

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """States (k, 6) and contact (points, k) of a single motion at times (k,)."""
        steps = self.steps.some(np.searchsorted(self.steps.t[1:], t))
        share = (t - steps.t) / np.maximum(steps.h, np.finfo(float).tiny)  # one may have no length
        return steps.states(share).T, steps.on

    @staticmethod
    def joined(parts: Sequence["Course"]) -> "Course":
        """The parts of one motion, one after the other, as one."""
        first, last = parts[0], parts[-1]
        lane, point, t, state = (
            np.concatenate([getattr(part, name) for part in parts], axis=-1)
            for name in ("lane", "point", "t", "state")
        )
        count = np.sum([part.count for part in parts], axis=0)
        pairs = zip(*(part.smooth for part in parts), strict=True)
        smooth = tuple(np.concatenate(each, axis=-1) for each in pairs)
        ends = first.t0, last.t1, first.first, last.end
        return Course(last.law, last.c, *ends, lane, point, t, state, count, last.limit, smooth)


class Integrator(Protocol):
    """Carries the motion on, at a tolerance."""

    method: str
    tolerance: float

    def run(
        self, contact: np.ndarray, t: float, state: np.ndarray, stop: float, dense: bool
    ) -> Course:
        """A course from contact (points,) and state (6,) at t on: to `stop`, to a limit, for a
        bounded number of steps, or to a change of contact beside which another point is near the
        surface.

        Raises ComputationError if the motion leaves all bounds.
        """


def state_of(contact: np.ndarray) -> State:
    """The contact state of a column (points,) of zeros and ones."""
    return State(*(value > 0 for value in contact.tolist()))


def state_rates(model: PadModel, state: np.ndarray, on: Touching | None = None) -> np.ndarray:
    """Rates (6, ...) of scaled states (6, ...), where no contact is given in that of their gaps."""
    q, rates = (np.array(model.c.place(part)) for part in (state[:3], state[3:]))
    touching = 1.0 * (model.gaps(q) < 0.0) if on is None else on
    x, y, turn = model.loads(q, touching, rates)
    c = model.c
    return np.array([*state[3:], x / c.m, y / c.m, turn * c.w / c.I])


def first_contact(model: PadModel, state: np.ndarray, options: Options = DEFAULT) -> np.ndarray:
    """Contact (points, ...) of 0 or 1 of the first motion from scaled states (6, ...).

    A point that starts on the switching surface, to rounding, belongs to the side to which the
    first motion takes it; a short Runge-Kutta step tells which, since the loads are continuous.
    """
    state, pad, step = np.asarray(state, dtype=float), model.pad, options.first_step
    heights = model.gaps(model.c.place(state))
    rounding = 8 * np.finfo(float).eps * (pad.h + pad.w + abs(pad.y0) + abs(state[1]))
    near = np.abs(heights) <= rounding
    if np.any(near):
        k1 = state_rates(model, state)
        k2 = state_rates(model, state + step * k1)
        moved = state[:3] + step * state[3:] + step**2 / 6 * (2 * k1 + k2)[3:]
        # the change of the gap, not the gap: an offset of rounding size must not decide
        heights = np.where(near, model.gaps(model.c.place(moved)) - heights, heights)
    return np.asarray(heights < 0.0).astype(int)


def off_level(
    model: PadModel, state: np.ndarray, contact: np.ndarray, options: Options = DEFAULT
) -> np.ndarray:
    """Scaled states (6, ...) from which partial contact can go on.

    A level pad exactly on the surface that turns leaves the contact length 0/0: it is turned by
    less than anything that is computed from it is rounded by, so that the point that touches lies
    lower.
    """
    if model.law.points > 2:
        return state
    leading, trailing = model.gaps(model.c.place(np.asarray(state, dtype=float)))
    level = np.abs(leading - trailing) < options.least_turn * model.pad.w
    turn = level * options.least_turn * (contact[0] - contact[1])
    return state + np.multiply.outer(np.eye(6)[2], turn) if np.any(turn) else state


def _late(model: PadModel, course: Course, point: int) -> np.ndarray:
    """The other points that have passed their switching surface in the same instant as `point`, at
    the end of a course.

    Such a crossing lies behind the located one by rounding and would not be seen again: its gap
    is as far beyond zero as that of the located point, which rounding may leave just before it.
    """
    wrong, contact = course.wrong[:, 0], course.last[:, 0]
    near = wrong >= -abs(wrong[point])
    near[point] = False
    if near.any():
        end = np.asarray(course.end[:, 0], dtype=float)
        place, speed = (np.array(model.c.place(part)) for part in (end[:3], end[3:]))
        rates = complex_step(model.gaps, place, along=speed)
        near &= np.where(contact > 0, rates, -rates) > 0.0
    return np.flatnonzero(near)


def integrate(
    model: PadModel,
    integrator: Integrator,
    units: Units,
    state: np.ndarray,
    stop: float,
    see: Sequence[Callable[[Course], Any]] = (),
    dense: bool = False,
    options: Options = DEFAULT,
) -> tuple[float, np.ndarray, int, int]:
    """Run a scaled pad to `stop` (natural units), whose courses some functions see; `dense` ones
    hold the motion between changes.

    Returns the final time and state (6,), the number of steps and the number of contact changes.
    Raises ModelEnd after the last course before the model ends, and ComputationError where a
    contact change was missed.
    """
    contact = first_contact(model, state, options)
    state = off_level(model, state, contact, options)
    t, steps, changed = 0.0, 0, 0
    while t < stop:
        course = integrator.run(contact, t, state, stop, dense)
        begun, t, state, limit = t, course.t1[0], course.end[:, 0], int(course.limit[0])
        at = f"t = {float(t) * units.time:.9g} s"
        point = int(course.point[-1]) if course.t.size and course.t[-1] == t else -1
        missed = course.wrong[:, 0] > options.missed
        if missed.any():
            raise ComputationError(
                f"a contact change was missed before {at}; ask for a smaller tolerance"
            )
        if limit < 0 and t < stop:
            if point >= 0:
                late = _late(model, course, point)
                again = np.append(np.arange(len(course.t)), np.full(len(late), -1))
                changes: Any = {
                    name: getattr(course, name).take(again, axis=-1)
                    for name in ("lane", "t", "state")
                }
                course = dataclasses.replace(course, point=np.append(course.point, late), **changes)
                state = off_level(model, state, course.last[:, 0], options)
            elif t - begun < 1e-9 * stop:
                raise ComputationError(
                    f"no progress beyond {at}; a spring may have collapsed to zero length there"
                )
        contact = course.last[:, 0]
        steps, changed = steps + int(course.count[0]), changed + len(course.t)
        for function in see:
            function(course)
        if limit >= 0:
            raise ModelEnd(f"{LIMITS[limit]} at {at}; the model ends there")
    return t, state, steps, changed


def whole(
    model: PadModel,
    integrator: Integrator,
    units: Units,
    state: np.ndarray,
    stop: float,
    dense: bool = False,
) -> Course:
    """The motion that `integrate` runs, as one course."""
    courses: list[Course] = []
    integrate(model, integrator, units, state, stop, [courses.append], dense)
    return Course.joined(courses)
