"""Contact laws: point contacts at the edges (B1) and line contact (B2), Eqs. (4)-(20).

A law is one object: loads on the pad, the signals that the article plots, and the potential, each
for a given contact state. Everything rests on the gaps of the two lower edges, never on the
contact-loss point of Eq. (12), which is singular for a level pad.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

from squeal.model.mechanics import Coefficients, Loads, Number, Point, Pose, gaps
from squeal.model.states import FULL, NONE, State

LineForce = Literal["integral", "mean"]
DeltaFrom = Literal["centre", "frame"]
DeltaMoment = Literal["+", "-"]


@dataclass(frozen=True)
class Formulation:
    """Which reading of Eqs. (10), (13) and (17)-(21) model B2 uses.

    line_force: "integral" = (k_c/2w) x integral of the penetration, "mean" = Eq. (13) as printed.
    delta_from: "centre" of mass (needed by Eq. 10), or the fixed "frame" as in Eqs. (17)-(20).
    delta_moment: "+" as in Eq. (10), "-" as in Eq. (21).
    """

    line_force: LineForce = "integral"
    delta_from: DeltaFrom = "centre"
    delta_moment: DeltaMoment = "+"


FORMULATION_CHOICES: dict[str, tuple[str, ...]] = {
    "line_force": ("integral", "mean"),
    "delta_from": ("centre", "frame"),
    "delta_moment": ("+", "-"),
}
CONSISTENT = Formulation()
AS_PRINTED = Formulation("mean", "frame", "-")


class Flags(NamedTuple):
    """A contact state as numbers, arrays or symbols, so that one formula serves all states.

    leading, trailing, both: 1 or 0; side: 1 on the trailing edge alone, -1 on the leading edge
    alone, else 0.
    """

    leading: Number
    trailing: Number
    both: Number
    side: Number


def flags(leading: Number, trailing: Number) -> Flags:
    """The flags of edges that touch (1) or do not (0)."""
    return Flags(leading, trailing, leading * trailing, trailing - leading)


def _edge_load(c: Coefficients, at: Pose, force: Number, corner: Point) -> Loads:
    """Load of a normal force at a lower corner, with its friction."""
    ax, ay = at.arm(*corner)
    return Loads(c.mu * force, force, (ax - c.mu * ay) * force)


@dataclass(frozen=True)
class PointContact:
    """Unilateral springs k3 and k4 at the two lower edges (model B1)."""

    absolute_gap = False
    signal_names = ("F3", "F4")

    def _forces(self, c: Coefficients, at: Pose, state: State) -> tuple[Number, Number]:
        g3, g4 = gaps(c, at)
        return (
            -c.k3 * g3 if state.leading else 0.0,
            -c.k4 * g4 if state.trailing else 0.0,
        )

    def loads(self, c: Coefficients, at: Pose, state: State) -> Loads:
        """Normal and friction forces of Eqs. (4)-(6), friction at the arm of each edge."""
        total = Loads(0.0, 0.0, 0.0)
        f3, f4 = self._forces(c, at, state)
        if state.leading:
            total += _edge_load(c, at, f3, (c.rlx, c.rly))
        if state.trailing:
            total += _edge_load(c, at, f4, (c.rtx, c.rty))
        return total

    def blended_loads(self, c: Coefficients, at: Pose, on: Flags) -> Loads:
        """The same loads with the contact state as numbers."""
        f3, f4 = self.blended_signals(c, at, on)
        return _edge_load(c, at, f3, (c.rlx, c.rly)) + _edge_load(c, at, f4, (c.rtx, c.rty))

    def blended_signals(self, c: Coefficients, at: Pose, on: Flags) -> tuple[Number, Number]:
        """F3 and F4 with the contact state as numbers."""
        f3, f4 = self._forces(c, at, FULL)
        return on.leading * f3, on.trailing * f4

    def signals(self, c: Coefficients, at: Pose, state: State) -> tuple[Number, Number]:
        """F3 and F4 (in units of force); zero where the edge is off."""
        return self._forces(c, at, state)

    def resultant(self, c: Coefficients, at: Pose, state: State) -> tuple[Number, Number]:
        """Total normal reaction and its distance from the mass centre along x."""
        f3, f4 = self._forces(c, at, state)
        a3, a4 = at.arm(c.rlx, c.rly)[0], at.arm(c.rtx, c.rty)[0]
        return f3 + f4, (a3 * f3 + a4 * f4) / (f3 + f4)

    def energy(self, c: Coefficients, at: Pose, state: State) -> Number:
        """Potential energy of the contact springs."""
        g3, g4 = gaps(c, at)
        return 0.5 * c.k3 * g3 * g3 * state.leading + 0.5 * c.k4 * g4 * g4 * state.trailing


def _partial(gl: Number, gt: Number, state: State) -> tuple[Number, Number, float]:
    """Penetration of the one touching edge, contact length over 2 w, and the edge's side."""
    touching, other, side = (gl, gt, -1.0) if state.leading else (gt, gl, 1.0)
    return -touching, touching / (touching - other), side


def _blended_partial(gl: Number, gt: Number, on: Flags) -> tuple[Number, Number, Number]:
    """What `_partial` gives where one edge touches alone; zeros, without 0/0, elsewhere."""
    one = on.side * on.side
    p = -one * (on.leading * gl + on.trailing * gt)
    return p, p / (on.side * (gl - gt) + (1.0 - one)), on.side


