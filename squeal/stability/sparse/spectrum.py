"""All roots of a small problem whose M may be singular, not symmetric or complex."""

from __future__ import annotations

import numpy as np

from squeal.stability.eigen import Eigenvalue
from squeal.stability.sparse.dense import REGULAR
from squeal.stability.sparse.merge import Roots
from squeal.stability.sparse.modes import listed
from squeal.stability.sparse.scaled import quadratic
from squeal.stability.terms import Matrix

INFINITE = 1e-12  # of the largest |1/lambda|, below which a root is at infinity


def dense_spectrum(M: Matrix, C: Matrix | None, K: Matrix) -> tuple[Eigenvalue, ...]:
    """All finite roots with vectors, backward errors and conditions; matrices (n, n).

    Of real matrices both of a conjugate pair, of complex ones those of rising motion
    Im lambda >= 0 alone. Raises InputError for an empty row.
    """
    from scipy.linalg import eig

    problem = quadratic(M, C, K)
    M, C, K = (X.toarray() for X in (problem.M, problem.C, problem.K))
    n, rate = len(M), 2.0 ** round(np.log2(problem.rate or 1.0))
    eye, zero = np.eye(n), np.zeros((n, n))
    if 1.0 / np.linalg.cond(M, 1) > REGULAR:
        lower = np.linalg.solve(M, np.hstack([-K / rate**2, -C / rate]))
        values, left, right = eig(np.vstack([np.hstack([zero, eye]), lower]), left=True)
        left = np.vstack([left[:n], np.linalg.solve(M.conj().T, left[n:])])
        finite = np.ones(len(values), dtype=bool)
    else:
        size = problem.norms[2]
        A = np.block([[zero, eye], [-K / size, -C * (rate / size)]])
        B = np.block([[eye, zero], [zero, M * (rate**2 / size)]])
        (alpha, beta), left, right = eig(A, B, left=True, homogeneous_eigvals=True)
        finite = np.abs(beta) > INFINITE * np.abs(alpha)
        with np.errstate(divide="ignore", invalid="ignore"):
            values = alpha / beta
    if not problem.real:
        finite &= values.imag >= 0.0
    values, x, y = values[finite] * rate, right[:n, finite], left[n:, finite]
    unit = [v / np.linalg.norm(v, axis=0) for v in (x, y)]
    return listed(problem, Roots(values, *unit))
