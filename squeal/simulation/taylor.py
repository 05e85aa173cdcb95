"""Taylor integration with heyoka, of one motion or of several side by side.

One set of equations serves all pads and contact states, which are runtime parameters. A callback
flips the contact where a gap passes zero, so that heyoka's own loop runs on.
"""

import math
from collections.abc import Callable
from functools import lru_cache
from threading import local
from typing import Any

import heyoka as hy
import numpy as np

from squeal.errors import ComputationError
from squeal.model.equations import PadModel, term_count
from squeal.model.law import ContactLaw
from squeal.model.mechanics import Coefficients, pose
from squeal.model.states import State
from squeal.simulation import symbols
from squeal.simulation.hybrid import DEFAULT, LIMITS, Course, Options, Steps

_ONWARD = (hy.taylor_outcome.success, hy.taylor_outcome.time_limit, hy.taylor_outcome.step_limit)
Together = Callable[[int], bool]
"""Whether a point changes so that another one has to be looked at before the motion goes on."""


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
        on = symbols.state_parameters(law)
        system, heights, limits = symbols.equations(law, on, terms)
        self.first, self.points = len(symbols.NAMES), law.points
        self.log: list[tuple[Any, ...]] = []  # lane (of several), point, time, state of the changes
        self.together: Together | None = None
        count = self.first + law.points + term_count(terms)
        upwards, downwards = hy.event_direction.positive, hy.event_direction.negative
        how: Any = {"fp_type": fp_type}
        none = fp_type(0.0)
        # No cooldown: once the state has changed, the same gap passes zero in the other sense.
        event = hy.t_event_batch if lanes else hy.t_event
        events = [
            event(e, direction=upwards, callback=self._on_change(i, lanes), cooldown=none, **how)
            for i, e in enumerate(symbols.rising(heights, on))
        ] + [event(limit, direction=downwards, **how) for limit in limits]
        how |= {"tol": fp_type(tolerance), "t_events": events, "fast_math": regrouped}
        how["compact_mode"] = law.points > symbols.UNROLLED or fp_type is not float
        if fp_type is not float:  # the time goes into the numbers, which no processor has
            how["opt_level"] = 0
        make = hy.taylor_adaptive_batch if lanes else hy.taylor_adaptive
        shape = (lanes,) if lanes else ()
        zero = np.full((6, *shape), none)
        self.ta = make(system, zero, pars=np.full((count, *shape), fp_type(1.0)), **how)
        self.pars, self.state = self.ta.pars, self.ta.state
        self.time: Any = self.ta.time if lanes else None
        self.on = self.pars[self.first : self.first + law.points]

    # heyoka copies callbacks deeply, which leaves functions and what they refer to shared
    def _on_change(self, point: int, lanes: int) -> Any:
        log = self.log

        def alone(ta: Any, _sign: int) -> bool:
            self.on[point] = 1.0 - self.on[point]
            log.append((point, ta.time, self.state.copy()))
            return self.together is None or not self.together(point)

        def side_by_side(_ta: Any, _sign: int, lane: int) -> bool:
            touches = self.on[point]
            touches[lane] = 1.0 - touches[lane]
            log.append((lane, point, self.time[lane], self.state[:, lane].copy()))
            return True

        return side_by_side if lanes else alone

    def run(self, stop: Any, most: int, dense: bool) -> tuple[Any, list[tuple[np.ndarray, ...]]]:
        """Propagate to `stop`, for at most so many steps.

        Returns what heyoka says of the end, and of each step, if `dense`, the contact, the
        coefficients and the time at its end.
        """
        self.log.clear()
        self.ta.reset_cooldowns()
        kept: list[tuple[np.ndarray, ...]] = []
        if not dense:
            return self.ta.propagate_until(stop, max_steps=most), kept
        on, now, series, time = self.on.copy(), self.on, self.ta.tc, self.time

        def keep(ta: Any) -> bool:
            nonlocal on
            kept.append((on, series.copy(), np.array(ta.time) if time is None else time.copy()))
            on = now.copy()
            return True

        return self.ta.propagate_until(stop, max_steps=most, write_tc=True, callback=keep), kept


