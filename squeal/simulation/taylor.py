"""Taylor integration of a motion with heyoka.

The equations of `squeal.model.equations` become heyoka's expressions. A pad's numbers and contact
are runtime parameters, so that the code that heyoka compiles, and keeps on disk, serves all. A
callback flips the contact where a gap passes zero, so that heyoka's own loop runs on.
"""

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from threading import get_ident
from typing import Any, ClassVar, NamedTuple, Protocol

import heyoka as hy
import numpy as np

from squeal.errors import ComputationError
from squeal.model.contact import ContactLaw, Touching
from squeal.model.equations import PadModel, net_loads, term_count
from squeal.model.pad import Coefficients, Number, at_speed, facing, pose_of, spring_vectors
from squeal.simulation.hybrid import (
    CLEAR,
    COLLAPSED,
    LIMITS,
    ContactChanges,
    DenseOutput,
    Integrator,
    Limit,
    Segment,
)

# its warnings would go to standard output; a lost root shows in the check at the end of a segment
hy.set_logger_level_critical()

# A gap that is exactly zero at the start of a step hides the next root of the same step from
# heyoka 7.13: its bracketing search then stops at the left end. This offset, far below the
# rounding of any gap, puts the start on the side of the contact state.
NEVER_ZERO = 1e-300
# heyoka's tolerance is relative to the largest of state and event functions: a limit of order one
# would loosen the error control of a small motion.
FAINT = 1e-30
# Steps of a motion after which observers see it; bounds the memory of a run.
STEPS_AT_ONCE = 5000
# Tolerance above which the compiler may regroup sums: a step is a third cheaper, but rounding
# drifts, which a hundred scenes' energy shows at finer tolerances.
REGROUPED_ABOVE = 1e-14
# With more contact points than so many heyoka compiles functions instead of unrolled code.
UNROLLED = 2
# of the first runtime parameters of `equations`, in their order
NAMES = Coefficients._fields
# Numbers of `PadModel.term_values` behind the nine of damping: of friction that falls with speed.
FALL_SHARE, FALL_RATE, SURFACE_SPEED = 9, 10, 11

_EPS = float(np.finfo(float).eps)
_GOES_ON = (hy.taylor_outcome.success, hy.taylor_outcome.time_limit, hy.taylor_outcome.step_limit)

NumberType = Callable[[float], Number]
"""What makes numbers of the integration: float, numpy.longdouble or heyoka.real128."""


class Equations(NamedTuple):
    """Symbolic equations of motion of a pad."""

    system: list[tuple[Number, Number]]  # each of (x, y, w theta) and their rates, and its rate
    gaps: list[Number]  # of the contact points
    limits: list[Number]  # positive as long as the model holds, in the order of `LIMITS`


def equations(law: ContactLaw, on: Touching, terms: tuple[str, ...] = ()) -> Equations:
    """The equations of a contact law, whose numbers are runtime parameters.

    `on` is the contact state, as constants or as symbols; `terms` are those with velocities, see
    `PadModel.terms`, whose numbers, `PadModel.term_values`, follow as runtime parameters.
    """
    c = Coefficients(*(hy.par[i] for i in range(len(NAMES))))
    first = len(NAMES) + law.points  # in between stands the contact of each point
    numbers = [hy.par[first + i] for i in range(term_count(terms))]
    state = hy.make_vars("x", "y", "s", "u", "v", "r")  # s = w theta; u, v, r: rates of x, y, s
    velocities = state[3:]
    u, v, r = velocities
    if "falling" in terms:
        c = at_speed(hy, c, (numbers[FALL_SHARE], numbers[FALL_RATE]), u)
    q = c.xy_theta(state)
    total = net_loads(hy, c, law, q, on)
    rates = [u, v, r, total.x / c.m, total.y / c.m, c.w * total.moment / c.I]
    if "damping" in terms:
        for i in range(3):
            row = numbers[3 * i : 3 * i + 3]  # of `PadModel.decay`, whose nine entries come first
            drag = sum(entry * speed for entry, speed in zip(row, velocities, strict=True))
            rates[3 + i] = rates[3 + i] - drag
    pose = pose_of(hy, q)
    # the model ends where one of these falls to zero
    limits = [facing(c, pose)]
    for (vx, vy), free_length in zip(spring_vectors(c, pose), (c.L1, c.L2), strict=True):
        length = hy.sqrt(vx * vx + vy * vy)
        limits.append(length / free_length - COLLAPSED)
    if "falling" in terms:
        limits.append(numbers[SURFACE_SPEED] - u)
    system = list(zip(state, rates, strict=True))
    return Equations(system, list(law.gaps(c, pose)), [FAINT * limit for limit in limits])


