"""Taylor integration with heyoka, of one motion or of many side by side.

The equations of `squeal.model.equations` become heyoka's expressions. A pad's numbers and contact
are runtime parameters, so that the code that heyoka compiles, and keeps on disk, serves all. A
callback flips the contact where a gap passes zero, so that heyoka's own loop runs on.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from threading import get_ident
from typing import Any

import heyoka as hy
import numpy as np

from squeal.errors import ComputationError
from squeal.model.contact import ContactLaw, Touching
from squeal.model.equations import PadModel, net_loads, term_count
from squeal.model.pad import Coefficients, Number, at_speed, facing, pose, spring_vectors
from squeal.simulation.hybrid import COLLAPSED, DEFAULT, LIMITS, Course, Options

# its warnings would go to standard output; a lost root shows in the check at the end of a course
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
    q, (u, v, r) = c.place(state), state[3:]
    if "falling" in terms:
        c = at_speed(hy, c, (numbers[9], numbers[10]), u)
    total = net_loads(hy, c, law, q, on)
    rates = [u, v, r, total.x / c.m, total.y / c.m, c.w * total.moment / c.I]
    if "damping" in terms:
        for i in range(3):
            drag = sum(numbers[3 * i + j] * speed for j, speed in enumerate((u, v, r)))
            rates[3 + i] = rates[3 + i] - drag
    at = pose(hy, q)
    lengths = [hy.sqrt(vx * vx + vy * vy) for vx, vy in spring_vectors(c, at)]
    limits = [facing(c, at), lengths[0] / c.L1 - COLLAPSED, lengths[1] / c.L2 - COLLAPSED]
    if "falling" in terms:
        limits.append(numbers[11] - u)
    system = list(zip(state, rates, strict=True))
    return system, list(law.gaps(c, at)), [FAINT * limit for limit in limits]


def state_parameters(law: ContactLaw) -> tuple[Any, ...]:
    """Runtime parameters, after those of the coefficients, that say which points touch."""
    return tuple(hy.par[len(NAMES) + i] for i in range(law.points))


def rising(heights: Sequence[Any], on: Touching) -> list[Any]:
    """Expressions that pass zero upwards where a contact point separates or touches."""
    pairs = zip(heights, on, strict=True)
    return [(2.0 * touches - 1.0) * gap - NEVER_ZERO for gap, touches in pairs]


class Machine:
    """A compiled integrator of a contact law, for every pad.

    `lanes` motions side by side, or with 0 a single one in numbers of `fp_type`. It comes as its
    last user left it, and each use sets all of its parameters and state.
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
        on = state_parameters(law)
        system, heights, limits = equations(law, on, terms)
        self.law, self.lanes = law, lanes
        self.log: list[tuple[Any, ...]] = []  # motion, point, time, state of the changes
        self.base: int  # the motion in the first lane
        self.clear: float  # see `Options`
        upwards, downwards = hy.event_direction.positive, hy.event_direction.negative
        how: Any = {"fp_type": fp_type}
        none = fp_type(0.0)
        # No cooldown: once the state has changed, the same gap passes zero in the other sense.
        event = hy.t_event_batch if lanes else hy.t_event
        events = [
            event(e, direction=upwards, callback=self._on_change(i), cooldown=none, **how)
            for i, e in enumerate(rising(heights, on))
        ] + [event(limit, direction=downwards, **how) for limit in limits]
        how |= {"tol": fp_type(tolerance), "t_events": events, "fast_math": regrouped}
        how["compact_mode"] = law.points > UNROLLED or fp_type is not float
        if fp_type is not float:  # the time goes into the numbers, which no processor has
            how["opt_level"] = 0
        make, shape = (hy.taylor_adaptive_batch, (lanes,)) if lanes else (hy.taylor_adaptive, ())
        pars = np.full((len(NAMES) + law.points + term_count(terms), *shape), fp_type(1.0))
        self.ta = make(system, np.full((6, *shape), none), pars=pars, **how)
        self.time: Any = self.ta.time if lanes else None
        # views of its own arrays
        self.pars, self.state = (v.reshape(len(v), -1) for v in (self.ta.pars, self.ta.state))
        self.on = list(self.pars[len(NAMES) : len(NAMES) + law.points])
        self.columns = list(self.state.T)

    # heyoka copies callbacks deeply, which leaves functions and what they refer to shared
    def _on_change(self, point: int) -> Any:
        log, alone = self.log, not self.lanes

        def change(ta: Any, _sign: int, lane: int = 0) -> bool:
            touches = self.on[point]
            touches[lane] = 1.0 - touches.item(lane)
            t = ta.time if alone else self.time.item(lane)
            log.append((self.base + lane, point, t, self.columns[lane].tobytes()))
            return not (alone and self._together(point))

        return change

    def _together(self, point: int) -> bool:
        """Whether another point of a single motion is near the surface, on the other side or on its
        way there, so that it has to be looked at before the motion goes on."""
        state, on = self.columns[0], self.on
        at = pose(math, self.c.place((0.0, float(state[1]), float(state[2]))))
        return any(
            i != point and (-gap if on[i][0] else gap) < self.clear
            for i, gap in enumerate(self.law.gaps(self.c, at))
        )

    def start(self, pars: np.ndarray, state: np.ndarray, t: np.ndarray) -> None:
        """Set parameters (k, lanes), states (6, lanes) and times (lanes,)."""
        self.pars[:], self.state[:] = pars, state
        if self.lanes:
            self.ta.set_time(t)
        else:
            self.ta.time = t[0]
            self.c = Coefficients(*map(float, pars[: len(NAMES), 0]))

    def recorded(self, how: dict[str, Any]) -> tuple[list[Any], list[Any]]:
        """Coefficients and ends of steps, the begin first, which a run with `how` will fill."""
        tc, time, tcs, times = self.ta.tc, self.time, list[Any](), [np.array(self.ta.time)]

        def record(ta: Any) -> bool:
            tcs.append(tc.copy())
            times.append(ta.time if time is None else time.copy())
            return True

        how |= {"write_tc": True, "callback": record}
        return tcs, times


