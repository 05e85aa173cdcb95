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
    # each motion counts twice but for those whose damping moves a root by more than rounding
    damping = np.linalg.svd(conull.conj().T @ (C @ null), compute_uv=False)
    mass = float(np.linalg.norm(conull.conj().T @ (M @ null), 2))
    zeros = 2 * null.shape[1] - int(np.sum(damping > math.sqrt(noise * mass)))
    return zeros, null, conull


def dense_values(
    M: Matrix, C: Matrix | None, K: Matrix, stiffness: float | None = None
) -> ComplexArray:
    """All finite roots of lambda^2 M + lambda C + K, matrices (n, n) of any kind.

    Without damping those on the imaginary axis are exactly there, and roots of motions that nothing
    holds are exactly zero. K may carry the rounding of a matrix of a greater norm `stiffness`.
    """
    C = None if C is None or not C.any() else C
    condition = np.linalg.cond(unit_diagonal(M))
    if 1.0 / condition <= ILL:
        problem = quadratic(M, C, K)
        M, C, K = (X.toarray() for X in (problem.M, problem.C, problem.K))
        return pencil_values(M, C, K)
    A, B = _normalised(M, K), None if C is None else _normalised(M, C)
    if B is None:
        solve = np.linalg.eigvalsh if np.array_equal(A, A.conj().T) else np.linalg.eigvals
        half = np.sqrt(-solve(A).astype(complex))
        values = np.concatenate([half, -half])
    else:
        matrix, rate = first_order(A, B)
        values = np.asarray(np.linalg.eigvals(matrix) * rate, dtype=complex)
    size = np.abs(values)
    if stiffness is not None:
        zeros = free_motions(M, C, K, ROUNDING * stiffness)[0]
    elif np.min(size) <= EPS**0.25 * np.max(size):  # as far as chains leave roots from zero
        zeros = free_motions(np.eye(len(M)), B, A, noise_of(A, 4 * EPS * condition))[0]
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


def pencil_values(M: Matrix, C: Matrix | None, K: Matrix) -> ComplexArray:
    """All finite roots of scaled matrices (n, n), whatever M is."""
    from scipy.linalg import eigvals

    C = None if C is None or not C.any() else C
    U, masses, Wh = np.linalg.svd(M)
    n, r = len(M), rank_of(np.linalg.svd(unit_diagonal(M), compute_uv=False))
    masses = np.where(np.arange(n) < r, masses, 0.0)
    size = norm_of(K) or 1.0
    rate = 2.0 ** round(np.log2(size / (masses[0] or 1.0)) / 2)
    masses, K = masses * (rate**2 / size), U.conj().T @ (K / size) @ Wh.conj().T
    if C is None:
        E, F, infinite = np.diag(masses), K, n - r
    else:
        C = U.conj().T @ (C * (rate / size)) @ Wh.conj().T
        E, F = _state_form(masses, C, K, r)
        light = np.linalg.svd(C[r:, r:], compute_uv=False)
        infinite = n - r - (rank_of(light, norm_of(C)) if r < n else 0)
    alpha, beta = eigvals(F, E, homogeneous_eigvals=True)
    fast = np.abs(beta) / np.maximum(np.abs(alpha), np.finfo(float).tiny)
    finite = (fast > 4 * EPS) | (infinite == 0)  # all, however fast, if none has to be infinite
    finite[np.argsort(fast)[:infinite]] = False
    values = (alpha / np.where(beta == 0, 1.0, beta))[finite].astype(complex)
    if not np.iscomplexobj(F):  # the second of a pair is exactly the conjugate of the first
        lower = np.flatnonzero(values.imag < 0)
        values[lower] = values[lower - 1].conj()
    each = 2 if C is None else 1
    zeros = free_motions(np.diag(masses), C, K)[0]
    values[np.argsort(np.abs(values))[: zeros // each]] = 0.0
    if C is None:
        half = np.sqrt(-values)
        half = np.where((values.imag == 0) & (values.real > 0), 1j * np.abs(half.imag), half)
        values = np.concatenate([half, -half])
    return np.asarray(values * rate)


def _state_form(masses: Array, C: Matrix, K: Matrix, r: int) -> tuple[Matrix, Matrix]:
    """E x' = F x: the state is what has mass, its velocity, and what has none."""
    state = len(K) + r
    E, F = np.zeros((2, state, state), dtype=np.result_type(C, K))
    E[:r, :r] = F[:r, r : 2 * r] = np.eye(r)
    E[r:, r : 2 * r] = np.diag(masses)[:, :r]
    E[r:, 2 * r :] = C[:, r:]
    F[r:, :r], F[r:, r : 2 * r], F[r:, 2 * r :] = -K[:, :r], -C[:, :r], -K[:, r:]
    return E, F


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
    return roots_at(M, C, K, values[region.contains(values)], left, stiffness)


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
    right = np.full((len(M), len(values)), np.nan, dtype=complex)
    other = right.copy()
    for group in _clusters(values):
        mean = values[group].mean()
        if mean == 0.0:
            noise = None if stiffness is None else ROUNDING * stiffness
            _, null, conull = free_motions(M, C, K, noise)
            if null.shape[1]:  # a chain repeats its one vector
                pick = np.arange(len(group)) % null.shape[1]
                right[:, group], other[:, group] = null[:, pick], conull[:, pick]
                continue
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
    """Right and left unit vectors (n, count) of the smallest singular values, by inverse iteration
    on one factorisation; left ones NaN unless wanted. Where fewer vanish the first is repeated."""
    from scipy.linalg import lu_solve

    rng = np.random.default_rng(len(P))
    x = rng.standard_normal((len(P), count)) + 1j * rng.standard_normal((len(P), count))
    factor = _near_singular(P)

    def solved(b: ComplexArray, trans: int) -> ComplexArray:
        return np.linalg.qr(lu_solve(factor, b, trans=trans, check_finite=False))[0]

    # the inverse of P and of its adjoint by turns converge to singular vectors
    y = solved(x, 2)
    for _ in range(1 if count == 1 else 3):
        x = solved(y, 0)
        y = solved(x, 2) if left or count > 1 else y
    if count > 1:
        rest = np.linalg.norm(P @ x, axis=0)
        defective = rest > max(100 * rest[0], 1e-6 * norm_of(P))
        x[:, defective], y[:, defective] = x[:, :1], y[:, :1]
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


def dense_spectrum(M: Matrix, C: Matrix | None, K: Matrix) -> tuple[Eigenvalue, ...]:
    """All finite roots with vectors, backward errors and conditions; matrices (n, n).

    Raises InputError for an empty row, and where every number is a root.
    """
    problem = quadratic(M, C, K)
    M, C, K = (X.toarray() for X in (problem.M, problem.C, problem.K))
    check_regular(M, C, K)
    values = pencil_values(M, C, K)
    if not problem.real:
        return listed(problem, roots_at(M, C, K, values, left=True))
    roots = roots_at(M, C, K, values[values.imag >= 0.0], left=True)
    return listed(problem, roots.joined(roots.picked(roots.values.imag > 0.0).mirrored()))
