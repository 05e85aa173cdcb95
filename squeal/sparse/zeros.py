"""Roots that are zero: motions that nothing holds.

A motion x with K x = 0 has the root 0, and has it twice where no damping acts on it. Computed, a
double root lies the square root of rounding away, on either side of the imaginary axis. So no small
root decides, but what K and C do to the motions, and these roots are then exactly zero.
"""

import math

import numpy as np

from squeal.linear.matrices import EPS, noise_of, null_spaces, zero_roots
from squeal.linear.system import Matrix
from squeal.sparse.factor import factorise
from squeal.sparse.merge import SAME, SPANNED, Roots, span
from squeal.sparse.quadratic import Array, ComplexArray, Quadratic

ROUNDING = 64 * EPS  # of |K|: what it does to a motion that it does not hold
FASTEST = math.sqrt(ROUNDING)  # of the system's rate: how far from zero such roots are computed
REACH = 3 * FASTEST  # ... and with what unsymmetric matrices add
SHIFT = 1e-7  # of the system's rate


def free_motions(
    M: Matrix, C: Matrix | None, K: Matrix, noise: float | None = None
) -> tuple[int, Matrix, Matrix]:
    """How many roots are zero; right and left null vectors (n, k) of K, matrices (n, n).

    Singular values of K up to `noise`, if not given of its own rounding, are zero.
    """
    noise = noise_of(K) if noise is None else noise
    null, conull = null_spaces(K, noise)
    if not null.shape[1]:
        return 0, null, conull
    if C is None or not C.any():
        return 2 * zero_roots(K, noise, M), null, conull
    return _multiplicity(M, C, noise, null, conull), null, conull


def _multiplicity(M: Matrix, C: Matrix, noise: float, null: Matrix, conull: Matrix) -> int:
    """Each motion counts twice but for those whose damping moves a root by more than rounding."""
    damping = np.linalg.svd(conull.conj().T @ (C @ null), compute_uv=False)
    mass = float(np.linalg.norm(conull.conj().T @ (M @ null), 2))
    return int(2 * null.shape[1] - np.sum(damping > math.sqrt(noise * mass)))


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
    size = np.abs(roots.values)
    slow = size <= REACH * problem.rate
    null, conull = _null_spaces(problem, roots.right[:, slow])
    if null.shape[1]:
        zeros = _multiplicity(problem.M, problem.C, ROUNDING * problem.norms[2], null, conull)
        rest = roots.right - null @ (null.conj().T @ roots.right)
        slow &= np.linalg.norm(rest, axis=0) <= SPANNED
        if zeros < 2 * null.shape[1]:  # one root of a motion decays
            slow &= size <= FASTEST * problem.rate
        pick = np.arange(zeros) % null.shape[1]
        exact = Roots(np.zeros(zeros, dtype=complex), null[:, pick], conull[:, pick])
        roots = roots.picked(~slow).joined(exact)
    if not problem.real:
        return roots
    values = roots.values
    partner = np.abs(values[:, None] - values.conj()) <= place_of(problem, values)
    alone = partner.sum(axis=1) == np.diag(partner)
    return Roots(np.where(alone, values.real + 0j, values), roots.right, roots.left)


def _null_spaces(problem: Quadratic, x: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Orthonormal right and left null vectors (n, k) of K from vectors (n, m) that span them but
    for what C adds, by inverse iteration."""
    if not x.shape[1]:
        return x, x
    held = problem.K + (SHIFT * problem.rate) ** 2 * problem.M
    try:
        factor = factorise(held.tocsc())
    except ZeroDivisionError:
        return x[:, :0], x[:, :0]
    spaces = []
    for transposed, K in ((False, problem.K), (True, problem.K.T)):
        z = span(x.conj() if transposed else x)
        for _ in range(2):
            z = np.linalg.qr(factor.solve(z, transposed))[0]
        _, singular, right = np.linalg.svd(K @ z, full_matrices=False)
        z = z @ right.conj().T[:, singular <= ROUNDING * problem.norms[2]]
        spaces.append(z.conj() if transposed else z)
    null, conull = spaces
    if null.shape != conull.shape:
        return x[:, :0], x[:, :0]
    return null, conull