def state_parameters(law: ContactLaw) -> tuple[Number, ...]:
    """Runtime parameters, after those of the coefficients, that say which points touch."""
    return tuple(hy.par[len(NAMES) + i] for i in range(law.points))


def rising(gaps: Sequence[Number], on: Touching) -> list[Number]:
    """Expressions that pass zero upwards where a contact point separates or touches."""
    expressions = []
    for gap, touches in zip(gaps, on, strict=True):
        sense = 2.0 * touches - 1.0  # 1 for a point that touches, else -1
        expressions.append(sense * gap - NEVER_ZERO)
    return expressions


class ContactChange(NamedTuple):
    """A change that a callback has seen: motion, contact point, time, bytes of the state (6,)."""

    motion: int
    point: int
    t: Number
    state: bytes


class Code(NamedTuple):
    """What heyoka compiles: the equations of a contact law, for every pad.

    law, terms: see `equations`; tolerance: of a step, relative; fp_type: the numbers; regrouped:
    see `REGROUPED_ABOVE`.
    """

    law: ContactLaw
    terms: tuple[str, ...]
    tolerance: float
    fp_type: NumberType
    regrouped: bool


class Adaptive(Protocol):
    """What a callback reads of heyoka's integrator.

    time: a number, or an array of several motions; tc: coefficients (6, p) of the last step.
    """

    time: Number
    tc: np.ndarray


