"""The hybrid run: smooth steps joined at the contact changes (Table 1, Fig. 3, Fig. 8).

An integrator carries one motion, or several side by side, through contact changes and hands over a
`Segment`. Observers see the segments as they come, so that memory does not grow with the time.
"""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from squeal.errors import ComputationError
from squeal.model.contact import ContactLaw, State, Touching
from squeal.model.equations import PadModel, Units
from squeal.model.pad import Coefficients, pose_of
from squeal.numerics.differentiation import complex_step

# Share of its free length at which a spring counts as collapsed: the direction of its force, and
# with it the motion, jumps at zero.
COLLAPSED = 1e-6

# Lengths and times in natural units, see `squeal.model.equations.natural_units`.
CLEAR = 1e-9  # gap, over 1 + w + h, below which a contact point may change together with another
MISSED = 1e-6  # gap of the wrong sign that shows a missed contact change
FIRST_STEP = 1e-3  # time in which a point that starts on the surface shows to which side it goes
LEAST_TURN = 1e-15  # of w theta by `off_level`: a contact of no length has no centre
LEAST_PROGRESS = 1e-9  # of a segment without a contact change, a share of the whole time

_TINY = float(np.finfo(float).tiny)
_ROUNDING = 8.0 * float(np.finfo(float).eps)  # of a gap, over the lengths that it is made of


class Limit(IntEnum):
    """What ended a motion before its time, if anything."""

    NONE = 0
    TURNED = 1
    SPRING_1 = 2
    SPRING_2 = 3
    SURFACE_SPEED = 4
    FAILED = 5  # the integrator could not carry it on


LIMITS = {
    Limit.TURNED: "the pad has turned past 90 degrees",
    Limit.SPRING_1: "spring 1 has collapsed to zero length",
    Limit.SPRING_2: "spring 2 has collapsed to zero length",
    Limit.SURFACE_SPEED: "the pad has reached the speed V of the surface, beyond which friction "
    "that falls with speed means nothing,",
}
"""Where the model ends: what has happened."""


class ModelEnd(ComputationError):
    """A motion leaves the model's range, for a reason of `LIMITS`."""


class Steps(NamedTuple):
    """Smooth steps of n motions, those of the first motion first, each in order of time.

    motion (s,): number of the motion of each; t, h (s,): its begin and length; series (p, 6, s):
    coefficients of the state in powers of the share of the step; on (points, s): 1 for a point that
    touches.
    """

    motion: np.ndarray
    t: np.ndarray
    h: np.ndarray
    series: np.ndarray
    on: np.ndarray

    def some(self, which: np.ndarray) -> "Steps":
        """Some of the steps (k,)."""
        return Steps(*(part.take(which, axis=-1) for part in self))

    def states(self, share: np.ndarray) -> np.ndarray:
        """States (6, s) at a share (s,) of each step."""
        states = self.series[-1]  # by Horner's rule
        for coefficient in self.series[-2::-1]:
            states = states * share + coefficient
        return np.asarray(states)


class ContactChanges(NamedTuple):
    """The e contact changes of some motions, sorted by motion, then by time."""

    motion: np.ndarray  # (e,), number of the motion
    point: np.ndarray  # (e,), the contact point that touches or separates
    t: np.ndarray  # (e,)
    state: np.ndarray  # (6, e), of the motion at that time


class DenseOutput(NamedTuple):
    """The smooth steps of a segment without their contact; fields as in `Steps`."""

    motion: np.ndarray
    t: np.ndarray
    h: np.ndarray
    series: np.ndarray

    @staticmethod
    def joined(parts: Sequence["DenseOutput | None"]) -> "DenseOutput | None":
        """The steps of all parts, one after the other; None if no part has any."""
        dense = [part for part in parts if part is not None]
        if not dense:
            return None
        return DenseOutput(*_concatenated(dense))


def _concatenated(parts: Sequence[tuple[np.ndarray, ...]]) -> list[np.ndarray]:
    """Each array of the first part with those of the others behind, along its last axis."""
    return [np.concatenate(arrays, axis=-1) for arrays in zip(*parts, strict=True)]


