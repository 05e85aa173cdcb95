"""Few right and left modes in place of a basis, for the many values of sweeps, charts and samples.

A reduction of hundreds of real vectors holds the modes at all values of the parameters; those of
one band need few complex ones. X holds right and Y left modes at some of the values, both in the
coordinates of the reduction, so that Y^H A X of its matrices are the terms of a small problem.
Values at which its roots may be off too far add their own modes. The error of a root is that of a
first look: the residuals of its right and left vectors in the full problem, which random vectors
estimate, meet through the inverse of the structure's F.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from squeal.linear.matrices import EPS
from squeal.linear.system import TermSystem
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.dense import roots_at
from squeal.sparse.quadratic import (
    Array,
    Changes,
    ComplexArray,
    Roots,
    projected,
)

DROPPED = 2e-4  # of unit vectors: what modes of another value add less is left out


class SmallProblem(NamedTuple):
    """lambda^2 M + lambda C + K of few modes, complex matrices (k, k)."""

    M: ComplexArray
    C: ComplexArray
    K: ComplexArray

    def values(self, region: Rectangle) -> ComplexArray:
        """All finite roots (rad/s), those in and around a region to rounding."""
        M, C, K = self
        shift = region.centre + (0.03 + 0.04j) * region.radius
        radius = region.radius
        # theta = radius / (lambda - shift) of the companion form
        images = np.hstack([radius * (2 * shift * M + C), radius**2 * M])
        solved = np.linalg.solve(shift * (shift * M + C) + K, images)
        companion = np.vstack([-solved, np.eye(len(M), 2 * len(M))])
        theta = np.linalg.eigvals(companion)
        sizes = np.abs(theta)
        theta = theta[sizes > np.finfo(float).eps * sizes.max(initial=0.0)]
        return shift + radius / theta

    def roots_at(self, values: ComplexArray) -> Roots:
        """Roots with right and left unit vectors (k, m), by inverse iteration."""
        z = values[:, None, None] * (1.0 + 8 * EPS)  # beside a root that is exact
        inverses = np.linalg.inv(z * (z * self.M + self.C) + self.K)
        # the largest column and row of an inverse point along both vectors
        sizes = np.abs(inverses)
        each = np.arange(len(values))
        columns = np.argmax(sizes.max(axis=1, initial=0.0), axis=1)
        rows = np.argmax(sizes.max(axis=2, initial=0.0), axis=1)
        right = np.einsum("mij,mj->im", inverses, inverses[each, :, columns])
        left = np.einsum("mij,mi->jm", inverses, inverses[each, rows, :]).conj()
        return Roots(
            values=values,
            right=right / np.linalg.norm(right, axis=0),
            left=left / np.linalg.norm(left, axis=0),
        )


class Compression:
    """The right and left modes that have been added, and their small system.

    `right` and `left` (d, k) are orthonormal columns in the coordinates of a reduction. Modes of
    `trained_region` are added, so that roots of the `region` inside it are good.
    """

    system: TermSystem

    def __init__(self, rows: int, region: Rectangle, trained_region: Rectangle) -> None:
        self.region = region
        self.trained_region = trained_region
        self.right = np.zeros((rows, 0), dtype=complex)
        self.left = self.right

    @property
    def size(self) -> int:
        """Number of right modes k, and of left ones."""
        return self.right.shape[1]

    def grow(self, system: TermSystem, roots: Roots) -> bool:
        """Add right and left modes of the reduced system; False if that brings nothing."""
        right, right_sizes = _directions_beyond(self.right, roots.right)
        left, left_sizes = _directions_beyond(self.left, roots.left)
        new = int(np.sum(np.maximum(right_sizes, left_sizes) > DROPPED))
        if new == 0:
            return False
        self.right = np.hstack([self.right, right[:, :new]])
        self.left = np.hstack([self.left, left[:, :new]])
        self.system = projected(system, self.left, self.right)
        return True

    def at(self, changes: Changes) -> SmallProblem:
        """The small problem at some parameters."""
        M, C, K = self.system.at(changes)
        return SmallProblem(M, np.zeros_like(M) if C is None else C, K)

    def roots(self, changes: Changes, left: bool = False) -> Roots:
        """The roots in the region with vectors of the few modes, multiple ones with several."""
        problem = self.at(changes)
        values = problem.values(self.trained_region)
        return roots_at(*problem, values[self.region.contains(values)], left)

    def in_basis(
        self, right: ComplexArray, left: ComplexArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """Right and left vectors (k,) of the few modes in the coordinates of the reduction."""
        return self.right @ right, self.left @ left


def _directions_beyond(basis: ComplexArray, columns: ComplexArray) -> tuple[ComplexArray, Array]:
    """Orthonormal directions that unit columns add to a basis, and their sizes, falling."""
    remainder = columns
    for _ in range(2):
        remainder = remainder - basis @ (basis.conj().T @ remainder)
    axes, sizes, _ = np.linalg.svd(remainder, full_matrices=False)
    return axes, sizes
