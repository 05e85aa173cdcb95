"""SciPy stand-in for platforms without heyoka, and an independent check of its results."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from squeal.errors import ComputationError
from squeal.mechanics import gaps, pose
from squeal.model import PadModel, net_loads
from squeal.simulation.legs import Leg
from squeal.states import State

LONGEST_LEG = 2000.0  # natural time units; bounds the memory of dense output


class SciPyIntegrator:
    """DOP853 of SciPy with located contact changes, over one scaled pad.

    SciPy looks for a change of sign over a step, so a separation shorter than a step could be
    missed; steps are therefore held to a fraction of the time unit. Right-hand sides use plain
    numbers, which are faster than arrays here.
    """

    method = "SciPy DOP853"

    def __init__(self, model: PadModel, tolerance: float) -> None:
        from scipy.integrate import solve_ivp

        self._solve: Any = solve_ivp
        self._model, self._tolerance = model, max(tolerance, 3e-14)
        self._w = float(model.pad.w)
        pad = model.pad
        # rotation is faster than translation where the moment of inertia is small
        self._max_step = 0.2 * min(1.0, math.sqrt(pad.I / (pad.m * (pad.w**2 + pad.h**2))) * 1.7)

    def _rhs(self, contact: State) -> Any:
        model, w = self._model, self._w
        c, law = model.c, model.law
        inverse_m, turn = 1.0 / c.m, w / c.I

        def rhs(_t: float, s: np.ndarray) -> list[float]:
            x, y, a, u, v, r = s.tolist()
            f = net_loads(math, c, law, (x, y, a / w), contact)
            return [u, v, r, f.x * inverse_m, f.y * inverse_m, f.moment * turn]

        return rhs

    def _events(self, contact: State) -> list[Any]:
        found = []
        for edge in (0, 1):

            def gap(_t: float, s: np.ndarray, edge: int = edge) -> float:
                return float(gaps(self._model.c, pose(math, (s[0], s[1], s[2] / self._w)))[edge])

            gap.terminal = True  # type: ignore[attr-defined]
            gap.direction = 1.0 if contact[edge] else -1.0  # type: ignore[attr-defined]
            found.append(gap)
        return found

    def advance(self, contact: State, t: float, state: np.ndarray, stop: float, dense: bool) -> Leg:
        """See `Integrator.advance`. Raises ComputationError if SciPy gives up."""
        solution = self._solve(
            self._rhs(contact),
            (t, min(stop, t + LONGEST_LEG)),
            state,
            method="DOP853",
            rtol=self._tolerance,
            atol=self._tolerance,
            max_step=self._max_step,
            events=self._events(contact),
            dense_output=dense,
        )
        if solution.status < 0:
            raise ComputationError(
                f"SciPy gave up at natural time {solution.t[-1]:.9g}: {solution.message}"
            )
        edge = None
        if solution.status == 1:
            edge = next(i for i in (0, 1) if len(solution.t_events[i]))
        motion = solution.sol
        return Leg(
            contact=contact,
            t0=t,
            t1=float(solution.t[-1]),
            end=solution.y[:, -1].copy(),
            edge=edge,
            steps=len(solution.t) - 1,
            nodes=solution.t if dense else None,
            dense=(lambda times: motion(times).T) if dense else None,
        )
