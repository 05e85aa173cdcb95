"""Periodic motions through contact changes, by shooting, with their Floquet multipliers.

A period is a time T with phi_T(z) = z. Newton's method solves this for z, T and, along a branch of
motions, for a parameter, with the matrix of the variational equations as derivative.

The loads are continuous where the contact changes, since an edge's force starts from zero. The jump
(saltation) matrix there, I + (f_after - f_before) n' / (n' f_before) with the normal n of the
switching surface, is therefore the identity, and the variational equations run on through it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.model.equations import PadModel, Units
from squeal.numerics.differentiation import complex_step
from squeal.simulation.hybrid import Course, state_of, state_rates, whole
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
SHRUNK = 1e-3  # of the greatest step of a branch: a step this short does not pass small cycles
CLOSED_CURVE, RESTS = "the branch is closed", "the motion comes to rest"
CRITICAL = 0.05  # most distance from the unit circle of a multiplier that crosses it


def deviations(model: PadModel, course: Course) -> np.ndarray:
    """The matrix of small deviations (6, 6) along a motion, in natural units."""
    steps, one, product = course.steps, np.eye(6), np.eye(6)
    h = steps.h[:, None, None] / PARTS

    def rates(share: float) -> np.ndarray:
        """The matrices A (s, 6, 6) of the linear equations at a share of each step."""
        states = steps.states(np.full(len(steps.t), share))
        slopes = complex_step(lambda state: state_rates(model, state, steps.on), states)
        return np.moveaxis(slopes, -1, 0)

    matrices, end = np.broadcast_to(one, (len(h), 6, 6)), rates(0.0)
    for part in range(PARTS):  # of all steps at once
        k1, middle, end = end, rates((part + 0.5) / PARTS), rates((part + 1.0) / PARTS)
        k2 = middle @ (one + h / 2 * k1)
        k3 = middle @ (one + h / 2 * k2)
        k4 = end @ (one + h * k3)
        matrices = (one + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)) @ matrices
    for matrix in matrices:
        product = matrix @ product
    return product


@dataclass(frozen=True, eq=False)
class Cycle:
    """A periodic motion in natural units.

    state (6,): a state that it passes; period; monodromy (6, 6): the matrix of small deviations
    over a period; value: of the scaled parameter; gap: distance of its ends, relative to its size;
    course: it itself; turn: what happens at it on a branch, empty for nothing: a fold, a
    period doubling, a torus (a complex pair leaves or enters the unit circle) or a grazing (the
    sequence of contact states changes).
    """

    state: np.ndarray
    period: float
    monodromy: np.ndarray
    value: float
    gap: float
    course: Course
    turn: str = ""

    @property
    def unknowns(self) -> np.ndarray:
        """(z, T, value), shape (8,)."""
        return np.concatenate([self.state, [self.period, self.value]])

    @cached_property
    def _values(self) -> np.ndarray:
        """The Floquet multipliers (6,), the one of a shift in time first, then the largest."""
        values = np.linalg.eigvals(self.monodromy)
        shift = np.argmin(np.abs(values - 1.0))
        others = np.delete(values, shift)
        return np.append(values[shift], others[np.argsort(-np.abs(others))])

    @property
    def multipliers(self) -> np.ndarray:
        """The five Floquet multipliers beside the one of a shift in time, the largest first."""
        return self._values[1:]

    @property
    def trivial(self) -> complex:
        """The multiplier of a shift in time, 1 but for errors."""
        return complex(self._values[0])

    @property
    def stable(self) -> bool | None:
        """Whether small deviations decay; None where the multipliers do not decide, which errors
        may move as they move that of a shift in time."""
        largest = abs(self.multipliers[0])
        if abs(largest - 1.0) <= 1e-6 + 10.0 * abs(self.trivial - 1.0):
            return None
        return bool(largest < 1.0)

    @cached_property
    def contacts(self) -> tuple[Any, ...]:
        """The contact states that it passes, in order, from the one with most contact on."""
        states = [state_of(on) for on in self.course.on.T]
        turns = [(*states[i:], *states[:i]) for i in range(len(states))]
        return max(turns, default=())


Point = tuple[Cycle, np.ndarray]
"""A cycle and the direction (8,) of its branch."""


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

    def _rates(self, state: np.ndarray, value: float) -> np.ndarray:
        return state_rates(self.model(value), state)

    def motion(self, state: np.ndarray, time: float, value: float, dense: bool = False) -> Course:
        """The motion from a state (6,) over some time. Raises ComputationError."""
        model = self.model(value)
        integrator = make_integrator(model, TOLERANCE, "auto")
        return whole(model, integrator, self.units, state, time, dense)

    def over(self, state: np.ndarray, period: float, value: float) -> Cycle:
        """The motion from a state over some time, as a cycle."""
        course = self.motion(state, period, value, True)
        gap = float(np.abs(course.end[:, 0] - state).max() / np.abs(state).max())
        small = deviations(self.model(value), course)
        return Cycle(state, period, small, value, gap, course)

    def solve(
        self, guess: np.ndarray, direction: np.ndarray | None = None, most: int = PASSES
    ) -> Point:
        """The cycle next to a guess (z, T, value), and the direction of its branch.

        The correction is orthogonal to `direction`, whose sense the branch's has; without one, the
        value is held. Raises ComputationError where Newton's method does not converge.
        """
        along = np.eye(8)[7] if direction is None else direction
        x = guess.copy()
        phase = self._rates(x[:6], x[7])
        phase /= np.linalg.norm(phase)
        for _ in range(most):
            cycle, J = self.over(x[:6], x[6], x[7]), np.zeros((8, 8))
            end = cycle.course.end[:, 0]
            J[:6, :6] = cycle.monodromy - np.eye(6)
            J[:6, 6] = self._rates(end, x[7])
            J[:6, 7] = (self.motion(x[:6], x[6], x[7] + STEP).end[:, 0] - end) / STEP
            J[6, :6] = phase
            J[7] = along
            closed = cycle.gap < CLOSED
            residual = [*(end - x[:6]), phase @ (x[:6] - guess[:6]), along @ (x - guess)]
            try:
                step = np.linalg.solve(J, np.eye(8)[7] if closed else residual)
            except np.linalg.LinAlgError:
                break
            if closed:
                return cycle, step / np.linalg.norm(step)
            x = x - step
            if not (x[6] > 0.0 and np.all(np.isfinite(x))):
                break
        raise ComputationError("no periodic motion was found next to the guess")

    def _tried(self, *how: Any) -> Point | None:
        try:
            return self.solve(*how)
        except ComputationError:
            return None

    def settle(
        self, state: np.ndarray, window: float, value: float, windows: int
    ) -> tuple[Cycle | None, str]:
        """The cycle to which the motion from a state settles within so many windows of time, or
        None with the reason. Raises ComputationError where the model ends."""
        rate, changes = 0.0, 0
        fastest = max(1e-6, float(np.linalg.norm(self._rates(state, value))))
        for _ in range(windows):
            course = self.motion(state, window, value)
            state, changes = course.end[:, 0], len(course.t)
            rate = float(np.linalg.norm(self._rates(state, value)))
            if not changes and rate <= RESTING * fastest:
                break
            begin, period = _return(course)
            if period:  # from between two changes, so that none falls on an end
                begin = self.motion(begin, 0.01 * period, value).end[:, 0]
                cycle, _ = self.solve(np.concatenate([begin, [period, value]]))
                return self._shortest(cycle), ""
        if changes:
            return None, "contact goes on changing and the motion does not return to itself"
        if rate <= RESTING * fastest:
            return None, RESTS
        return None, "the motion still oscillates, without a change of contact"

    def _shortest(self, cycle: Cycle) -> Cycle:
        """The cycle over its least period: a slow transient returns late, after several of them."""
        for parts in range(len(cycle.course.t), 1, -1):
            part = self.over(cycle.state, cycle.period / parts, cycle.value)
            if part.gap < RETURNED:
                return self.solve(part.unknowns)[0]
        return cycle

    def branch(
        self, own: Cycle, towards: float, ends: tuple[float, float], step: float, most: int
    ) -> tuple[list[Cycle], str]:
        """Cycles along the branch from one in the sense in which the value goes `towards` (+1 or
        -1), and why no more follow.

        Steps of at most `step` in (z, T, value), shortened where Newton's method fails; ends after
        `most` cycles, outside the values `ends`, or where it fails with a thousandth of the step.
        """
        members: list[Cycle] = []
        cycle, way = self.solve(own.unknowns)
        way *= np.sign(way[7]) * towards
        size, (low, high) = step, ends
        speed = first = self._rates(cycle.state, cycle.value)
        while len(members) < most:
            found = self._tried(cycle.unknowns + size * way, way, 6)
            if found is None or found[1] @ way <= STRAIGHT:  # may be a jump between branches
                size /= 2.0
                if size < 1e-3 * step:
                    return members, "no further cycle was found"
                continue
            after, turned = found
            rates = self._rates(after.state, after.value)
            resting = np.linalg.norm(rates) < RESTING * np.linalg.norm(first)
            beyond = rates @ speed < 0.0  # past the equilibrium the same cycles follow
            if resting or beyond:
                # a long step may come to either also from small cycles that do not shrink to it
                size /= 2.0
                if size < SHRUNK * step:
                    return members, "the cycle shrinks to the equilibrium"
                continue
            speed = rates
            met = self._turns((cycle, way), size, found)
            for k, (a, b) in enumerate(zip([cycle, *met], [*met, after], strict=True)):
                if (a.value - own.value) * (b.value - own.value) < 0.0:
                    back = any(one.turn == "fold" for one in met)  # the value turns in this step
                    again = self._between(*((a, b) if back else (cycle, after)), own.value)
                    if any(abs(one.period / own.period - 1.0) < RETURNED for one in again):
                        return members + met[:k] + again, CLOSED_CURVE
            members += [one for one in met if low <= one.value <= high]
            if not low <= after.value <= high:
                return members + self._between(cycle, after, min(max(after.value, low), high)), ""
            members.append(after)
            if not after.contacts and after.stable is None:
                return members, "without a change of contact, cycles of any amplitude follow"
            cycle, way, size = after, turned, min(1.5 * size, step)
        return members, f"{most} cycles were followed"

    def _between(self, cycle: Cycle, beyond: Cycle, value: float) -> list[Cycle]:
        """The cycle at a value between two, where there is one."""
        share = (value - cycle.value) / (beyond.value - cycle.value)
        guess = cycle.unknowns + share * (beyond.unknowns - cycle.unknowns)
        guess[7] = value
        found = self._tried(guess)
        return [found[0]] if found else []

    def _turns(self, first: Point, size: float, last: Point) -> list[Cycle]:
        """What happens within a step, in order, each located by bisection."""
        (cycle, way), met = first, list[tuple[float, Cycle]]()
        linear = not last[0].contacts and last[0].stable is None  # at one value, with any amplitude
        for kind, sign in SIGNS.items():
            low, before = 0.0, sign(*first)
            while before != sign(*last) and low < size and (kind == "grazing" or not linear):
                high, found = size, last
                for _ in range(HALVINGS):
                    middle = (low + high) / 2.0
                    one = self._tried(cycle.unknowns + middle * way, way)
                    if one is None:
                        break
                    if sign(*one) == before:
                        low = middle
                    else:
                        high, found = middle, one
                crosses = any(
                    abs(abs(m) - 1.0) < CRITICAL and m.real < 0.99 for m in found[0].multipliers
                )
                if kind in ("fold", "grazing") or crosses:  # no pair that meets elsewhere
                    met.append((high, replace(found[0], turn=kind)))
                low, before = high, sign(*found)
        return [one for _, one in sorted(met, key=lambda each: each[0])]


SIGNS: dict[str, Callable[[Cycle, np.ndarray], Any]] = {
    "fold": lambda cycle, way: way[7] > 0.0,
    "period doubling": lambda cycle, _: sum(
        m.real < -1.0 for m in cycle.multipliers if m.imag == 0.0
    ),
    "torus": lambda cycle, _: sum(abs(m) > 1.0 for m in cycle.multipliers if m.imag > 0.0),
    "grazing": lambda cycle, _: cycle.contacts,
}
"""What changes of a cycle, with the direction of its branch, at each kind of turn."""


def _return(course: Course) -> tuple[np.ndarray, float]:
    """The state (6,) from which a separation repeats and the time until then, 0 if none does."""
    lost = np.flatnonzero(course.on[course.point, np.arange(len(course.t))] == 0)
    if not lost.size:
        return course.end[:, 0], 0.0
    first, alike = lost[0], (course.on == course.on[:, lost[:1]]).all(axis=0)
    same = lost[alike[lost] & (course.point[lost] == course.point[first])]
    states, size = course.state[:, same[1 : PASSAGES + 1]], np.abs(course.state[:, same]).max()
    apart = np.abs(states - course.state[:, [first]]).max(axis=0)
    returns = same[1:][np.flatnonzero(apart < RETURNED * size)]
    return course.state[:, first], float(
        course.t[returns[0]] - course.t[first]
    ) if returns.size else 0.0
