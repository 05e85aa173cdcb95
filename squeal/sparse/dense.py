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
from numpy.typing import NDArray

from squeal.errors import InputError
from squeal.linear.eigen import Eigenvalue
from squeal.linear.matrices import (
    EPS,
    ILL,
    check_regular,
    divisor,
    first_order,
    noise_of,
    norm_of,
    null_spaces,
    rank_of,
    reduce,
    unit_diagonal,
    zero_roots,
)
from squeal.linear.system import Matrix
from squeal.sparse.quadratic import ComplexArray, Roots, listed, quadratic

ROUNDING = 64 * EPS  # of |K|: what it does to a motion that it does not hold


def _zeros(M: Matrix, C: Matrix | None, K: Matrix, noise: float) -> int:
    """How many roots are zero, of K (n, n) singular values up to `noise`."""
    null, conull = null_spaces(K, noise)
    if C is None or not C.any() or not null.size:
        return 2 * zero_roots(K, noise, M) if null.size else 0
    # each motion counts twice but for those whose damping moves a root by more than rounding
    damping = np.linalg.svd(conull.conj().T @ (C @ null), compute_uv=False)
    mass = float(np.linalg.norm(conull.conj().T @ (M @ null), 2))
    return 2 * null.shape[1] - int(np.sum(damping > math.sqrt(noise * mass)))


def dense_values(
    M: Matrix, C: Matrix | None, K: Matrix, stiffness: float | None = None
) -> ComplexArray:
    """All finite roots of lambda^2 M + lambda C + K, matrices (n, n) of any kind.

    Without damping those on the imaginary axis are exactly there, and roots of motions that nothing
    holds are exactly zero. K may carry the rounding of a matrix of a greater norm `stiffness`.
    """
    C = None if C is None or not C.any() else C
    try:
        reduced = reduce(M, C, K)
        A, B, rounding = reduced.A, reduced.B, reduced.rounding
    except InputError:  # a light mass, or one that is not symmetric; complex matrices
        condition = float(np.linalg.cond(unit_diagonal(M)))
        if 1.0 / condition <= ILL:
            problem = quadratic(M, C, K)
            return pencil_values(*(X.toarray() for X in (problem.M, problem.C, problem.K)))
        A, B = np.linalg.solve(M, K), None if C is None else np.linalg.solve(M, C)
        rounding = 4 * EPS * condition
    if B is None:
        solve = np.linalg.eigvalsh if np.array_equal(A, A.conj().T) else np.linalg.eigvals
        half = np.sqrt(-solve(A).astype(complex))
        values = np.concatenate([half, -half])
    else:
        matrix, rate = first_order(A, B)
        values = np.asarray(np.linalg.eigvals(matrix) * rate, dtype=complex)
    size = np.abs(values)
    if stiffness is not None:
        zeros = _zeros(M, C, K, ROUNDING * stiffness)
    elif np.min(size) <= EPS**0.25 * np.max(size):  # as far as chains leave roots from zero
        zeros = _zeros(np.eye(len(M)), B, A, noise_of(A, rounding))
    else:
        return values
    values[np.argsort(size)[:zeros]] = 0.0
    return values


def pencil_values(M: Matrix, C: Matrix | None, K: Matrix) -> ComplexArray:
    """All finite roots of scaled matrices (n, n), whatever M is."""
    from scipy.linalg import eigvals

    C = None if C is None or not C.any() else C
    U, masses, Wh = np.linalg.svd(M)
    n, r = len(M), rank_of(np.linalg.svd(unit_diagonal(M), compute_uv=False))
    size = divisor(norm_of(K))
    if r == 0 and C is not None:  # the system is of the first order
        rate = 2.0 ** np.round(np.log2(size / norm_of(C)))
    else:
        rate = 2.0 ** np.round(np.log2(size / divisor(masses[0])) / 2)
    M = np.diag(np.where(np.arange(n) < r, masses, 0.0) * (rate**2 / size))
    K, infinite = U.conj().T @ (K / size) @ Wh.conj().T, n - r
    E, F = M, K
    if C is not None:  # the state is what has mass, its velocity, and what has none
        C = U.conj().T @ (C * (rate / size)) @ Wh.conj().T
        eye, zero, none = np.eye(r), np.zeros((r, r)), np.zeros((r, n - r))
        E = np.block([[eye, zero, none], [np.zeros((n, r)), M[:, :r], C[:, r:]]])
        F = np.block([[zero, eye, none], [-K[:, :r], -C[:, :r], -K[:, r:]]])
        if r < n:
            light = np.linalg.svd(C[r:, r:], compute_uv=False)
            infinite -= rank_of(light, norm_of(C))
    alpha, beta = eigvals(F, E, homogeneous_eigvals=True)
    fast = np.abs(beta) / np.maximum(np.abs(alpha), np.finfo(float).tiny)
    finite = (fast > 4 * EPS) | (infinite == 0)  # all, however fast, if none has to be infinite
    finite[np.argsort(fast)[:infinite]] = False
    values = (alpha / np.where(beta == 0, 1.0, beta))[finite].astype(complex)
    if not np.iscomplexobj(F):  # the second of a pair is exactly the conjugate of the first
        lower = np.flatnonzero(values.imag < 0)
        values[lower] = values[lower - 1].conj()
    zeros = _zeros(M, C, K, noise_of(K))
    values[np.argsort(np.abs(values))[: zeros if C is not None else zeros // 2]] = 0.0
    if C is None:
        half = np.sqrt(-values)
        half = np.where((values.imag == 0) & (values.real > 0), 1j * np.abs(half.imag), half)
        values = np.concatenate([half, -half])
    return np.asarray(values * rate)


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
            noise = noise_of(K) if stiffness is None else ROUNDING * stiffness
            null, conull = null_spaces(K, noise)
            if null.shape[1]:  # a chain repeats its one vector
                pick = np.arange(len(group)) % null.shape[1]
                right[:, group], other[:, group] = null[:, pick], conull[:, pick]
                continue
        P = mean * mean * M + (0.0 if C is None else mean * C) + K
        right[:, group], other[:, group] = _null(P, len(group), left)
    return Roots(values, right, other)


def _clusters(values: ComplexArray) -> Iterable[NDArray[np.intp]]:
    """Indices of neighbouring values that are too close for a vector each."""
    apart = np.abs(np.diff(values)) > 1e-7 * np.abs(values[1:])
    return np.split(np.arange(len(values)), np.flatnonzero(apart) + 1) if len(values) else ()


def _null(P: ComplexArray, count: int, left: bool) -> tuple[ComplexArray, ComplexArray]:
    """Right and left unit vectors (n, count) of the smallest singular values, by inverse iteration
    on one factorisation; left ones NaN unless wanted. Where fewer vanish the first is repeated."""
    from scipy.linalg import lu_factor, lu_solve

    rng = np.random.default_rng(len(P))
    x = rng.standard_normal((len(P), 2 * count)).view(complex)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a singular P is what is expected here
        lu, pivots = lu_factor(P, check_finite=False)
    # pivots that vanish are rounding: what they solve points along the null space
    floor = EPS / 2 * (float(np.abs(P).max()) or 1.0)
    small = np.flatnonzero(np.abs(np.diag(lu)) < floor)
    lu[small, small] = floor

    def solved(b: ComplexArray, trans: int) -> ComplexArray:
        return np.linalg.qr(lu_solve((lu, pivots), b, trans=trans, check_finite=False))[0]

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
    upper = roots_at(M, C, K, values[values.imag >= 0.0], left=True)
    return listed(problem, upper.with_conjugates())
