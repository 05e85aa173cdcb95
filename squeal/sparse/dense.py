"""Roots of small dense problems of any kind: M singular, not symmetric, complex; roots at zero.

A motion x with K x = 0 has the root 0, and has it twice where no damping acts on it. Computed, a
double root lies the square root of rounding away, on either side of the imaginary axis. So no small
root decides, but what K and C do to the motions, and these roots are then exactly zero.

Where M is singular or nearly so a pencil is solved that its inverse does not enter. In singular
vectors of M what has no mass to rounding is exactly zero, and its velocity no unknown. The QZ
algorithm is backward stable in M, C and K: what a light mass does to the inverse of M costs the
roots of the heavy ones no digit.
"""

import math
import warnings
from collections.abc import Iterable

import numpy as np

from squeal.linear.eigen import Eigenvalue
from squeal.linear.matrices import (
    EPS,
    ILL,
    Array,
    check_regular,
    first_order,
    noise_of,
    norm_of,
    null_spaces,
    rank_of,
    unit_diagonal,
    zero_roots,
)
from squeal.linear.system import Matrix
from squeal.sparse.argument_principle import Region
from squeal.sparse.quadratic import ComplexArray, Roots, listed, quadratic

ROUNDING = 64 * EPS  # of |K|: what it does to a motion that it does not hold
FAINT = 1e-3  # of the largest root: above the fourth root of rounding, which chains leave


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
    return multiplicity(M, C, noise, null, conull), null, conull


def multiplicity(M: Matrix, C: Matrix, noise: float, null: Matrix, conull: Matrix) -> int:
    """Each motion counts twice but for those whose damping moves a root by more than rounding."""
    damping = np.linalg.svd(conull.conj().T @ (C @ null), compute_uv=False)
    mass = float(np.linalg.norm(conull.conj().T @ (M @ null), 2))
    return int(2 * null.shape[1] - np.sum(damping > math.sqrt(noise * mass)))


def dense_values(
    M: Matrix, C: Matrix | None, K: Matrix, stiffness: float | None = None
) -> ComplexArray:
    """All finite roots of lambda^2 M + lambda C + K, matrices (n, n) of any kind.

    Without damping those on the imaginary axis are exactly there, and roots of motions that nothing
    holds are exactly zero. K may carry the rounding of a matrix of a greater norm `stiffness`.
    """
    condition = np.linalg.cond(unit_diagonal(M))
    if 1.0 / condition <= ILL:
        problem = quadratic(M, C, K)
        return pencil_roots(*(X.toarray() for X in (problem.M, problem.C, problem.K))).values
    n = len(M)
    A = _normalised(M, K)
    if C is None or not C.any():
        solve = np.linalg.eigvalsh if np.array_equal(A, A.conj().T) else np.linalg.eigvals
        squares = -solve(A).astype(complex)
        half = np.sqrt(squares)
        B, values = None, np.concatenate([half, -half])
    else:
        B = _normalised(M, C)
        matrix, rate = first_order(A, B)
        values = np.asarray(np.linalg.eigvals(matrix) * rate, dtype=complex)
    size = np.abs(values)
    if stiffness is not None:
        zeros = free_motions(M, C, K, ROUNDING * stiffness)[0]
    elif np.min(size) <= FAINT * np.max(size):
        zeros = free_motions(np.eye(n), B, A, noise_of(A, 4 * EPS * condition))[0]
    else:
        return values
    values[np.argsort(size)[:zeros]] = 0.0
    return values


def _normalised(M: Matrix, K: Matrix) -> Matrix:
    """A with the roots -lambda^2 of the undamped problem, symmetric if M and K are."""
    try:
        lower = np.linalg.cholesky(M) if np.array_equal(M, M.T) else None
    except np.linalg.LinAlgError:
        lower = None
    if lower is None:
        return np.linalg.solve(M, K)
    inverse = np.linalg.inv(lower)
    A = inverse @ K @ inverse.T
    return (A + A.T) / 2 if np.array_equal(K, K.T) else A


