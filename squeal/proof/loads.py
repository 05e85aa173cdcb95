"""Loads and gaps of a pad with their slopes, over balls and series, and in doubles.

The unknowns of its sliding equilibria are x, y, theta and the friction mu: three loads vanish,
F(u) = 0 of u = (x, y, theta, mu). Needs python-flint.
"""

from collections.abc import Sequence
from copy import copy
from typing import Any

import numpy as np

from squeal.model.contact import State
from squeal.model.equations import PadModel, net_loads
from squeal.model.pad import Coefficients, coefficients, pose_of
from squeal.proof.balls import Floats
from squeal.proof.jets import Doubles, Functions, Jet

try:
    import flint
except ImportError:  # an extra
    flint = None

UNIT_SLOPES = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
"""Slopes of the unknowns x, y, theta and mu by themselves."""
FRICTION = 3
"""The index of mu among the unknowns x, y, theta, mu."""
BITS = 106
"""Precision of the arithmetic: twice that of a double, so that thresholds are known to all its
digits."""


class Balance:
    """The balance of a pad: its loads and gaps from balls, series or jets of x, y, theta and mu.

    Raises ImportError without python-flint.
    """

    def __init__(self, model: PadModel) -> None:
        if flint is None:
            raise ImportError("pads need python-flint", name="flint")
        self.model = model
        with flint.ctx.workprec(BITS):
            pad = copy(model.pad)
            for name, value in model.pad.given().items():
                vars(pad)[name] = flint.arb(float(value))  # exact
            self.fall = pad.fall
            """The friction that falls with the sliding speed, as `Pad.fall`."""
            # the surface lies at the distance of the absolute gap or not, by the contact law
            self.c: Coefficients = coefficients(Functions, pad, model.law.absolute_gap)

    def gaps(self, unknowns: Sequence[Any]) -> Sequence[Any]:
        """The gaps of the contact points."""
        return self.model.law.gaps(self.c, pose_of(Functions, tuple(unknowns[:FRICTION])))

    def loads(self, unknowns: Sequence[Any], state: State) -> tuple[Any, ...]:
        """Loads (3), two forces and a moment, in one contact state."""
        c = self.c._replace(mu=unknowns[FRICTION])
        return net_loads(
            Functions, c, self.model.law, tuple(unknowns[:FRICTION]), factors_of(state)
        )

    def jets(self, unknowns: Sequence[Any], state: State) -> list[Jet]:
        """Loads (3) in one contact state with their slopes by the unknowns."""
        jets = [Jet(u, unit) for u, unit in zip(unknowns, UNIT_SLOPES, strict=True)]
        return [Jet.of(load) for load in self.loads(jets, state)]

    def loads_and_slopes(self, point: Floats, state: State) -> tuple[Floats, Floats] | None:
        """Loads F (3,), two forces and a moment, and their slopes J (3, 4) by x, y, theta and mu.

        point (4,): x, y, theta and mu. In doubles, for Newton's method and tangents, which prove
        nothing. The gaps do not matter: the contact state is the argument. None where a load is not
        finite.
        """
        unknowns = [Jet(v, unit) for v, unit in zip(point.tolist(), UNIT_SLOPES, strict=True)]
        touches = factors_of(state)
        c = self.model.c._replace(mu=unknowns[FRICTION])  # doubles; `self.c` has the same as balls
        try:
            loads = net_loads(Doubles, c, self.model.law, tuple(unknowns[:FRICTION]), touches)
        except (ArithmeticError, ValueError):  # a pole, or a root of a negative number
            return None
        jets = [Jet.of(load) for load in loads]  # a load that no unknown moves is a plain number
        F = np.array([jet.value for jet in jets], dtype=float)
        J = np.array([jet.slopes for jet in jets], dtype=float)
        if not (np.isfinite(F).all() and np.isfinite(J).all()):
            return None
        return F, J


def factors_of(state: State) -> tuple[int, ...]:
    """1 of each contact point that touches, 0 of the others: factors of their forces."""
    return tuple(int(touches) for touches in state)


def other_unknowns(unknown: int) -> list[int]:
    """The indices of the three other unknowns."""
    return [i for i in range(4) if i != unknown]
