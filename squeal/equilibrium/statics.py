"""Balance of the loads on a pad at rest in its own units, with derivatives by q and by mu."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from squeal.model.equations import PadModel, net_loads
from squeal.model.mechanics import pose
from squeal.model.states import State
from squeal.model.units import Units, natural_units
from squeal.numerics.newton import complex_step, newton, with_derivative

EPS = float(np.finfo(float).eps)


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

    def residual(self, z: np.ndarray, state: State) -> np.ndarray:
        """Net loads (Fx, Fy, M/w) of a contact state, shape (3, ...), real or complex."""
        c = dataclasses.replace(self.model.c, mu=z[3])
        f = net_loads(np, c, self.model.law, tuple(self.place(z)), state)
        return np.array(np.broadcast_arrays(f.x, f.y, f.moment / self.model.pad.w))

    def linearised(
        self, z: np.ndarray, state: State, unknowns: int = 4
    ) -> tuple[np.ndarray, np.ndarray]:
        """The residual (3, ...) and its derivative (3, unknowns, ...) by the first parts of z."""
        return with_derivative(lambda z: self.residual(z, state), z, unknowns)

    def gaps(self, z: np.ndarray) -> np.ndarray:
        """Gaps of the contact points, shape (points, ...)."""
        return self.model.gaps(self.place(z))

    def gap_derivative(self, z: np.ndarray, point: int) -> np.ndarray:
        """Derivative of one gap by z (4,), shape (4,)."""
        return np.asarray(complex_step(self.gaps, z)[point])

    def rounding(self, z: np.ndarray) -> float:
        """Size of rounding in a gap at z (4, ...)."""
        c = self.model.c
        moved = (1.0 + c.h / c.w) * np.max(np.abs(z[:3]))
        return float(1e-13 * (1.0 + max(abs(c.gap_l), abs(c.gap_t)) + moved))

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
        return bool(np.all(np.abs(self.residual(z, told)) <= 1e3 * rounding + 1e-9))

    def potential(self, z: np.ndarray, state: State) -> float:
        """Potential energy; in partial contact that of the integral law in every formulation."""
        return float(self.model.energy(self.place(z), np.zeros(3), state))

    def reaction(self, z: np.ndarray, state: State) -> tuple[float, float]:
        """R_n in N and its distance delta in m, as the formulation counts it."""
        at = pose(np, tuple(self.place(z)))
        with np.errstate(divide="ignore", invalid="ignore"):  # no place where there is no force
            force, place = self.model.law.resultant(self.model.c, at, state)
        return float(force) * self.units.force, float(place) * self.units.length

    def presses(self, z: np.ndarray, touching: Any) -> np.ndarray:
        """Where R_n at z (4, ...) is more than what rounding may leave of it where none presses.

        That is eps times the load and each stiffness by as far as its spring is moved.
        touching: a contact state, or factors (points, ...).
        """
        c, at = self.model.c, pose(np, tuple(self.place(z)))
        one, two = (np.hypot(*at.displacement(x, y)) for x, y in ((c.r1x, c.r1y), (c.r2x, c.r2y)))
        opened = np.maximum(np.abs(c.gap_l), np.abs(c.gap_t))
        face = np.abs(at.y) + (np.abs(at.S) + np.abs(at.C)) * (c.w + c.h) + opened
        contact = sum(getattr(self.model.pad, name) for name in self.model.law.parameters)
        forces = c.F_n + c.k1 * one + c.k2 * two + contact * face
        with np.errstate(all="ignore"):  # no place where there is no force
            R_n = self.model.law.resultant(c, at, np.asarray(touching, dtype=float))[0]
        return np.asarray(R_n > EPS * forces)

    def newton(self, z: np.ndarray, state: State) -> np.ndarray | None:
        """Newton's method in (x, y, w theta) at fixed mu; None where it does not converge."""
        mu = z[3:]

        def balance(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            return self.linearised(np.append(q, mu), state, 3)

        found = newton(balance, z[:3], stalled=1e-8)
        return np.append(found.x, mu) if found.converged else None
