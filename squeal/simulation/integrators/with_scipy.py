"""SciPy stand-in for platforms without heyoka, and an independent check of its results."""

import math
from typing import Any

import numpy as np

from squeal.errors import ComputationError
from squeal.model.equations import PadModel, net_loads
from squeal.model.mechanics import facing, pose, spring_vectors
from squeal.model.states import State
from squeal.simulation.legs import LIMITS, Integrator, Leg

LONGEST_LEG = 2000.0  # natural time units; bounds the memory of dense output


_LIMITS = (LIMITS[0], LIMITS[3])  # those that are events here, in their order


class SciPyIntegrator(Integrator):
    """DOP853 of SciPy with located contact changes, over one scaled pad.

    SciPy looks for a change of sign over a step, so a separation shorter than a step could be
    missed; steps are therefore held to a fraction of the time unit. Right-hand sides use plain
    numbers, which are faster than arrays here.
    """

    method = "SciPy DOP853"

    def __init__(self, model: PadModel, tolerance: float) -> None:
        from scipy.integrate import solve_ivp

        self._solve: Any = solve_ivp
        self._model, self.tolerance = model, max(tolerance, 3e-14)
        pad = model.pad
        # rotation is faster than translation where the moment of inertia is small
        self._max_step = 0.2 * min(1.0, math.sqrt(pad.I / (pad.m * (pad.w**2 + pad.h**2))) * 1.7)

    def _rhs(self, contact: State) -> Any:
        c, law = self._model.c, self._model.law
        inverse_m, turn = 1.0 / c.m, c.w / c.I
        D, falls = self._model.decay, "falling" in self._model.terms

        def rhs(_t: float, s: np.ndarray) -> list[float]:
            state = s.tolist()
            now = self._model.at_speed(state[3], math) if falls else c
            f = net_loads(math, now, law, c.place(state), contact)
            return [*state[3:], f.x * inverse_m, f.y * inverse_m, f.moment * turn]

        def damped(t: float, s: np.ndarray) -> list[float]:
            rates = rhs(t, s)
            taken = D @ s[3:]
            return [*rates[:3], *(rates[3:] - taken).tolist()]

        return damped if "damping" in self._model.terms else rhs

    def _events(self, contact: State) -> list[Any]:
        c, law = self._model.c, self._model.law
        found = []
        for point in range(law.points):

            def gap(_t: float, s: np.ndarray, point: int = point) -> float:
                return float(law.gaps(c, pose(math, c.place(s)))[point])

            gap.terminal = True  # type: ignore[attr-defined]
            gap.direction = 1.0 if contact[point] else -1.0  # type: ignore[attr-defined]
            found.append(gap)

        def upright(_t: float, s: np.ndarray) -> float:
            return float(facing(c, pose(math, c.place(s))))

        def slower(_t: float, s: np.ndarray) -> float:
            return float(V - s[3])

        ends = [upright]
        V = self._model.pad.V
        if "falling" in self._model.terms:
            ends.append(slower)
        for end in ends:
            end.terminal = True  # type: ignore[attr-defined]
            end.direction = -1.0  # type: ignore[attr-defined]
        return [*found, *ends]

    def _collapse(self, y: np.ndarray) -> tuple[int, str] | None:
        """The first step (its end) in which a spring turns by more than 90 degrees, and what it is.

        It has passed through zero length, where its force jumps; y (6, n) holds the step ends.
        """
        at = pose(np, self._model.c.place(y))
        for (vx, vy), limit in zip(spring_vectors(self._model.c, at), LIMITS[1:3], strict=True):
            turned = vx[:-1] * vx[1:] + vy[:-1] * vy[1:] < 0.0
            if turned.any():
                return int(np.argmax(turned)) + 1, limit
        return None

    def advance(self, contact: State, t: float, state: np.ndarray, stop: float, dense: bool) -> Leg:
        """See `Integrator.advance`. Raises ComputationError if SciPy gives up."""
        span, events = (t, min(stop, t + LONGEST_LEG)), self._events(contact)
        wanted: Any = {"method": "DOP853", "max_step": self._max_step, "dense_output": dense}
        wanted |= {"rtol": self.tolerance, "atol": self.tolerance}
        solution = self._solve(self._rhs(contact), span, state, events=events, **wanted)
        if solution.status < 0:
            raise ComputationError(
                f"SciPy gave up at natural time {solution.t[-1]:.9g}: {solution.message}"
            )
        point, limit, last = None, None, -1
        collapse = self._collapse(solution.y)
        if collapse is not None:
            last, limit = collapse
        elif solution.status == 1:
            event = next(i for i, times in enumerate(solution.t_events) if len(times))
            point, limit = (
                (event, None) if event < len(contact) else (None, _LIMITS[event - len(contact)])
            )
        motion = solution.sol
        t1, end, steps = float(solution.t[last]), solution.y[:, last].copy(), len(solution.t) - 1
        kept = (solution.t, lambda times: motion(times).T) if dense else ()
        return Leg(contact, t, t1, end, point, steps, limit, *kept)
