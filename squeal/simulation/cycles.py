"""Periodic motions through contact changes, by shooting, with their Floquet multipliers.

A period is a time T with phi_T(z) = z. Newton's method solves this for z, T and, along a branch of
motions, for a parameter, with the matrix of the variational equations as derivative.

The loads are continuous where the contact changes, since an edge's force starts from zero. The jump
(saltation) matrix there, I + (f_after - f_before) n' / (n' f_before) with the normal n of the
switching surface, is therefore the identity, and the variational equations run on through it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.model.equations import PadModel, Units, net_loads
from squeal.model.pad import facing, pose
from squeal.numerics.differentiation import complex_step
from squeal.simulation.hybrid import Course, Observer, Steps, integrate, state_rates
from squeal.simulation.observers import Change, Events, Grid, one_of
from squeal.simulation.run import make_integrator

PARTS = 8  # Runge-Kutta steps of the variational equations in a step of the motion
TOLERANCE = 1e-12  # of the integration
CLOSED = 1e-9  # how far apart, relative to its size, a motion's ends may be to count as closed
PASSES = 12  # of Newton's method
STEP = 1e-6  # in the scaled parameter, for the derivative by it
RETURNED = 1e-6  # relative distance of two passages that count as a return
PASSAGES = 9  # most passages in a period
STRAIGHT = 0.9  # least cosine of the angle by which a branch turns in a step
HALVINGS = 12  # of a step, to locate what happens in it
RESTING = 1e-4  # relative speed of a motion that has come to rest
CLOSED_CURVE, RESTS = "the branch is closed", "the motion comes to rest"
CRITICAL = 0.05  # most distance from the unit circle of a multiplier that crosses it


class Variations(Observer):
    """The matrix of small deviations (6, 6) along a motion, in natural units."""

    dense = True

    def __init__(self, model: PadModel) -> None:
        self._model = model
        self.matrix = np.eye(6)

    def _rates(self, steps: Steps, share: float) -> np.ndarray:
        """The matrices A (s, 6, 6) of the linear equations at a share of each step."""
        pad = self._model.pad
        lever = np.array([1.0, 1.0, pad.w])
        states = steps.states(np.full(len(steps.t), share))
        q, rates = (np.array(self._model.c.place(part)) for part in (states[:3], states[3:]))
        loads = partial(self._model.loads, state=steps.on)
        slopes = np.moveaxis(complex_step(partial(loads, rates=rates), q), -1, 0)
        mass = np.array([pad.m, pad.m, pad.I])
        A = np.zeros((len(steps.t), 6, 6))
        A[:, :3, 3:] = np.eye(3)
        A[:, 3:, :3] = slopes * (lever / mass)[:, None] / lever
        if self._model.terms:
            damping = np.moveaxis(complex_step(lambda v: loads(q, rates=v), rates), -1, 0)
            A[:, 3:, 3:] = damping * (lever / mass)[:, None] / lever
        return A

    def see(self, course: Course) -> None:
        steps, one = course.steps, np.eye(6)
        h = steps.h[:, None, None] / PARTS
        matrices = np.broadcast_to(one, (len(h), 6, 6))
        end = self._rates(steps, 0.0)
        for part in range(PARTS):  # of all steps at once
            k1, middle = end, self._rates(steps, (part + 0.5) / PARTS)
            end = self._rates(steps, (part + 1.0) / PARTS)
            k2 = middle @ (one + h / 2 * k1)
            k3 = middle @ (one + h / 2 * k2)
            k4 = end @ (one + h * k3)
            matrices = (one + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)) @ matrices
        for matrix in matrices:
            self.matrix = matrix @ self.matrix


@dataclass(frozen=True, eq=False)
class Cycle:
    """A periodic motion in natural units.

    state (6,): a state that it passes; period; monodromy (6, 6): the matrix of small deviations
    over a period; value: of the scaled parameter; gap: distance of its ends, relative to its size;
    changes: its contact changes.
    """

    state: np.ndarray
    period: float
    monodromy: np.ndarray
    value: float
    gap: float
    changes: tuple[Change, ...]

    @property
    def unknowns(self) -> np.ndarray:
        """(z, T, value), shape (8,)."""
        return np.concatenate([self.state, [self.period, self.value]])

    @cached_property
    def _split(self) -> tuple[complex, np.ndarray]:
        values = np.linalg.eigvals(self.monodromy)
        shift = np.argmin(np.abs(values - 1.0))
        others = np.delete(values, shift)
        return complex(values[shift]), others[np.argsort(-np.abs(others))]

    @property
    def multipliers(self) -> np.ndarray:
        """The five Floquet multipliers beside the one of a shift in time, the largest first."""
        return self._split[1]

    @property
    def trivial(self) -> complex:
        """The multiplier of a shift in time, 1 but for errors."""
        return self._split[0]

    @property
    def margin(self) -> float:
        """How far errors may move a multiplier, from that of a shift in time."""
        return 1e-6 + 10.0 * abs(self.trivial - 1.0)

    @property
    def stable(self) -> bool | None:
        """Whether small deviations decay; None where the multipliers do not decide."""
        largest = abs(self.multipliers[0])
        return None if abs(largest - 1.0) <= self.margin else bool(largest < 1.0)

    @property
    def critical(self) -> bool:
        """Whether a multiplier is next to the unit circle, away from 1."""
        return any(abs(abs(m) - 1.0) < CRITICAL and m.real < 0.99 for m in self.multipliers)

    @cached_property
    def contacts(self) -> tuple[Any, ...]:
        """The contact states that it passes, in order, from the one with most contact on."""
        states = [change.target for change in self.changes]
        turns = [(*states[i:], *states[:i]) for i in range(len(states))]
        return max(turns, default=())


class Member(NamedTuple):
    """A cycle of a branch.

    turn: what happens at it, empty for nothing: a fold, a period doubling, a torus (a complex pair
    leaves or enters the unit circle) or a grazing (the sequence of contact states changes).
    """

    cycle: Cycle
    turn: str = ""


@dataclass(frozen=True, eq=False)
class Shooting:
    """A pad in natural units over a scaled parameter: `at` gives its model at a value."""

    at: Callable[[float], PadModel]
    units: Units

    def model(self, value: float) -> PadModel:
        """The model at a value. Raises ComputationError where there is none."""
        try:
            return self.at(float(value))
        except InputError as error:
            raise ComputationError(str(error)) from None

    def motion(
        self, state: np.ndarray, time: float, value: float, observers: Sequence[Observer] = ()
    ) -> np.ndarray:
        """The state (6,) after some time from a state. Raises ComputationError."""
        model = self.model(value)
        integrator = make_integrator(model, TOLERANCE, "auto")
        _, end, _, _ = integrate(model, integrator, self.units, state, time, observers)
        return np.asarray(end)

    def over(self, state: np.ndarray, period: float, value: float) -> tuple[np.ndarray, Cycle]:
        """phi_T(z) - z and, as a cycle, the motion from z over T."""
        small, events = Variations(self.model(value)), Events()
        apart = self.motion(state, period, value, [small, events]) - state
        gap = float(np.abs(apart).max() / np.abs(state).max())
        return apart, Cycle(state, period, small.matrix, value, gap, tuple(events.changes))

    def solve(
        self, guess: np.ndarray, direction: np.ndarray | None = None, most: int = PASSES
    ) -> tuple[Cycle, np.ndarray]:
        """The cycle next to a guess (z, T, value), and the direction (8,) of its branch.

        The correction is orthogonal to `direction`; without one, the value is held. Raises
        ComputationError where Newton's method does not converge.
        """
        along = np.eye(8)[7] if direction is None else direction
        x = guess.copy()
        phase = state_rates(self.model(x[7]), x[:6])
        phase /= np.linalg.norm(phase)
        for _ in range(most):
            apart, cycle = self.over(x[:6], x[6], x[7])
            end = x[:6] + apart
            J = np.zeros((8, 8))
            J[:6, :6] = cycle.monodromy - np.eye(6)
            J[:6, 6] = state_rates(self.model(x[7]), end)
            J[:6, 7] = (self.motion(x[:6], x[6], x[7] + STEP) - end) / STEP
            J[6, :6] = phase
            J[7] = along
            if cycle.gap < CLOSED:
                tangent = np.linalg.solve(J, np.eye(8)[7])
                return cycle, tangent / np.linalg.norm(tangent)
            residual = np.concatenate([apart, [phase @ (x[:6] - guess[:6]), along @ (x - guess)]])
            x = x - np.linalg.solve(J, residual)
            if not (x[6] > 0.0 and np.all(np.isfinite(x))):
                break
        raise ComputationError("no periodic motion was found next to the guess")

    def settle(
        self, state: np.ndarray, window: float, value: float, windows: int
    ) -> tuple[Cycle | None, str]:
        """The cycle to which the motion from a state settles within so many windows of time, or
        None with the reason. Raises ComputationError where the model ends."""
        rate, changes = 0.0, list[Change]()
        fastest = max(1e-6, float(np.linalg.norm(state_rates(self.model(value), state))))
        for _ in range(windows):
            events = Events()
            end = self.motion(state, window, value, [events])
            changes, state = events.changes, end
            rate = float(np.linalg.norm(state_rates(self.model(value), state)))
            if not changes and rate <= RESTING * fastest:
                break
            if period := _return(changes):
                begin = next(c.state for c in changes if sum(c.target) < sum(c.source))
                # from between two changes, so that none falls on an end
                begin = self.motion(begin, 0.01 * period, value)
                cycle, _ = self.solve(np.concatenate([begin, [period, value]]))
                return self._shortest(cycle), ""
        if changes:
            return None, "contact goes on changing and the motion does not return to itself"
        if rate <= RESTING * fastest:
            return None, RESTS
        return None, "the motion still oscillates, without a change of contact"

    def _shortest(self, cycle: Cycle) -> Cycle:
        """The cycle over its least period: a slow transient returns late, after several of them."""
        for parts in range(len(cycle.changes), 1, -1):
            _, part = self.over(cycle.state, cycle.period / parts, cycle.value)
            if part.gap < RETURNED:
                return self.solve(part.unknowns)[0]
        return cycle

    def branch(
        self, own: Cycle, towards: float, ends: tuple[float, float], step: float, most: int
    ) -> tuple[list[Member], str]:
        """Cycles along the branch from one in the sense in which the value goes `towards` (+1 or
        -1), and why no more follow.

        Steps of at most `step` in (z, T, value), shortened where Newton's method fails; ends after
        `most` cycles, outside the values `ends`, or where it fails with a thousandth of the step.
        """
        members: list[Member] = []
        cycle, way = self.solve(own.unknowns)
        way *= np.sign(way[7]) * towards
        size, (low, high) = step, ends
        speed = first = state_rates(self.model(cycle.value), cycle.state)
        while len(members) < most:
            try:
                after, turned = self.solve(cycle.unknowns + size * way, way, 6)
            except (ComputationError, np.linalg.LinAlgError):
                turned = np.zeros(8)
            if abs(turned @ way) <= STRAIGHT:  # a sharp turn may be a jump between branches
                size /= 2.0
                if size < 1e-3 * step:
                    return members, "no further cycle was found"
                continue
            turned = turned * np.sign(turned @ way)
            before, speed = speed, state_rates(self.model(after.value), after.state)
            small = np.linalg.norm(speed) < RESTING * np.linalg.norm(first)
            if small or speed @ before < 0.0:  # beyond the equilibrium the same cycles follow
                return members, "the cycle shrinks to the equilibrium"
            met = self._turns((cycle, way), size, (after, turned))
            side = cycle.value - own.value
            if (after.value - own.value) * side < 0.0:
                again = self._last(cycle, after, own.value, own.value)
                if any(abs(one.cycle.period / own.period - 1.0) < RETURNED for one in again):
                    met = [one for one in met if (one.cycle.value - own.value) * side > 0.0]
                    return members + met + again, CLOSED_CURVE
            members += [one for one in met if low <= one.cycle.value <= high]
            if not low <= after.value <= high:
                return members + self._last(cycle, after, low, high), ""
            members.append(Member(after))
            if not after.changes and after.stable is None:
                return members, "without a change of contact, cycles of any amplitude follow"
            cycle, way, size = after, turned, min(1.5 * size, step)
        return members, f"{most} cycles were followed"

    def _last(self, cycle: Cycle, beyond: Cycle, low: float, high: float) -> list[Member]:
        """The cycle at the end of the range, between two, where there is one."""
        end = low if beyond.value < low else high
        share = (end - cycle.value) / (beyond.value - cycle.value)
        guess = cycle.unknowns + share * (beyond.unknowns - cycle.unknowns)
        guess[7] = end
        try:
            return [Member(self.solve(guess)[0])]
        except (ComputationError, np.linalg.LinAlgError):
            return []

    def _turns(
        self, first: tuple[Cycle, np.ndarray], size: float, last: tuple[Cycle, np.ndarray]
    ) -> list[Member]:
        """What happens within a step, in order, each located by bisection."""
        (cycle, way), met = first, list[tuple[float, Member]]()
        linear = not last[0].changes and last[0].stable is None  # at one value, with any amplitude
        for kind, sign in SIGNS.items():
            if linear and kind != "grazing":
                continue
            low, before = 0.0, sign(*first)
            while before != sign(*last) and low < size:
                high, found = size, last
                for _ in range(HALVINGS):
                    middle = (low + high) / 2.0
                    try:
                        one, turned = self.solve(cycle.unknowns + middle * way, way)
                    except (ComputationError, np.linalg.LinAlgError):
                        break
                    turned = turned * np.sign(turned @ way)
                    if sign(one, turned) == before:
                        low = middle
                    else:
                        high, found = middle, (one, turned)
                if kind in ("fold", "grazing") or found[0].critical:  # no pair that meets elsewhere
                    met.append((high, Member(found[0], kind)))
                low, before = high, sign(*found)
        return [member for _, member in sorted(met, key=lambda one: one[0])]


SIGNS: dict[str, Callable[[Cycle, np.ndarray], Any]] = {
    "fold": lambda cycle, way: way[7] > 0.0,
    "period doubling": lambda cycle, _: sum(
        m.real < -1.0 for m in cycle.multipliers if m.imag == 0.0
    ),
    "torus": lambda cycle, _: sum(abs(m) > 1.0 for m in cycle.multipliers if m.imag > 0.0),
    "grazing": lambda cycle, _: cycle.contacts,
}
"""What changes of a cycle, with the direction of its branch, at each kind of turn."""


def _return(changes: Sequence[Change]) -> float:
    """The time after which a separation repeats, 0 where none does."""
    separations = [c for c in changes if sum(c.target) < sum(c.source)]
    if not separations:
        return 0.0
    first = separations[0]
    same = [c for c in separations if (c.source, c.target) == (first.source, first.target)]
    size = np.abs([c.state for c in same]).max()
    for one in same[1 : PASSAGES + 1]:
        if np.abs(one.state - first.state).max() < RETURNED * size:
            return one.t - first.t
    return 0.0


class Measures(Observer):
    """Work of friction and of damping, ranges of the place, mean square velocities and the greatest
    speed of the lower face while it touches, in natural units."""

    dense = True

    def __init__(self, model: PadModel) -> None:
        self._model = model
        self.friction = self.damping = 0.0
        self.squares = np.zeros(3)  # time integrals
        self.ranges = np.array([[np.inf, -np.inf]] * 4)

    @property
    def face(self) -> float:
        """The greatest speed of the lower face while it touches, -inf if it never does."""
        return float(self.ranges[3, 1])

    def _powers(self, c: Any, states: np.ndarray, on: np.ndarray) -> np.ndarray:
        """Powers of friction and of damping, and squared velocities (5, ...)."""
        model = self._model
        q, v = c.place(states[:3]), np.array(c.place(states[3:]))
        C = np.zeros((3, 3)) if model.damping is None else np.array(model.damping)
        drag = np.tensordot(C, v, 1)
        bare = net_loads(np, c._replace(mu=0.0 * c.mu), model.law, q, on)
        rest = net_loads(np, model.at_speed(v[0]), model.law, q, on)
        friction = sum((a - b) * u for a, b, u in zip(rest, bare, v, strict=True))
        return np.array([friction, (drag * v).sum(axis=0), *states[3:] ** 2])

    @staticmethod
    def _places(c: Any, states: np.ndarray, on: np.ndarray) -> np.ndarray:
        """The place, and the speed of the middle of the lower face where it touches (4, ...)."""
        q, v = c.place(states[:3]), c.place(states[3:])
        face = v[0] + c.h * facing(c, pose(np, q)) * v[2]
        return np.array([*states[:3], np.where(on.any(axis=0), face, np.nan)])

    def see(self, course: Course) -> None:
        grid = Grid(course, 16)
        total = (grid.read(self._powers) * grid.weights[:, None] * grid.steps.h).sum(axis=(1, 2))
        self.friction += float(total[0])
        self.damping += float(total[1])
        self.squares += total[2:]
        for i, known in enumerate(self.ranges):
            ((low, high),) = grid.ranges(one_of(self._places, i))
            known[:] = min(known[0], low), max(known[1], high)