class _Machines(local):
    """Compiled integrators of a thread: threads cannot disturb each other."""

    def __init__(self) -> None:
        self.of = lru_cache(maxsize=64)(Machine)


_MACHINES = _Machines()


def machine(
    law: ContactLaw,
    terms: tuple[str, ...],
    tolerance: float,
    lanes: int = 0,
    fp_type: Any = float,
    options: Options = DEFAULT,
) -> Machine:
    """The integrator of a contact law with some terms (`PadModel.terms`) at a tolerance."""
    regrouped = fp_type is float and tolerance > options.regrouped_above
    return _MACHINES.of(law, terms, tolerance, lanes, fp_type, regrouped)


def smooth(kept: list[tuple[np.ndarray, ...]], begin: Any, lanes: int, count: int) -> Steps:
    """The steps of the first `count` of several motions from what `Machine.run` keeps of them.

    They began at a time `begin`.
    """
    on, series, t = (np.array(parts) for parts in zip(*kept, strict=True))
    t = np.concatenate([np.full((1, lanes), begin), t.reshape(-1, lanes)])
    h = np.diff(t, axis=0)
    taken = h > 0.0  # motions that are done wait for others
    taken[0] |= ~taken.any(axis=0)  # a change of contact may take no time
    lane, k = np.nonzero(taken.T[:count])
    step = h[k, lane]
    parts = np.moveaxis(series.reshape(len(kept), 6, -1, lanes), 0, 2).swapaxes(0, 1)
    parts = parts.reshape(len(parts), 6, -1).take(lanes * k + lane, axis=2)
    powers = np.multiply.accumulate(np.broadcast_to(step, (len(parts), 1, len(step))), axis=0)
    parts[1:] *= powers[:-1]
    return Steps(lane, t[k, lane], step, parts, on.reshape(len(kept), -1, lanes)[k, :, lane].T)


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
        self.tolerance = (
            max(tolerance, float(np.finfo(float).eps)) if fp_type is float else tolerance
        )
        self._model, self._law, self._c, self._fp = model, model.law, model.c, fp_type
        self._options = options
        numbers = (*model.c, *(0.0,) * model.law.points, *model.term_values.tolist())
        self._pars = np.array([fp_type(float(value)) for value in numbers])
        self._near = options.clear * (1.0 + model.c.w + model.c.h)

    def _together(self, machine: Machine) -> Together:
        """Whether another point is near the surface, on the other side or on its way there."""
        c, law, state, on = self._c, self._law, machine.state, machine.on

        def near(point: int) -> bool:
            at = pose(math, c.place((0.0, float(state[1]), float(state[2]))))
            return any(
                other != point and (-gap if on[other] else gap) < self._near
                for other, gap in enumerate(law.gaps(c, at))
            )

        return near

    def run(self, contact: State, t: float, state: np.ndarray, stop: float, dense: bool) -> Course:
        """See `squeal.simulation.hybrid.Integrator`."""
        own = machine(self._law, self._model.terms, self.tolerance, 0, self._fp, self._options)
        own.pars[:] = self._pars
        own.on[:] = contact
        own.state[:] = state
        own.ta.time = begin = self._fp(t)
        own.together = self._together(own)
        (outcome, _, _, steps, *_), kept = own.run(
            self._fp(stop), self._options.steps_at_once, dense
        )
        limit = limit_of(outcome, self._law.points)
        if limit < -1:
            raise ComputationError(
                f"the motion is not finite after t = {float(t):.9g} natural time units"
            )
        points, times, states = zip(*own.log, strict=True) if own.log else ((), (), ())
        return Course(
            law=self._law,
            c=self._c,
            terms=self._model.term_values[:, None],
            t0=np.array([begin]),
            t1=np.array([own.ta.time]),
            first=np.array(contact, dtype=int)[:, None],
            end=own.state[:, None].copy(),
            lane=np.zeros(len(points), dtype=int),
            point=np.array(points, dtype=int),
            t=np.array(times),
            state=np.array(states).reshape(-1, 6).T,
            steps=np.array([steps]),
            limit=np.array([limit]),
            smooth=smooth(kept, begin, 1, 1) if kept else None,
        )