def _aside(c: Coefficients, part: Number, side: Number) -> Number:
    """Centroid of the pressure in partial contact, from the middle of the lower face."""
    return side * c.w * (1.0 - part * (2.0 / 3.0))


@dataclass(frozen=True)
class LineContact:
    """Distributed stiffness along the lower face (model B2).

    With pl, pt the penetrations of the leading and trailing edge, the pressure varies linearly
    between them. In full contact both line-force laws give Rn = k_c (pl + pt)/2. In partial
    contact, p being the penetration of the touching edge, the contact length over 2w is
    p/|pl - pt|, and the integral law weighs Rn = k_c p/2 (the printed mean) with it.
    """

    formulation: Formulation = CONSISTENT
    absolute_gap = True
    signal_names = ("Rn", "delta")

    def _reaction(self, c: Coefficients, at: Pose, state: State) -> tuple[Number, Number]:
        """Rn, and Rn times the distance of its place from the middle of the lower face."""
        gl, gt = gaps(c, at)
        if state == FULL:
            return -0.5 * c.k_c * (gl + gt), -c.k_c * c.w * (gt - gl) / 6.0
        return self._one_edge(c, *_partial(gl, gt, state))

    def _one_edge(self, c: Coefficients, p: Number, part: Number, side: Number) -> Point:
        """The same in partial contact, told by what `_partial` gives."""
        Rn = 0.5 * c.k_c * p
        if self.formulation.line_force == "integral":
            Rn = Rn * part
        return Rn, Rn * _aside(c, part, side)

    def _place(self, c: Coefficients, at: Pose, state: State) -> Number:
        """Distance of Rn from the middle of the lower face: the centroid of the pressure."""
        gl, gt = gaps(c, at)
        if state == FULL:
            return c.w * (gt - gl) / (3.0 * (gl + gt))
        _, part, side = _partial(gl, gt, state)
        return _aside(c, part, side)

    def _face(self, c: Coefficients, at: Pose) -> tuple[Number, Number]:
        """cos(theta0 + theta), and x of the middle of the lower face from the mass centre."""
        (lx, _), (tx, _) = at.arm(c.rlx, c.rly), at.arm(c.rtx, c.rty)
        return (tx - lx) / (2.0 * c.w), (lx + tx) / 2.0

    def _middle(self, c: Coefficients, at: Pose) -> tuple[Number, Number]:
        """cos(theta0 + theta), and where the middle of the face lies, as delta is counted."""
        cos_phi, middle = self._face(c, at)
        if self.formulation.delta_from == "frame":
            middle = middle + c.x0 + at.x
        return cos_phi, middle

    def loads(self, c: Coefficients, at: Pose, state: State) -> Loads:
        """Rn, Rf = mu Rn and their moment, Eqs. (8)-(10) (friction at the constant arm h)."""
        if state == NONE:
            return Loads(0.0, 0.0, 0.0)
        return self._loads_of(c, at, self._reaction(c, at, state))

    def _loads_of(self, c: Coefficients, at: Pose, reaction: Point) -> Loads:
        Rn, along = reaction
        cos_phi, middle = self._middle(c, at)
        Rf, delta_Rn = c.mu * Rn, cos_phi * along + middle * Rn
        turning = delta_Rn if self.formulation.delta_moment == "+" else -delta_Rn
        return Loads(Rf, Rn, c.h * Rf + turning)

    def signals(self, c: Coefficients, at: Pose, state: State) -> tuple[Number, Number]:
        """Rn (in units of force) and delta (of length), Eqs. (13)-(20); delta is NaN apart."""
        if state == NONE:
            return 0.0 * at.y, float("nan") + 0.0 * at.y
        cos_phi, middle = self._middle(c, at)
        Rn, _ = self._reaction(c, at, state)
        return Rn, cos_phi * self._place(c, at, state) + middle

    resultant = signals

    def blended_loads(self, c: Coefficients, at: Pose, on: Flags) -> Loads:
        """The loads with the contact state as numbers."""
        Rn, along = self._one_edge(c, *_blended_partial(*gaps(c, at), on))
        full_Rn, full_along = self._reaction(c, at, FULL)
        return self._loads_of(c, at, (Rn + on.both * full_Rn, along + on.both * full_along))

    def blended_signals(self, c: Coefficients, at: Pose, on: Flags) -> tuple[Number, Number]:
        """Rn and delta with the contact state as numbers; delta is 0/0, a NaN, apart."""
        p, part, side = _blended_partial(*gaps(c, at), on)
        Rn, _ = self._one_edge(c, p, part, side)
        full_Rn, full_along = self._reaction(c, at, FULL)
        place = _aside(c, part, side) + on.both * full_along / (on.both * full_Rn + 1.0 - on.both)
        cos_phi, middle = self._middle(c, at)
        touching = on.both + side * side
        return Rn + on.both * full_Rn, (cos_phi * place + middle) * touching / touching

    def energy(self, c: Coefficients, at: Pose, state: State) -> Number:
        """(k_c/4w) x integral of the squared penetration: the potential of the integral law."""
        gl, gt = gaps(c, at)
        if state == NONE:
            return 0.0 * gl
        if state == FULL:
            return c.k_c * ((gl + gt) ** 2 / 8.0 + (gl - gt) ** 2 / 24.0)
        p = gl if state.leading else gt
        return c.k_c * p**3 / (6.0 * (p - (gt if state.leading else gl)))


ContactLaw = Any  # PointContact | LineContact; both offer the methods above