@dataclass(frozen=True)
class Segment:
    """A part of n motions in natural units. Contact is 0 or 1 for each point."""

    law: ContactLaw
    c: Coefficients  # numbers (n,)
    t0: np.ndarray  # (n,), time at the begin
    t1: np.ndarray  # (n,), time at the end
    first_contact: np.ndarray  # (points, n), at the begin
    end: np.ndarray  # (6, n), state at the end
    changes: ContactChanges
    step_count: np.ndarray  # (n,), of the integration
    limit: np.ndarray  # (n,), `Limit`
    dense_output: DenseOutput | None = None

    def _contact(self, motion: np.ndarray, changes: np.ndarray) -> np.ndarray:
        """Contact (points, k) of motions (k,) once the first `changes` (k,) of the changes of all
        motions have happened."""
        # (points, changes + 1): how often each point has changed after 0, 1, ... of all changes
        flips = np.zeros((len(self.first_contact), len(self.changes.t) + 1), dtype=int)
        flips[self.changes.point, np.arange(1, flips.shape[1])] = 1
        flips = flips.cumsum(axis=1)
        changes_of_earlier_motions = np.searchsorted(self.changes.motion, motion)
        flips_of_the_motion = flips[:, changes] - flips[:, changes_of_earlier_motions]
        return np.asarray((self.first_contact[:, motion] + flips_of_the_motion) % 2)

    @cached_property
    def contact_after_changes(self) -> np.ndarray:
        """Contact (points, e) after each change."""
        return self._contact(self.changes.motion, np.arange(1, len(self.changes.t) + 1))

    @cached_property
    def last_contact(self) -> np.ndarray:
        """Contact (points, n) at the end."""
        motion = np.arange(len(self.t0))
        changes = np.searchsorted(self.changes.motion, motion, side="right")
        return self._contact(motion, changes)

    @cached_property
    def steps(self) -> Steps:
        """Steps of the trajectories, where there is dense output."""
        assert self.dense_output is not None
        motion, t, h, series = self.dense_output
        # how many changes precede each step, in the order of motion, then of time: NumPy sorts
        # complex numbers by their real parts, then by their imaginary ones
        times_of_changes = self.changes.motion + 1j * self.changes.t
        changes = np.searchsorted(times_of_changes, motion + 1j * t, side="right")
        return Steps(motion, t, h, series, on=self._contact(motion, changes))

    @cached_property
    def overshoot(self) -> np.ndarray:
        """How far (points, n) each gap at the end has passed zero without a change of contact: the
        height of a point that counts as touching, the depth of another one; negative before."""
        end = np.asarray(self.end, dtype=float)
        heights = np.array(self.law.gaps(self.c, pose_of(np, self.c.xy_theta(end))))
        return np.where(self.last_contact > 0, heights, -heights)

    def coefficients(self, motion: np.ndarray) -> Coefficients:
        """Coefficients (k,) of motions of these numbers (k,); of a single motion always (1,)."""
        if len(self.t0) == 1:
            return self.c
        return Coefficients(*(values[motion] for values in self.c))

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """States (k, 6) and contact (points, k) of a single motion at times (k,)."""
        step_of_time = np.searchsorted(self.steps.t[1:], t)
        steps = self.steps.some(step_of_time)
        length = np.maximum(steps.h, _TINY)  # a step may take no time
        share = (t - steps.t) / length
        return steps.states(share).T, steps.on

    @staticmethod
    def joined(parts: Sequence["Segment"]) -> "Segment":
        """The parts of one motion, one after the other, as one."""
        if len(parts) == 1:
            return parts[0]
        # the last part tells the end, and what ended the motion
        return dataclasses.replace(
            parts[-1],
            t0=parts[0].t0,
            first_contact=parts[0].first_contact,
            changes=ContactChanges(*_concatenated([part.changes for part in parts])),
            step_count=np.sum([part.step_count for part in parts], axis=0),
            dense_output=DenseOutput.joined([part.dense_output for part in parts]),
        )


Observe = Callable[[Segment], object]
"""What is called with each segment of a motion as it comes."""