def run_together(
    law: ContactLaw,
    terms: tuple[str, ...],
    tolerance: float,
    coefficients: np.ndarray,
    numbers: np.ndarray,
    on: np.ndarray,
    state: np.ndarray,
    stop: np.ndarray,
    dense: bool,
    options: Options = DEFAULT,
) -> Course:
    """The motions of n <= `options.lanes` scaled pads side by side, each to its own time.

    coefficients (names, n); numbers (m, n): of the terms with velocities; on (points, n) of 0 or 1;
    state (6, n); stop (n,). The entry of `limit` is -2 for a motion that could not be carried to
    the end. Changes of several points in one instant are not told apart, see `unsure`.
    """
    lanes, n = options.lanes, len(stop)
    own = machine(law, terms, tolerance, lanes, options=options)
    each = np.minimum(np.arange(lanes), n - 1)
    own.pars[:] = np.concatenate([coefficients, on, numbers])[:, each]
    own.state[:] = state[:, each]
    own.ta.set_time(0.0)
    now: Any = own.time
    until = np.where(np.arange(lanes) < n, stop[each], 0.0)
    limit, steps = np.full(lanes, -1), np.zeros(lanes, dtype=int)
    log: list[tuple[Any, ...]] = []
    kept: list[tuple[np.ndarray, ...]] = []
    while (now < until).any():
        _, more = own.run(until, options.most_steps, dense)
        log += own.log
        kept += more
        ended = []
        for lane, (outcome, _, _, taken) in enumerate(own.ta.propagate_res):
            steps[lane] += taken
            met = limit_of(outcome, law.points)
            if met != -1 and now[lane] < until[lane]:
                limit[lane], until[lane] = met, now[lane]
                ended.append(lane)
        if not ended:  # too many steps
            limit[now < until] = -2
            break
        lost = [lane for lane in ended if limit[lane] == -2]
        own.state[:, lost] = state[:, each[lost]]
    log.sort(key=lambda change: change[0])
    changes: Any = list(zip(*log, strict=True)) if log else [()] * 4
    begin = np.zeros(n)
    return Course(
        law=law,
        c=Coefficients(*coefficients),
        terms=numbers,
        t0=begin,
        t1=until[:n],
        first=on,
        end=own.state[:, :n].copy(),
        lane=np.array(changes[0], dtype=int),
        point=np.array(changes[1], dtype=int),
        t=np.array(changes[2]),
        state=np.array(changes[3]).reshape(-1, 6).T,
        steps=steps[:n],
        limit=limit[:n],
        smooth=smooth(kept, 0.0, lanes, n) if dense else None,
    )


def unsure(course: Course, options: Options = DEFAULT) -> np.ndarray:
    """True (n,) for motions side by side that had better be run alone.

    They could not be carried to the end, a gap has the wrong sign there, or several points may have
    changed in one instant.
    """
    law, c = course.law, course.c
    heights = np.array(law.gaps(c, pose(np, c.place(course.end))))
    wrong = np.where(course.last > 0, heights, -heights) > options.missed
    found = (course.limit == -2) | (wrong.any(axis=0) & (course.limit == -1))
    at = course.coefficients(course.lane)
    heights = np.array(law.gaps(at, pose(np, at.place(course.state))))
    near = np.where(course.on > 0, -heights, heights) < options.clear * (1.0 + at.w + at.h)
    near[course.point, np.arange(len(course.t))] = False
    found[course.lane[near.any(axis=0)]] = True
    return found
