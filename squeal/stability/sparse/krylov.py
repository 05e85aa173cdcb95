"""Roots nearest a shift: two-level orthogonal Arnoldi on the shifted and inverted problem.

With lambda = shift + radius / theta the problem reads
theta^2 P(shift) x + theta radius P'(shift) x + radius^2 M x = 0: the roots nearest the shift
become the largest theta, of size one at the distance `radius`. The companion vectors [theta x; x]
are kept as U [G1; G2] with one orthonormal U (Lu, Su and Bai 2016), which halves memory and work;
of real matrices at a real shift all of it is real.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from squeal.stability.sparse.factor import Factor
from squeal.stability.sparse.quadratic import ComplexArray, Quadratic

CONVERGED = 1e-13  # residual of a Ritz value relative to theta
ROUGH = 1e-4  # the same of a subspace in single precision
EVERY = 6  # steps between looks at the Ritz values


@dataclass(frozen=True, eq=False)
class Near:
    """Converged roots around a shift: all within `reach` of it, and some beyond."""

    shift: complex
    values: ComplexArray  # (m,) by distance
    vectors: ComplexArray = field(repr=False)  # (n, m) of unit length, or (n, 0)
    reach: float


class Krylov:
    """A growing subspace at one shift; ask for more steps until what is found suffices."""

    def __init__(
        self,
        problem: Quadratic,
        shift: complex,
        factor: Factor,
        radius: float,
        rng: np.random.Generator,
        transposed: bool = False,
        single: bool = False,
    ) -> None:
        self.problem = problem.transposed() if transposed else problem
        self.shift, self.radius = shift, radius
        self._factor, self._transposed = factor, transposed
        self._slope, self._mass = radius * self.problem.slope(shift), radius**2 * self.problem.M
        self._type = float if problem.real and shift.imag == 0.0 else complex
        self._kept: Any = self._type  # precision of the long vectors
        if single:
            self._kept = np.float32 if self._type is float else np.complex64
            self._slope = self._slope.astype(self._kept)
            self._mass = self._mass.astype(self._kept)
        self._eps = float(np.finfo(self._kept).eps)
        self._converged = ROUGH if single else CONVERGED
        start = rng.standard_normal(problem.n)
        if self._type is complex:
            start = start + 1j * rng.standard_normal(problem.n)
        start = factor.solve(self._mass @ start, transposed)
        self._U = np.zeros((problem.n, 0), dtype=self._kept, order="F")
        self._used = 0
        self._G = np.zeros((2, 0, 0), dtype=self._type)
        self._H = np.zeros((0, 0), dtype=self._type)
        self.steps = 0
        self._room(2 * EVERY)
        self._U[:, 0] = start / np.linalg.norm(start)
        self._G[0, 0, 0] = 1.0
        self._used = 1

    def _room(self, steps: int) -> None:
        """Enlarge the arrays for so many steps."""
        if self._U.shape[1] > steps:
            return
        grown = np.zeros((self.problem.n, steps + 1), dtype=self._kept, order="F")
        grown[:, : self._used] = self._U[:, : self._used]
        G = np.zeros((2, steps + 1, steps + 1), dtype=self._type)
        H = np.zeros((steps + 1, steps), dtype=self._type)
        k = self._G.shape[1]
        G[:, :k, :k] = self._G
        H[: self._H.shape[0], : self._H.shape[1]] = self._H
        self._U, self._G, self._H = grown, G, H

    def advance(self, steps: int) -> None:
        """Extend the subspace by so many steps."""
        self._room(self.steps + steps)
        for _ in range(steps):
            self._step()

    def _step(self) -> None:
        j, k = self.steps, self._used
        U, (G1, G2) = self._U, self._G
        first = U[:, :k] @ G1[:k, j].astype(self._kept)
        second = U[:, :k] @ G2[:k, j].astype(self._kept)
        right = self._slope @ first + self._mass @ second
        r = -self._factor.solve(right, self._transposed)
        before = float(np.linalg.norm(r))
        top = np.zeros(k + 1, dtype=self._type)
        for _ in range(2):  # the second pass restores orthogonality to rounding
            s = (r.conj() @ U[:, :k]).conj()
            r -= U[:, :k] @ s
            top[:k] += s
        rest = float(np.linalg.norm(r))
        if rest > 4 * self._eps * before:  # else nothing new: the subspace of first vectors is full
            U[:, k] = r / rest
            top[k] = rest
            self._used = k + 1
        bottom = np.zeros(k + 1, dtype=self._type)
        bottom[:k] = G1[:k, j]
        h = np.zeros(j + 1, dtype=self._type)
        for _ in range(2):
            s = G1[: k + 1, : j + 1].conj().T @ top + G2[: k + 1, : j + 1].conj().T @ bottom
            top -= G1[: k + 1, : j + 1] @ s
            bottom -= G2[: k + 1, : j + 1] @ s
            h += s
        size = float(np.sqrt(np.linalg.norm(top) ** 2 + np.linalg.norm(bottom) ** 2))
        self._H[: j + 1, j], self._H[j + 1, j] = h, size
        if size > 0:
            G1[: k + 1, j + 1], G2[: k + 1, j + 1] = top / size, bottom / size
        self.steps = j + 1

    def found(self, vectors: bool = True) -> Near:
        """What has converged so far; without `vectors` (n, 0) it is less work."""
        m, k = self.steps, self._used
        theta, Y = np.linalg.eig(self._H[:m, :m])
        size = np.abs(theta)
        with np.errstate(divide="ignore", invalid="ignore"):
            residual = abs(self._H[m, m - 1]) * np.abs(Y[m - 1]) / size
            distance = self.radius / size
        good = residual <= self._converged
        reach = float(np.min(distance[~good], initial=np.inf))
        order = np.argsort(distance[good])
        theta, Y = theta[good][order], Y[:, good][:, order]
        values = self.shift + self.radius / theta
        if not vectors:
            return Near(self.shift, values, np.zeros((len(self._U), 0), dtype=complex), reach)
        # theta x = U G1 y and x = U G2 y: the longer of the two has the smaller error
        small = self._G[0, :k, :m] @ Y / theta if len(theta) else self._G[0, :k, :m] @ Y
        large = self._G[1, :k, :m] @ Y
        inner = np.where(np.abs(theta) >= 1.0, small, large)
        shapes = self._U[:, :k] @ inner.astype(np.result_type(self._kept, np.complex64))
        if shapes.size:
            shapes = shapes / np.linalg.norm(shapes, axis=0)
        return Near(self.shift, values, shapes, reach)
