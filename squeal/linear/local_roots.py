"""One root, or two that are close, next to a given number, by quantities that stay smooth.

Two that come close are examined in the 2 x 2 problem of their invariant subspace. Its mean and the
squared half difference d = ((z1 - z2) / 2)^2 stay smooth where the two coalesce, and are well
conditioned there although neither root is.

A root z is -lambda^2 of an undamped system, -i lambda of an undamped gyroscopic one and lambda of
any other, see `continuation`. The line on which two meet is the real axis of the first two, the
imaginary axis of the third. A single root crosses that imaginary axis; without damping it passes
zero on the real one.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError
from squeal.linear.continuation import (
    DAMPED,
    SMALL_ROWS,
    UNDAMPED,
    Continuation,
    ProblemClass,
)
from squeal.linear.matrices import BEYOND_DOUBLES, EPS, Array, StandardProblem, norm_of

NEWTON_STEPS = 12
"""Steps of Newton's method at most, and half of the corrections to an invariant subspace."""
ROUNDING_DEVIATIONS = 4.0
"""Standard deviations of rounding that an interval holds."""


class EventFunction(NamedTuple):
    """A real function f of the parameter that vanishes at an event, at one value of it.

    value: f; slope: f'; bend: f''/2 where two roots meet, the only use of it, else 0; noise: how
    far rounding moves f.
    """

    value: float
    slope: float
    bend: float
    noise: float


class ClosestApproach(NamedTuple):
    """Where two roots come closest, by the two values of the parameter at which d = 0.

    centre: the middle of these values, as an offset from `LocalRoots.value`; half_width: half of
    their distance.
    """

    centre: float
    half_width: float


class LocalRoots(NamedTuple):
    """One root, or two that are close, at a value of the parameter, by quantities that are smooth.

    These are the mean of the two and d, the square of half their difference. Of one root the mean
    is the root itself, and d = 0.

    Attributes
    ----------
    value : float
        The parameter.
    mean, mean_slope : complex
        The mean and its derivative by the parameter.
    mean_noise : float
        How far rounding moves the mean.
    d, d_slope : complex
        d and its derivative by the parameter.
    d_bend : complex
        Half of the second derivative of d, by the coupling of the two roots alone.
    d_noise : float
        How far rounding moves d.
    right, left : array (N, 1) or (N, 2)
        Orthonormal bases of the right and the left invariant subspace.
    is_resolved : bool
        Whether the errors of these bases move the roots by no more than rounding does. Those of
        two move them by more if a third root is nearer to their mean than they are: the iteration
        for the bases does not converge then.
    """

    value: float
    mean: complex
    mean_slope: complex
    mean_noise: float
    d: complex
    d_slope: complex
    d_bend: complex
    d_noise: float
    right: NDArray
    left: NDArray
    is_resolved: bool

    @property
    def is_single(self) -> bool:
        """True of one root."""
        return self.right.shape[1] == 1

    def extrapolate(self, step: Array) -> tuple[NDArray, NDArray]:
        """The mean (...) and d (...) at distances `step` (...) from the value."""
        d = self.d + step * self.d_slope + step**2 * self.d_bend
        return self.mean + step * self.mean_slope, d

    def closest_approach(self, problem: ProblemClass) -> ClosestApproach | None:
        """Where two roots come closest, by the zeros of d; None where d is no parabola."""
        coefficients = np.array([self.d_bend, self.d_slope, self.d])
        if problem is not DAMPED:  # of two that may meet on the line d is real, up to rounding
            coefficients = coefficients.real
        zeros = np.roots(coefficients)
        if len(zeros) < 2:  # d is straight or constant, as that of one root
            return None
        centre = float(zeros.real.mean())
        return ClosestApproach(centre, float(np.abs(zeros - centre).max()))

    def at(self, continuation: Continuation, p: float) -> LocalRoots:
        """The roots at p that continue these."""
        root = self.mean + (p - self.value) * self.mean_slope
        return roots_near(continuation, p, root, self.right, self.left)

    def event_function(self, coalesces: bool) -> EventFunction:
        """The function of the parameter that vanishes at the event, here; see `EventFunction`.

        - One root m + i w crosses the line: m.
        - Two roots m + i w +- sqrt(d) meet on the line (`coalesces`): Re d, as d is real where the
          two mirror each other in the line.
        - One of two roots crosses it: with sqrt(d) = a + i b the function
          m^2 Re d + (Im d)^2 / 4 - m^4 = (a^2 - m^2) (m^2 + b^2), for Re d = a^2 - b^2 and
          Im d = 2 a b. It vanishes where a real part m + a or m - a does, and is smooth where
          sqrt(d) is not.
        """
        m = self.mean.real
        dm = self.mean_slope.real
        d = self.d
        dd = self.d_slope
        if self.is_single:
            return EventFunction(m, dm, bend=0.0, noise=self.mean_noise)
        if coalesces:
            return EventFunction(d.real, dd.real, self.d_bend.real, self.d_noise)
        value = m**2 * d.real + d.imag**2 / 4 - m**4
        slope = 2 * m * dm * d.real + m**2 * dd.real + d.imag * dd.imag / 2 - 4 * m**3 * dm
        # the derivatives of the function by m and by d, times the noise of each
        noise = abs(2 * m * d.real - 4 * m**3) * self.mean_noise
        noise += (m**2 + abs(d.imag) / 2) * self.d_noise
        return EventFunction(value, slope, bend=0.0, noise=noise)


