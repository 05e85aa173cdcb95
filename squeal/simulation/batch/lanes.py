"""Several pads at once in the lanes of the processor: heyoka's batch integrator.

One set of equations serves all lanes and all contact states, which are runtime parameters; the
callback of a contact change switches them. The gap of an edge counts with the sign in which it
grows towards its next change, so each event passes zero upwards whatever the state.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import lru_cache
from typing import Any

import heyoka as hy
import numpy as np

from squeal.model.contact import ContactLaw, Flags, flags
from squeal.model.mechanics import Coefficients, Loads, Pose
from squeal.simulation.integrators.pool import Pool
from squeal.simulation.integrators.taylor import NEVER_ZERO, equations

LANES = int(hy.recommended_simd_size())
NAMES = [f.name for f in fields(Coefficients)]
_N = len(NAMES)
_FLAGS, _SENSES = range(_N, _N + 4), range(_N + 4, _N + 6)
_MODE = slice(_N, _N + 6)
# The runtime parameters of contact state leading + 2 trailing: its flags, and for each edge the
# sense, 1 where it touches and -1 where it does not, in which its gap grows to the next change.
_MODES = [
    np.array([*flags(a, b), 2 * a - 1, 2 * b - 1], dtype=float)
    for a, b in ((0, 0), (1, 0), (0, 1), (1, 1))
]
_LOAD = NAMES.index("F_n")
_MOST_STEPS = 1_000_000


@dataclass(frozen=True)
class Motion:
    """Motion of n pads in natural units, as far as it is kept.

    stop (n,): wanted time; touching (2, n): contact (0 or 1) of the edges at the start; end (6, n);
    samples (k, 6, n): states at equal steps of time from 0 to stop, k = 0 if none were wanted;
    lane, edge, t (e,), on (2, e), state (6, e): contact changes, in order within a pad, with the
    contact afterwards; steps (n,); limit (n,): the entry of `LIMITS` that ended the motion, else
    -1, and limit_t (n,) when; whole (n,): False where heyoka gave up.
    """

    stop: np.ndarray
    touching: np.ndarray
    end: np.ndarray
    samples: np.ndarray
    lane: np.ndarray
    edge: np.ndarray
    t: np.ndarray
    on: np.ndarray
    state: np.ndarray
    steps: np.ndarray
    limit: np.ndarray
    limit_t: np.ndarray
    whole: np.ndarray


@dataclass(frozen=True)
class _Blended:
    """A contact law whose contact state is given as flags."""

    law: ContactLaw

    def loads(self, c: Coefficients, at: Pose, state: Any) -> Loads:
        return self.law.blended_loads(c, at, state)


@dataclass(frozen=True)
class _Log:
    """What the callbacks of a run leave: present contact of each lane, changes, limits."""

    contact: list[int] = field(default_factory=list)
    mark: list[int] = field(default_factory=list)
    time: list[float] = field(default_factory=list)
    state: list[bytes] = field(default_factory=list)
    limits: list[tuple[int, int, float]] = field(default_factory=list)

    def restart(self, contact: list[int]) -> None:
        for part in (self.contact, self.mark, self.time, self.state, self.limits):
            part.clear()
        self.contact.extend(contact)


class Lanes:
    """The batch integrator of a law at a tolerance; its compiled code serves every pad."""

    def __init__(self, law: ContactLaw, tolerance: float) -> None:
        on = Flags(*(hy.par[i] for i in _FLAGS))
        system, heights, limits = equations(_Blended(law), on)  # type: ignore[arg-type]
        self._log = _Log()
        upwards, downwards = hy.event_direction.positive, hy.event_direction.negative
        # No cooldown: once the state has changed, the same gap passes zero in the other sense.
        events = [
            hy.t_event_batch(
                hy.par[_SENSES[edge]] * gap - NEVER_ZERO,
                direction=upwards,
                callback=self._on_change(edge),
                cooldown=0.0,
            )
            for edge, gap in enumerate(heights)
        ] + [
            hy.t_event_batch(
                limit, direction=downwards, callback=self._on_limit(number), cooldown=0.0
            )
            for number, limit in enumerate(limits)
        ]
        self._ta = hy.taylor_adaptive_batch(
            system,
            np.zeros((6, LANES)),
            pars=np.ones((_N + 6, LANES)),
            tol=max(tolerance, float(np.finfo(float).eps)),
            t_events=events,
        )
        self._pars, self._state, self._time = self._ta.pars, self._ta.state, self._ta.time

    # heyoka copies callbacks deeply, which leaves functions and what they refer to shared; an
    # object would be doubled. A change happens some fifty times in a run: this code is hot.
    def _on_change(self, edge: int) -> Any:
        bit, log = 1 << edge, self._log

        def switch(_ta: Any, _sign: int, lane: int) -> bool:
            now = log.contact[lane] ^ bit
            log.contact[lane] = now
            self._pars[_MODE, lane] = _MODES[now]
            log.mark.append(lane << 3 | edge << 2 | now)
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
            self._pars[_MODE, lane] = _MODES[0]
            return True

        return park

    def run(
        self,
        coefficients: np.ndarray,
        touching: np.ndarray,
        state: np.ndarray,
        stop: np.ndarray,
        samples: int,
    ) -> Motion:
        """Integrate `LANES` pads: coefficients (len(NAMES), n), touching (2, n) of 0 or 1,
        state (6, n)."""
        log, ta = self._log, self._ta
        contact = (touching[0] + 2 * touching[1]).tolist()
        log.restart(contact)
        self._pars[:_N] = coefficients
        self._pars[_MODE] = np.array([_MODES[i] for i in contact]).T
        self._state[:] = state
        ta.set_time(np.zeros(LANES))
        ta.reset_cooldowns()
        if samples:
            grid = np.linspace(0.0, 1.0, samples)[:, None] * stop
            _, sampled = ta.propagate_grid(grid, max_steps=_MOST_STEPS)
        else:
            ta.propagate_until(stop, max_steps=_MOST_STEPS)
            sampled = np.empty((0, 6, LANES))
        limit, limit_t = np.full(LANES, -1), np.full(LANES, np.nan)
        for lane, number, t in log.limits:
            if limit[lane] < 0:
                limit[lane], limit_t[lane] = number, t
        mark = np.array(log.mark, dtype=int)
        outcomes = ta.propagate_res
        return Motion(
            stop=stop,
            touching=touching,
            end=self._state.copy(),
            samples=sampled,
            lane=mark >> 3,
            edge=mark >> 2 & 1,
            t=np.array(log.time),
            on=np.array([mark & 1, mark >> 1 & 1]),
            state=np.frombuffer(b"".join(log.state)).reshape(-1, 6).T,
            steps=np.array([o[3] for o in outcomes]),
            limit=limit,
            limit_t=limit_t,
            whole=np.array([o[0] == hy.taylor_outcome.time_limit for o in outcomes]),
        )


@lru_cache(maxsize=32)
def lanes(law: ContactLaw, tolerance: float) -> Pool[Lanes]:
    """The integrators of a law and a tolerance; one serves all pads of a thread in turn."""
    return Pool(lambda: Lanes(law, tolerance))
