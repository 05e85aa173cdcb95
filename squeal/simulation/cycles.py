"""Periodic motions through contact changes, by shooting, with their Floquet multipliers.

A period is a time T with phi_T(z) = z. Newton's method solves this for z, T and, along a branch of
motions, for a parameter, with the matrix of the variational equations as derivative.

The loads are continuous where the contact changes, since an edge's force starts from zero. The jump
(saltation) matrix there, I + (f_after - f_before) n' / (n' f_before) with the normal n of the
switching surface, is therefore the identity, and the variational equations run on through it.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.model.contact import State
from squeal.model.equations import PadModel, Units
from squeal.numerics.differentiation import complex_step
from squeal.simulation.hybrid import Segment, state_of, state_rates, whole_motion
from squeal.simulation.run import make_integrator

SUBSTEPS = 8  # Runge-Kutta steps of the variational equations in a step of the motion
TOLERANCE = 1e-12  # of the integration
CLOSED = 1e-9  # how far apart, relative to its size, a motion's ends may be to count as closed
PASSES = 12  # of Newton's method
PASSES_AHEAD = 6  # of Newton's method from a guess on a branch's tangent
DIFFERENCE = 1e-6  # of the scaled parameter, for the derivative by it
RETURNED = 1e-6  # relative distance of two passages that count as a return
PASSAGES = 9  # most passages in a period
STRAIGHT = 0.9  # least cosine of the angle by which a branch turns in a step
HALVINGS = 12  # of a step, to locate what happens in it
RESTING = 1e-4  # relative speed of a motion that has come to rest
SHORTEST = 1e-3  # of the greatest step of a branch: it does not pass small cycles, nor go on below
GROWTH = 1.5  # of a step after one that succeeded
CLOSED_CURVE = "the branch is closed"
RESTS = "the motion comes to rest"
AT_ONE = 0.99  # least real part of a multiplier that counts as near 1, or as right of it
UNDECIDED = 1e-6  # least distance from 1 at which the largest multiplier decides stability

PERIOD, VALUE = 6, 7  # indices of the period and of the parameter in the unknowns (z, T, value)


def transition_matrix(model: PadModel, segment: Segment) -> np.ndarray:
    """The matrix (6, 6) that takes small deviations at the begin of a motion to those at its end.

    The variational equations are Z' = A(t) Z, A the Jacobian of the rates. The classical
    Runge-Kutta method integrates them over all s steps of the motion side by side, each from Z = I.
    The matrices of the steps are then multiplied. The segment needs dense output.
    """
    steps = segment.steps
    identity = np.eye(6)
    h = steps.h[:, None, None] / SUBSTEPS
    shares = np.linspace(0.0, 1.0, 2 * SUBSTEPS + 1)  # ends and middles of the substeps
    # of each step its states at these shares, (6, shares, s)
    states = np.stack([steps.states(np.full(len(h), share)) for share in shares], axis=1)
    slopes = complex_step(lambda state: state_rates(model, state, steps.on), states)
    A = slopes.transpose(2, 3, 0, 1)  # from (6, 6, shares, s) to (shares, s, 6, 6)
    matrices = np.broadcast_to(identity, (len(h), 6, 6))
    for substep in range(SUBSTEPS):
        k1, A_middle, A_end = A[2 * substep : 2 * substep + 3]
        k2 = A_middle @ (identity + h / 2 * k1)
        k3 = A_middle @ (identity + h / 2 * k2)
        k4 = A_end @ (identity + h * k3)
        matrices = (identity + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)) @ matrices
    product = identity
    for matrix in matrices:
        product = matrix @ product
    return product


@dataclass(frozen=True, eq=False)
class Cycle:
    """A periodic motion in natural units.

    state (6,): a state that it passes; period; monodromy (6, 6): the matrix of small deviations
    over a period; value: of the scaled parameter; gap: distance of its ends, relative to its size;
    segment: the motion over the period; turn: a bifurcation or grazing that was located at it on a
    branch, empty without one: a fold, a period doubling, a torus (a complex pair of multipliers
    leaves or enters the unit circle) or a grazing (the sequence of contact states changes).
    """

    state: np.ndarray
    period: float
    monodromy: np.ndarray
    value: float
    gap: float
    segment: Segment
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
        error = abs(self.trivial - 1.0)
        if abs(largest - 1.0) <= UNDECIDED + 10.0 * error:
            return None
        return bool(largest < 1.0)

    @cached_property
    def contacts(self) -> tuple[State, ...]:
        """The contact states that it passes, in order, from the one with most contact on.

        The greatest of the cyclic orders: cycles compare, wherever they are counted from.
        """
        states = [state_of(on) for on in self.segment.contact_after_changes.T]
        orders = [(*states[i:], *states[:i]) for i in range(len(states))]
        return max(orders, default=())

    @property
    def of_any_amplitude(self) -> bool:
        """Whether the cycle is one of a family of linear vibrations at one parameter value."""
        return not self.contacts and self.stable is None


class Point(NamedTuple):
    """A cycle and the unit direction (8,) of its branch, in (z, T, value)."""

    cycle: Cycle
    direction: np.ndarray


TestValue = bool | int | tuple[State, ...]
TestFunction = Callable[[Point], TestValue]
"""A function of a cycle and the direction of its branch that changes its value at a turn."""


@dataclass(frozen=True, eq=False)
class Shooting:
    """A pad in natural units over a scaled parameter: `model_at` gives its model at a value."""

    model_at: Callable[[float], PadModel]
    units: Units

    def model(self, value: float) -> PadModel:
        """The model at a value. Raises ComputationError where there is none."""
        try:
            return self.model_at(float(value))
        except InputError as error:
            raise ComputationError(str(error)) from None

    def _rates(self, state: np.ndarray, value: float) -> np.ndarray:
        """Time derivative (6,) of a state (6,)."""
        return state_rates(self.model(value), state)

    def motion(
        self,
        state: np.ndarray,
        time: float,
        value: float,
        dense: bool = False,
        since: float = 0.0,
    ) -> Segment:
        """The motion from a state (6,) over some time. Raises ComputationError.

        value: of the scaled parameter; dense: whether the segment gives states within its steps;
        since: the time that has passed before; messages of errors add it to theirs.
        """
        model = self.model(value)
        integrator = make_integrator(model, TOLERANCE, "auto")
        return whole_motion(model, integrator, self.units, state, time, dense, since)

    def shoot(self, state: np.ndarray, period: float, value: float) -> Cycle:
        """The motion from a state over some time, as a cycle; it is one if its gap is nearly 0."""
        segment = self.motion(state, period, value, dense=True)
        distance = np.abs(segment.end[:, 0] - state).max()
        return Cycle(
            state=state,
            period=period,
            monodromy=transition_matrix(self.model(value), segment),
            value=value,
            gap=float(distance / np.abs(state).max()),
            segment=segment,
        )

    def solve(
        self, guess: np.ndarray, direction: np.ndarray | None = None, passes: int = PASSES
    ) -> Point:
        """The cycle next to a guess (8,) = (z, T, value), and the unit direction of its branch.

        Newton's method for eight equations: the ends of the motion meet (6), the state lies in a
        plane across the motion of the guess (1), which chooses one state of the cycle, and the
        whole correction is orthogonal to `direction` (8,) (1), Keller's bordering of pseudo-
        arclength. Without a direction the value is held instead; the branch's direction is then the
        one in which the value rises. Raises ComputationError where Newton's method does not
        converge.
        """
        orthogonal_to = np.eye(8)[VALUE] if direction is None else direction
        across = self._rates(guess[:6], guess[VALUE])
        across /= np.linalg.norm(across)
        x = guess.copy()
        for _ in range(passes):
            state = x[:6]
            period = x[PERIOD]
            value = x[VALUE]
            cycle = self.shoot(state, period, value)
            end = cycle.segment.end[:, 0]
            end_at_next_value = self.motion(state, period, value + DIFFERENCE).end[:, 0]
            J = np.zeros((8, 8))  # of the eight equations by the unknowns
            J[:6, :6] = cycle.monodromy - np.eye(6)
            J[:6, PERIOD] = self._rates(end, value)
            J[:6, VALUE] = (end_at_next_value - end) / DIFFERENCE
            J[6, :6] = across
            J[7] = orthogonal_to
            try:
                if cycle.gap < CLOSED:  # the distance of both ends of the motion
                    # along the branch all equations stay satisfied but the last, which rises by 1
                    tangent = np.linalg.solve(J, np.eye(8)[7])
                    return Point(cycle, tangent / np.linalg.norm(tangent))
                off_plane = across @ (state - guess[:6])
                off_direction = orthogonal_to @ (x - guess)
                residual = np.array([*(end - state), off_plane, off_direction])
                x = x - np.linalg.solve(J, residual)
            except np.linalg.LinAlgError:
                break
            if not (x[PERIOD] > 0.0 and np.all(np.isfinite(x))):
                break
        raise ComputationError("no periodic motion was found next to the guess")

    def _solve_or_none(
        self, guess: np.ndarray, direction: np.ndarray | None = None, passes: int = PASSES
    ) -> Point | None:
        """As `solve`; None where Newton's method does not converge."""
        try:
            return self.solve(guess, direction, passes)
        except ComputationError:
            return None

    def settle(
        self, state: np.ndarray, window: float, value: float, windows: int
    ) -> tuple[Cycle | None, str]:
        """The cycle to which the motion from a state settles.

        Parameters
        ----------
        state : array (6,)
            Where it starts.
        window : float
            Time after which the motion is examined for a return, again and again.
        value : float
            Of the scaled parameter.
        windows : int
            How many windows at most.

        Returns
        -------
        cycle : Cycle or None
            None where the motion settles to none.
        reason : str
            Why there is none, else empty.

        Raises
        ------
        ComputationError
            Where the model ends, or where no cycle is found next to a motion that returns.
        """
        start = state
        speed = 0.0
        changes = 0
        # a motion that starts nearly at rest is measured by 1e-6, not by its rounding
        resting = RESTING * max(1e-6, float(np.linalg.norm(self._rates(state, value))))
        for passed in range(windows):
            segment = self.motion(start, window, value, since=passed * window)
            start = segment.end[:, 0]
            changes = len(segment.changes.t)
            speed = float(np.linalg.norm(self._rates(start, value)))
            if not changes and speed <= resting:
                break
            first_return = _first_return(segment)
            if first_return is not None:
                at_change, period = first_return
                # start between two changes of contact, so that none falls on an end of the period
                between = self.motion(at_change, 0.01 * period, value).end[:, 0]
                # the second result of `solve`, the direction of the branch, is not needed
                cycle, _ = self.solve(np.concatenate([between, [period, value]]))
                return self._shortest(cycle), ""
        # `changes` and `speed` are those of the last window
        if changes:
            return None, "contact goes on changing and the motion does not return to itself"
        if speed <= resting:
            return None, RESTS
        return None, "the motion still oscillates, without a change of contact"

    def _shortest(self, cycle: Cycle) -> Cycle:
        """The cycle over its least period: while a transient decays, a motion may first return to
        itself after several periods."""
        most_parts = len(cycle.segment.changes.t)  # each period holds a change of contact
        for parts in range(most_parts, 1, -1):
            part = self.shoot(cycle.state, cycle.period / parts, cycle.value)
            if part.gap < RETURNED:
                return self.solve(part.unknowns).cycle
        return cycle

    def branch(
        self,
        first: Cycle,
        towards: float,
        ends: tuple[float, float],
        longest_step: float,
        most: int,
    ) -> tuple[list[Cycle], str]:
        """The branch of cycles from a first one, by pseudo-arclength continuation.

        Parameters
        ----------
        first : Cycle
            Where it begins; it is among the cycles returned only at the end of a closed branch.
        towards : float
            Sense in which the value goes at first, +1 or -1.
        ends : (float, float)
            Values at which the branch ends.
        longest_step : float
            In (z, T, value). A step is halved where Newton's method fails, down to a thousandth.
        most : int
            Number of cycles after which it ends.

        Returns
        -------
        cycles : list of Cycle
            In order along the branch, located turns among them.
        reason : str
            Why no more follow; empty where the value leaves `ends`.
        """
        low, high = ends
        members: list[Cycle] = []
        start = self.solve(first.unknowns)
        # of the two directions of the branch the one in which the value goes `towards`
        sense = np.sign(start.direction[VALUE]) * towards
        present = Point(start.cycle, sense * start.direction)
        step = longest_step
        # below these rates (their norm) a cycle is the equilibrium, see `_shrinks`
        resting = RESTING * float(np.linalg.norm(self._rates(start.cycle.state, start.cycle.value)))
        while len(members) < most:
            guess = present.cycle.unknowns + step * present.direction
            following = self._solve_or_none(guess, present.direction, PASSES_AHEAD)
            if following is None or following.direction @ present.direction <= STRAIGHT:
                # a branch that seems to turn sharply has been left for another one
                refusal = "no further cycle was found"
            elif self._shrinks(present.cycle, following.cycle, resting):
                refusal = "the cycle shrinks to the equilibrium"
            else:
                refusal = ""
            if following is None or refusal:
                step /= 2.0
                if step < SHORTEST * longest_step:
                    return members, refusal
                continue
            after = following.cycle
            turns = self._turns_within(present, step, following)
            closing = self._closing(first, present.cycle, turns, after)
            if closing is not None:
                return members + closing, CLOSED_CURVE
            members += [cycle for cycle in turns if low <= cycle.value <= high]
            if not low <= after.value <= high:
                end = min(max(after.value, low), high)
                return members + self._between(present.cycle, after, end), ""
            members.append(after)
            if after.of_any_amplitude:
                return members, "without a change of contact, cycles of any amplitude follow"
            present = following
            step = min(GROWTH * step, longest_step)
        return members, f"{most} cycles were followed"

    def _shrinks(self, before: Cycle, after: Cycle, resting: float) -> bool:
        """Whether a step leads to the equilibrium or past it.

        At the equilibrium rates are below `resting`; past it the same cycles follow in the opposite
        phase. A long step may also jump over the equilibrium from a small cycle of a branch that
        does not end there, so that `branch` tries shorter steps before it believes this.
        """
        rates = self._rates(after.state, after.value)
        is_past = rates @ self._rates(before.state, before.value) < 0.0
        return bool(is_past or np.linalg.norm(rates) < resting)

    def _closing(
        self, first: Cycle, before: Cycle, turns: list[Cycle], after: Cycle
    ) -> list[Cycle] | None:
        """The last cycles of a branch that comes back to its first one within a step: the turns up
        to there, then the first cycle again. None where the step does not pass it.

        before, turns, after: the cycles of the step in order.
        """
        has_fold = any(cycle.turn == "fold" for cycle in turns)
        for turns_before, (a, b) in enumerate(itertools.pairwise([before, *turns, after])):
            if (a.value - first.value) * (b.value - first.value) < 0.0:
                # interpolate between cycles whose values enclose that of the first one: without a
                # fold the value is monotone over the step, so that its well-separated ends do
                enclosing = (a, b) if has_fold else (before, after)
                at_first_value = self._between(*enclosing, first.value)  # one cycle, or none
                for cycle in at_first_value:
                    if abs(cycle.period / first.period - 1.0) < RETURNED:
                        return turns[:turns_before] + at_first_value
        return None

    def _between(self, cycle: Cycle, beyond: Cycle, value: float) -> list[Cycle]:
        """The cycle at a value between those of two cycles, in a list; none where Newton's method
        does not converge."""
        share = (value - cycle.value) / (beyond.value - cycle.value)
        guess = cycle.unknowns + share * (beyond.unknowns - cycle.unknowns)
        guess[VALUE] = value
        point = self._solve_or_none(guess)
        return [] if point is None else [point.cycle]

    def _turns_within(self, first: Point, step: float, last: Point) -> list[Cycle]:
        """The cycles within a step of the branch at which it folds, grazes or changes stability.

        They stand in their order along the step, each located by bisection of a test function
        between the ends of the step.
        """
        located: list[tuple[float, Cycle]] = []  # distances along the step, and cycles
        for kind, test in TEST_FUNCTIONS.items():
            # a family of vibrations at one value of the parameter neither folds nor changes
            # stability
            if last.cycle.of_any_amplitude and kind != "grazing":
                continue
            low = 0.0  # distance along the step up to which changes are located
            at_low = first
            at_end = test(last)
            # the value may change several times: each pass goes on behind the last change
            while test(at_low) != at_end and low < step:
                low, before, at_low = self._first_change(first, test, low, at_low, (step, last))
                # outside the unit circle a complex pair may meet on the real axis and go on as two
                # real multipliers: this changes the counts of both, but none crosses the circle
                crosses = _count_outside(before.cycle) != _count_outside(at_low.cycle)
                if kind in ("fold", "grazing") or crosses:
                    located.append((low, replace(at_low.cycle, turn=kind)))
        located.sort(key=itemgetter(0))
        return [cycle for _, cycle in located]

    def _first_change(
        self,
        first: Point,
        test: TestFunction,
        low: float,
        at_low: Point,
        end: tuple[float, Point],
    ) -> tuple[float, Point, Point]:
        """Where a test function changes on a step after `low`, by bisection for the first change.

        Distances are those along the step from its `first` point; `at_low` is the point at `low`,
        and `end` the distance and the point of the end, at which the test's value differs. Returns
        the distance just after the change, and the points just before and after it.
        """
        high, at_high = end
        unchanged = test(at_low)
        for _ in range(HALVINGS):
            middle = (low + high) / 2.0
            guess = first.cycle.unknowns + middle * first.direction
            point = self._solve_or_none(guess, first.direction)
            if point is None:
                break
            if test(point) == unchanged:  # a change and its return before the middle are not seen
                low = middle
                at_low = point
            else:
                high = middle
                at_high = point
        return high, at_low, at_high


