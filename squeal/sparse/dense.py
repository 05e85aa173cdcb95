"""Roots of small dense problems, such as reduced ones: all values, vectors of the wanted ones."""

from collections.abc import Iterable

import numpy as np

from squeal.linear.matrices import EPS, ILL, noise_of, norm_of, unit_diagonal
from squeal.linear.system import Matrix
from squeal.numerics.inverse import near_singular
from squeal.sparse.merge import Roots
from squeal.sparse.pencil import pencil_roots
from squeal.sparse.quadratic import ComplexArray
from squeal.sparse.region import Region
from squeal.sparse.scaled import quadratic
from squeal.sparse.zeros import ROUNDING, free_motions

FAINT = 1e-3  # of the largest root: above the fourth root of rounding, which chains leave


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
        rate = np.sqrt(norm_of(K) / norm_of(M)) or 1.0
        B, eye = _normalised(M, C), np.eye(n)
        matrix = np.block([[np.zeros_like(eye), eye], [-A / rate**2, -B / rate]])
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
    factor = near_singular(P)

    def solved(b: ComplexArray, trans: int) -> ComplexArray:
        return np.linalg.qr(lu_solve(factor, b, trans=trans, check_finite=False))[0]

    # the inverse of P and of its adjoint by turns converge to singular vectors
    y = solved(x, 2)
    for _ in range(1 if count == 1 else 3):
        x = solved(y, 0)
        y = solved(x, 2) if left or count > 1 else y
    return x, y if left else np.full_like(x, np.nan)