def roots_near(
    continuation: Continuation,
    p: float,
    approximation: complex,
    right: NDArray,
    left: NDArray,
    perturbed: StandardProblem | None = None,
) -> LocalRoots:
    """The root, or the two roots, of A(p) next to a given number, with slopes and errors.

    On the invariant subspaces X and Y the matrix is the block B = (Y^H X)^-1 Y^H A X of one or two
    rows. The mean of the roots is half the trace of B, or its only entry. The square d of half
    their difference is half the trace of (B - mean)^2.

    Parameters
    ----------
    continuation : Continuation
        The system along its parameter.
    p : float
        The parameter.
    approximation : complex
        An approximate root, or the mean of two.
    right, left : array (N, 1) or (N, 2)
        Approximate right and left eigenvectors of the one or the two.
    perturbed : StandardProblem, optional
        The problem at p with derivatives by something else than the parameter; that by the
        parameter if none is given.
    """
    # (N, N) each; `sizes` of the terms that make each entry, by which it is rounded
    A, derivative, sizes = perturbed or continuation.standard_problem(p)
    # the rounding of other strong components is no rounding of these roots
    N = len(A)
    rows = continuation.rows_of_components(right, left)
    within = np.ix_(rows, rows)
    A = A[within]
    derivative = derivative[within]
    sizes = sizes[within]
    right = right[rows]
    left = left[rows]
    size = norm_of(A) or 1.0
    # the shift of inverse iteration lies so near to the roots that it converges at once, and so far
    # from them that A - shift is regular; for roots near 0 the size of A sets the distance
    distance = 1e-7 * max(abs(approximation), 1e-4 * size)
    shift = approximation + distance
    if continuation.problem is UNDAMPED and abs(approximation.imag) <= distance:
        shift = shift.real
        # A is real, and so are its vectors. Real and imaginary parts are added, since the real
        # parts of two conjugate columns are the same
        right = right.real + right.imag
        left = left.real + left.imag
    solve, solve_adjoint = _solvers(A - shift * np.eye(len(A)))
    X = _invariant_subspace(A, size, right, solve)
    Y = _invariant_subspace(A.conj().T, size, left, solve_adjoint)
    inverse = np.linalg.inv(Y.conj().T @ X) @ Y.conj().T
    block = inverse @ (A @ X)
    block_slope = inverse @ (derivative @ X)
    # the error of X is, to first order, Newton's correction without its part in the subspace. It
    # changes the block by its product with inverse A, to second order as Y is nearly invariant too
    correction = solve(A @ X - X @ block)
    subspace_error = np.abs(inverse @ (A @ (correction - X @ (inverse @ correction))))
    # independent roundings in the entries of A: their variances add up
    with np.errstate(over="ignore", invalid="ignore"):
        entry_error = EPS * np.sqrt(np.abs(inverse) ** 2 @ (sizes**2 @ np.abs(X) ** 2))
    error = ROUNDING_DEVIATIONS * (entry_error + subspace_error)
    if not np.isfinite(error).all():  # M is all but singular at p
        raise ComputationError(BEYOND_DOUBLES)
    count = len(block)
    mean = np.trace(block) / count
    mean_slope = np.trace(block_slope) / count
    deviator = block - mean * np.eye(count)  # the square of it is d times the identity
    deviator_slope = block_slope - mean_slope * np.eye(count)
    # a change of the block changes d by tr(deviator change) + tr(change^2) / 2. The errors of its
    # entries are independent: the squares of the first terms add up
    d_noise = np.linalg.norm(np.abs(deviator.T) * error) + np.linalg.norm(error) ** 2
    return LocalRoots(
        value=p,
        mean=complex(mean),
        mean_slope=complex(mean_slope),
        mean_noise=float(error.trace() / count),
        d=complex(np.trace(deviator @ deviator) / 2),
        d_slope=complex(np.trace(2 * deviator @ deviator_slope) / 2),
        d_bend=complex(np.trace(deviator_slope @ deviator_slope) / 2),
        d_noise=float(d_noise),
        right=_embedded(X, rows, N),
        left=_embedded(Y, rows, N),
        is_resolved=bool(np.linalg.norm(subspace_error) <= np.linalg.norm(entry_error)),
    )


