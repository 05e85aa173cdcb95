"""All roots where M is singular or nearly so, from a pencil that its inverse does not enter.

In singular vectors of M what has no mass to rounding is exactly zero, and its velocity no unknown.
The QZ algorithm is backward stable in M, C and K: what a light mass does to the inverse of M costs
the roots of the heavy ones no digit.
"""

import numpy as np

from squeal.linear.matrices import EPS, Array, norm_of, rank_of, unit_diagonal
from squeal.linear.system import Matrix
from squeal.sparse.merge import Roots
from squeal.sparse.quadratic import ComplexArray
from squeal.sparse.zeros import free_motions


def pencil_roots(M: Matrix, C: Matrix, K: Matrix) -> Roots:
    """All finite roots of lambda^2 M + lambda C + K with unit vectors; matrices (n, n), scaled.

    Without damping roots on the imaginary axis are exactly there; a K that is singular to rounding
    gives roots that are exactly zero.
    """
    U, masses, Wh = np.linalg.svd(M)
    W, r = Wh.conj().T, rank_of(np.linalg.svd(unit_diagonal(M), compute_uv=False))
    masses = np.where(np.arange(len(M)) < r, masses, 0.0)
    square = (norm_of(K) or 1.0) / (masses[0] or 1.0)
    rate, size = 2.0 ** round(np.log2(square) / 2), norm_of(K) or 1.0
    C, K = (U.conj().T @ X @ W for X in (C * (rate / size), K / size))
    masses = masses * (rate**2 / size)
    values, x, y = _damped(masses, C, K, r) if C.any() else _undamped(masses, K, r)
    return Roots(values * rate, _unit(W @ x), _unit(U @ y))


def _undamped(masses: Array, K: Matrix, r: int) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    from scipy.linalg import eig

    pairs, left, right = eig(K, np.diag(masses), left=True, homogeneous_eigvals=True)
    kept = _finite(pairs[0], pairs[1], len(K) - r)
    squares = (pairs[0] / np.where(pairs[1] == 0, 1.0, pairs[1]))[kept]
    x, y = right[:, kept], left[:, kept]
    _pair(squares, K)
    _settle_zeros(squares, x, y, free_motions(np.diag(masses), None, K), 2)
    half = np.sqrt(-squares.astype(complex))
    half = np.where((squares.imag == 0) & (squares.real > 0), 1j * np.abs(half.imag), half)
    return np.concatenate([half, -half]), np.hstack([x, x]), np.hstack([y, y])


def _damped(
    masses: Array, C: Matrix, K: Matrix, r: int
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """The state is what has mass, its velocity, and what has none."""
    from scipy.linalg import eig

    n = len(K)
    state = n + r
    E, F = np.zeros((2, state, state), dtype=np.result_type(C, K))
    E[:r, :r] = F[:r, r : 2 * r] = np.eye(r)
    E[r:, r : 2 * r] = np.diag(masses)[:, :r]
    E[r:, 2 * r :] = C[:, r:]
    F[r:, :r], F[r:, r : 2 * r], F[r:, 2 * r :] = -K[:, :r], -C[:, :r], -K[:, r:]
    pairs, left, right = eig(F, E, left=True, homogeneous_eigvals=True)
    light = C[r:, r:]
    damped = rank_of(np.linalg.svd(light, compute_uv=False), norm_of(C)) if r < n else 0
    kept = _finite(pairs[0], pairs[1], n - r - damped)
    values = (pairs[0] / np.where(pairs[1] == 0, 1.0, pairs[1]))[kept].astype(complex)
    x = np.vstack([right[:r], right[2 * r :]])[:, kept].astype(complex)
    y = left[r:, kept].astype(complex)
    _pair(values, E)
    _settle_zeros(values, x, y, free_motions(np.diag(masses), C, K))
    return values, x, y


def _finite(alpha: ComplexArray, beta: ComplexArray, infinite: int) -> np.ndarray:
    """Which roots alpha / beta are finite, if at least so many are not; all, however fast, if none
    has to be infinite."""
    small = np.abs(beta) / np.maximum(np.abs(alpha), np.finfo(float).tiny)
    kept = (small > 4 * EPS) | (infinite == 0)
    kept[np.argsort(small)[:infinite]] = False
    return kept


def _pair(values: ComplexArray, matrix: Matrix) -> None:
    """Make the second of two conjugate roots of a real matrix exactly that."""
    if not np.iscomplexobj(matrix):
        lower = np.flatnonzero(values.imag < 0)
        values[lower] = values[lower - 1].conj()


def _settle_zeros(
    values: ComplexArray,
    x: ComplexArray,
    y: ComplexArray,
    free: tuple[int, Matrix, Matrix],
    each: int = 1,
) -> None:
    """Set the roots of free motions to zero; a value stands for `each` so many."""
    zeros, null, conull = free
    where = np.argsort(np.abs(values))[: zeros // each]
    values[where] = 0.0
    pick = np.arange(len(where)) % max(null.shape[1], 1)
    x[:, where], y[:, where] = null[:, pick], conull[:, pick]


def _unit(vectors: ComplexArray) -> ComplexArray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=0), dtype=complex)
