"""How fast a root of a frequency band can grow at most: definite matrices beyond a real part.

x^H (1 - i t) P(lambda) x has the real part x^H T x with T = K_r + t K_i + (a^2 - b^2 + 2 a b t) M +
(a + b t) C_r - (b - a t) C_i at lambda = a + i b, where A_r and i A_i are the Hermitian and the
skew part of A. Where T is positive definite, lambda is no root. T is concave in b, so that it is
definite in low <= b <= high if it is at both ends, and it grows with a if 2 (a + b t) M + C_r +
t C_i is positive: the two ends at one a speak for all that lies to the right.
"""

from typing import Any

import numpy as np

from squeal.linear.matrices import norm_of
from squeal.sparse.factor import FULL
from squeal.sparse.quadratic import Quadratic
from squeal.sparse.region import Rectangle

ROWS = 20_000  # of larger systems no bound is sought: its factorisations cost as much as the roots
DOUBLINGS = 10  # of the real part at which a region ends
ROUNDING = 1e-13  # of a matrix: a semidefinite one passes, and a mass that is nearly symmetric


def growth_bound(problem: Quadratic, region: Rectangle) -> float | None:
    """A real part (1/s), that of the region's right edge or more, that no root at the region's
    imaginary parts exceeds; None if none was proved up to 1024 times that of the edge."""
    if problem.n > ROWS or region.high_real <= 0.0:
        return None
    (M, C, K), skew = _parts(problem)
    if norm_of(skew[0]) > ROUNDING * problem.norms[0]:
        return None
    low, high = region.low_imag, region.high_imag
    for k in range(DOUBLINGS + 1):
        a = 2.0**k * region.high_real
        t = (high + low) / (2 * a)  # as much of M at both ends

        def turned(b: float, a: float = a, t: float = t) -> Any:
            parts = K + t * skew[2] + (a * a - b * b + 2 * a * b * t) * M
            return parts + (a + b * t) * C - (b - a * t) * skew[1]

        slope = 2 * (a + low * t) * M + C + t * skew[1]
        if definite(turned(high)) and definite(_lifted(slope)) and definite(turned(low)):
            return a
    return None


def _parts(problem: Quadratic) -> tuple[list[Any], list[Any]]:
    """A_r and A_i of M, C and K; real where they can be."""
    given = problem.M, problem.C, problem.K
    other = [A.conj().T.tocsc() for A in given]
    even = [(A + B) / 2 for A, B in zip(given, other, strict=True)]
    odd = [(A - B) / 2j for A, B in zip(given, other, strict=True)]
    return even, odd


def _lifted(A: Any) -> Any:
    """A with rounding added to the diagonal, so that rows without mass and damping pass."""
    from scipy.sparse import eye_array

    return A + ROUNDING * norm_of(A) * eye_array(A.shape[0])


def definite(A: Any) -> bool:
    """True if a Hermitian sparse array is positive definite: if all pivots on its diagonal are."""
    from scipy.sparse.linalg import splu

    A = A.tocsc(copy=True)
    A.eliminate_zeros()
    if A.nnz == A.shape[0]:
        return bool(np.all(A.diagonal().real > 0.0))
    if np.iscomplexobj(A.data) and not A.data.imag.any():
        A = A.real.copy()  # contiguous, as the factorisation wants it
    if np.any(A.diagonal().real <= 0.0):
        return False
    if A.nnz > FULL * A.shape[0] ** 2:
        try:
            np.linalg.cholesky(A.toarray())
        except np.linalg.LinAlgError:
            return False
        return True
    try:
        factor = splu(
            A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError:  # a pivot vanishes
        return False
    pivots = factor.U.diagonal()
    return bool(np.array_equal(factor.perm_r, factor.perm_c) and np.all(pivots.real > 0.0))