def dense_roots(
    M: Matrix,
    C: Matrix | None,
    K: Matrix,
    region: Region,
    left: bool = False,
    stiffness: float | None = None,
) -> Roots:
    """The roots inside a region with unit right vectors and, if wanted, left ones (else NaN)."""
    values = dense_values(M, C, K, stiffness)
    values = values[region.contains(values)]
    return roots_at(M, C, K, values, left, stiffness)


def roots_at(
    M: Matrix,
    C: Matrix | None,
    K: Matrix,
    values: ComplexArray,
    left: bool = False,
    stiffness: float | None = None,
) -> Roots:
    """Known roots, sorted, with unit right vectors and, if wanted, left ones (else NaN)."""
    values = values[np.lexsort((values.real, values.imag))]
    noise = None if stiffness is None else ROUNDING * stiffness
    right = np.full((len(M), len(values)), np.nan, dtype=complex)
    other = right.copy()
    for group in _clusters(values):
        if not values[group[0]]:
            _, null, conull = free_motions(M, C, K, noise)
            if null.shape[1]:
                pick = np.arange(len(group)) % null.shape[1]
                right[:, group], other[:, group] = null[:, pick], conull[:, pick]
                continue
        mean = values[group].mean()
        P = mean * mean * M + (0.0 if C is None else mean * C) + K
        right[:, group], other[:, group] = _null(P, len(group), left)
    return Roots(values, right, other)


def _clusters(values: ComplexArray) -> Iterable[list[int]]:
    """Indices of neighbouring values that are too close for a vector each."""
    group: list[int] = []
    for j, value in enumerate(values):
        if group and abs(value - values[group[-1]]) > 1e-7 * abs(value):
            yield group
            group = []
        group.append(j)
    if group:
        yield group


def _null(P: ComplexArray, count: int, left: bool) -> tuple[ComplexArray, ComplexArray]:
    """Orthonormal right and left vectors (n, count) of the smallest singular values, by inverse
    iteration on one factorisation; left ones NaN unless wanted."""
    from scipy.linalg import lu_solve

    n = len(P)
    rng = np.random.default_rng(n)
    x = rng.standard_normal((n, count)) + 1j * rng.standard_normal((n, count))
    factor = _near_singular(P)

    def solved(b: ComplexArray, trans: int) -> ComplexArray:
        return np.linalg.qr(lu_solve(factor, b, trans=trans, check_finite=False))[0]

    # the inverse of P and of its adjoint by turns converge to singular vectors
    y = solved(x, 2)
    for _ in range(1 if count == 1 else 3):
        x = solved(y, 0)
        y = solved(x, 2) if left or count > 1 else y
    return x, y if left else np.full_like(x, np.nan)


def _near_singular(P: Matrix) -> tuple[Matrix, Matrix]:
    """LU factors of P (n, n), pivots that vanish replaced by rounding: what they solve points along
    the null space."""
    from scipy.linalg import lu_factor

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a singular P is what is expected here
        lu, pivots = lu_factor(P, check_finite=False)
    floor = EPS / 2 * (float(np.abs(P).max()) or 1.0)
    small = np.flatnonzero(np.abs(np.diag(lu)) < floor)
    lu[small, small] = floor
    return lu, pivots


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


def dense_spectrum(M: Matrix, C: Matrix | None, K: Matrix) -> tuple[Eigenvalue, ...]:
    """All finite roots with vectors, backward errors and conditions; matrices (n, n).

    Of real matrices both of a conjugate pair, of complex ones those of rising motion
    Im lambda >= 0 alone. Raises InputError for an empty row, and where
    every number is a root.
    """
    problem = quadratic(M, C, K)
    matrices = [X.toarray() for X in (problem.M, problem.C, problem.K)]
    check_regular(*matrices)
    roots = pencil_roots(*matrices)
    return listed(problem, roots if problem.real else roots.picked(roots.values.imag >= 0.0))
