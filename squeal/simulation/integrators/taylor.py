"""Taylor integration with heyoka: the equations of `model.equations` compiled once per machine.

One integrator per contact state holds just the terms of that state and watches all gaps, each in
the direction that ends the state. The numbers of the pad are runtime parameters, so the compiled
code, which heyoka keeps on disk, serves every pad.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any

import heyoka as hy
import numpy as np

from squeal.errors import ComputationError
from squeal.model.equations import PadModel, net_loads, term_count
from squeal.model.law import ContactLaw, Touching
from squeal.model.mechanics import Coefficients, at_speed, facing, pose, spring_vectors
from squeal.model.states import State
from squeal.simulation.integrators.pool import Pool
from squeal.simulation.legs import COLLAPSED, LIMITS, Leg

# its warnings would go to standard output; a lost root shows in the check at the end of a leg
hy.set_logger_level_critical()

LONGEST_LEG = 5000  # steps; bounds the memory of dense output
# A gap that is exactly zero at the start of a step hides the next root of the same step from
# heyoka 7.13: its bracketing search then stops at the left end. This offset, far below the
# rounding of any gap, puts the start on the side of the contact state.
NEVER_ZERO = 1e-300
# heyoka's tolerance is relative to the largest of state and event functions: a limit of order one
# would loosen the error control of a small motion.
FAINT = 1e-30
# Up to so many contact points each state has compiled code of its own, which is fastest; with more
# points one code serves all states.
OWN_CODE = 2
_NAMES = [f.name for f in fields(Coefficients)]


def coefficient_names() -> list[str]:
    """Names of the runtime parameters of `equations`, in their order."""
    return _NAMES


def equations(
    law: ContactLaw, on: Touching, terms: tuple[str, ...] = ()
) -> tuple[list[tuple[Any, Any]], list[Any], list[Any]]:
    """Symbolic equations of motion, the gaps of the contact points and the model's limits.

    `on` is the contact state, as constants or as symbols; `terms` are those with velocities, see
    `PadModel.terms`, whose numbers are the last runtime parameters, see
    `PadModel.term_values`.

    The limits are positive as long as the model holds, in the order of `LIMITS`.

    The state is (x, y, w theta) and rates; coefficients are runtime parameters in the order of
    `Coefficients`.
    """
    c = Coefficients(**{name: hy.par[i] for i, name in enumerate(_NAMES)})
    x, y, s, u, v, r = hy.make_vars("x", "y", "s", "u", "v", "r")
    q = c.place((x, y, s))
    first, v3 = len(_NAMES) + law.points, (u, v, r)
    if "falling" in terms:
        c = at_speed(hy, c, (hy.par[first + 9], hy.par[first + 10]), u)
    total = net_loads(hy, c, law, q, on)
    system = [
        (x, u),
        (y, v),
        (s, r),
        (u, total.x / c.m),
        (v, total.y / c.m),
        (r, c.w * total.moment / c.I),
    ]
    if "damping" in terms:
        for i in range(3):
            drag = sum(hy.par[first + 3 * i + j] * v3[j] for j in range(3))
            system[3 + i] = (system[3 + i][0], system[3 + i][1] - drag)
    at = pose(hy, q)
    limits = [facing(c, at)] + [
        hy.sqrt(vx * vx + vy * vy) / L - COLLAPSED
        for (vx, vy), L in zip(spring_vectors(c, at), (c.L1, c.L2), strict=True)
    ]
    if "falling" in terms:
        limits.append(hy.par[first + 11] - u)
    return system, list(law.gaps(c, at)), [FAINT * limit for limit in limits]


def state_parameters(law: ContactLaw) -> tuple[Any, ...]:
    """Runtime parameters, after those of the coefficients, that say which points touch."""
    return tuple(hy.par[len(_NAMES) + i] for i in range(law.points))


def rising(heights: list[Any], on: Touching) -> list[Any]:
    """Expressions that pass zero upwards where a contact point separates or touches."""
    pairs = zip(heights, on, strict=True)
    return [(2.0 * touches - 1.0) * gap - NEVER_ZERO for gap, touches in pairs]


@lru_cache(maxsize=64)
def compiled(
    law: ContactLaw,
    contact: State | None,
    tolerance: float,
    fp_type: Any,
    terms: tuple[str, ...] = (),
    **options: Any,
) -> Any:
    """The integrator of one contact state, or of any (None) that its parameters then tell.

    The compiled code is shared through heyoka's caches. `options` go to heyoka, which
    compiles in another way then.
    """
    on = state_parameters(law) if contact is None else contact
    system, heights, limits = equations(law, on, terms)
    upwards, downwards = hy.event_direction.positive, hy.event_direction.negative
    events = [_event(fp_type)(e, direction=upwards) for e in rising(heights, on)]
    events += [_event(fp_type)(limit, direction=downwards) for limit in limits]
    expressions = [rhs for _, rhs in system] + heights + limits
    used = hy.get_params(expressions)
    highest = max(
        i for i in range(len(_NAMES) + law.points + term_count(terms)) if hy.par[i] in used
    )
    return hy.taylor_adaptive(
        system,
        [fp_type(0.0)] * 6,
        pars=[fp_type(1.0)] * (highest + 1),
        tol=fp_type(tolerance),
        t_events=events,
        fp_type=fp_type,
        **({"compact_mode": contact is None} | options),
    )


@lru_cache(maxsize=64)
def _pool(
    law: ContactLaw,
    contact: State | None,
    tolerance: float,
    fp_type: Any,
    terms: tuple[str, ...],
) -> Pool[Any]:
    """Integrators of one kind, copies of the compiled one, which itself never runs."""
    return Pool(lambda: copy.copy(compiled(law, contact, tolerance, fp_type, terms)))


def _event(fp_type: Any) -> Any:
    return hy.t_event if fp_type is float else lambda *a, **k: hy.t_event(*a, fp_type=fp_type, **k)


_ONWARD = (
    hy.taylor_outcome.success,
    hy.taylor_outcome.time_limit,
    hy.taylor_outcome.step_limit,
)


@dataclass(frozen=True)
class Series:
    """Dense output: the Taylor polynomials of consecutive steps.

    nodes (n + 1,): step times; coefficients (n, 6, order + 1). Kept by hand, since heyoka compiles
    code anew for each continuous output, which costs more than a whole leg.
    """

    nodes: np.ndarray
    coefficients: np.ndarray

    def __call__(self, t: np.ndarray) -> np.ndarray:
        """The state at times t, shape (len(t), 6)."""
        last = len(self.coefficients) - 1
        step = np.clip(np.searchsorted(self.nodes, t, side="right") - 1, 0, last)
        lapse = (t - self.nodes[step])[:, None]
        c = self.coefficients[step]
        value = c[:, :, -1]
        for k in range(c.shape[2] - 2, -1, -1):
            value = value * lapse + c[:, :, k]
        return value


def _recorded(ta: Any, stop: float) -> tuple[Any, Series]:
    """Step on to a contact change, to `stop` or for a bounded number of steps, keeping the series.

    Returns heyoka's outcome and the series.
    """
    nodes, pieces = [ta.time], []
    while True:
        outcome, _ = ta.step(max_delta_t=stop - ta.time, write_tc=True)
        pieces.append(ta.tc.copy())
        nodes.append(ta.time)
        if outcome != hy.taylor_outcome.success or ta.time >= stop or len(pieces) >= LONGEST_LEG:
            return outcome, Series(np.array(nodes), np.array(pieces))


class TaylorIntegrator:
    """Integrator over one scaled pad; `fp_type` may be numpy.longdouble or heyoka.real128.

    In the longer types the coefficients stay the doubles of the pad, so that the difference to a
    double run is that of the integration alone.
    """

    method = "heyoka Taylor"

    def __init__(self, model: PadModel, tolerance: float, fp_type: Any = float) -> None:
        self._law = model.law
        self._fp = fp_type
        eps = float(np.finfo(float).eps) if fp_type is float else 0.0
        self.tolerance = max(tolerance, eps)
        self._terms = model.terms
        self._pars = np.array([fp_type(float(getattr(model.c, name))) for name in _NAMES])
        self._last = np.array([fp_type(value) for value in model.term_values.tolist()])

    def advance(self, contact: State, t: float, state: np.ndarray, stop: float, dense: bool) -> Leg:
        """See `Integrator.advance`. Raises ComputationError if the motion leaves all bounds."""
        own = contact if len(contact) <= OWN_CODE else None
        with _pool(self._law, own, self.tolerance, self._fp, self._terms).lease() as ta:
            pars = self._pars
            if own is None or self._terms:
                touching = [self._fp(on) for on in contact]
                pars = np.concatenate([pars, touching, self._last])
            ta.pars[:] = pars[: len(ta.pars)]
            ta.time = self._fp(t)
            ta.state[:] = state
            ta.reset_cooldowns()
            if dense:
                outcome, motion = _recorded(ta, stop)
                steps = len(motion.nodes) - 1
            else:
                motion = None
                outcome, _, _, steps, *_ = ta.propagate_until(self._fp(stop), max_steps=LONGEST_LEG)
            t1, end = ta.time, ta.state.copy()
        point, limit, event = None, None, -int(outcome) - 1
        points = self._law.points
        if 0 <= event < points:
            point = event
        elif points <= event < points + len(LIMITS):
            limit = LIMITS[event - points]
        elif outcome not in _ONWARD:
            raise ComputationError(
                f"the motion is not finite after t = {float(t):.9g} natural time units"
            )
        return Leg(
            contact=contact,
            t0=t,
            t1=t1,
            end=end,
            point=point,
            limit=limit,
            steps=steps,
            nodes=motion.nodes if motion is not None else None,
            dense=motion,
        )