class Integrator(Protocol):
    """Carries the motion on, at a tolerance."""

    method: str
    tolerance: float

    def run(
        self, contact: np.ndarray, t: float, state: np.ndarray, stop: float, dense: bool
    ) -> Segment:
        """A segment from contact (points,) and state (6,) at t on: to `stop`, to a limit, for a
        bounded number of steps, or to a change of contact beside which another point is near the
        surface.

        Raises ComputationError if the motion leaves all bounds.
        """


def state_of(contact: np.ndarray) -> State:
    """The contact state of a column (points,) of zeros and ones."""
    return State(*(value > 0 for value in contact.tolist()))


def state_rates(model: PadModel, state: np.ndarray, on: Touching | None = None) -> np.ndarray:
    """Rates (6, ...) of scaled states (6, ...) in the contact `on`; without it, in that which their
    gaps show."""
    c = model.c
    q = np.array(c.xy_theta(state[:3]))
    velocity = np.array(c.xy_theta(state[3:]))
    touching = 1.0 * (model.gaps(q) < 0.0) if on is None else on
    force_x, force_y, moment = model.loads(q, touching, velocity)
    return np.array([*state[3:], force_x / c.m, force_y / c.m, moment * c.w / c.I])


def first_contact(model: PadModel, state: np.ndarray, step: float = FIRST_STEP) -> np.ndarray:
    """Contact (points, ...) of 0 or 1 of the first motion from scaled states (6, ...).

    A point that starts on the switching surface, to rounding, belongs to the side to which the
    first motion takes it; a Runge-Kutta `step` of time tells which, since the loads are continuous.
    """
    start = np.asarray(state, dtype=float)
    pad = model.pad
    gaps = model.gaps(model.c.xy_theta(start))
    rounding = _ROUNDING * (pad.h + pad.w + abs(pad.y0) + abs(start[1]))
    on_surface = np.abs(gaps) <= rounding
    touches = gaps < 0.0
    if np.any(on_surface):
        k1 = state_rates(model, start)
        k2 = state_rates(model, start + step * k1)
        # x + v dt + a dt^2/2 + (da/dt) dt^3/6 with dt = step; a is the last half of k1, and da/dt
        # that of (k2 - k1)/dt, so that both terms of a add up to (2 k1 + k2) dt^2/6
        moved = start[:3] + step * start[3:] + step**2 / 6 * (2 * k1 + k2)[3:]
        # the change of the gap, not the gap: an offset of rounding size must not decide
        change = model.gaps(model.c.xy_theta(moved)) - gaps
        touches = np.where(on_surface, change < 0.0, touches)
    return np.asarray(touches).astype(int)


def off_level(model: PadModel, state: np.ndarray, contact: np.ndarray) -> np.ndarray:
    """Scaled states (6, ...) from which partial contact can go on.

    contact (2, ...): 1 where the leading edge, and where the trailing edge touches, else 0.

    The contact length of a level pad exactly on the surface is 0/0. The pad is turned by less than
    rounding, so that the edge that touches lies lower. Other states are returned as they are.
    """
    if model.law.points > 2:  # springs have no contact length
        return state
    leading, trailing = model.gaps(model.c.xy_theta(np.asarray(state, dtype=float)))
    # level to rounding of the lengths: the gaps differ by less than that of the half length w
    is_level = np.abs(leading - trailing) < LEAST_TURN * model.pad.w
    # 1 where the leading edge touches alone, -1 the trailing edge, 0 in full or no contact
    sense = contact[0] - contact[1]
    turn = np.where(is_level, LEAST_TURN * sense, 0.0)
    if not np.any(turn):
        return state
    turned = np.array(state)
    turned[2] += turn  # w theta, which lowers the leading edge
    return turned


