"""Taylor integration with heyoka: the equations of `model.equations` compiled once per machine.

One integrator per contact state holds just the terms of that state and watches all gaps, each in
the direction that ends the state.
"""

import copy
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import heyoka as hy
import numpy as np

from squeal.errors import ComputationError
from squeal.model.equations import PadModel, term_count
from squeal.model.law import ContactLaw
from squeal.model.mechanics import pose
from squeal.model.states import State
from squeal.simulation.integrators import symbols
from squeal.simulation.integrators.kept import kept
from squeal.simulation.integrators.pool import Pool
from squeal.simulation.integrators.through import MOST_STEPS, Changes, through
from squeal.simulation.legs import LIMITS, Leg

LONGEST_LEG = 5000  # steps; bounds the memory of dense output
FEWEST_STEPS = 4  # of a run through changes, after one that had to be cut
CLEAR = 1e-9  # gap beyond which a point does not change together with another


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
    on = symbols.state_parameters(law) if contact is None else contact
    system, heights, limits = symbols.equations(law, on, terms)
    upwards, downwards = hy.event_direction.positive, hy.event_direction.negative
    rising = symbols.rising(heights, on)
    events = [_event(fp_type)(e, direction=upwards) for e in rising]
    events += [_event(fp_type)(limit, direction=downwards) for limit in limits]
    expressions = [rhs for _, rhs in system] + rising + limits
    used = hy.get_params(expressions)
    highest = max(
        i for i in range(len(symbols.NAMES) + law.points + term_count(terms)) if hy.par[i] in used
    )
    how = {"compact_mode": contact is None} | options
    if fp_type is not float:  # the time goes into the numbers, which no processor has
        how |= {"compact_mode": True, "opt_level": 0}
    return kept(
        expressions,
        (law.points, highest, tolerance, fp_type.__name__, how),
        lambda: hy.taylor_adaptive(
            system,
            [fp_type(0.0)] * 6,
            pars=[fp_type(1.0)] * (highest + 1),
            tol=fp_type(tolerance),
            t_events=events,
            fp_type=fp_type,
            **how,
        ),
    )


@lru_cache(maxsize=64)
def _pool(
    law: ContactLaw, contact: State | None, tolerance: float, fp_type: Any, terms: tuple[str, ...]
) -> Pool[Any]:
    """Integrators of one kind, copies of the compiled one, which itself never runs."""
    return Pool(lambda: copy.copy(compiled(law, contact, tolerance, fp_type, terms)))


def _event(fp_type: Any) -> Any:
    return hy.t_event if fp_type is float else lambda *a, **k: hy.t_event(*a, fp_type=fp_type, **k)


_ONWARD = (hy.taylor_outcome.success, hy.taylor_outcome.time_limit, hy.taylor_outcome.step_limit)


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
        step = np.searchsorted(self.nodes[1:-1], t, side="right")
        powers = np.ones((len(t), self.coefficients.shape[2]))
        powers[:, 1:] = (t - self.nodes[step])[:, None]
        np.multiply.accumulate(powers, axis=1, out=powers)
        return np.asarray(self.coefficients[step] @ powers[:, :, None])[:, :, 0]


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
        self._law, self._c = model.law, model.c
        self._fp = fp_type
        eps = float(np.finfo(float).eps) if fp_type is float else 0.0
        self.tolerance = max(tolerance, eps)
        self._terms = model.terms
        self._most = MOST_STEPS
        self._pars = np.array([fp_type(float(getattr(model.c, name))) for name in symbols.NAMES])
        self._last = np.array([fp_type(value) for value in model.term_values.tolist()])

    def advance(self, contact: State, t: float, state: np.ndarray, stop: float, dense: bool) -> Leg:
        """See `Integrator.advance`. Raises ComputationError if the motion leaves all bounds."""
        own = contact if len(contact) <= symbols.OWN_CODE else None
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
        point, limit = self._met(outcome, t)
        nodes = None if motion is None else motion.nodes
        return Leg(contact, t, t1, end, point, steps, limit, nodes, motion)

    def legs(
        self, contact: State, t: float, state: np.ndarray, stop: float, dense: bool
    ) -> list[Leg]:
        """See `Integrator.legs`."""
        if dense or self._fp is not float:
            return [self.advance(contact, t, state, stop, dense)]
        pars = np.concatenate([self._pars, contact, self._last])
        with through(self._law, self.tolerance, self._terms).lease() as machine:
            changes, last = machine.run(pars, t, state, stop, self._most)
            outcome, _, _, steps, *_ = last
            t1, end = machine.ta.time, machine.ta.state.copy()
        _, limit = self._met(outcome, t)
        plain = self._plain(contact, changes)
        legs = []
        for point, time, state in zip(*changes, strict=True):
            legs.append(Leg(contact, t, time, state, point, 0))
            contact, t = contact.flip(point), time
        # what comes after a cut is done again: as little as may be where one follows another
        self._most = FEWEST_STEPS if plain < len(legs) else min(4 * self._most, MOST_STEPS)
        if plain < len(legs):
            return [*legs[:plain], legs[plain]._replace(steps=steps)]
        return [*legs, Leg(contact, t, t1, end, None, steps, limit)]

    def _plain(self, contact: State, changes: Changes) -> int:
        """How many changes come first in which one point passes and all others are clear."""
        if not changes.points:
            return 0
        c = self._c
        _, y, turn, *_ = changes.states.T
        heights = np.array(self._law.gaps(c, pose(np, c.place((0.0, y, turn)))))
        passing = np.arange(len(contact))[:, None] == changes.points
        touching = np.array(contact)[:, None] ^ (passing.cumsum(axis=1) & 1 != passing)
        room = np.where(touching, -heights, heights)
        near = (room < CLEAR * (1.0 + c.w + c.h)) & ~passing
        first = near.any(axis=0).argmax()
        return int(first) if near[:, first].any() else len(changes.points)

    def _met(self, outcome: Any, t: float) -> tuple[int | None, str | None]:
        """The contact point or the limit at which heyoka stopped."""
        event, points = -int(outcome) - 1, self._law.points
        if 0 <= event < points:
            return event, None
        if points <= event < points + len(LIMITS):
            return None, LIMITS[event - points]
        if outcome in _ONWARD:
            return None, None
        raise ComputationError(
            f"the motion is not finite after t = {float(t):.9g} natural time units"
        )