class Machine:
    """A compiled integrator.

    It comes as its last user left it: `start` sets all of its parameters and state, and the
    coefficients `c`.

    ta: heyoka's integrator; log: the contact changes since it was last cleared; clear: gap below
    which the motion stops at a change, see `CLEAR`; pars (k, n), state (6, n): views of heyoka's
    own arrays. A subclass may carry several motions, whose number `motions` is the last axis of
    these arrays; a single motion lacks that axis in heyoka, and n is 1 here.
    """

    adaptive: ClassVar = staticmethod(hy.taylor_adaptive)
    event: ClassVar = staticmethod(hy.t_event)
    motions: ClassVar[tuple[int, ...]] = ()

    def __init__(self, code: Code) -> None:
        """Have heyoka compile the equations, for any pad: numbers are set by `start`."""
        self.code = code
        self.log: list[ContactChange] = []
        self.clear = 0.0
        law = code.law
        fp_type = code.fp_type
        system, gaps, limits = equations(law, state_parameters(law), code.terms)
        settings: dict[str, Any] = {
            "fp_type": fp_type,
            "tol": fp_type(code.tolerance),
            "t_events": self._events(gaps, limits),
            "fast_math": code.regrouped,
            "compact_mode": law.points > UNROLLED or fp_type is not float,
        }
        if fp_type is not float:
            # such numbers are slow by themselves: optimised code would only take longer to compile
            settings["opt_level"] = 0
        count = len(NAMES) + law.points + term_count(code.terms)
        # any numbers, until `start` sets others
        state = np.full((6, *self.motions), fp_type(0.0))
        parameters = np.full((count, *self.motions), fp_type(1.0))
        self.ta = self.adaptive(system, state, pars=parameters, **settings)
        self.pars = self.ta.pars.reshape(count, -1)
        self.state = self.ta.state.reshape(6, -1)
        # parts of these views for callbacks
        self.columns = list(self.state.T)  # the state (6,) of each motion
        self.on = list(self.pars[len(NAMES) : len(NAMES) + law.points])  # (n,) of each point

    def _events(self, gaps: list[Number], limits: list[Number]) -> list[hy.t_event]:
        """heyoka's events: a change at each contact point, whose callback says whether the motion
        goes on, then the limits, which end it."""
        code = self.code
        events = []
        # expressions that pass zero upwards where a contact point changes
        for point, event_function in enumerate(rising(gaps, state_parameters(code.law))):
            contact_change = self.event(
                event_function,
                direction=hy.event_direction.positive,
                callback=self.contact_callback(point),
                # once the contact has changed, the same gap passes zero in the other sense
                cooldown=code.fp_type(0.0),
                fp_type=code.fp_type,
            )
            events.append(contact_change)
        for limit in limits:
            downwards = hy.event_direction.negative
            events.append(self.event(limit, direction=downwards, fp_type=code.fp_type))
        return events

    # heyoka copies callbacks deeply, which leaves functions and what they refer to shared

    def contact_callback(self, point: int) -> Callable[..., bool]:
        """The callback that flips the contact of a point, and lets heyoka go on where no other
        point is near the surface."""

        def of_motion(ta: Adaptive, _sign: int) -> bool:
            self.flip(point, 0)
            self.log.append(ContactChange(0, point, ta.time, self.columns[0].tobytes()))
            return not self._another_point_is_near(point)

        return of_motion

    def flip(self, point: int, motion: int) -> None:
        """Let a point of a motion touch if it does not, and separate if it does."""
        touches = self.on[point]
        touches[motion] = 1.0 - touches.item(motion)

    def _another_point_is_near(self, point: int) -> bool:
        """Whether another point is near the surface, on the other side or on its way there, so that
        it has to be looked at before the motion goes on."""
        state = self.columns[0]  # gaps do not depend on x, its first entry
        pose = pose_of(math, self.c.xy_theta((0.0, float(state[1]), float(state[2]))))
        for other, gap in enumerate(self.code.law.gaps(self.c, pose)):
            touches = self.on[other][0]
            depth = -gap if touches else gap  # on its own side of the surface
            if other != point and depth < self.clear:
                return True
        return False

    def start(self, pars: np.ndarray, state: np.ndarray, t: np.ndarray) -> None:
        """Set parameters (k, n), states (6, n) and times (n,)."""
        self.pars[:] = pars
        self.state[:] = state
        self.set_time(t)
        self.c = Coefficients(*pars[: len(NAMES), 0].tolist())
        self.ta.reset_cooldowns()

    def set_time(self, t: np.ndarray) -> None:
        """Set heyoka's time to that of the motions (n,)."""
        self.ta.time = t[0]

    def changes(self) -> ContactChanges:
        """The contact changes of the log."""
        dtype = self.state.dtype
        changes = sorted(self.log, key=lambda change: change.motion)
        states = np.frombuffer(b"".join(change.state for change in changes), dtype)
        return ContactChanges(
            motion=np.array([change.motion for change in changes], dtype=int),
            point=np.array([change.point for change in changes], dtype=int),
            t=np.array([change.t for change in changes], dtype=dtype),
            state=states.reshape(len(changes), 6).T,
        )


class Record:
    """What heyoka computes in each step, for dense output if that is wanted.

    times: the begin and the ends of steps, for each motion if there are several; series:
    coefficients (6, p), or (6, p, n), of the state in powers of time.
    """

    def __init__(self, machine: Machine, dense: bool) -> None:
        self.dense = dense
        self.times = [np.array(machine.ta.time)]
        self.series: list[np.ndarray] = []

    def options(self) -> dict[str, Any]:
        """The arguments of a run of heyoka that record its steps."""
        if not self.dense:
            return {}
        times = self.times
        series = self.series

        def keep(ta: Adaptive) -> bool:
            series.append(ta.tc.copy())
            times.append(np.array(ta.time))
            return True

        return {"write_tc": True, "callback": keep}

    def dense_output(self) -> DenseOutput | None:
        """The steps of a single motion; None if no dense output is wanted."""
        if not self.dense:
            return None
        return dense_output(np.array(self.times), np.array(self.series), motion=0)


def dense_output(times: np.ndarray, coefficients: np.ndarray, motion: int) -> DenseOutput:
    """The steps of a motion, by its number, from their ends (s + 1,) and coefficients (s, 6, p)."""
    lengths = np.diff(times)
    taken = lengths > 0.0
    # a motion that ends at once at a change of contact takes no time: it keeps its first step
    taken[0] |= not taken.any()
    h = lengths[taken]
    series = np.ascontiguousarray(coefficients[taken].T)
    # from powers of time to powers of the share of the step
    powers = np.cumprod(np.broadcast_to(h, (len(series) - 1, len(h))), axis=0)
    series[1:] *= powers[:, None]
    return DenseOutput(np.full(len(h), motion), t=times[:-1][taken], h=h, series=series)


