"""One equilibrium of a pad, enclosed at its friction, and the matrices about it as balls.

Where a pad presses lightly on a stiff surface its penetration is a small difference of two
positions, and near a fold its position depends on the last digits of the friction: doubles resolve
neither. Newton's method with twice their digits finds the equilibrium, Krawczyk's operator (see
`cells`) proves it, and K follows over the whole box around it. Needs python-flint.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from squeal.model.contact import State
from squeal.model.equations import PadModel
from squeal.model.pad import pose_of
from squeal.proof.balls import Ball, Balls, in_doubles
from squeal.proof.jets import Functions, Jet
from squeal.proof.loads import BITS, FRICTION, Balance, factors_of

try:
    import flint
except ImportError:  # an extra
    flint = None

Matrix = Any
"""A `flint.arb_mat`."""
NEWTON_STEPS = 12
"""Steps of Newton's method at most; from the digits of doubles three or four suffice."""
FAR_SHARE = 1e-3
"""An equilibrium farther from the given one, as a share of the largest coordinate, is another."""
MOST_BOXES = 4
"""How many boxes, each wider than the last, are tried."""


class EnclosedEquilibrium(NamedTuple):
    """An equilibrium q = (x, y, theta), SI units, that exists in its contact state and is unique
    nearby; its normal reaction; K and C (3, 3) about it, C of falling friction alone."""

    q: tuple[float, float, float]
    state: State
    R_n: float
    K: Balls
    C: Balls


def enclosed_equilibrium(model: PadModel, q: ArrayLike, state: State) -> EnclosedEquilibrium | None:
    """The equilibrium near an approximate one at the model's friction; None if none is proved.

    Where the gaps of the equilibrium of one contact state belong to another state, the equilibrium
    of that other state is tried. Of the two equilibria near a fold the one is taken whose det K has
    the sign of that at q. A linear model is taken about the origin, whatever acts there.

    Parameters
    ----------
    model : PadModel
        The pad, its friction a double.
    q : array_like (3,)
        Approximately x, y (m) and theta (rad).
    state : State
        The contact state there, which may be wrong where a gap is next to nothing.

    Raises
    ------
    ImportError
        Without python-flint.
    """
    neighbourhood = _Neighbourhood(model, np.asarray(q, float))
    with flint.ctx.workprec(BITS):
        if model.linear:
            return neighbourhood.linearised([flint.arb(0)] * 3, model.full)
        tried: set[State] = set()
        while state not in tried:
            tried.add(state)
            try:
                box = neighbourhood.box(state)
            except (ArithmeticError, ValueError):  # a singular matrix, or a pole of the law
                return None
            if box is None:
                return None
            gaps = [flint.arb(gap) for gap in neighbourhood.balance.gaps(box)]
            if any(gap.contains(0) for gap in gaps):
                return None
            state_of_gaps = State(*(bool(gap < 0) for gap in gaps))
            if state_of_gaps == state:
                return neighbourhood.linearised(box, state)
            state = state_of_gaps
        return None


