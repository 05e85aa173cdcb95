"""Roots of small dense problems, such as reduced ones: all values, vectors of the wanted ones."""

from collections.abc import Iterable

import numpy as np

from squeal.numerics.inverse import near_singular
from squeal.stability.matrices import ILL, unit_diagonal
from squeal.stability.sparse.merge import Roots
from squeal.stability.sparse.pencil import pencil_roots
from squeal.stability.sparse.quadratic import ComplexArray, norm_of
from squeal.stability.sparse.region import Region
from squeal.stability.sparse.scaled import quadratic
from squeal.stability.terms import Matrix


def dense_values(M: Matrix, C: Matrix | None, K: Matrix) -> ComplexArray:
    """All finite roots of lambda^2 M + lambda C + K, matrices (n, n) of any kind.

    Without damping those on the imaginary axis are exactly there.
    """
    if 1.0 / np.linalg.cond(unit_diagonal(M)) <= ILL:
        problem = quadratic(M, C, K)
        return pencil_roots(*(X.toarray() for X in (problem.M, problem.C, problem.K))).values
    n = len(M)
    if C is None or not C.any():
        A = _normalised(M, K)
        solve = np.linalg.eigvalsh if np.array_equal(A, A.conj().T) else np.linalg.eigvals
        squares = -solve(A).astype(complex)
        half = np.sqrt(squares)
        return np.concatenate([half, -half])
    rate = np.sqrt(norm_of(K) / norm_of(M)) or 1.0
    eye, zero = np.eye(n), np.zeros((n, n))
    lower = np.linalg.solve(M, np.hstack([-K / rate**2, -C / rate]))
    first_order = np.vstack([np.hstack([zero, eye]), lower])
    return np.asarray(np.linalg.eigvals(first_order) * rate, dtype=complex)


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
    M: Matrix, C: Matrix | None, K: Matrix, region: Region, left: bool = False
) -> Roots:
    """The roots inside a region with unit right vectors and, if wanted, left ones (else NaN)."""
    values = dense_values(M, C, K)
    values = values[region.contains(values)]
    return roots_at(M, C, K, values, left)


def roots_at(
    M: Matrix, C: Matrix | None, K: Matrix, values: ComplexArray, left: bool = False
) -> Roots:
    """Known roots, sorted, with unit right vectors and, if wanted, left ones (else NaN)."""
    values = values[np.lexsort((values.real, values.imag))]
    C = np.zeros_like(M) if C is None else C
    right = np.full((len(M), len(values)), np.nan, dtype=complex)
    other = right.copy()
    for group in _clusters(values):
        mean = values[group].mean()
        P = mean * mean * M + mean * C + K
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