def _count_outside(cycle: Cycle) -> int:
    """How many multipliers lie outside the unit circle; those near 1 and right of it are left out.

    Only a multiplier that crosses the circle, through -1 or as one of a pair, changes the count.
    """
    return sum(abs(m) > 1.0 and m.real < AT_ONE for m in cycle.multipliers)


# The test functions


def _value_rises(point: Point) -> bool:
    return bool(point.direction[VALUE] > 0.0)


def _real_multipliers_below_minus_one(point: Point) -> int:
    return sum(m.real < -1.0 for m in point.cycle.multipliers if m.imag == 0.0)


def _pairs_outside_the_unit_circle(point: Point) -> int:
    return sum(abs(m) > 1.0 for m in point.cycle.multipliers if m.imag > 0.0)


def _contact_states(point: Point) -> tuple[State, ...]:
    return point.cycle.contacts


TEST_FUNCTIONS: dict[str, TestFunction] = {
    "fold": _value_rises,
    "period doubling": _real_multipliers_below_minus_one,
    "torus": _pairs_outside_the_unit_circle,
    "grazing": _contact_states,
}
"""What changes its value at each kind of turn."""


def _first_return(segment: Segment) -> tuple[np.ndarray, float] | None:
    """The state (6,) at the first separation of a segment of one motion, and the time until the
    motion separates in the same state again.

    The first separation is compared with the next `PASSAGES` separations of the same point into the
    same contact state; None where the motion returns at none of them.
    """
    _, point, t, state = segment.changes
    contact = segment.contact_after_changes
    # changes after which the point that has changed does not touch
    separations = np.flatnonzero(contact[point, np.arange(len(t))] == 0)
    if not separations.size:
        return None
    first = separations[0]
    same_contact = (contact == contact[:, [first]]).all(axis=0)
    same_point = point == point[first]
    # with the first separation itself
    passages = separations[(same_contact & same_point)[separations]]
    start = state[:, first]
    later = passages[1 : PASSAGES + 1]
    size = np.abs(state[:, passages]).max()
    distances = np.abs(state[:, later] - start[:, None]).max(axis=0)
    returns = later[distances < RETURNED * size]
    if not returns.size:
        return None
    return start, float(t[returns[0]] - t[first])