def _embedded(vectors: NDArray, rows: NDArray[np.intp], N: int) -> NDArray:
    """Vectors (m, k) as vectors (N, k): theirs are the `rows` (m,), the other entries are zero."""
    all_rows = np.zeros((N, vectors.shape[1]), vectors.dtype)
    all_rows[rows] = vectors
    return all_rows


Solve = Callable[[NDArray], NDArray]
"""x of P x = b, from b."""


def _solvers(P: NDArray) -> tuple[Solve, Solve]:
    """Functions that solve P x = b and P^H x = b for P (N, N).

    Beyond `SMALL_ROWS` both use one factorisation. Not the inverse: next to a coalescence its
    rounding hides the second vector.
    """
    if len(P) <= SMALL_ROWS:
        return partial(np.linalg.solve, P), partial(np.linalg.solve, P.conj().T)
    from scipy.linalg import lu_factor, lu_solve

    factor = lu_factor(P, check_finite=False)
    return partial(lu_solve, factor), partial(lu_solve, factor, trans=2)  # 2: P^H, as SciPy says


def _invariant_subspace(A: NDArray, size: float, start: NDArray, solve: Solve) -> NDArray:
    """An orthonormal basis (N, 1) or (N, 2) of the invariant subspace of A next to `start`.

    One step of inverse iteration, then corrections by the residual: further steps of inverse
    iteration would make both columns one vector next to a coalescence.

    Parameters
    ----------
    A : array (N, N)
        The matrix.
    size : float
        A norm of it.
    start : array (N, 1) or (N, 2)
        Columns near the subspace.
    solve : function
        x of (A - s) x = b, for a fixed s next to the roots.
    """
    X = np.linalg.qr(solve(np.linalg.qr(start)[0]))[0]
    norm_before = np.inf
    for _ in range(2 * NEWTON_STEPS):
        image = A @ X
        block = X.conj().T @ image
        residual = image - X @ block
        norm = float(np.linalg.norm(residual))
        # stop at rounding, or where the residual falls no longer
        if norm <= 64 * EPS * size or norm > 0.9 * norm_before:
            break
        correction = solve(residual)
        # only the part of the correction that is orthogonal to X turns the subspace
        X = np.linalg.qr(X - correction + X @ (X.conj().T @ correction))[0]
        norm_before = norm
    return X
