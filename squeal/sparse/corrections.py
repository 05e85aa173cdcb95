"""Roots and vectors of the full problem from a basis that nearly holds them.

The problem projected onto an orthonormal basis V, V' P(lambda) V, is small and dense. Its roots and
the vectors V u are Ritz pairs; their residuals P(lambda) V u tell how well they solve the full
problem. P(shift)^-1 applied to the residuals gives the directions that correct the vectors, as
Newton's method does with P(lambda)^-1, but with one factor for all roots near the shift (residual
inverse iteration, Neumaier, SIAM J. Numer. Anal. 22, 1985). They are added to V for all roots at
once, so that close and multiple roots are treated as the dense problem treats them. The nearer the
roots are to the shift, the fewer steps are required.

Left vectors y solve P' conj(y) = 0, with the transpose P', and are corrected in the same basis.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.linear.matrices import Matrix, divisor
from squeal.numerics.threads import side_by_side
from squeal.sparse.argument_principle import Region
from squeal.sparse.dense import dense_values, roots_at
from squeal.sparse.factor import Factor
from squeal.sparse.krylov import orthogonalise
from squeal.sparse.quadratic import Array, Bools, ComplexArray, Roots, ScaledProblem, multiply

EXACT_RESIDUAL = 1e-12  # backward error of right vectors with which corrections end
ACCEPTED_RESIDUAL = 2e-9  # ... of left vectors, and of right ones that no longer improve
MOST_CORRECTIONS = 12  # at most


def corrected_roots(
    problem: ScaledProblem,
    factor: Factor,
    basis: Array,
    region: Region,
    exact: float = EXACT_RESIDUAL,
    accepted: float = ACCEPTED_RESIDUAL,
) -> Roots | None:
    """The roots in a region by residual inverse iteration (Neumaier 1985), with vectors; None if it
    does not converge.

    The problem projected onto the basis gives roots and vectors. P^-1 times their residuals, with P
    at one value near all of them, is added to the basis, which then gives better roots, and so on.

    Parameters
    ----------
    problem : ScaledProblem
        n rows.
    factor : Factor
        Of P at a value near the roots.
    basis : ndarray (n, d)
        Real and orthonormal; it nearly holds their right vectors.
    region : Rectangle or Disc
        Where.
    exact, accepted : float
        Corrections end when the backward error of each right vector is at most `exact`, and of each
        left vector, which only conditions and derivatives depend on, at most `accepted`. Once a
        correction has not halved the worst error, limits that are accepted / exact times as large
        suffice: `accepted` for right vectors, accepted^2 / exact for left ones.
    """
    if not basis.size:
        return Roots.none(problem.n)
    V = basis
    M = V.T @ (problem.M @ V)
    C = V.T @ (problem.C @ V)
    K = V.T @ (problem.K @ V)
    _, _, stiffness = problem.norms  # |K|, whose rounding the projected K carries
    worst_before = np.inf
    for _ in range(MOST_CORRECTIONS):
        values = dense_values(M, C, K, stiffness=stiffness)
        values = values[region.contains(values)]
        roots = roots_at(M, C, K, values, stiffness).expanded(V)
        residuals = residuals_of(problem, roots).outside(V)
        # errors over their limits
        right_ratios = np.linalg.norm(residuals.right, axis=0) / exact
        left_ratios = np.linalg.norm(residuals.left, axis=0) / accepted
        worst = max(np.max(right_ratios, initial=0.0), np.max(left_ratios, initial=0.0))
        is_halved = worst <= worst_before / 2
        if worst <= 1.0 or (not is_halved and worst <= accepted / exact):
            return roots
        worst_before = worst
        old = V
        corrections = residuals.corrections(factor, right_ratios > 1.0, left_ratios > 1.0)
        # directions that make up less than 1e-4 of a correction are left to the next one
        V = enlarged(V, corrections, dropped=1e-4)
        new = np.ascontiguousarray(V[:, old.shape[1] :])
        grow = partial(grown, old=old, new=new)
        M, C, K = side_by_side(grow, [M, C, K], [problem.M, problem.C, problem.K])
    return None


class Residuals(NamedTuple):
    """P x and P' conj(y) of right and left vectors x, y of m roots, over a bound of |P|; P' is the
    transpose."""

    right: ComplexArray  # (n, m)
    left: ComplexArray  # (n, m)

    def outside(self, basis: Array) -> Residuals:
        """The parts of the residuals that are orthogonal to a basis (n, d), real and orthonormal.

        They vanish once the basis holds the vectors. The parts in the basis are rounding, and more
        than that where close roots share vectors, see `roots_at`: more directions cannot lessen
        them.
        """
        right = self.right - multiply(basis, multiply(basis.T, self.right))
        left = self.left - multiply(basis, multiply(basis.T, self.left))
        return Residuals(right, left)

    def corrections(self, factor: Factor, of_right: Bools, of_left: Bools) -> ComplexArray:
        """Directions P^-1 r (n, k) that correct some of the right and some of the left vectors, by
        a factor of P near the roots; `of_right`, `of_left` (m,) choose them."""
        columns = [self.right[:, of_right], self.left[:, of_left]]
        return np.hstack(list(side_by_side(factor.solve, columns, [False, True])))


def residuals_of(problem: ScaledProblem, roots: Roots) -> Residuals:
    """Residuals of right and left vectors of roots, relative to a bound of |P| at each root."""
    sizes = divisor(problem.size(roots.values))
    problems = [problem, problem.transposed()]
    vectors = [roots.right, roots.left.conj()]
    images = side_by_side(lambda P, x: P.apply(roots.values, x) / sizes, problems, vectors)
    return Residuals(*images)


def grown(projected: Array, A: Matrix, old: Array, new: Array) -> Array:
    """V' A V of a basis V = [old, new], from `projected` = old' A old."""
    image = A @ new
    return np.block([[projected, old.T @ image], [(A.T @ new).T @ old, new.T @ image]])


def enlarged(basis: Array, columns: NDArray, dropped: float) -> Array:
    """An orthonormal real basis (n, d), enlarged by the real and imaginary parts of columns.

    Directions in which unit columns add less than `dropped` are left out.
    """
    units = columns / divisor(np.linalg.norm(columns, axis=0))
    parts = [units.real, units.imag] if np.iscomplexobj(columns) else [units]
    new, _ = orthogonalise(basis, np.hstack(parts).astype(float), dropped)
    return np.hstack([basis, new])