def _simultaneous(model: PadModel, segment: Segment, point: int) -> np.ndarray:
    """The other points that have passed their switching surface in the same instant as `point`, at
    the end of the segment of a single motion.

    Rounding may put such a crossing before the end of the segment, where the integrator, going on
    from the end, would not see it. A point counts if two conditions hold. Its gap has passed zero,
    or is short of it by no more than what rounding left of the gap of `point`. And its gap moves on
    away from its contact state: it opens where the point touches, it closes where the point is off.
    """
    overshoot = segment.overshoot[:, 0]  # (points,): above 0 where a gap has passed zero
    rounding = abs(overshoot[point])  # the gap of `point` is zero but for rounding
    passed = overshoot >= -rounding
    passed[point] = False
    if passed.any():
        end = np.asarray(segment.end[:, 0], dtype=float)
        q = np.array(model.c.xy_theta(end[:3]))
        velocity = np.array(model.c.xy_theta(end[3:]))
        gap_rates = complex_step(model.gaps, q, along=velocity)
        goes_on = np.where(segment.last_contact[:, 0] > 0, gap_rates, -gap_rates) > 0.0
        passed &= goes_on
    return np.flatnonzero(passed)


def _with_simultaneous(model: PadModel, segment: Segment) -> Segment:
    """A segment that ends at a change, with those of other points in the same instant."""
    changes = segment.changes
    points = _simultaneous(model, segment, int(changes.point[-1]))
    # motion, time and state of the last change hold for those in the same instant too
    repeats = np.ones(len(changes.t), dtype=int)
    repeats[-1] += len(points)
    motion, _, t, state = (array.repeat(repeats, axis=-1) for array in changes)
    with_others = ContactChanges(motion, np.append(changes.point, points), t, state)
    return dataclasses.replace(segment, changes=with_others)


class MotionEnd(NamedTuple):
    """Final time and state (6,) in natural units, number of steps and of contact changes."""

    t: float
    state: np.ndarray
    steps: int
    changes: int


def integrate(
    model: PadModel,
    integrator: Integrator,
    units: Units,
    state: np.ndarray,
    stop: float,
    observers: Sequence[Observe] = (),
    dense: bool = False,
    since: float = 0.0,
) -> MotionEnd:
    """Run a scaled pad from a state (6,) to the time `stop`, both in natural units.

    Each segment is handed to the observers; with `dense` it holds the motion between changes.
    `since` is the time that has passed before, which messages add to the time. Raises
    ModelEnd after the last segment before the model ends, and ComputationError where a contact
    change was missed.
    """

    def instant(t: float) -> str:
        return f"t = {float(since + t) * units.time:.9g} s"

    contact = first_contact(model, state)
    z = off_level(model, state, contact)
    t = 0.0
    steps = 0
    changes = 0
    while t < stop:  # one segment in each pass
        try:
            segment = integrator.run(contact, t, z, stop, dense)
        except ComputationError as error:
            raise ComputationError(f"after {instant(t)}: {error}") from None
        # a segment may hold several motions side by side: here the only one has the index 0
        begin = t
        t = segment.t1[0]
        z = segment.end[:, 0]
        limit = Limit(segment.limit[0])
        if (segment.overshoot[:, 0] > MISSED).any():
            raise ComputationError(
                f"a contact change was missed before {instant(t)}; ask for a smaller tolerance"
            )
        if limit == Limit.NONE and t < stop:
            times = segment.changes.t
            ends_at_a_change = times.size > 0 and times[-1] == t
            if ends_at_a_change:
                segment = _with_simultaneous(model, segment)
                z = off_level(model, z, segment.last_contact[:, 0])
            elif t - begin < LEAST_PROGRESS * stop:
                raise ComputationError(
                    f"no progress beyond {instant(t)}; a spring may have collapsed to zero length "
                    "there"
                )
        contact = segment.last_contact[:, 0]
        steps += int(segment.step_count[0])
        changes += len(segment.changes.t)
        for observe in observers:
            observe(segment)
        if limit != Limit.NONE:
            raise ModelEnd(f"{LIMITS[limit]} at {instant(t)}; the model ends there")
    return MotionEnd(t, z, steps, changes)


def whole_motion(
    model: PadModel,
    integrator: Integrator,
    units: Units,
    state: np.ndarray,
    stop: float,
    dense: bool = False,
    since: float = 0.0,
) -> Segment:
    """The motion that `integrate` runs, as one segment."""
    segments: list[Segment] = []
    integrate(model, integrator, units, state, stop, [segments.append], dense, since=since)
    return Segment.joined(segments)