@lru_cache
def _machine(_thread: int, kind: type[Machine], code: Code) -> Machine:
    """One for each thread, since a machine has a state."""
    return kind(code)


def limit_of(outcome: hy.taylor_outcome, points: int) -> Limit:
    """What stopped heyoka: the limit, if any. points: contact points, whose events come before
    those of the limits."""
    # -1 - i where event i stopped heyoka, i where the callback of event i let the motion go on.
    # The events of the limits 1, 2, ... follow those of the points: i = points + limit - 1
    code = int(outcome)
    limit = -code - points
    if limit in LIMITS:
        return Limit(limit)
    if code >= -points or outcome in _GOES_ON:
        return Limit.NONE
    return Limit.FAILED


def runtime_parameters(model: PadModel, contact: np.ndarray) -> np.ndarray:
    """Runtime parameters (k, n) of n pads: coefficients, contact (points, n), terms."""
    points, n = contact.shape
    terms = model.term_values.reshape(-1, n)
    rows = np.empty((len(NAMES) + points + len(terms), n))
    for row, value in zip(rows, model.c, strict=False):  # the rows of coefficients come first
        row[:] = value
    rows[len(NAMES) : len(NAMES) + points] = contact
    rows[len(NAMES) + points :] = terms
    return rows


class HeyokaIntegrator:
    """What integrators of one motion and of several have in common: a scaled pad, a tolerance.

    `fp_type` may be numpy.longdouble or heyoka.real128; the coefficients then stay the doubles of
    the pad, so that the difference to a double run is that of the integration alone.
    """

    method = "heyoka Taylor"
    machine: ClassVar = Machine

    def __init__(self, model: PadModel, tolerance: float, fp_type: NumberType = float) -> None:
        least = _EPS if fp_type is float else 0.0
        self.tolerance = max(tolerance, least)
        self.model = model
        self._fp = fp_type

    def ready(self) -> Machine:
        """The machine of this thread, with an empty log."""
        code = Code(
            law=self.model.law,
            terms=self.model.terms,
            tolerance=self.tolerance,
            fp_type=self._fp,
            regrouped=self._fp is float and self.tolerance > REGROUPED_ABOVE,
        )
        machine = _machine(get_ident(), self.machine, code)
        machine.log.clear()
        return machine


class TaylorIntegrator(HeyokaIntegrator, Integrator):
    """Integrator over one scaled pad."""

    def run(
        self, contact: np.ndarray, t: float, state: np.ndarray, stop: float, dense: bool
    ) -> Segment:
        """A segment from contact (points,) and the scaled state (6,) at t on, to `stop` at most.

        See `squeal.simulation.hybrid.Integrator`. The arrays of the segment hold one motion (1,).
        dense: whether the segment has the Taylor series of all steps.
        """
        law = self.model.law
        machine = self.ready()
        dtype = machine.state.dtype  # doubles, or numbers of more digits
        first = np.reshape(contact, (law.points, 1))
        parameters = runtime_parameters(self.model, first)
        t0 = np.reshape(t, 1).astype(dtype)
        until = np.reshape(stop, 1).astype(dtype)
        machine.start(parameters, np.reshape(state, (6, 1)), t0)
        # rounding of a gap grows with the lengths in it: y of order 1, and the corners' arms
        machine.clear = CLEAR * (1.0 + machine.c.w + machine.c.h)
        record = Record(machine, dense)
        # heyoka also gives the least and the largest step, and after `steps` what `record` knows
        outcome, _, _, steps, *_ = machine.ta.propagate_until(
            until[0], max_steps=STEPS_AT_ONCE, **record.options()
        )
        t1 = np.full(1, machine.ta.time, dtype=dtype)
        limit = Limit.NONE
        if t1[0] != until[0]:  # also where the time is not a number
            limit = limit_of(outcome, law.points)
        if limit == Limit.FAILED:
            raise ComputationError("the motion is not finite")
        return Segment(
            law=law,
            c=Coefficients(*parameters[: len(NAMES)]),
            t0=t0,
            t1=t1,
            first_contact=first,
            end=machine.state.copy(),
            changes=machine.changes(),
            step_count=np.array([steps]),
            limit=np.array([limit]),
            dense_output=record.dense_output(),
        )
