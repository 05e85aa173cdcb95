"""Taylor integration with heyoka, of one motion or of many side by side.

The equations of `squeal.model.equations` become heyoka's expressions. A pad's numbers and contact
are runtime parameters, so that the code that heyoka compiles, and keeps on disk, serves all. A
callback flips the contact where a gap passes zero, so that heyoka's own loop runs on.
"""

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from threading import get_ident
from typing import Any

import heyoka as hy
import numpy as np

from squeal.errors import ComputationError
from squeal.model.contact import ContactLaw, State, Touching
from squeal.model.equations import PadModel, net_loads, term_count
from squeal.model.pad import Coefficients, Number, at_speed, facing, pose, spring_vectors
from squeal.simulation.hybrid import COLLAPSED, DEFAULT, LIMITS, Course, Options, Steps

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
Together = Callable[[int], bool]
"""Whether a point changes so that another one has to be looked at before the motion goes on."""


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

    `lanes` motions side by side, or with 0 a single one in numbers of `fp_type`. A machine comes as
    its last user left it, and each use sets all of its parameters and state.
    """

    def __init__(
        self,
        law: ContactLaw,
        terms: tuple[str, ...],
        tolerance: float,
        lanes: int,
        fp_type: Any,
        regrouped: bool,
    ) -> None:
        on = state_parameters(law)
        system, heights, limits = equations(law, on, terms)
        first, self.points = len(NAMES), law.points
        self.log: list[tuple[Any, ...]] = []  # lane, point, time, state of the changes
        self.together: Together | None = None
        upwards, downwards = hy.event_direction.positive, hy.event_direction.negative
        how: Any = {"fp_type": fp_type}
        none = fp_type(0.0)
        # No cooldown: once the state has changed, the same gap passes zero in the other sense.
        event = hy.t_event_batch if lanes else hy.t_event
        events = [
            event(e, direction=upwards, callback=self._on_change(i, lanes), cooldown=none, **how)
            for i, e in enumerate(rising(heights, on))
        ] + [event(limit, direction=downwards, **how) for limit in limits]
        how |= {"tol": fp_type(tolerance), "t_events": events, "fast_math": regrouped}
        how["compact_mode"] = law.points > UNROLLED or fp_type is not float
        if fp_type is not float:  # the time goes into the numbers, which no processor has
            how["opt_level"] = 0
        make, shape = (hy.taylor_adaptive_batch, (lanes,)) if lanes else (hy.taylor_adaptive, ())
        pars = np.full((first + law.points + term_count(terms), *shape), fp_type(1.0))
        self.ta = make(system, np.full((6, *shape), none), pars=pars, **how)
        self.pars, self.state = self.ta.pars, self.ta.state
        self.time: Any = self.ta.time if lanes else None
        self.on = self.pars[first : first + law.points]
        self.columns = [self.state[:, lane] for lane in range(lanes)]

    # heyoka copies callbacks deeply, which leaves functions and what they refer to shared
    def _on_change(self, point: int, lanes: int) -> Any:
        log = self.log

        def alone(ta: Any, _sign: int) -> bool:
            self.on[point] = 1.0 - self.on[point]
            log.append((0, point, ta.time, self.state.tobytes()))
            return self.together is None or not self.together(point)

        def side_by_side(_ta: Any, _sign: int, lane: int) -> bool:
            touches = self.on[point]
            touches[lane] = 1.0 - touches.item(lane)
            log.append((lane, point, self.time.item(lane), self.columns[lane].tobytes()))
            return True

        return side_by_side if lanes else alone

    def run(self, stop: Any, most: int, motion: np.ndarray | None) -> tuple[Any, Steps | None]:
        """Propagate to `stop`, for at most so many steps.

        motion (lanes,): what runs in each lane, -1 where nothing does, if its steps are wanted.
        Returns what heyoka says of the end, and these steps in order of time.
        """
        self.log.clear()
        self.ta.reset_cooldowns()
        if motion is None:
            return self.ta.propagate_until(stop, max_steps=most), None
        ta, on, tc, count = self.ta, self.on, self.ta.tc, 0
        series = np.empty((most, *tc.shape), tc.dtype)
        t = np.empty((most + 1, len(motion)), tc.dtype)
        contact = np.empty((most + 1, *on.shape))
        t[0], contact[0] = ta.time, on

        def record(_ta: Any) -> bool:
            nonlocal count
            series[count] = tc
            count += 1
            t[count], contact[count] = ta.time, on
            return True

        outcome = ta.propagate_until(stop, max_steps=most, write_tc=True, callback=record)
        h = np.diff(t[: count + 1], axis=0)
        taken = h > 0.0  # motions at their end wait for others
        taken[0] |= ~taken.any(axis=0)  # a change of contact may take no time
        step, lane = np.nonzero(taken & (motion >= 0))
        rows = series[:count].reshape(count, *tc.shape[:2], -1).transpose(2, 1, 0, 3)
        rows = rows.reshape(*rows.shape[:2], -1).take(step * len(motion) + lane, axis=2)
        h = h[step, lane]
        power = np.ones_like(h)
        for coefficient in rows[1:]:  # heyoka's are in powers of time
            power *= h
            coefficient *= power
        contact = contact[:count].reshape(count, self.points, -1)[step, :, lane].T
        return outcome, Steps(motion[lane], t[step, lane], h, rows, contact)

    def changes(self) -> dict[str, np.ndarray]:
        """Lane, point, time and state (6, e) of the contact changes of the last run."""
        lane, point, t, states = zip(*self.log, strict=True) if self.log else ((), (), (), ())
        return {
            "lane": np.array(lane, dtype=int),
            "point": np.array(point, dtype=int),
            "t": np.array(t),
            "state": np.frombuffer(b"".join(states), self.state.dtype).reshape(-1, 6).T,
        }


@lru_cache(maxsize=64)
def _machine(_thread: int, *how: Any) -> Machine:
    return Machine(*how)


def machine(
    model: PadModel, tolerance: float, lanes: int, fp_type: Any, options: Options
) -> Machine:
    """The integrator of a model's law and terms at a tolerance; each thread has its own."""
    regrouped = fp_type is float and tolerance > options.regrouped_above
    return _machine(get_ident(), model.law, model.terms, tolerance, lanes, fp_type, regrouped)


