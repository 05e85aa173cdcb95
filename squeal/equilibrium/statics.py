"""Balance of the loads on a pad at rest in its own units, with derivatives by q and by mu."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from squeal.model.equations import PadModel, net_loads
from squeal.model.law import Touching
from squeal.model.mechanics import Pose, pose, springs
from squeal.model.states import State
from squeal.model.units import Units, natural_units
from squeal.numerics.newton import complex_step, newton, with_derivative

ROUNDING = 8.0 * float(np.finfo(float).eps)  # of a sum, over the sizes of what is added
HIDDEN = 1e-4  # of a penetration that may be rounding, by a bound that is some 100 times the error
TINY = float(np.finfo(float).tiny)
COARSE = 1e-6  # of a penetration: the last step of Newton's method; its square is then left


@dataclass(frozen=True)
class Point:
    """A point of the branch in natural units: z = (x, y, w theta, mu), and the contact state.

    error: how far rounding may move mu at a fold or change of contact that was located.
    """

    z: np.ndarray
    state: State
    error: float = 0.0


@dataclass(frozen=True)
class Statics:
    """Static balance of a pad in natural units.

    Unknowns are z = (x, y, w theta, mu), shape (4, ...); the residual is (Fx, Fy, M/w).
    """

    model: PadModel
    units: Units

    @staticmethod
    def of(model: PadModel) -> Statics:
        """The statics of a pad given in SI units."""
        units = natural_units(model, (0.0,) * 6)
        return Statics(units.scaled(model), units)

    def place(self, z: np.ndarray) -> np.ndarray:
        """q = (x, y, theta) in natural units."""
        return np.array(self.model.c.place(z))

    def tilt(self, z: np.ndarray) -> np.ndarray:
        """theta0 + theta, shape (...)."""
        return np.asarray(self.model.pad.theta0 + self.place(z)[2])

    def to_si(self, z: np.ndarray) -> np.ndarray:
        """q = (x, y, theta) in SI units, shape (3,)."""
        return self.units.to_si(np.append(np.real(z[:3]), np.zeros(3)))[:3]

    def residual(self, z: np.ndarray, state: Touching) -> np.ndarray:
        """Net loads (Fx, Fy, M/w) of a contact state, shape (3, ...), real or complex."""
        c = self.model.c._replace(mu=z[3])
        f = net_loads(np, c, self.model.law, tuple(self.place(z)), state)
        return np.array([f.x, f.y, f.moment / self.model.pad.w])

    def linearised(
        self, z: np.ndarray, state: Touching, unknowns: int = 4
    ) -> tuple[np.ndarray, np.ndarray]:
        """The residual (3, ...) and its derivative (3, unknowns, ...) by the first parts of z."""
        with np.errstate(divide="ignore", invalid="ignore"):  # a search that hits the law's pole
            return with_derivative(lambda z: self.residual(z, state), z, unknowns)

    def gaps(self, z: np.ndarray) -> np.ndarray:
        """Gaps of the contact points, shape (points, ...)."""
        return self.model.gaps(self.place(z))

    def gap_derivative(self, z: np.ndarray, point: int) -> np.ndarray:
        """Derivative of one gap by z (4,), shape (4,)."""
        return np.asarray(complex_step(self.gaps, z)[point])

    def rounding(self, z: np.ndarray) -> np.ndarray:
        """How far rounding may move each gap at z (4, ...), shape (points, ...).

        It is that of the sizes of which a gap is the sum: where the pad is put, and displacements.
        """
        c = self.model.c
        put = abs(c.gap_l) + abs(c.gap_t)
        if self.model.law.absolute_gap:
            put = put + abs(self.model.pad.y0)
        corners = {name: abs(getattr(c, name)) for name in ("rlx", "rly", "rtx", "rty")}
        sizes = c._replace(gap_l=put, gap_t=put, **corners)
        at = Pose(*map(np.abs, pose(np, tuple(self.place(z)))))
        return ROUNDING * np.array(self.model.law.gaps(sizes, at))

    def deepest(self, z: np.ndarray) -> np.ndarray:
        """The greatest penetration at z (4, ...), shape (...); negative if it separated."""
        return np.asarray(np.max(-self.gaps(z), axis=0))

    def blur(self, z: np.ndarray) -> np.ndarray:
        """The share of the greatest penetration at z (4, ...) that may be rounding, 1 at most."""
        error = np.fmax(np.max(self.rounding(z), axis=0), TINY)
        return np.asarray(error / np.fmax(self.deepest(z), error))

    def touches(self, z: np.ndarray) -> np.ndarray:
        """Where a pad at z (4, ...) touches the surface, if only to rounding, shape (...)."""
        return np.asarray(np.any(self.gaps(z) <= self.rounding(z), axis=0))

    def hidden(self, z: np.ndarray) -> np.ndarray:
        """Where rounding hides whether and how a pad at z (4, ...) touches, shape (...)."""
        return np.asarray(self.touches(z) & (self.blur(z) > HIDDEN))

    def why_hidden(self, z: np.ndarray) -> str:
        """Why rounding hides the contact of one pad at z (4,) or (4, 1); empty if it does not."""
        if not self.hidden(z).any():
            return ""
        share = float(np.max(self.blur(z)))
        size = "as great as" if share >= 1.0 else f"{share:.1g} of"
        return (
            f"rounding of the pad's place is {size} how deep it presses into the surface, which "
            "hides the contact; softer contact or a greater load is required"
        )

    def presses(self, z: np.ndarray) -> np.ndarray:
        """Where a pad at rest at z (4, ...) presses on the surface, shape (...).

        It does where it lies below the surface by more than rounding. Where rounding hides that, it
        does if there is a load, or a force of the springs beyond the rounding of what cancels.
        """
        c, at = self.model.c, pose(np, tuple(self.place(z)))
        one, two = (np.hypot(*at.displacement(x, y)) for x, y in ((c.r1x, c.r1y), (c.r2x, c.r2y)))
        forced = -springs(np, c, at).y > ROUNDING * (c.k1 * one + c.k2 * two)
        return np.asarray(self.touches(z) & (~self.hidden(z) | (c.F_n > 0.0) | forced))

    def admits(self, z: np.ndarray, state: State) -> bool:
        """True if the gaps at z (4,) tell the state, and the lower face faces the surface.

        Where a gap is zero to rounding the loads of the state that the gaps tell must balance too:
        the line law of partial contact has a pole where both gaps vanish.
        """
        rounding = self.rounding(z)
        turned = abs(self.tilt(z)) < np.pi / 2
        sides = np.where(list(state), 1.0, -1.0)
        if not turned or np.any(sides * self.gaps(z) > rounding):
            return False
        told = self.model.state_at(self.place(z))
        return bool(np.all(np.abs(self.residual(z, told)) <= 1e3 * np.max(rounding) + 1e-9))

    def potential(self, z: np.ndarray, state: State) -> float:
        """Potential energy; in partial contact that of the integral law in every formulation."""
        return float(self.model.energy(self.place(z), np.zeros(3), state))

    def reaction(self, z: np.ndarray, state: State) -> tuple[float, float]:
        """R_n in N and its distance delta in m, as the formulation counts it."""
        at = pose(np, tuple(self.place(z)))
        with np.errstate(divide="ignore", invalid="ignore"):  # no place where there is no force
            force, place = self.model.law.resultant(self.model.c, at, state)
        return float(force) * self.units.force, float(place) * self.units.length

    def newton(self, z: np.ndarray, state: State) -> np.ndarray | None:
        """Newton's method in (x, y, w theta) at fixed mu; None where it does not converge."""
        mu = z[3:]

        def balance(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            return self.linearised(np.append(q, mu), state, 3)

        found = self.solve(balance, z[:3], mu, 1e-13, 1e-8)
        return None if found is None else np.append(found, mu)

    def solve(
        self,
        conditions: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
        start: np.ndarray,
        rest: np.ndarray,
        tolerance: float,
        stalled: float,
    ) -> np.ndarray | None:
        """A zero of conditions on the first parts of z, the rest of z being known; None if Newton's
        method finds none.

        Where the tolerance means much beside the penetration it goes on down to rounding.
        """
        found = newton(conditions, start, tolerance, stalled=stalled)
        if not found.converged:
            return None
        size = 1.0 + np.max(np.abs(found.x))
        if tolerance * size > COARSE * self.deepest(np.append(found.x, rest)):
            found = newton(conditions, found.x, 0.0, stalled=1e-6)
        return found.x if found.converged else None
