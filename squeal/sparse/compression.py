"""Few right and left modes in place of a basis, for the many values of sweeps, charts and samples.

A reduction of hundreds of real vectors holds the modes at all values of the parameters; those of
one band need few complex ones. X holds right and Y left modes at some of the values, both in the
coordinates of the reduction, so that Y^H A X of its matrices are the terms of a small problem.
Values at which its roots may be off too far add their own modes. The error of a root is that of a
first look: the residuals of its right and left vectors in the full problem, which random vectors
estimate, meet through the inverse of the structure's F.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.linear.system import Term, TermSystem
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.quadratic import Array, ComplexArray, Roots

DROPPED = 2e-4  # of unit vectors: what modes of another value add less is left out


class Compression:
    """The right and left modes of a region that have been added, and their small problem.

    `right` and `left` (d, k) are orthonormal columns in the coordinates of a reduction.
    """

    def __init__(self, system: TermSystem, region: Rectangle) -> None:
        self.reduced, self.region = system, region
        self.right = np.zeros((system.n, 0), dtype=complex)
        self.left = self.right
        self.system: TermSystem | None = None

    @property
    def size(self) -> int:
        """Number of right modes k, and of left ones."""
        return self.right.shape[1]

    def grow(self, system: TermSystem, roots: Roots) -> bool:
        """Add right and left modes of a reduction, which may have grown itself; False if that
        brings nothing."""
        missing = system.n - len(self.right)
        self.reduced = system
        self.right, self.left = (
            np.pad(basis, ((0, missing), (0, 0))) for basis in (self.right, self.left)
        )
        right, sizes = _beyond(self.right, roots.right)
        left, others = _beyond(self.left, roots.left)
        new = int(np.sum(np.maximum(sizes, others) > DROPPED))
        if new == 0:
            return False
        self.right = np.hstack([self.right, right[:, :new]])
        self.left = np.hstack([self.left, left[:, :new]])
        M, C, K = (
            tuple(Term(self.left.conj().T @ t.matrix @ self.right, t.factor) for t in terms)
            for terms in system.parts
        )
        self.system = replace(system, M=M, C=C, K=K)
        return True

    def at(self, changes: Mapping[str, float]) -> tuple[ComplexArray, Any]:
        """All finite roots (rad/s) of the small problem at some parameters, and its matrices."""
        assert self.system is not None
        M, C, K = self.system.at(changes)
        C = np.zeros_like(M) if C is None else C
        shift = self.region.centre + (0.03 + 0.04j) * self.region.radius
        radius, k = self.region.radius, self.size
        images = np.hstack([radius * (2 * shift * M + C), radius**2 * M])
        solved = np.linalg.solve(shift * (shift * M + C) + K, images)
        inverse = np.vstack([-solved, np.eye(k, 2 * k)])
        theta = np.linalg.eigvals(inverse)
        theta = theta[np.abs(theta) > np.finfo(float).eps * np.abs(theta).max(initial=0.0)]
        return shift + radius / theta, (M, C, K)

    def vectors(self, matrices: Any, values: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Right and left unit vectors (k, m) of roots, by inverse iteration."""
        M, C, K = matrices
        z = values[:, None, None]
        inverse = np.linalg.inv(z * (z * M + C) + K)
        # the largest column and row of an inverse point along both vectors
        sizes = np.abs(inverse)
        each = np.arange(len(values))
        columns = np.argmax(sizes.max(axis=1, initial=0.0), axis=1)
        rows = np.argmax(sizes.max(axis=2, initial=0.0), axis=1)
        right = np.einsum("mij,mj->im", inverse, inverse[each, :, columns])
        left = np.einsum("mij,mi->jm", inverse, inverse[each, rows, :]).conj()
        return right / np.linalg.norm(right, axis=0), left / np.linalg.norm(left, axis=0)


def _beyond(basis: ComplexArray, columns: ComplexArray) -> tuple[ComplexArray, Array]:
    """Orthonormal directions that columns of unit length add to a basis, by falling size."""
    for _ in range(2):
        columns = columns - basis @ (basis.conj().T @ columns)
    axes, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    return axes, sizes


def weights(parts: Any, p: Mapping[str, float], values: ComplexArray) -> NDArray:
    """Factor times power of the root (terms, m) of each term of M, C and K."""
    rows = [
        term.factor.value(p) * values**power
        for terms, power in zip(parts, (2, 1, 0), strict=True)
        for term in terms
    ]
    return np.array(rows)
