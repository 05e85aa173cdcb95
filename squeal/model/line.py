"""Line contact: distributed stiffness along the lower face (model B2, Eqs. 8-20).

Everything rests on the gaps of the two lower edges, never on the contact-loss point of Eq. (12),
which is singular for a level pad.
"""

from dataclasses import dataclass
from typing import ClassVar, Literal

from squeal.model.law import FACE_STATES, NORMAL_REACTION, Touching, face_state
from squeal.model.mechanics import Coefficients, Forces, Loads, Number, Point, Pose, edges, gaps

LineForce = Literal["integral", "mean"]
DeltaFrom = Literal["centre", "frame"]
DeltaMoment = Literal["+", "-"]


def _partial(
    c: Coefficients, gl: Number, gt: Number, on: Touching
) -> tuple[Number, Number, Number]:
    """Partial contact; zeros, without 0/0, where both edges touch or none.

    Penetration of the edge that touches, contact length over 2 w, and the centroid of the pressure
    from the middle of the lower face.
    """
    leading, trailing = on
    side = trailing - leading  # 1 on the trailing edge alone, -1 on the leading edge alone
    one = side * side
    p = -one * (leading * gl + trailing * gt)
    part = p / (side * (gl - gt) + (1.0 - one))
    return p, part, side * c.w * (1.0 - part * (2.0 / 3.0))


@dataclass(frozen=True)
class LineContact:
    """Distributed stiffness along the lower face.

    With pl, pt the penetrations of the leading and trailing edge, the pressure varies linearly
    between them. In full contact both line-force laws give Rn = k_c (pl + pt)/2. In partial
    contact, p being the penetration of the touching edge, the contact length over 2w is
    p/|pl - pt|, and the integral law weighs Rn = k_c p/2 (the printed mean) with it.

    The choices are those of `squeal.model.contact.Formulation`.
    """

    line_force: LineForce = "integral"
    delta_from: DeltaFrom = "centre"
    delta_moment: DeltaMoment = "+"

    parameters: ClassVar = ("k_c",)
    absolute_gap: ClassVar = True
    points: ClassVar = 2
    plotted: ClassVar = NORMAL_REACTION
    meanings: ClassVar = FACE_STATES
    state_name = staticmethod(face_state)
    gaps = staticmethod(gaps)

    @property
    def restoring(self) -> bool:
        """False with the sign of Eq. (21), which turns the pad ever further."""
        return self.delta_moment == "+"

    def _reaction(self, c: Coefficients, at: Pose, on: Touching) -> tuple[Point, Point, Number]:
        """Partial and full contact, one of which is zero, and the centroid of the partial one.

        Each is Rn with its moment about the middle of the lower face.
        """
        gl, gt = gaps(c, at)
        p, part, aside = _partial(c, gl, gt, on)
        Rn = 0.5 * c.k_c * p
        if self.line_force == "integral":
            Rn = Rn * part
        full = on[0] * on[1] * c.k_c
        return (
            (Rn, Rn * aside),
            (full * (-0.5 * (gl + gt)), full * (c.w * (gl - gt) / 6.0)),
            aside,
        )

    def _middle(self, c: Coefficients, at: Pose) -> tuple[Number, Number]:
        """cos(theta0 + theta), and where the middle of the face lies, as delta is counted."""
        leading, trailing = edges(c, at)
        cos_phi, middle = (trailing - leading) / (2.0 * c.w), (leading + trailing) / 2.0
        return cos_phi, middle if self.delta_from == "centre" else middle + c.x0 + at.x

    def forces(self, c: Coefficients, at: Pose, on: Touching) -> Forces:
        """Rn and Rf = mu Rn, Eqs. (8)-(10) (friction at the constant arm h)."""
        partial, full, _ = self._reaction(c, at, on)
        Rn, along = partial[0] + full[0], partial[1] + full[1]
        Rf, sign = c.mu * Rn, 1.0 if self.delta_moment == "+" else -1.0
        # sums of the coordinates of the points where Rn acts, each times its part
        aside, down = (
            sign * (0.5 * (t + l) * Rn + (t - l) / (2.0 * c.w) * along)
            for l, t in ((c.rlx, c.rtx), (c.rly, c.rty))
        )
        moment = c.h * Rf
        if self.delta_from == "frame":
            moment = moment + sign * ((c.x0 + at.x) * Rn)
        return Forces(Rf, Rn, aside, down, moment)

    def loads(self, c: Coefficients, at: Pose, on: Touching) -> Loads:
        """The forces and their moment."""
        return self.forces(c, at, on).loads(at)

    def signals(self, c: Coefficients, at: Pose, on: Touching) -> tuple[Number, Number]:
        """Rn (in units of force) and delta (of length), Eqs. (13)-(20); delta is 0/0 apart."""
        (partial, _), (full, along), aside = self._reaction(c, at, on)
        cos_phi, middle = self._middle(c, at)
        both = on[0] * on[1]
        place = aside + along / (full + (1.0 - both))
        touching = on[0] + on[1] - both
        return partial + full, (cos_phi * place + middle) * touching / touching

    resultant = signals

    def energy(self, c: Coefficients, at: Pose, on: Touching) -> Number:
        """(k_c/4w) x integral of the squared penetration: the potential of the integral law."""
        gl, gt = gaps(c, at)
        p, part, _ = _partial(c, gl, gt, on)
        full = on[0] * on[1] * ((gl + gt) ** 2 / 8.0 + (gl - gt) ** 2 / 24.0)
        return c.k_c * (p * p * part / 6.0 + full)
