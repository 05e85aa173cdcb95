"""Periodic motions of `_damped_contact` and their boundaries in two parameters.

A periodic motion is X = (z, T, ln a, ln zeta, mu): a state (6,), a period and the parameters, with
phi_T(z) = z and a phase condition. The variational equations give all derivatives of phi. With one
parameter free, motions form a branch; with two, and one more condition (a fold, a period doubling,
a grazing), a boundary. Both are followed by pseudo-arclength.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from squeal.article.studies._damped_contact import Arc, DampedContact, Flow, flow
from squeal.errors import ComputationError

PERIOD = 6
LOG_A = 7
LOG_ZETA = 8
MU = 9
"""Indices into X after the state."""
SIZE = 10  # of X
CLOSED = 1e-10  # residual at which a motion counts as closed
CONVERGED = 1e-11  # step of Newton's method that changes nothing
TOO_LONG = 3.0  # step of Newton's method that leaves the neighbourhood of the guess
PASSES = 10  # of Newton's method
DIFFERENCE = 1e-6  # for the gradient of a condition
CLEAR = 1e-8  # static compressions between a grazing edge and the surface
REAL = 1e-6  # imaginary part up to which a multiplier counts as real
STRAIGHT = 0.9  # least cosine between the tangents at both ends of a step along a branch
# steps along a branch, lengths in the space of X
FIRST_STEP = 0.05
LONGEST_STEP = 0.4
SHORTEST_STEP = 1e-3


@dataclass(frozen=True, eq=False)
class Cycle:
    """A periodic motion: X (10,), its pad and the motion over the period."""

    x: np.ndarray
    pad: DampedContact
    arc: Arc

    @property
    def state(self) -> np.ndarray:
        """The state (6,) from which the period counts."""
        return self.x[:6]

    @property
    def monodromy(self) -> np.ndarray:
        """The matrix (6, 6) of small deviations over a period."""
        return self.arc.matrix[:, :6]

    @cached_property
    def multipliers(self) -> np.ndarray:
        """The five Floquet multipliers beside that of a shift in time, the largest first."""
        values = np.linalg.eigvals(self.monodromy)
        others = np.delete(values, np.argmin(np.abs(values - 1.0)))
        return np.asarray(others[np.argsort(-np.abs(others))])

    @property
    def stable(self) -> bool:
        """Small deviations decay."""
        return bool(np.abs(self.multipliers[0]) < 1.0)

    @property
    def period(self) -> float:
        """In s."""
        return float(self.x[PERIOD]) * self.pad.time

    @cached_property
    def contacts(self) -> str:
        """The contact changes in order, from the first separation of the leading edge: L, T for a
        separation of the leading and the trailing edge, l, t for its touch."""
        letters = "".join("LlTt"[2 * p.edge + p.touches] for p in self.arc.passages)
        rotations = [letters[i:] + letters[:i] for i in range(len(letters))]
        return min(rotations, default="")  # capitals come first in the alphabet, L before T


Condition = Callable[[np.ndarray], float]
"""A function of X that vanishes on a boundary."""


def direction_of(index: int, sign: float) -> np.ndarray:
    """The direction (10,) in which one entry of X rises (1) or falls (-1)."""
    direction = np.zeros(SIZE)
    direction[index] = sign
    return direction


@dataclass(frozen=True, eq=False)
class Cycles:
    """Periodic motions of one pad (its scene) over its parameters."""

    pad: DampedContact

    @cached_property
    def flow(self) -> Flow:
        """The compiled integrator."""
        return flow(self.pad.law)

    def start(self, state: np.ndarray, period: float, pad: DampedContact) -> np.ndarray:
        """X of a guess."""
        return np.array([*state, period, np.log(pad.a), np.log(pad.zeta), pad.mu])

    def pad_at(self, x: np.ndarray) -> DampedContact:
        """The pad with the parameters of X."""
        return self.pad.replace(
            a=float(np.exp(x[LOG_A])), zeta=float(np.exp(x[LOG_ZETA])), mu=float(x[MU])
        )

    def over(self, x: np.ndarray) -> Cycle:
        """The motion of X over its period."""
        pad = self.pad_at(x)
        return Cycle(x, pad, self.flow.run(pad, x[:6], float(x[PERIOD])))

    def closure(self, cycle: Cycle) -> tuple[np.ndarray, np.ndarray]:
        """phi_T(z) - z (6,) and its derivative (6, 10) by X = (z, T, ln a, ln zeta, mu)."""
        arc = cycle.arc
        pad = cycle.pad
        jacobian = np.empty((6, 10))
        jacobian[:, :6] = arc.matrix[:, :6] - np.eye(6)
        jacobian[:, PERIOD] = pad.rates(arc.end)
        # by the logarithm: d/d(ln a) = a d/da, with a (`size`) in the units of the motion
        jacobian[:, LOG_A] = arc.matrix[:, 6] * pad.size
        jacobian[:, LOG_ZETA] = arc.matrix[:, 7] * pad.zeta
        jacobian[:, MU] = arc.matrix[:, 8]
        return arc.end - cycle.state, jacobian

    def solve(
        self,
        guess: np.ndarray,
        free: Sequence[int] = (),
        conditions: Sequence[Condition] = (),
        tangent: np.ndarray | None = None,
        anchored: bool = False,
    ) -> tuple[Cycle, np.ndarray]:
        """The periodic motion next to a guess X, and the tangent (10,) of its branch.

        By Newton's method, with as many equations as unknowns, bordered by that of pseudo-arclength
        (Keller) where a tangent is given. The tangent returned is zero where none is given.

        Parameters
        ----------
        free : indices of the parameters that may change
        conditions : further functions of X that vanish
        tangent : the correction is orthogonal to it, where one parameter more is free than
            conditions are given
        anchored : the conditions say where on the motion the state lies; otherwise the correction
            of the state is orthogonal to the motion

        Raises
        ------
        ComputationError
            where Newton's method does not converge
        """
        columns = [*range(7), *free]  # of X that change: state, period and the free parameters
        x = guess.copy()
        # the phase condition: the correction of the state is orthogonal to the flow at the guess
        phase = np.zeros(SIZE)
        phase[:6] = self.pad_at(x).rates(x[:6])
        phase /= np.linalg.norm(phase)
        for _ in range(PASSES):
            cycle = self.over(x)
            closure, jacobian = self.closure(cycle)  # (6,) and (6, 10)
            # an equation a row: closure, phase condition, conditions, pseudo-arclength
            rows = [*jacobian]
            residual = [*closure]
            if not anchored:
                rows.append(phase)
                residual.append(phase @ (x - guess))
            for condition in conditions:
                value, slope = self._gradient(condition, x, columns)
                rows.append(slope)
                residual.append(value)
            if tangent is not None:
                rows.append(tangent)
                residual.append(tangent @ (x - guess))
            matrix = np.array(rows)[:, columns]
            try:
                step = np.linalg.solve(matrix, residual)
            except np.linalg.LinAlgError:
                break
            if np.abs(residual).max() < CLOSED or np.abs(step).max() < CONVERGED:
                new_tangent = np.zeros(SIZE)
                if tangent is not None:
                    # along it all equations stay satisfied but that of the tangent, the last one
                    unit = np.zeros(len(columns))
                    unit[-1] = 1.0
                    new_tangent[columns] = np.linalg.solve(matrix, unit)
                    new_tangent /= np.linalg.norm(new_tangent)
                return cycle, new_tangent
            if np.abs(step).max() > TOO_LONG or not np.isfinite(step).all():
                break
            x = x.copy()
            x[columns] -= step
            if not x[PERIOD] > 0.0:
                break
        raise ComputationError("no periodic motion was found next to the guess")

    def _gradient(
        self, condition: Condition, x: np.ndarray, columns: Sequence[int]
    ) -> tuple[float, np.ndarray]:
        """A condition at X and its derivative (10,), by differences in the `columns` alone."""
        value = condition(x)
        slope = np.zeros(SIZE)
        for i in columns:
            moved = x.copy()
            moved[i] += DIFFERENCE
            slope[i] = (condition(moved) - value) / DIFFERENCE
        return value, slope

    def bordered(self, sign: float) -> Condition:
        """A condition that vanishes where a multiplier is `sign` (1: a fold, -1: a period
        doubling), whatever the others are.

        Such a multiplier makes A = monodromy - sign I singular; for a fold the flow direction f
        borders A besides, since a shift in time has the multiplier 1 anyway. With borders b, c near
        the null vectors, g of

            [A b; c' 0] [v; g] = [0; 1]

        vanishes where A is singular, since by Cramer's rule it is det A over that of the whole
        matrix (Griewank and Reddien's test function). b and c are fixed at the first motion for
        which g is computed.
        """
        borders: list[np.ndarray] = []

        def singular_at_zero(x: np.ndarray) -> float:
            """The number g at X (10,): the last unknown of the equations of `bordered`."""
            cycle = self.over(x)
            if sign > 0.0:
                # bordered by the flow, whose direction has the multiplier 1 of a shift in time
                flow_direction = cycle.pad.rates(x[:6])
                matrix = np.zeros((7, 7))
                matrix[:6, :6] = cycle.monodromy - np.eye(6)
                matrix[:6, 6] = flow_direction
                matrix[6, :6] = flow_direction
            else:
                matrix = cycle.monodromy + np.eye(6)
            n = len(matrix)
            if not borders:  # at the first motion for which g is computed
                # singular vectors of the least singular value, the last one
                left, _, right = np.linalg.svd(matrix)
                borders.extend((left[:, -1], right[-1]))
            b, c = borders
            bordered = np.zeros((n + 1, n + 1))
            bordered[:n, :n] = matrix
            bordered[:n, n] = b
            bordered[n, :n] = c
            right_side = np.eye(n + 1)[n]
            return float(np.linalg.solve(bordered, right_side)[n])

        return singular_at_zero

    def unit_pair(self, x: np.ndarray) -> float:
        """A condition that vanishes where a complex pair of multipliers meets the unit circle."""
        multipliers = self.over(x).multipliers
        complex_ones = multipliers[np.abs(multipliers.imag) > REAL]
        if not complex_ones.size:
            raise ComputationError("no complex pair of multipliers")
        return float(np.abs(complex_ones).max()) - 1.0

    def grazing(self, edge: int, touches: bool) -> tuple[Condition, Condition]:
        """Conditions of a grazing at the start of a cycle: the gap of an edge is all but zero, and
        its rate is zero.

        touches : whether the edge touches before and after; the gap stays on that side, `CLEAR`
            away from zero
        """
        offset = -CLEAR if touches else CLEAR

        def gap(x: np.ndarray) -> float:
            return float(self.pad_at(x).at(x[:6]).gaps[edge]) - offset

        def rate(x: np.ndarray) -> float:
            return float(self.pad_at(x).gap_rates(x[:6])[edge])

        return gap, rate

    def branch(
        self,
        x: np.ndarray,
        free: Sequence[int],
        direction: np.ndarray,
        conditions: Callable[[], Sequence[Condition]] = tuple,
        anchored: bool = False,
    ) -> Iterator[Cycle]:
        """Motions along a branch from a converged X; it ends where no step succeeds.

        Pseudo-arclength continuation: a step along the tangent, then Newton's method orthogonal to
        it.

        Parameters
        ----------
        x : array (10,)
            The converged X, which is not among the motions.
        free : indices of the parameters that change along the branch
        direction : array (10,)
            Roughly that of the branch from X on; which of its two senses is taken.
        conditions : callable
            Further functions of X that vanish, none if left out. They are made anew at each motion,
            so that their borders fit.
        anchored : the conditions say where on the motion the state lies, see `solve`

        Raises
        ------
        ComputationError
            where Newton's method does not converge at X itself
        """
        tangent = direction / np.linalg.norm(direction)
        # the tangent returned has the sense of the given one: the last equation of `solve` makes
        # their product positive
        _, tangent = self.solve(x, free, conditions(), tangent, anchored)
        step = FIRST_STEP
        while step > SHORTEST_STEP:  # the length of the step, halved until it succeeds
            try:
                guess = x + step * tangent
                cycle, following = self.solve(guess, free, conditions(), tangent, anchored)
            except ComputationError:
                step /= 2.0
                continue
            if following @ tangent < STRAIGHT:  # the branch bends too much over the step
                step /= 2.0
                continue
            yield cycle
            x = cycle.x
            tangent = following
            step = min(1.4 * step, LONGEST_STEP)  # after a success the next one is longer