def limit_of(outcome: Any, points: int) -> int:
    """The entry of `LIMITS` at which heyoka stopped, -1 where it did not, -2 where it failed."""
    code = int(outcome)  # not negative where a callback let the motion go on
    event = -code - 1 - points
    if code >= 0 or -points <= event < 0 or outcome in _ONWARD:
        return -1
    return event if 0 <= event < len(LIMITS) else -2


class TaylorIntegrator:
    """Integrator over one scaled pad; `fp_type` may be numpy.longdouble or heyoka.real128.

    In the longer types the coefficients stay the doubles of the pad, so that the difference to a
    double run is that of the integration alone.
    """

    method = "heyoka Taylor"

    def __init__(
        self,
        model: PadModel,
        tolerance: float,
        fp_type: Any = float,
        options: Options = DEFAULT,
    ) -> None:
        least = float(np.finfo(float).eps) if fp_type is float else 0.0
        self.tolerance = max(tolerance, least)
        self._model, self._fp, self._options = model, fp_type, options
        numbers = (*model.c, *(0.0,) * model.law.points, *model.term_values.tolist())
        self._pars = np.array([fp_type(float(value)) for value in numbers])

    def _together(self, own: Machine) -> Together:
        """Whether another point is near the surface, on the other side or on its way there."""
        c, law, state, on = self._model.c, self._model.law, own.state, own.on
        limit = self._options.clear * (1.0 + c.w + c.h)

        def near(point: int) -> bool:
            at = pose(math, c.place((0.0, float(state[1]), float(state[2]))))
            return any(
                other != point and (-gap if on[other] else gap) < limit
                for other, gap in enumerate(law.gaps(c, at))
            )

        return near

    def run(self, contact: State, t: float, state: np.ndarray, stop: float, dense: bool) -> Course:
        """See `squeal.simulation.hybrid.Integrator`."""
        model, options = self._model, self._options
        own = machine(model, self.tolerance, 0, self._fp, options)
        own.pars[:] = self._pars
        own.on[:] = contact
        own.state[:] = state
        own.ta.time = begin = self._fp(t)
        own.together = self._together(own)
        single = np.zeros(1, dtype=int) if dense else None
        (outcome, _, _, steps, *_), smooth = own.run(self._fp(stop), options.steps_at_once, single)
        limit = limit_of(outcome, own.points)
        if limit < -1:
            raise ComputationError(
                f"the motion is not finite after t = {float(t):.9g} natural time units"
            )
        return Course(
            law=model.law,
            c=model.c,
            t0=np.array([begin]),
            t1=np.array([own.ta.time]),
            first=np.array(contact, dtype=int)[:, None],
            end=own.state[:, None].copy(),
            steps=np.array([steps]),
            limit=np.array([limit]),
            smooth=smooth,
            **own.changes(),
        )


