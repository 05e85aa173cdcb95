"""Two roots that come close: the 2 x 2 problem of their invariant subspace.

Its mean and d = ((z1 - z2) / 2)^2 stay smooth where the two coalesce, and are well conditioned
there although neither root is.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from squeal.linear.following.line import Line
from squeal.linear.matrices import EPS, norm_of
from squeal.numerics.inverse import near_singular

ROUNDS = 60  # of block inverse iteration, at most
CONVERGED = 64 * EPS  # of |A|: residual of a subspace that has converged
STALLED = 0.9  # of the residual before: more is left by a round that helps no more
SURE = 4.0  # standard deviations of rounding that a noise holds
NUDGE = 1e-7  # of the shift, so that the factorised matrix is regular


@dataclass(frozen=True)
class Pair:
    """Mean and d at a value of the parameter, with first derivatives and, of d, half the second.

    The second derivative holds where the pair is close, which is where it is used; `noise` is the
    error of d by rounding and by what its subspaces, spanned by `right` and `left` (N, 2), are off.
    """

    value: float
    mean: complex
    mean_slope: complex
    d: complex
    d_slope: complex
    d_bend: complex
    noise: float
    right: NDArray = field(repr=False)
    left: NDArray = field(repr=False)

    def roots(self, step: np.ndarray) -> np.ndarray:
        """Both roots, (..., 2), at values beyond this one by `step`."""
        d = self.d + step * self.d_slope + step**2 * self.d_bend
        mean, half = self.mean + step * self.mean_slope, np.sqrt(np.asarray(d) + 0j)
        return np.stack([mean - half, mean + half], axis=-1)


def pair_at(line: Line, p: float, near: complex, right: NDArray, left: NDArray) -> Pair:
    """The pair of roots next to `near` at p; right, left (N, 2) vectors that it begins from."""
    from scipy.linalg import lu_solve

    A, derivative, rounding = line.both(p)
    size = norm_of(A)
    shift = near + NUDGE * (abs(near) or size) * (1 + 1j)
    if not line.damped and abs(near.imag) <= NUDGE * abs(near):
        shift = shift.real
        # two conjugate columns have one real part
        right, left = np.asarray(right.real + right.imag), np.asarray(left.real + left.imag)
    factor = near_singular(A - shift * np.eye(len(A)))
    X = _subspace(A, size, right, lambda X: lu_solve(factor, X, check_finite=False))
    Y = _subspace(A.T, size, left, lambda Y: lu_solve(factor, Y, trans=2, check_finite=False))
    across = Y.conj().T @ X
    inverse = np.linalg.inv(across)
    small = inverse @ (Y.conj().T @ (A @ X))
    slope = inverse @ (Y.conj().T @ (derivative @ X))
    mean, mean_slope = np.trace(small) / 2, np.trace(slope) / 2
    N, S = small - mean * np.eye(2), slope - mean_slope * np.eye(2)
    # independent roundings in the entries of A, and what the subspaces miss, to second order
    entries = np.sqrt(np.abs(inverse @ Y.conj().T) ** 2 @ (A**2 @ np.abs(X) ** 2))
    beside = lu_solve(factor, A @ X - X @ small, check_finite=False)
    beside = beside - X @ (inverse @ (Y.conj().T @ beside))
    missed = np.abs(inverse @ (Y.conj().T @ (A @ beside)))
    error = SURE * (max(rounding, EPS) * entries + missed)
    return Pair(
        p,
        complex(mean),
        complex(mean_slope),
        complex(-np.linalg.det(N)),
        complex(np.trace(N @ S)),
        complex(np.trace(S @ S) / 2),
        float(np.linalg.norm(np.abs(N.T) * error) + np.linalg.norm(error) ** 2),
        X,
        Y,
    )


def _subspace(
    A: NDArray, size: float, start: NDArray, solve: Callable[[NDArray], NDArray]
) -> NDArray:
    """The invariant subspace (N, 2) that inverse iteration turns `start` to.

    Next to a coalescence both columns become one vector but for half the digits; what these leave
    is lessened by Newton's steps.
    """
    X, before, step = np.linalg.qr(solve(start))[0], np.inf, False
    for _ in range(ROUNDS):
        image = A @ X
        rest = image - X @ (X.conj().T @ image)
        left = float(np.linalg.norm(rest))
        if left <= CONVERGED * size or (step and left > STALLED * before):
            break
        step = step or left > STALLED * before
        if step:
            beside = solve(rest)
            X = np.linalg.qr(X - beside + X @ (X.conj().T @ beside))[0]
        else:
            X = np.linalg.qr(solve(X))[0]
        before = left
    return X
