"""SciPy stand-in for platforms without heyoka, and an independent check of its results."""

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from squeal.errors import ComputationError
from squeal.model.contact import State
from squeal.model.equations import PadModel, net_loads
from squeal.model.pad import facing, pose, spring_vectors
from squeal.simulation.hybrid import DEFAULT, Course, Integrator, Options, Steps

_UPRIGHT, _SLOWER = 0, 3  # entries of `LIMITS` that are events here, in their order


class SciPyIntegrator(Integrator):
    """DOP853 of SciPy with located contact changes, over one scaled pad.

    SciPy looks for a change of sign over a step, so a separation shorter than a step could be
    missed; steps are therefore held to a fraction of the time unit. Right-hand sides use plain
    numbers, which are faster than arrays here.
    """

    method = "SciPy DOP853"

    def __init__(self, model: PadModel, tolerance: float, options: Options = DEFAULT) -> None:
        from scipy.integrate import solve_ivp

        self._solve: Any = solve_ivp
        self._model, self.tolerance, self._options = model, max(tolerance, 3e-14), options
        pad = model.pad
        # rotation is faster than translation where the moment of inertia is small
        turn = math.sqrt(pad.I / (pad.m * (pad.w**2 + pad.h**2))) * 1.7
        self._max_step = options.scipy_step * min(1.0, turn)

    def _rhs(self, contact: State) -> Any:
        c, law, model = self._model.c, self._model.law, self._model
        inverse_m, turn, D = 1.0 / c.m, c.w / c.I, model.decay
        falls, damped = ("falling" in model.terms), ("damping" in model.terms)

        def rhs(_t: float, s: np.ndarray) -> list[float]:
            state = s.tolist()
            now = model.at_speed(state[3], math) if falls else c
            f = net_loads(math, now, law, c.place(state), contact)
            rates = [f.x * inverse_m, f.y * inverse_m, f.moment * turn]
            return [*state[3:], *((rates - D @ s[3:]).tolist() if damped else rates)]

        return rhs

    def _events(self, contact: State) -> list[Any]:
        """Those of the contact points, then of the limits `_UPRIGHT` and `_SLOWER`."""
        c, law, V = self._model.c, self._model.law, self._model.pad.V

        def gap(point: int, s: np.ndarray) -> Any:
            return law.gaps(c, pose(math, c.place(s)))[point]

        events = [_event(partial(gap, i), 1.0 if on else -1.0) for i, on in enumerate(contact)]
        events.append(_event(lambda s: facing(c, pose(math, c.place(s))), -1.0))
        if "falling" in self._model.terms:
            events.append(_event(lambda s: V - s[3], -1.0))
        return events

    def _collapse(self, y: np.ndarray) -> tuple[int, int] | None:
        """The first step (its end) in which a spring turns by more than 90 degrees, and its limit.

        It has passed through zero length, where its force jumps; y (6, n) holds the step ends.
        """
        at = pose(np, self._model.c.place(y))
        for limit, (vx, vy) in enumerate(spring_vectors(self._model.c, at), 1):
            turned = vx[:-1] * vx[1:] + vy[:-1] * vy[1:] < 0.0
            if turned.any():
                return int(np.argmax(turned)) + 1, limit
        return None

    def run(self, contact: State, t: float, state: np.ndarray, stop: float, dense: bool) -> Course:
        """See `squeal.simulation.hybrid.Integrator`; ends at each change of contact."""
        span = (t, min(stop, t + self._options.scipy_time))
        wanted: Any = {"method": "DOP853", "max_step": self._max_step, "dense_output": dense}
        wanted |= {"rtol": self.tolerance, "atol": self.tolerance}
        events = self._events(contact)
        solution = self._solve(self._rhs(contact), span, state, events=events, **wanted)
        if solution.status < 0:
            raise ComputationError(
                f"SciPy gave up at natural time {solution.t[-1]:.9g}: {solution.message}"
            )
        limit, last, points = -1, len(solution.t) - 1, []
        collapse = self._collapse(solution.y)
        if collapse is not None:
            last, limit = collapse
        elif solution.status == 1:
            event = next(i for i, times in enumerate(solution.t_events) if len(times))
            if event < len(contact):
                points = [event]
            else:
                limit = (_UPRIGHT, _SLOWER)[event - len(contact)]
        nodes, end = solution.t[: last + 1], solution.y[:, last : last + 1].copy()
        on = np.array(contact, dtype=int)[:, None]
        return Course(
            law=self._model.law,
            c=self._model.c,
            t0=np.array([t]),
            t1=nodes[-1:],
            first=on,
            end=end,
            lane=np.zeros(len(points), dtype=int),
            point=np.array(points, dtype=int),
            t=nodes[-1:].repeat(len(points)),
            state=end.repeat(len(points), axis=1),
            steps=np.array([last]),
            limit=np.array([limit]),
            smooth=_steps(nodes, solution.sol, on) if dense else None,
        )


def _event(value: Callable[[np.ndarray], Any], direction: float) -> Any:
    def event(_t: float, s: np.ndarray) -> float:
        return float(value(s))

    event.terminal, event.direction = True, direction  # type: ignore[attr-defined]
    return event


def _steps(nodes: np.ndarray, motion: Any, on: np.ndarray) -> Steps:
    """The polynomials of SciPy's dense output, of degree 7, between nodes (s + 1,)."""
    shares = (1.0 - np.cos(np.pi * np.arange(8) / 7)) / 2.0
    h, fit = np.diff(nodes), np.linalg.inv(np.vander(shares, increasing=True))
    states = motion((nodes[:-1, None] + h[:, None] * shares).ravel()).reshape(6, len(h), -1)
    series, on = (states @ fit.T).transpose(2, 0, 1), 1.0 * on.repeat(len(h), axis=1)
    return Steps(np.zeros(len(h), dtype=int), nodes[:-1], h, series, on)
