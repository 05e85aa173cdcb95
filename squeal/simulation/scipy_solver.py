"""SciPy stand-in for platforms without heyoka, and an independent check of its results."""

import math
from typing import Any

import numpy as np

from squeal.errors import ComputationError
from squeal.model.equations import PadModel, net_loads
from squeal.model.pad import Coefficients, at_speed, facing, pose, spring_vectors
from squeal.simulation.hybrid import DEFAULT, Course, Integrator, Options
from squeal.simulation.observers import lobatto

_UPRIGHT, _SLOWER = 0, 3  # entries of `LIMITS` that are events here, in their order


class SciPyIntegrator(Integrator):
    """DOP853 of SciPy with located contact changes, over one scaled pad.

    SciPy looks for a change of sign over a step; where a gap turns back within one, the motion is
    solved up to there. Steps are held to a fraction of the time unit. Right-hand sides use plain
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
        step = options.scipy_step * min(1.0, turn)
        self._how: Any = {"method": "DOP853", "max_step": step}
        self._how |= {"rtol": self.tolerance, "atol": self.tolerance}

    def _rhs(self, contact: list[int]) -> Any:
        c, model = self._model.c, self._model
        inverse_m, turn, D = 1.0 / c.m, c.w / c.I, model.decay
        damped = "damping" in model.terms

        def rhs(_t: float, s: np.ndarray) -> list[float]:
            state = s.tolist()
            now = at_speed(math, c, model.pad.fall, state[3])
            f = net_loads(math, now, model.law, c.place(state), contact)
            rates = [f.x * inverse_m, f.y * inverse_m, f.moment * turn]
            return [*state[3:], *((rates - D @ s[3:]).tolist() if damped else rates)]

        return rhs

    def _events(self, contact: list[int]) -> list[Any]:
        """Those of the contact points, then of the limits `_UPRIGHT` and `_SLOWER`."""
        c, law, V = self._model.c, self._model.law, self._model.pad.V

        def gap(point: int) -> Any:
            return lambda _t, s: law.gaps(c, pose(math, c.place(s)))[point]

        events: list[Any] = [gap(i) for i in range(len(contact))]
        events.append(lambda _t, s: facing(c, pose(math, c.place(s))))
        if "falling" in self._model.terms:
            events.append(lambda _t, s: V - s[3])
        for event, on in zip(events, [*contact, 0, 0], strict=False):
            event.terminal, event.direction = True, on - 0.5  # upwards from contact
        return events

    def _turn(self, nodes: np.ndarray, states: np.ndarray, contact: np.ndarray) -> float | None:
        """Where a gap first turns back within a step about as far as zero, by a cubic."""
        c, moving, tiny = self._model.c, states.astype(complex), 1e-30
        moving[:3] += 1j * tiny * states[3:]
        gaps = np.array(self._model.law.gaps(c, pose(np, c.place(moving))))
        gaps *= np.where(contact, 1.0, -1.0)[:, None]  # that a change of contact raises above zero
        values, rates = gaps.real, gaps.imag / tiny
        a, b, h = values[:, :-1], values[:, 1:], np.diff(nodes)
        da, db = h * rates[:, :-1], h * rates[:, 1:]
        second, third = 3 * (b - a) - 2 * da - db, 2 * (a - b) + da + db
        with np.errstate(all="ignore"):
            share = da / (np.sqrt(second**2 - 3 * da * third) - second)
            top = a + share * (da + share * (second + share * third))
            turns = (a < 0) & (b < 0) & (da > 0) & (db < 0) & (top > 0.02 * np.maximum(a, b))
        turns &= (share > 0.01) & (share < 0.99)  # else the motion was solved up to there
        at = np.where(turns, nodes[:-1] + share * h, np.inf).min(initial=np.inf)
        return float(at) if at < nodes[-1] else None

    def run(
        self, contact: np.ndarray, t: float, state: np.ndarray, stop: float, dense: bool
    ) -> Course:
        """See `squeal.simulation.hybrid.Integrator`; ends at each change of contact."""
        law, c, touching = self._model.law, self._model.c, contact.tolist()
        more = {"events": self._events(touching), "dense_output": dense}
        span = (t, min(stop, t + self._options.scipy_time))
        solution = self._solve(self._rhs(touching), span, state, **self._how, **more)
        if solution.status < 0:
            raise ComputationError(
                f"SciPy gave up at natural time {solution.t[-1]:.9g}: {solution.message}"
            )
        turn = self._turn(solution.t, solution.y, contact)
        if turn is not None:
            return self.run(contact, t, state, turn, dense)
        limit, last, point = -1, len(solution.t) - 1, np.empty(0, dtype=int)
        if solution.status == 1:
            event = next(i for i, times in enumerate(solution.t_events) if len(times))
            if event < len(touching):
                point = np.array([event])
            else:
                limit = (_UPRIGHT, _SLOWER)[event - len(touching)]
        # a spring that turns by more than 90 degrees in a step has passed through zero length,
        # where its force jumps
        vectors = spring_vectors(c, pose(np, c.place(solution.y)))
        for spring, (vx, vy) in reversed([*enumerate(vectors, 1)]):
            turned = np.flatnonzero(vx[:-1] * vx[1:] + vy[:-1] * vy[1:] < 0.0)
            if turned.size:
                limit, last, point = spring, int(turned[0]) + 1, point[:0]
        nodes, end = solution.t[: last + 1], solution.y[:, last : last + 1].copy()
        t1, many = nodes[-1:], Coefficients(*np.reshape(c, (-1, 1)))
        changes = (0 * point, point, t1.repeat(len(point)), end.repeat(len(point), axis=1))
        counts = np.array([last]), np.array([limit])
        smooth = _smooth(nodes, solution.sol) if dense else ()
        return Course(law, many, nodes[:1], t1, contact[:, None], end, *changes, *counts, smooth)


def _smooth(nodes: np.ndarray, motion: Any) -> tuple[np.ndarray, ...]:
    """The polynomials of SciPy's dense output, of degree 7, between nodes (s + 1,)."""
    shares, _ = lobatto(8)
    h, fit = np.diff(nodes), np.linalg.inv(np.vander(shares, increasing=True))
    states = motion((nodes[:-1, None] + h[:, None] * shares).ravel()).reshape(6, len(h), -1)
    return np.zeros(len(h), dtype=int), nodes[:-1], h, (states @ fit.T).transpose(2, 0, 1)
