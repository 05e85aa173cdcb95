"""Roots that are zero: motions that nothing holds.

A motion x with K x = 0 has the root 0, and has it twice where no damping acts on it. Computed, a
double root lies the square root of rounding away, on either side of the imaginary axis. So no small
root decides, but what K and C do to the motions, and these roots are then exactly zero.
"""

import math

import numpy as np

from squeal.stability.matrices import EPS, rank_of
from squeal.stability.sparse.merge import SAME, SPANNED, Roots
from squeal.stability.sparse.quadratic import Array, ComplexArray, Quadratic
from squeal.stability.terms import Matrix

ROUNDING = 64 * EPS  # of |K|: what it does to a motion that it does not hold
FASTEST = math.sqrt(ROUNDING)  # of the system's rate: how far from zero such roots are computed
SYMMETRIC = 1e-12  # of |K|: its skew part, for the same null space on both sides
SHIFT = 1e-7  # of the system's rate


def free_motions(
    M: Matrix, C: Matrix, K: Matrix, size: float | None = None
) -> tuple[int, Matrix, Matrix]:
    """How many roots are zero; right and left null vectors (n, k) of K, matrices (n, n).

    Where K comes from a matrix of that `size` (2-norm) it carries that one's rounding.
    """
    left, singular, right = np.linalg.svd(K)
    rank = rank_of(singular) if size is None else int(np.sum(singular > ROUNDING * size))
    null, conull = right[rank:].conj().T, left[:, rank:]
    stiffness = size or (float(singular[0]) if len(singular) else 0.0)
    return _multiplicity(M, C, stiffness, null, conull), null, conull


def _multiplicity(M: Matrix, C: Matrix, size: float, null: Matrix, conull: Matrix) -> int:
    """Each motion counts twice but for those whose damping moves a root by more than rounding."""
    if not null.shape[1]:
        return 0
    damping = np.linalg.svd(conull.conj().T @ (C @ null), compute_uv=False)
    mass = float(np.linalg.norm(conull.conj().T @ (M @ null), 2))
    return int(2 * null.shape[1] - np.sum(damping > FASTEST * math.sqrt(size * mass)))


def slow_noise(problem: Quadratic, size: Array) -> Array:
    """How far rounding of K moves roots of a size (m,), rad/s: their squares alike."""
    return np.asarray(ROUNDING * problem.rate**2 / np.maximum(size, FASTEST * problem.rate))


def place_of(problem: Quadratic, values: ComplexArray) -> Array:
    """How far from each value (m,) the same root may be computed a second time, rad/s."""
    size = np.abs(values)
    return np.maximum(SAME * size, slow_noise(problem, size))


def settled(problem: Quadratic, roots: Roots) -> Roots:
    """Roots whose motion nothing holds are exactly zero, as often as they are roots.

    However many copies of them several shifts brought; of real matrices a root without a partner
    lies on the real axis.
    """
    values, x = roots.values, roots.right
    length = np.abs(values)
    forces = [
        factor * np.linalg.norm(A @ x, axis=0)
        for factor, A in ((length**2, problem.M), (length, problem.C), (1.0, problem.K))
    ]
    free = np.max(forces, axis=0) <= ROUNDING * problem.norms[2]
    if np.any(free):
        basis, singular, _ = np.linalg.svd(x[:, free], full_matrices=False)
        null = basis[:, singular > SPANNED * singular[0]]
        conull = _left_null(problem, null)
        zeros = _multiplicity(problem.M, problem.C, problem.norms[2], null, conull)
        pick = np.arange(zeros) % null.shape[1]
        exact = Roots(np.zeros(zeros, dtype=complex), null[:, pick], conull[:, pick])
        roots = roots.picked(~free).joined(exact)
    if not problem.real:
        return roots
    values = roots.values
    partner = np.abs(values[:, None] - values.conj()) <= place_of(problem, values)
    alone = partner.sum(axis=1) == np.diag(partner)
    return Roots(np.where(alone, values.real + 0j, values), roots.right, roots.left)


def _left_null(problem: Quadratic, null: ComplexArray) -> ComplexArray:
    """The left null vectors of K, by inverse iteration where it is not symmetric."""
    from squeal.stability.sparse.factor import factorise_at

    skew = abs(problem.K - problem.K.conj().T).max()
    if skew <= SYMMETRIC * problem.norms[2]:
        return null
    _, factor = factorise_at(problem, complex(SHIFT * problem.rate))
    y = null.conj()
    for _ in range(2):
        y = np.linalg.qr(factor.solve(y, transposed=True))[0]
    return np.asarray(y.conj())