def run_together(
    model: PadModel,
    on: np.ndarray,
    state: np.ndarray,
    stop: np.ndarray,
    tolerance: float,
    dense: bool,
    options: Options = DEFAULT,
) -> Course:
    """The motions of n scaled pads, each to its own time; the next begins where one is done.

    model: of pads whose numbers are arrays (n,); on (points, n) of 0 or 1; state (6, n); stop (n,).
    The entry of `limit` is -2 for a motion that could not be carried to the end. Changes of several
    points in one instant are not resolved, see `unsure`.
    """
    law, n, lanes = model.law, len(stop), options.lanes
    own = machine(model, max(tolerance, float(np.finfo(float).eps)), lanes, float, options)
    c = Coefficients(*(np.broadcast_to(v, n) for v in model.c))
    numbers = np.concatenate([c, on, model.term_values.reshape(-1, n)])
    t1, end, steps, limit = np.zeros(n), state.copy(), np.zeros(n, dtype=int), np.full(n, -1)
    motion, time, until, begun = np.full(lanes, -1), np.zeros(lanes), np.zeros(lanes), 0
    logs: list[dict[str, np.ndarray]] = []
    parts: list[Steps] = []
    while True:
        free = np.flatnonzero(time >= until)
        ended = free[motion[free] >= 0]
        t1[motion[ended]], end[:, motion[ended]] = time[ended], own.state[:, ended]
        # idle lanes stand at the start of the first motion, where nothing happens
        motion[free], time[free], until[free] = -1, 0.0, 0.0
        new = np.arange(begun, min(n, begun + len(free)))
        begun += len(new)
        motion[free[: len(new)]], until[free[: len(new)]] = new, stop[new]
        each = motion[free].clip(0)
        own.pars[:, free], own.state[:, free] = numbers[:, each], state[:, each]
        if (motion < 0).all():
            break
        own.ta.set_time(time)
        most = max(options.refilled_after, int(steps[:begun].mean()) // 4)
        _, part = own.run(until, most, motion if dense else None)
        parts += [] if part is None else [part]
        logs.append(own.changes())
        logs[-1]["lane"] = motion[logs[-1]["lane"]]
        time = own.time.copy()
        for lane in np.flatnonzero(motion >= 0).tolist():
            outcome, _, _, taken = own.ta.propagate_res[lane]
            i = motion[lane]
            steps[i] += taken
            limit[i] = limit_of(outcome, law.points) if time[lane] < until[lane] else -1
            if limit[i] != -1 or steps[i] >= options.most_steps:
                until[lane] = time[lane]
                limit[i] = -2 if limit[i] == -1 else limit[i]
    changes = {name: np.concatenate([log[name] for log in logs], axis=-1) for name in logs[0]}
    order = np.argsort(changes["lane"], kind="stable")
    order = order[np.searchsorted(changes["lane"][order], 0) :]  # without those of idle lanes
    return Course(
        law=law,
        c=c,
        t0=np.zeros(n),
        t1=t1,
        first=on,
        end=end,
        steps=steps,
        limit=limit,
        smooth=Steps.joined(parts) if dense else None,
        **{name: values[..., order] for name, values in changes.items()},
    )


def unsure(course: Course, options: Options = DEFAULT) -> np.ndarray:
    """True (n,) for motions side by side that had better be run alone.

    They could not be carried to the end, a gap has the wrong sign there, or several points may have
    changed in one instant.
    """
    law, c = course.law, course.c
    heights = np.array(law.gaps(c, pose(np, c.place(course.end))))
    wrong = np.where(course.last > 0, heights, -heights) > options.missed
    doubt = (course.limit == -2) | (wrong.any(axis=0) & (course.limit == -1))
    at = course.coefficients(course.lane)
    heights = np.array(law.gaps(at, pose(np, at.place(course.state))))
    near = np.where(course.on > 0, -heights, heights) < options.clear * (1.0 + at.w + at.h)
    near[course.point, np.arange(len(course.t))] = False
    doubt[course.lane[near.any(axis=0)]] = True
    return doubt
