"""Balance of the loads on a pad at rest in its own units, with derivatives by q and by mu."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from squeal.model.equations import PadModel, net_loads
from squeal.model.mechanics import pose
from squeal.model.states import State
from squeal.model.units import Units, natural_units

_STEP = 1e-200


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

    def derivative(self, z: np.ndarray, state: State) -> np.ndarray:
        """Derivative of the residual by z, shape (3, 4, ...), by complex steps."""
        shift = 1j * _STEP * np.eye(4).reshape((4, 4) + (1,) * (z.ndim - 1))
        return self.residual(z[:, None] + shift, state).imag / _STEP

    def gaps(self, z: np.ndarray) -> np.ndarray:
        """Gaps of the contact points, shape (points, ...)."""
        return self.model.gaps(self.place(z))

    def gap_derivative(self, z: np.ndarray, point: int) -> np.ndarray:
        """Derivative of one gap by z (4,), shape (4,)."""
        shifted = z[:, None] + 1j * _STEP * np.eye(4)
        return self.gaps(shifted)[point].imag / _STEP

    def rounding(self, z: np.ndarray) -> float:
        """Size of rounding in a gap at z."""
        pad = self.model.pad
        return float(1e-13 * (pad.w + pad.h + abs(pad.y0) + np.max(np.abs(z[:3]))))

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

    def newton(self, z: np.ndarray, state: State, rows: int = 30) -> np.ndarray | None:
        """Newton's method in (x, y, w theta) at fixed mu; None where it does not converge."""
        z, last = z.copy(), np.inf
        for _ in range(rows):
            try:
                step = np.linalg.solve(self.derivative(z, state)[:, :3], self.residual(z, state))
            except np.linalg.LinAlgError:
                return None
            z[:3] -= step
            if not np.all(np.isfinite(z)):
                return None
            size = float(np.max(np.abs(step)) / (1.0 + np.max(np.abs(z[:3]))))
            # next to a fold rounding keeps the steps from shrinking further
            if size <= 1e-13 or (size <= 1e-8 and size >= last):
                return z
            last = size
        return None
