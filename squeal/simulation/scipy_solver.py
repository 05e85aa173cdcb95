"""SciPy stand-in for platforms without heyoka, and an independent check of its results."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from squeal.errors import ComputationError
from squeal.model.equations import PadModel, net_loads
from squeal.model.pad import Coefficients, Number, at_speed, facing, pose_of, spring_vectors
from squeal.simulation.hybrid import ContactChanges, DenseOutput, Integrator, Limit, Segment
from squeal.simulation.observers import lobatto

LONGEST_STEP = 0.2  # natural time: contact changes are seen at the ends of steps only
_AT_ONCE = 2000.0  # natural time after which observers see the motion
_LIMITS_BY_EVENTS = (Limit.TURNED, Limit.SURFACE_SPEED)
"""Limits that are events here, in their order."""
_IMAGINARY = 1e-30  # step of a complex-step derivative
_UPWARDS = 1.0  # through zero, of a function that an event watches
_DOWNWARDS = -1.0


@dataclass(frozen=True)
class _Event:
    """What SciPy ends at: a function of the state (6,) that passes zero in a direction."""

    function: Callable[[np.ndarray], Number]
    direction: float
    terminal: bool = True

    def __call__(self, _t: float, state: np.ndarray) -> Number:
        return self.function(state)


class SciPyIntegrator(Integrator):
    """DOP853 of SciPy with located contact changes, over one scaled pad.

    SciPy looks for a change of sign over a step; where a gap turns back within one, the motion is
    solved up to there. Steps are held to a fraction of the time unit. Right-hand sides use plain
    numbers, which are faster than arrays here.
    """

    method = "SciPy DOP853"

    def __init__(
        self, model: PadModel, tolerance: float, longest_step: float = LONGEST_STEP
    ) -> None:
        self._model = model
        self.tolerance = max(tolerance, 3e-14)
        pad = model.pad
        # rotation is faster than translation where the moment of inertia is small; 1.7, about
        # sqrt(3), makes the time 1 for a uniform rectangle, of I = m (w^2 + h^2) / 3
        rotation_time = math.sqrt(pad.I / (pad.m * (pad.w**2 + pad.h**2))) * 1.7
        self._max_step = longest_step * min(1.0, rotation_time)

    def _rhs(self, contact: list[int]) -> Callable[[float, np.ndarray], list[float]]:
        """The rates (6,) of states (6,) in a contact state, as SciPy calls for them."""
        model = self._model
        c = model.c
        inverse_m = 1.0 / c.m
        w_over_I = c.w / c.I  # times the moment: the acceleration of w theta
        D = model.decay  # (3, 3), acts on the velocities of (x, y, w theta)
        damped = "damping" in model.terms

        def rhs(_t: float, s: np.ndarray) -> list[float]:
            state = s.tolist()
            c_at_speed = at_speed(math, c, model.pad.fall, state[3])
            f = net_loads(math, c_at_speed, model.law, c.xy_theta(state), contact)
            rates = [f.x * inverse_m, f.y * inverse_m, f.moment * w_over_I]
            if damped:
                rates = (rates - D @ s[3:]).tolist()
            return [*state[3:], *rates]

        return rhs

    def _events(self, contact: list[int]) -> list[_Event]:
        """Events of the contact points, then those of `_LIMITS_BY_EVENTS` that the model has."""
        c = self._model.c
        law = self._model.law
        V = self._model.pad.V

        def gap(point: int) -> Callable[[np.ndarray], Number]:
            return lambda state: law.gaps(c, pose_of(math, c.xy_theta(state)))[point]

        def faces_surface(state: np.ndarray) -> Number:
            return facing(c, pose_of(math, c.xy_theta(state)))

        def slower_than_surface(state: np.ndarray) -> Number:
            return V - state[3]

        events = []
        for point, touches in enumerate(contact):
            events.append(_Event(gap(point), _UPWARDS if touches else _DOWNWARDS))
        events.append(_Event(faces_surface, _DOWNWARDS))
        if "falling" in self._model.terms:
            events.append(_Event(slower_than_surface, _DOWNWARDS))
        return events

    def _turning_time(
        self, nodes: np.ndarray, states: np.ndarray, contact: np.ndarray
    ) -> float | None:
        """The earliest time at which a gap turns back within a step; None if none does.

        SciPy sees no change of sign where a gap passes zero and comes back within a step. Gaps are
        taken with the sign that makes them negative until their contact changes: a maximum near
        zero or above it is such a time. It is that of the cubic Hermite interpolant a + da s +
        second s^2 + third s^3 of the gap over the step, 0 <= s <= 1, from the gaps and their rates
        at nodes (n,) with states (6, n). contact (points,): which points touch during the step.
        """
        c = self._model.c
        moving = states.astype(complex)  # rates of the gaps by the complex step
        moving[:3] += 1j * _IMAGINARY * states[3:]
        gaps = np.array(self._model.law.gaps(c, pose_of(np, c.xy_theta(moving))))  # (points, n)
        gaps *= np.where(contact, 1.0, -1.0)[:, None]
        rates = gaps.imag / _IMAGINARY
        h = np.diff(nodes)
        a = gaps.real[:, :-1]  # at the start of each step
        b = gaps.real[:, 1:]  # at its end
        da = h * rates[:, :-1]
        db = h * rates[:, 1:]
        second = 3 * (b - a) - 2 * da - db
        third = 2 * (a - b) + da + db
        with np.errstate(all="ignore"):
            # the slope da + 2 second s + 3 third s^2 has two roots; at this one, which is
            # -(second + sqrt(...)) / (3 third), its derivative is -2 sqrt(...): a maximum
            share = da / (np.sqrt(second**2 - 3 * da * third) - second)
            top = a + share * (da + share * (second + share * third))
            # above zero, or below by less than a fiftieth of the end that is nearer to zero: the
            # cubic is not exact
            near_zero = top > 0.02 * np.maximum(a, b)
        has_top = (a < 0) & (b < 0) & (da > 0) & (db < 0) & near_zero
        # not at the ends of a step: `run` ends a segment at a maximum, and would find it again
        has_top &= (share > 0.01) & (share < 0.99)
        first = np.where(has_top, nodes[:-1] + share * h, np.inf).min(initial=np.inf)
        return float(first) if first < nodes[-1] else None

    def run(
        self, contact: np.ndarray, t: float, state: np.ndarray, stop: float, dense: bool
    ) -> Segment:
        """See `squeal.simulation.hybrid.Integrator`; ends at each change of contact."""
        from scipy.integrate import solve_ivp

        touching = contact.tolist()
        solution = solve_ivp(
            self._rhs(touching),
            (t, min(stop, t + _AT_ONCE)),
            state,
            method="DOP853",
            events=self._events(touching),
            dense_output=dense,
            max_step=self._max_step,
            rtol=self.tolerance,
            atol=self.tolerance,
        )
        if solution.status < 0:
            raise ComputationError(f"SciPy gave up: {solution.message}")
        turning_time = self._turning_time(solution.t, solution.y, contact)
        if turning_time is not None:  # with an end there SciPy sees the change of sign
            return self.run(contact, t, state, turning_time, dense)
        last = len(solution.t) - 1
        limit = Limit.NONE
        point = np.empty(0, dtype=int)  # (1,) if a contact point changes at the end, else (0,)
        if solution.status == 1:  # an event, of which `_events` gives the order, has ended it
            event = next(i for i, times in enumerate(solution.t_events) if len(times))
            if event < len(touching):
                point = np.array([event])
            else:
                limit = _LIMITS_BY_EVENTS[event - len(touching)]
        collapse = self._collapse(solution.y)
        if collapse is not None:
            limit, last = collapse
            point = point[:0]  # what comes behind the collapse does not count
        nodes = solution.t[: last + 1]
        t1 = nodes[-1:]  # (1,), as a segment of a single motion has it
        end = solution.y[:, last : last + 1].copy()
        return Segment(
            law=self._model.law,
            c=Coefficients(*np.reshape(self._model.c, (-1, 1))),
            t0=nodes[:1],
            t1=t1,
            first_contact=contact[:, None],
            end=end,
            changes=ContactChanges(
                motion=np.zeros(len(point), dtype=int),
                point=point,
                t=t1.repeat(len(point)),
                state=end.repeat(len(point), axis=1),
            ),
            step_count=np.array([last]),
            limit=np.array([limit]),
            dense_output=_dense_output(nodes, solution.sol) if dense else None,
        )

    def _collapse(self, states: np.ndarray) -> tuple[Limit, int] | None:
        """The first spring that passes through zero length, where its force jumps, and the number
        of the state behind; None if none does.

        Such a spring turns by more than 90 degrees from one of the states (6, s) to the next.
        """
        c = self._model.c
        vectors = spring_vectors(c, pose_of(np, c.xy_theta(states)))
        for limit, (vx, vy) in zip((Limit.SPRING_1, Limit.SPRING_2), vectors, strict=True):
            turned = np.flatnonzero(vx[:-1] * vx[1:] + vy[:-1] * vy[1:] < 0.0)
            if turned.size:
                return limit, int(turned[0]) + 1
        return None


def _dense_output(nodes: np.ndarray, motion: Callable[[np.ndarray], np.ndarray]) -> DenseOutput:
    """SciPy's dense output, times (k,) to states (6, k), as the polynomials of degree 7 that it is
    between nodes (s + 1,)."""
    shares, _ = lobatto(8)  # eight values determine a polynomial of degree 7
    fit = np.linalg.inv(np.vander(shares, increasing=True))
    h = np.diff(nodes)
    times = nodes[:-1, None] + h[:, None] * shares
    states = motion(times.ravel()).reshape(6, len(h), -1)
    series = (states @ fit.T).transpose(2, 0, 1)
    return DenseOutput(motion=np.zeros(len(h), dtype=int), t=nodes[:-1], h=h, series=series)
