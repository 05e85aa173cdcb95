"""A pad's equilibria, eigenvalues and thresholds at 50 digits, from the literal equations.

What the package found serves as the first guess of Newton's method and for nothing else.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mpmath as mp

from squeal.io.scene import Scene
from squeal.model.contact import State
from tests import naive

SMALL = mp.mpf(10) ** -24  # a step of Newton's method after which the next is below 1e-45
Cubic = tuple[Any, Any, Any]


def discriminant(cubic: Cubic) -> Any:
    """Discriminant of s^3 - a s^2 + b s - c."""
    a, b, c = cubic
    return a * a * b * b - 4 * b**3 - 4 * a**3 * c + 18 * a * b * c - 27 * c * c


@dataclass(frozen=True)
class Exact:
    """The literal equations of a scene's pad in one contact state; mu is free."""

    scene: Scene
    state: State

    def _given(self, q: Any, mu: Any) -> tuple[Any, ...]:
        pad = self.scene.pad.replace(mu=mp.mpf(mu))
        return self.scene.model, pad, self.scene.formulation, list(q), self.state

    def loads(self, q: Any, mu: Any) -> mp.matrix:
        """Loads (Fx, Fy, M)."""
        return mp.matrix(naive.loads(*self._given(q, mu)))

    def stiffness(self, q: Any, mu: Any) -> mp.matrix:
        """K, minus the derivative of the loads."""
        return -naive.jacobian(*self._given(q, mu))

    def gaps(self, q: Any) -> tuple[Any, Any]:
        """Heights of the leading and the trailing edge over where they touch."""
        pad = self.scene.pad
        *_, leading, trailing, _ = naive.points(pad, q)
        low = -pad.h, -pad.h
        if self.scene.model == "B1":
            *_, rest_l, rest_t, _ = naive.points(pad, (0, 0, 0))
            low = rest_l[1], rest_t[1]
        return leading[1] - low[0], trailing[1] - low[1]

    def equilibrium(self, guess: Any, mu: Any) -> mp.matrix:
        """The equilibrium near `guess`."""
        q = mp.matrix([mp.mpf(v) for v in guess])
        for _ in range(8):
            step = mp.lu_solve(self.stiffness(q, mu), self.loads(q, mu))
            q += step
            if mp.norm(step) <= SMALL * mp.norm(q):
                return q
        raise ArithmeticError(f"no exact equilibrium near {guess} at mu = {mu}")

    def _reduced(self, q: Any, mu: Any) -> mp.matrix:
        pad = self.scene.pad
        return mp.diag([1 / mp.mpf(m) for m in (pad.m, pad.m, pad.I)]) * self.stiffness(q, mu)

    def cubic(self, q: Any, mu: Any) -> Cubic:
        """Coefficients a, b, c of the polynomial in s = -lambda^2."""
        A = self._reduced(q, mu)
        b = sum(A[i, i] * A[j, j] - A[i, j] * A[j, i] for i, j in ((0, 1), (0, 2), (1, 2)))
        return A[0, 0] + A[1, 1] + A[2, 2], b, mp.det(A)

    def squares(self, q: Any, mu: Any) -> list[Any]:
        """The three roots s."""
        return list(mp.eig(self._reduced(q, mu), left=False, right=False))

    def critical(
        self, condition: Callable[[Any, Any], Any], guess: Any, mu: Any
    ) -> tuple[mp.matrix, Any]:
        """Equilibrium and mu at which condition(q, mu) vanishes."""
        z = mp.matrix([*(mp.mpf(v) for v in guess), mp.mpf(mu)])
        unit = mp.mpf(10) ** -22
        for _ in range(12):
            q, at = z[:3], z[3]
            here, K = condition(q, at), self.stiffness(q, at)
            f = mp.matrix([*self.loads(q, at), here])
            J = mp.zeros(4)
            J[:3, :3] = -K
            J[:3, 3] = self.loads(q, at + 1) - self.loads(q, at)  # linear in mu
            for i in range(4):
                ahead = z.copy()
                ahead[i] += unit
                J[3, i] = (condition(ahead[:3], ahead[3]) - here) / unit
            step = mp.lu_solve(J, f)
            z -= step
            if abs(step[3]) <= SMALL and mp.norm(step[:3]) <= SMALL * mp.norm(z[:3]):
                return z[:3], z[3]
        raise ArithmeticError(f"no exact threshold near mu = {mu}")
