"""Taylor integration with heyoka.

The equations of `squeal.model.equations` become heyoka's expressions. A pad's numbers and contact
are runtime parameters, so that the code that heyoka compiles, and keeps on disk, serves all. A
callback flips the contact where a gap passes zero, so that heyoka's own loop runs on.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from threading import get_ident
from typing import Any, NamedTuple

import heyoka as hy
import numpy as np

from squeal.errors import ComputationError
from squeal.model.contact import ContactLaw, Touching
from squeal.model.equations import PadModel, net_loads, term_count
from squeal.model.pad import Coefficients, Number, at_speed, facing, pose, spring_vectors
from squeal.simulation.hybrid import (
    COLLAPSED,
    DEFAULT,
    LIMITS,
    DenseOutput,
    Limit,
    Options,
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
# With more contact points than so many heyoka compiles functions instead of unrolled code.
UNROLLED = 2
# of the runtime parameters of `equations`, in their order
NAMES = Coefficients._fields
# Numbers of `PadModel.term_values` behind the nine of damping: of friction that falls with speed.
FALL_SHARE, FALL_RATE, SURFACE_SPEED = 9, 10, 11

_EPS = float(np.finfo(float).eps)
_ONWARD = (hy.taylor_outcome.success, hy.taylor_outcome.time_limit, hy.taylor_outcome.step_limit)


def equations(
    law: ContactLaw, on: Touching, terms: tuple[str, ...] = ()
) -> tuple[list[tuple[Any, Number]], list[Number], list[Number]]:
    """Symbolic equations of motion of (x, y, w theta) and their rates, gaps of the contact points,
    and limits, which are positive as long as the model holds, in the order of `LIMITS`.

    `on` is the contact state, as constants or as symbols; `terms` are those with velocities, see
    `PadModel.terms`, whose numbers, `PadModel.term_values`, follow as runtime parameters.
    """
    c = Coefficients(*(hy.par[i] for i in range(len(NAMES))))
    first = len(NAMES) + law.points
    numbers = [hy.par[first + i] for i in range(term_count(terms))]
    state = hy.make_vars("x", "y", "s", "u", "v", "r")
    velocities = state[3:]
    u, v, r = velocities
    if "falling" in terms:
        c = at_speed(hy, c, (numbers[FALL_SHARE], numbers[FALL_RATE]), u)
    q = c.place(state)
    total = net_loads(hy, c, law, q, on)
    rates = [u, v, r, total.x / c.m, total.y / c.m, c.w * total.moment / c.I]
    if "damping" in terms:
        for i in range(3):
            row = numbers[3 * i : 3 * i + 3]
            drag = sum(entry * speed for entry, speed in zip(row, velocities, strict=True))
            rates[3 + i] = rates[3 + i] - drag
    at = pose(hy, q)
    limits = [facing(c, at)]
    for (vx, vy), free_length in zip(spring_vectors(c, at), (c.L1, c.L2), strict=True):
        length = hy.sqrt(vx * vx + vy * vy)
        limits.append(length / free_length - COLLAPSED)
    if "falling" in terms:
        limits.append(numbers[SURFACE_SPEED] - u)
    system = list(zip(state, rates, strict=True))
    return system, list(law.gaps(c, at)), [FAINT * limit for limit in limits]


def state_parameters(law: ContactLaw) -> tuple[Any, ...]:
    """Runtime parameters, after those of the coefficients, that say which points touch."""
    return tuple(hy.par[len(NAMES) + i] for i in range(law.points))


def rising(heights: Sequence[Any], on: Touching) -> list[Any]:
    """Expressions that pass zero upwards where a contact point separates or touches."""
    pairs = zip(heights, on, strict=True)
    return [(2.0 * touches - 1.0) * gap - NEVER_ZERO for gap, touches in pairs]


class ContactChange(NamedTuple):
    """A change that a callback has seen: motion, contact point, time, bytes of the state (6,)."""

    motion: int
    point: int
    t: Any
    state: bytes


class Machine:
    """A compiled integrator of a contact law, for every pad.

    It carries `lanes` motions side by side, or with 0 a single one in numbers of `fp_type`. It
    comes as its last user left it: `start` sets all of its parameters and state.

    log: the contact changes since it was last cleared; first_motion: number of the motion in the
    first lane; clear: gap below which a single motion stops at a change, see `Options.clear`;
    pars (k, lanes), state (6, lanes): views of heyoka's own arrays.
    """

    def __init__(
        self,
        law: ContactLaw,
        terms: tuple[str, ...],
        tolerance: float,
        fp_type: Any,
        lanes: int,
        regrouped: bool,
    ) -> None:
        self.law = law
        self.lanes = lanes
        self.log: list[ContactChange] = []
        self.first_motion = 0
        self.clear = 0.0
        on = state_parameters(law)
        system, heights, limits = equations(law, on, terms)
        event = hy.t_event_batch if lanes else hy.t_event
        change = self._change_in_a_lane if lanes else self._change_alone
        events = []
        for point, height in enumerate(rising(heights, on)):
            contact_change = event(
                height,
                direction=hy.event_direction.positive,
                callback=change(point),
                # once the contact has changed, the same gap passes zero in the other sense
                cooldown=fp_type(0.0),
                fp_type=fp_type,
            )
            events.append(contact_change)
        for limit in limits:
            events.append(event(limit, direction=hy.event_direction.negative, fp_type=fp_type))
        how: dict[str, Any] = {
            "fp_type": fp_type,
            "tol": fp_type(tolerance),
            "t_events": events,
            "fast_math": regrouped,
            "compact_mode": law.points > UNROLLED or fp_type is not float,
        }
        if fp_type is not float:  # the time goes into the numbers, which no processor has
            how["opt_level"] = 0
        adaptive = hy.taylor_adaptive_batch if lanes else hy.taylor_adaptive
        shape = (lanes,) if lanes else ()
        state = np.full((6, *shape), fp_type(0.0))
        count = len(NAMES) + law.points + term_count(terms)
        self.ta = adaptive(system, state, pars=np.full((count, *shape), fp_type(1.0)), **how)
        self.pars = self.ta.pars.reshape(count, -1)
        self.state = self.ta.state.reshape(6, -1)
        self._times = np.atleast_1d(self.ta.time)  # of lanes a view, too
        self._columns = list(self.state.T)
        self._on = list(self.pars[len(NAMES) : len(NAMES) + law.points])

    # heyoka copies callbacks deeply, which leaves functions and what they refer to shared

    def _change_alone(self, point: int) -> Any:
        """The callback of a single motion: flips the contact of a point, and lets heyoka go on
        where no other point is near the surface."""

        def change(ta: Any, _sign: int) -> bool:
            self._flip(point, 0)
            self.log.append(ContactChange(0, point, ta.time, self._columns[0].tobytes()))
            return not self._another_point_is_near(point)

        return change

    def _change_in_a_lane(self, point: int) -> Any:
        """The callback of motions side by side: flips the contact of a point in a lane."""

        def change(_ta: Any, _sign: int, lane: int) -> bool:
            self._flip(point, lane)
            motion = self.first_motion + lane
            state = self._columns[lane].tobytes()
            self.log.append(ContactChange(motion, point, self._times.item(lane), state))
            return True

        return change

    def _flip(self, point: int, lane: int) -> None:
        touches = self._on[point]
        touches[lane] = 1.0 - touches.item(lane)

    def _another_point_is_near(self, point: int) -> bool:
        """Whether another point of a single motion is near the surface, on the other side or on its
        way there, so that it has to be looked at before the motion goes on."""
        state = self._columns[0]
        at = pose(math, self.c.place((0.0, float(state[1]), float(state[2]))))
        for other, gap in enumerate(self.law.gaps(self.c, at)):
            inside = -gap if self._on[other][0] else gap
            if other != point and inside < self.clear:
                return True
        return False

    def start(self, pars: np.ndarray, state: np.ndarray, t: np.ndarray) -> None:
        """Set parameters (k, lanes), states (6, lanes) and times (lanes,)."""
        self.pars[:] = pars
        self.state[:] = state
        if self.lanes:
            self.ta.set_time(t)
        else:
            self.ta.time = t[0]
            self.c = Coefficients(*pars[: len(NAMES), 0].tolist())
        self.ta.reset_cooldowns()


class Record:
    """What heyoka computes in each step, for dense output.

    times: the begin and the ends of steps, numbers or arrays (lanes,); series: coefficients
    (6, p) or (6, p, lanes) of the state in powers of time.
    """

    def __init__(self, machine: Machine) -> None:
        self.times = [np.array(machine.ta.time)]
        self.series: list[np.ndarray] = []

    def options(self) -> dict[str, Any]:
        """Of a run of heyoka that is to be recorded."""
        times = self.times
        series = self.series

        def keep(ta: Any) -> bool:
            series.append(ta.tc.copy())
            times.append(np.array(ta.time))
            return True

        return {"write_tc": True, "callback": keep}

    def smooth(self, first_motion: int) -> DenseOutput:
        """The steps of the motions from a number on."""
        t = np.array(self.times).reshape(len(self.times), -1)
        steps_of_lanes = np.array(self.series)
        steps_of_lanes = steps_of_lanes.reshape(*steps_of_lanes.shape[:3], -1)
        lengths = np.diff(t, axis=0)
        taken = lengths > 0.0  # motions at their end wait for others
        taken[0] |= ~taken.any(axis=0)  # a change of contact may take no time
        lane, step = np.nonzero(taken.T)
        h = lengths[step, lane]
        series = np.ascontiguousarray(steps_of_lanes[step, :, :, lane].T)
        # from powers of time to powers of the share of the step
        powers = np.cumprod(np.broadcast_to(h, (len(series) - 1, len(h))), axis=0)
        series[1:] *= powers[:, None]
        return DenseOutput(lane=first_motion + lane, t=t[step, lane], h=h, series=series)


@lru_cache
def _machine(_thread: int, *how: Any) -> Machine:
    return Machine(*how)


def limit_of(outcome: Any, points: int) -> Limit:
    """What stopped heyoka, with so many contact points before the limits among its events."""
    code = int(outcome)  # of events: -1, -2, ..., not negative where a callback let it go on
    limit = -code - 1 - points
    if 0 <= limit < len(LIMITS):
        return Limit(limit)
    if code >= -points or outcome in _ONWARD:
        return Limit.NONE
    return Limit.FAILED


def parameters_of(model: PadModel, contact: np.ndarray) -> np.ndarray:
    """Runtime parameters (k, n) of n pads: coefficients, contact (points, n), terms."""
    points, n = contact.shape
    terms = model.term_values.reshape(-1, n)
    rows = np.empty((len(NAMES) + points + len(terms), n))
    for row, value in zip(rows, model.c, strict=False):
        row[:] = value
    rows[len(NAMES) : len(NAMES) + points] = contact
    rows[len(NAMES) + points :] = terms
    return rows


class TaylorIntegrator:
    """Integrator over one scaled pad.

    `fp_type` may be numpy.longdouble or heyoka.real128; the coefficients then stay the doubles of
    the pad, so that the difference to a double run is that of the integration alone.
    """

    method = "heyoka Taylor"

    def __init__(
        self,
        model: PadModel,
        tolerance: float,
        fp_type: Any = float,
        options: Options = DEFAULT,
    ) -> None:
        least = _EPS if fp_type is float else 0.0
        self.tolerance = max(tolerance, least)
        self._model = model
        self._fp = fp_type
        self._options = options

    def compiled(self, lanes: int) -> Machine:
        """The machine of this thread, with an empty log."""
        regrouped = self._fp is float and self.tolerance > self._options.regrouped_above
        model = self._model
        how = (model.law, model.terms, self.tolerance, self._fp, lanes, regrouped)
        machine = _machine(get_ident(), *how)
        machine.log.clear()
        machine.first_motion = 0
        return machine

    def run(
        self, contact: np.ndarray, t: Any, state: np.ndarray, stop: Any, dense: bool
    ) -> Segment:
        """See `squeal.simulation.hybrid.Integrator`."""
        law = self._model.law
        options = self._options
        machine = self.compiled(lanes=0)
        number = machine.state.dtype
        first = np.reshape(contact, (law.points, 1))
        parameters = parameters_of(self._model, first)
        t0 = np.reshape(t, 1).astype(number)
        until = np.reshape(stop, 1).astype(number)
        machine.start(parameters, np.reshape(state, (6, 1)), t0)
        machine.clear = options.clear * (1.0 + machine.c.w + machine.c.h)
        record = Record(machine) if dense else None
        how = record.options() if record is not None else {}
        result = machine.ta.propagate_until(until[0], max_steps=options.steps_at_once, **how)
        t1 = np.full(1, machine.ta.time, dtype=number)
        limit = limit_of(result[0], law.points) if t1[0] < until[0] else Limit.NONE
        if limit == Limit.FAILED:
            raise ComputationError(
                f"the motion is not finite after t = {float(t):.9g} natural time units"
            )
        return segment_of(
            machine,
            parameters,
            t0=t0,
            t1=t1,
            first=first,
            end=machine.state.copy(),
            count=np.array([result[3]]),
            limit=np.array([limit]),
            smooth=record.smooth(0) if record is not None else None,
        )


def segment_of(machine: Machine, parameters: np.ndarray, **motions: Any) -> Segment:
    """What a machine has run with parameters (k, n), and the contact changes of its log."""
    number = machine.state.dtype
    changes = sorted(machine.log, key=lambda change: change.motion)
    states = np.frombuffer(b"".join(change.state for change in changes), number)
    return Segment(
        law=machine.law,
        c=Coefficients(*parameters[: len(NAMES)]),
        lane=np.array([change.motion for change in changes], dtype=int),
        point=np.array([change.point for change in changes], dtype=int),
        t=np.array([change.t for change in changes], dtype=number),
        state=states.reshape(len(changes), 6).T,
        **motions,
    )
