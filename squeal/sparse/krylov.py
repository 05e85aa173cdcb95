"""Roots nearest a shift: two-level orthogonal Arnoldi on the shifted and inverted problem.

With lambda = shift + radius / theta the problem reads
theta^2 P(shift) x + theta radius P'(shift) x + radius^2 M x = 0: the roots nearest the shift
become the largest theta, of size one at the distance `radius`. The companion vectors [theta x; x]
are kept as U [G1; G2] with one orthonormal U (Lu, Su and Bai 2016), which halves memory and work;
of real matrices at a real shift all of it is real.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.sparse.factor import Factor
from squeal.sparse.quadratic import ComplexArray, Quadratic

CONVERGED = 1e-13  # residual of a Ritz value relative to theta
ROUGH = 1e-4  # the same of a subspace in single precision
EVERY = 6  # steps between looks at the Ritz values
BLOCK = 3  # vectors of a step in single precision
MANY = 5_000  # rows from which there are so many


@dataclass(frozen=True, eq=False)
class Near:
    """Converged roots around a shift: all within `reach` of it, and some beyond."""

    shift: complex
    values: ComplexArray  # (m,) by distance
    vectors: ComplexArray = field(repr=False)  # (n, m) of unit length, or (n, 0)
    reach: float


class Krylov:
    """A growing subspace at one shift; ask for more steps until what is found suffices.

    In single precision large problems take small blocks of vectors: a factor solves for three right
    sides in little more than the time of one, but a wider subspace needs more vectors, and the more
    digits are wanted, the more so.
    """

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
        self._converged = ROUGH if single else CONVERGED
        self._U = np.zeros((problem.n, 0), dtype=self._kept, order="F")
        self._G = np.zeros((2, 0, 0), dtype=self._type)
        self._H = np.zeros((0, 0), dtype=self._type)
        self._used = self._columns = 0  # of U and of G
        self.steps = 0  # columns to which the operator has been applied
        block = BLOCK if single and problem.n >= MANY else 1
        start = rng.standard_normal((problem.n, block))
        if self._type is complex:
            start = start + 1j * rng.standard_normal((problem.n, block))
        first = _split(self._U, factor.solve(self._mass @ start, transposed))[1]
        self._room(block)
        self._used = self._columns = first.shape[1]
        self._U[:, : self._used] = first
        self._G[0, : self._used, : self._used] = np.eye(self._used)

    def _room(self, columns: int) -> None:
        """Enlarge the arrays for so many columns and some more."""
        if self._U.shape[1] >= columns:
            return
        columns += 4 * EVERY
        grown = np.zeros((self.problem.n, columns), dtype=self._kept, order="F")
        grown[:, : self._used] = self._U[:, : self._used]
        G = np.zeros((2, columns, columns), dtype=self._type)
        H = np.zeros((columns, columns), dtype=self._type)
        k = self._G.shape[1]
        G[:, :k, :k] = self._G
        H[:k, :k] = self._H
        self._U, self._G, self._H = grown, G, H

    def advance(self, most: int) -> bool:
        """Extend the subspace by EVERY steps, to `most` in all; False if it cannot grow more."""
        goal = min(self.steps + EVERY, most)
        while self.steps < goal and self._open(most):
            self._step()
        return self._open(most)

    def _open(self, most: int) -> bool:
        return 0 < self._columns - self.steps <= most - self.steps

    def _step(self) -> None:
        now, k = slice(self.steps, self._columns), self._used
        self._room(2 * self._columns - self.steps)
        U, (G1, G2) = self._U[:, :k], self._G
        first, second = (U @ G[:k, now].astype(self._kept) for G in (G1, G2))
        right = self._slope @ first + self._mass @ second
        upper, new, lower = _split(U, -self._factor.solve(right, self._transposed))
        q = k + new.shape[1]
        self._U[:, k:q] = new
        bottom = np.zeros((q, lower.shape[1]), dtype=self._type)
        bottom[:k] = G1[:k, now]
        m = self._columns
        known = np.vstack([G1[:q, :m], G2[:q, :m]])
        upper, new, lower = _split(known, np.vstack([upper, lower, bottom]))
        last = m + new.shape[1]
        self._H[:m, now], self._H[m:last, now] = upper, lower
        G1[:q, m:last], G2[:q, m:last] = new[:q], new[q:]
        self.steps, self._used, self._columns = m, q, last

    def found(self, vectors: bool = True) -> Near:
        """What has converged so far; without `vectors` (n, 0) it is less work."""
        m, k = self.steps, self._used
        theta, Y = np.linalg.eig(self._H[:m, :m])
        size = np.abs(theta)
        with np.errstate(divide="ignore", invalid="ignore"):
            rest = np.linalg.norm(self._H[m : self._columns, :m] @ Y, axis=0)
            residual = rest / size
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


def _split(U: NDArray, R: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """S, Q and T with R = U S + Q T: Q is orthonormal beside the orthonormal U, and has fewer
    columns than R where R brings less that is new."""
    from scipy.linalg import qr

    before = float(np.linalg.norm(R))
    S = np.zeros((U.shape[1], R.shape[1]), dtype=R.dtype)
    for _ in range(2):  # the second pass restores orthogonality to rounding
        part = (R.conj().T @ U).conj().T
        R = R - U @ part
        S += part
    Q, T, order = qr(R, mode="economic", pivoting=True, check_finite=False)
    wide = int(np.sum(np.abs(np.diag(T)) > 4 * np.finfo(R.dtype).eps * before))
    Q, T = Q[:, :wide], T[:wide, np.argsort(order)]
    if wide > 1:  # a column that was small has lost its orthogonality to U
        Q = Q - U @ (Q.conj().T @ U).conj().T
        Q = Q / np.linalg.norm(Q, axis=0)
    return S, Q, T
