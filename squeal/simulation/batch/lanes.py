"""Several pads at once in the lanes of the processor: heyoka's batch integrator.

One set of equations serves all lanes and all contact states, which are runtime parameters; the
callback of a contact change switches them. The gap of a point counts with the sign in which it
grows towards its next change, so each event passes zero upwards whatever the state.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import heyoka as hy
import numpy as np

from squeal.model.equations import term_count
from squeal.model.law import ContactLaw
from squeal.simulation.batch.motion import Motion
from squeal.simulation.integrators.pool import Pool
from squeal.simulation.integrators.symbols import NAMES, equations, rising, state_parameters

LANES = int(hy.recommended_simd_size())
_N = len(NAMES)
_LOAD = NAMES.index("F_n")
_MOST_STEPS = 1_000_000


@dataclass(frozen=True)
class _Log:
    """What the callbacks of a run leave: changes and limits."""

    change: list[tuple[int, int]] = field(default_factory=list)  # lane, point
    time: list[float] = field(default_factory=list)
    state: list[bytes] = field(default_factory=list)
    limits: list[tuple[int, int, float]] = field(default_factory=list)

    def clear(self) -> None:
        for part in (self.change, self.time, self.state, self.limits):
            part.clear()


class Lanes:
    """The batch integrator of a law at a tolerance; its compiled code serves every pad.

    `terms` are those with velocities, see `PadModel.terms`.
    """

    def __init__(self, law: ContactLaw, tolerance: float, terms: tuple[str, ...] = ()) -> None:
        self._points = law.points
        self._touching = slice(_N, _N + law.points)
        on = state_parameters(law)
        system, heights, limits = equations(law, on, terms)
        self._log = _Log()
        upwards, downwards = hy.event_direction.positive, hy.event_direction.negative
        # No cooldown: once the state has changed, the same gap passes zero in the other sense.
        events = [
            hy.t_event_batch(
                expression, direction=upwards, callback=self._on_change(point), cooldown=0.0
            )
            for point, expression in enumerate(rising(heights, on))
        ] + [
            hy.t_event_batch(
                limit, direction=downwards, callback=self._on_limit(number), cooldown=0.0
            )
            for number, limit in enumerate(limits)
        ]
        self._ta = hy.taylor_adaptive_batch(
            system,
            np.zeros((6, LANES)),
            pars=np.ones((_N + law.points + term_count(terms), LANES)),
            tol=max(tolerance, float(np.finfo(float).eps)),
            t_events=events,
        )
        self._pars, self._state, self._time = self._ta.pars, self._ta.state, self._ta.time

    # heyoka copies callbacks deeply, which leaves functions and what they refer to shared; an
    # object would be doubled. A change happens some fifty times in a run: this code is hot.
    def _on_change(self, point: int) -> Any:
        row, log = _N + point, self._log

        def switch(_ta: Any, _sign: int, lane: int) -> bool:
            self._pars[row, lane] = 1.0 - self._pars[row, lane]
            log.change.append((lane, point))
            log.time.append(self._time[lane])
            log.state.append(self._state[:, lane].tobytes())
            return True

        return switch

    def _on_limit(self, number: int) -> Any:
        def park(_ta: Any, _sign: int, lane: int) -> bool:
            """Put the pad to rest without load, so that the other lanes can go on."""
            self._log.limits.append((lane, number, float(self._time[lane])))
            self._state[:, lane] = 0.0
            self._pars[_LOAD, lane] = 0.0
            self._pars[self._touching, lane] = 0.0
            return True

        return park

    def run(
        self,
        coefficients: np.ndarray,
        touching: np.ndarray,
        state: np.ndarray,
        stop: np.ndarray,
        samples: int,
        terms: np.ndarray,
    ) -> Motion:
        """Integrate `LANES` pads: coefficients (len(NAMES), n), touching (points, n) of 0 or 1,
        state (6, n), terms (m, n): the numbers of terms with velocities."""
        log, ta = self._log, self._ta
        log.clear()
        self._pars[:_N] = coefficients
        self._pars[self._touching] = touching
        self._pars[_N + self._points :] = terms
        self._state[:] = state
        ta.set_time(np.zeros(LANES))
        ta.reset_cooldowns()
        grid = np.linspace(0.0, 1.0, samples)[:, None] * stop
        if samples:
            _, sampled = ta.propagate_grid(grid, max_steps=_MOST_STEPS)
        else:
            ta.propagate_until(stop, max_steps=_MOST_STEPS)
            sampled = np.empty((0, 6, LANES))
        limit, limit_t = np.full(LANES, -1), np.full(LANES, np.nan)
        for lane, number, t in log.limits:
            if limit[lane] < 0:
                limit[lane], limit_t[lane] = number, t
        change = np.array(log.change, dtype=int).reshape(-1, 2).T
        on = (change[1] == np.arange(self._points)[:, None]).astype(int)
        for i in range(LANES):
            mine = change[0] == i
            on[:, mine] = touching[:, [i]] + on[:, mine].cumsum(axis=1) & 1
        outcomes = ta.propagate_res
        return Motion(
            stop=stop,
            touching=touching,
            end=self._state.copy(),
            times=grid,
            samples=sampled,
            lane=change[0],
            point=change[1],
            t=np.array(log.time),
            on=on,
            state=np.frombuffer(b"".join(log.state)).reshape(-1, 6).T,
            steps=np.array([o[3] for o in outcomes]),
            limit=limit,
            limit_t=limit_t,
            whole=np.array([o[0] == hy.taylor_outcome.time_limit for o in outcomes]),
        )


@lru_cache(maxsize=32)
def lanes(law: ContactLaw, tolerance: float, terms: tuple[str, ...] = ()) -> Pool[Lanes]:
    """The integrators of a law and a tolerance; one serves all pads of a thread in turn."""
    return Pool(lambda: Lanes(law, tolerance, terms))