class _Neighbourhood:
    """The equilibria of a pad at its friction around an approximate one q (3,), in balls."""

    def __init__(self, model: PadModel, q: np.ndarray) -> None:
        self.balance = Balance(model)
        self.approximate = q
        lever = np.array([1.0, 1.0, float(model.pad.w)])  # makes theta a length
        self.sizes = np.max(np.abs(q) * lever) / lever
        """What counts as a large x, y (m) and theta (rad): the largest of the three as a length."""

    def loads(self, q: Sequence[Ball], state: State) -> list[Jet]:
        """Loads (3) with their slopes by x, y, theta and mu."""
        return self.balance.jets([*q, self.balance.c.mu], state)

    def _computed(self, state: State) -> list[Ball] | None:
        """The equilibrium (3) of a contact state by Newton's method, as balls without radius.

        None if it lies far from the approximate one, or if det K has another sign there, as beyond
        a fold.
        """
        q = [flint.arb(v) for v in self.approximate.tolist()]
        first_det = _slopes(self.loads(q, state)).det()
        for _ in range(NEWTON_STEPS):
            loads = self.loads(q, state)
            slopes = _slopes(loads).mid()
            step = slopes.solve(flint.arb_mat(3, 1, [flint.arb(f.value).mid() for f in loads]))
            q = [(u - step[i, 0]).mid() for i, u in enumerate(q)]
            # until the steps are rounding: 256 units in the last of `BITS`
            if all(abs(step[i, 0]) <= 2.0 ** (8 - BITS) * self.sizes[i] for i in range(3)):
                break
        if any(abs(q[i] - self.approximate[i]) > FAR_SHARE * self.sizes[i] for i in range(3)):
            return None
        if not _slopes(self.loads(q, state)).mid().det() * first_det > 0:
            return None
        return q

    def box(self, state: State) -> list[Ball] | None:
        """Balls (3) that hold exactly one equilibrium of a contact state; None if none is found.

        The box around a computed equilibrium is widened until Krawczyk's operator maps it into
        itself: deviations e from its middle to -Y F + (1 - Y J) e, J the slopes of the loads F
        over the box and Y about their inverse.
        """
        middle = self._computed(state)
        if middle is None:
            return None
        loads = self.loads(middle, state)  # F at the middle, with slopes
        Y = _slopes(loads).mid().inv().mid()
        # Y F, a Newton step, which is about rounding at the middle
        shift = Y * flint.arb_mat(3, 1, [flint.arb(f.value) for f in loads])
        one = flint.arb_mat(3, 3, [int(i == j) for i in range(3) for j in range(3)])
        radii = [2 * abs(shift[i, 0]).upper() + 2.0**-BITS * self.sizes[i] for i in range(3)]
        for _ in range(MOST_BOXES):
            contraction = one - Y * _slopes(self.loads(_box(middle, radii), state))
            image = []
            for i in range(3):
                moved = sum((abs(contraction[i, j]) * radii[j] for j in range(3)), flint.arb(0))
                image.append((abs(shift[i, 0]) + moved).upper())
            if all(new < old for new, old in zip(image, radii, strict=True)):
                return _box(middle, image)
            radii = [4 * r for r in radii]
        return None

    def linearised(self, box: Sequence[Ball], state: State) -> EnclosedEquilibrium:
        """The equilibrium in a box, and balls of the matrices about all displacements in the box.

        Friction that falls with the speed of sliding, mu (1 + b (exp(r x') - 1)) as in `Pad.fall`,
        makes the first column of C: -dF/dx' = -(dF/dmu) mu b r at x' = 0, F the loads.
        """
        loads = self.loads(box, state)
        slopes = _slopes(loads)
        C = flint.arb_mat(3, 3)
        coefficients = self.balance.c
        if self.balance.fall is not None:
            share, rate = self.balance.fall  # b and r of the docstring
            for i, load in enumerate(loads):
                C[i, 0] = -flint.arb(load.slopes[FRICTION]) * coefficients.mu * share * rate
        pose = pose_of(Functions, tuple(box))
        R_n, _ = self.balance.model.law.normal(coefficients, pose, factors_of(state))
        x, y, theta = (float(ball.mid()) for ball in box)
        reaction = float(flint.arb(R_n).mid())
        K = in_doubles((-slopes).tolist())  # K = -dF/dq
        return EnclosedEquilibrium((x, y, theta), state, reaction, K, in_doubles(C.tolist()))


def _box(middles: Sequence[Ball], radii: Sequence[Ball]) -> list[Ball]:
    """Balls with some middles and radii."""
    return [u + flint.arb(0, r) for u, r in zip(middles, radii, strict=True)]


def _slopes(loads: Sequence[Jet]) -> Matrix:
    """The slopes (3, 3) of loads by x, y and theta, as a matrix of balls."""
    return flint.arb_mat([[flint.arb(s) for s in load.slopes[:FRICTION]] for load in loads])
