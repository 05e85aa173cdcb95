"""Thresholds where some motion has no mass, or hardly any: those of the slow roots.

In eigenvectors of M and with s = -lambda^2, K21 q1 + K22 q2 = s D2 q2. On the subspace of the slow
roots q2 = -X q1, K22 X = K21 + D2 X L and D1 L = K11 - K12 X: static condensation of what has no
mass, and with a light one a few iterations more, each of which gains a factor of D2 L / K22.
"""

from dataclasses import dataclass, field

import numpy as np

from squeal.errors import MatrixError
from squeal.linear.matrices import EPS, Array, light_motions, unit_diagonal
from squeal.linear.system import Matrices, Parametrised, System

REFUSED = (
    "M: is ill conditioned, as where some motion has (nearly) no mass or coordinates nearly depend "
    "on each other, and that motion is damped or may grow, or M varies; those thresholds can be "
    "given that lie in a band (--band LOW:HIGH, in Hz)"
)


class FastMotionError(MatrixError):
    """What has no mass, or hardly any, cannot be eliminated."""

    def __init__(self) -> None:
        super().__init__(REFUSED)


@dataclass
class Slow:
    """The slow roots of `system`, which has to be like that at p, as a system of their own, M = 1.

    A motion is light whose mass is below `light` times the next heavier one. Calls raise
    FastMotionError if M varies, light motions are damped or may grow, or their stiffness has a
    condition above `condition`, which leaves the slow roots too few digits. `growth` is by how much
    what was eliminated so far has increased rounding.
    """

    system: System
    p: float
    light: float = 1e-4
    condition: float = 1e8
    growth: float = field(default=1.0, init=False)

    def __post_init__(self) -> None:
        self._family = Parametrised(self.system, self.p, self.p)
        self.M, _, K = self._family.at(self.p)
        masses, self.turn = light_motions(self.M)
        gaps = masses[1:] / np.maximum(masses[:-1], EPS * masses[-1])
        self.count = int(np.argmax(gaps)) + 1
        self.fast, self.heavy = masses[: self.count], masses[self.count :]
        if gaps.max() * self.light < 1.0 or np.count_nonzero(self.fast) > 1:
            raise FastMotionError
        self.sign = float(np.linalg.slogdet(self._turned(K)[0])[0])
        if self.sign <= 0.0 and np.any(self.fast):
            raise FastMotionError

    def _turned(self, X: Array) -> tuple[Array, Array, Array, Array]:
        """Blocks 22, 21, 12 and 11 of a matrix, 2 being the light motions."""
        X, k = self.turn.T @ X @ self.turn, self.count
        return X[:k, :k], X[:k, k:], X[k:, :k], X[k:, k:]

    def __call__(self, p: float) -> Matrices:
        """M, C and K of the slow motions at p."""
        M, C, K = self._family.at(p)
        unit = np.sqrt(np.outer(self.heavy, self.heavy))
        if C is not None:
            *light, C = self._turned(C)
            least = 4 * EPS * len(M) * np.abs(C).max(initial=0.0)
            if np.any(self.fast) or any(np.abs(X).max() > least for X in light):
                raise FastMotionError
            C = C / unit
        if not np.array_equal(M, self.M):
            raise FastMotionError
        return np.eye(len(unit)), C, self._condensed(*self._turned(K)) / unit

    def _condensed(self, K22: Array, K21: Array, K12: Array, K11: Array) -> Array:
        """D1 L (n1, n1)."""
        condition = float(np.linalg.cond(unit_diagonal(K22)))
        if not condition < self.condition or np.linalg.slogdet(K22)[0] != self.sign:
            raise FastMotionError
        X = np.linalg.solve(K22, K21)
        for _ in range(60):
            inertia = self.fast[:, None] * (X @ ((K11 - K12 @ X) / self.heavy[:, None]))
            before, X = X, np.linalg.solve(K22, K21 + inertia)
            if np.abs(X - before).max() <= 4 * EPS * np.abs(X).max():
                terms, rest = np.abs(K11) + np.abs(K12) @ np.abs(X), K11 - K12 @ X
                lost = float(np.abs(terms).max() / np.abs(rest).max())
                lost *= float(self.heavy[-1] / self.heavy[0])
                self.growth = max(self.growth, len(self.M) * condition * lost)
                return rest
        raise FastMotionError