@lru_cache
def _machine(_thread: int, *how: Any) -> Machine:
    return Machine(*how)


def _smooth(tcs: list[Any], times: list[Any], base: int) -> tuple[np.ndarray, ...]:
    """`Course.smooth` of the motions from number `base` on, from what heyoka computes in a step."""
    t, rows = np.array(times).reshape(len(times), -1), np.array(tcs)
    h = np.diff(t, axis=0)
    taken = h > 0.0  # motions at their end wait for others
    taken[0] |= ~taken.any(axis=0)  # a change of contact may take no time
    lane, step = np.nonzero(taken.T)
    h = h[step, lane]
    series = np.ascontiguousarray(rows.reshape(*rows.shape[:3], -1)[step, :, :, lane].T)
    # heyoka's are in powers of time
    series[1:] *= np.cumprod(np.broadcast_to(h, (len(series) - 1, len(h))), axis=0)[:, None]
    return base + lane, t[step, lane], h, series


def limit_of(outcome: Any, points: int) -> int:
    """The entry of `LIMITS` at which heyoka stopped, -1 where it did not, -2 where it failed."""
    code = int(outcome)  # not negative where a callback let the motion go on
    limit = -code - 1 - points
    if 0 <= limit < len(LIMITS):
        return limit
    return -1 if code >= -points or outcome in _ONWARD else -2


class TaylorIntegrator:
    """Integrator over one scaled pad, or over many whose numbers are arrays (n,).

    `fp_type` may be numpy.longdouble or heyoka.real128; the coefficients then stay the doubles of
    the pad, so that the difference to a double run is that of the integration alone. With `lanes`
    so many motions run side by side.
    """

    method = "heyoka Taylor"

    def __init__(
        self,
        model: PadModel,
        tolerance: float,
        fp_type: Any = float,
        options: Options = DEFAULT,
        lanes: int = 0,
    ) -> None:
        least = float(np.finfo(float).eps) if fp_type is float else 0.0
        self.tolerance = max(tolerance, least)
        self._model, self._fp, self._options, self._lanes = model, fp_type, options, lanes

    def run(self, contact: np.ndarray, t: Any, state: np.ndarray, stop: Any, dense: bool) -> Course:
        """See `squeal.simulation.hybrid.Integrator`.

        With lanes it carries motions, a multiple of the lanes, from contact (points, n), times (n,)
        and states (6, n) to their ends, and resolves no changes of several points in one instant.
        """
        model, law, options, lanes = self._model, self._model.law, self._options, self._lanes
        regrouped = self._fp is float and self.tolerance > options.regrouped_above
        how: Any = (model.terms, self.tolerance, self._fp, lanes, regrouped)
        own = _machine(get_ident(), law, *how)  # each thread has its own
        t0, t1 = (np.reshape(v, -1).astype(own.state.dtype) for v in (t, stop))
        n, first = len(t1), np.reshape(contact, (law.points, -1))
        c = Coefficients(*(np.broadcast_to(np.asarray(v, dtype=float), n) for v in model.c))
        numbers = np.concatenate([c, first, model.term_values.reshape(-1, n)])
        count, limit, end = np.zeros(n, dtype=int), np.full(n, -1), np.array(state).reshape(6, n)
        smooth = list[tuple[np.ndarray, ...]]()
        how = {"max_steps": options.most_steps if lanes else options.steps_at_once}
        own.clear = options.clear * (1.0 + c.w[0] + c.h[0])
        own.log.clear()
        for own.base in range(0, n, max(lanes, 1)):
            each = slice(own.base, own.base + max(lanes, 1))
            starts, until = (numbers[:, each], end[:, each].copy()), t1[each].copy()
            own.start(*starts, t0[each])
            tcs, times = own.recorded(how) if dense else ([], [])
            while True:
                own.ta.reset_cooldowns()
                result = own.ta.propagate_until(until if lanes else until[0], **how)
                results = own.ta.propagate_res if lanes else [result]
                count[each] += [one[3] for one in results]
                t1[each], codes = own.ta.time, [limit_of(one[0], law.points) for one in results]
                end[:, each] = np.where(limit[each] < 0, own.state, end[:, each])
                stopped = (t1[each] < until) & (np.array(codes) != -1)
                limit[each] = np.where(stopped, codes, limit[each])
                if not lanes or not stopped.any():
                    break
                # where one motion ends at a limit, it waits at its start while the others go on
                until[stopped] = t1[each][stopped]
                for now, start in zip((own.pars, own.state), starts, strict=True):
                    now[:, stopped] = start[:, stopped]
            if lanes:
                limit[each] = np.where(t1[each] < until, -2, limit[each])
            elif limit[0] < -1:
                raise ComputationError(
                    f"the motion is not finite after t = {float(t):.9g} natural time units"
                )
            if dense:
                smooth.append(_smooth(tcs, times, own.base))
        lane, point, when, states = zip(*own.log, strict=True) if own.log else ((), (), (), ())
        order = np.argsort(lane, kind="stable")
        state = np.frombuffer(b"".join(states), end.dtype).reshape(len(lane), 6)[order].T
        changes = (np.array(lane, int)[order], np.array(point, int)[order], np.array(when)[order])
        parts = tuple(np.concatenate(part, axis=-1) for part in zip(*smooth, strict=True))
        return Course(law, c, t0, t1, first, end, *changes, state, count, limit, parts)
