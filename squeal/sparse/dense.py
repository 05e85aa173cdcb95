"""Roots of small dense problems of any kind: M singular, not symmetric, complex; roots at zero.

A motion x with K x = 0 has the root 0, and has it twice where no damping acts on it. Computed, a
double root lies the square root of rounding away, on either side of the imaginary axis. So the
number of zeros is not read from small roots but from ranks of K and C, and as many of the smallest
roots are set to zero.

Where M is singular or nearly so a pencil is solved that does not contain its inverse. In singular
vectors of M entries of motions without mass, to rounding, are exactly zero, and the velocities of
these motions are no unknowns. The QZ algorithm is backward stable in M, C and K, so that a light
mass, which would spoil the inverse of M, costs the roots of the heavy ones no digit.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError
from squeal.linear.condensation import state_pencil
from squeal.linear.eigen import Eigenvalue
from squeal.linear.matrices import (
    EPS,
    ILL_CONDITIONED,
    Matrix,
    check_regular,
    divisor,
    equilibrated,
    first_order,
    noise_of,
    norm_of,
    normalised_system,
    null_spaces,
    rank_of,
    scaled_rank,
    solver_near_singular,
    zero_roots,
)
from squeal.numerics.threads import side_by_side
from squeal.sparse.quadratic import (
    ComplexArray,
    Indices,
    Roots,
    ScaledProblem,
    eigenvalues_of,
    scaled_problem,
)

STIFFNESS_ROUNDING = 64 * EPS
"""Of |K|: the stiffness that rounding of K may give to a motion without stiffness."""
CLUSTER_DISTANCE = 1e-7
"""The relative distance of roots that are too close for a vector each."""


def dense_values(
    M: Matrix, C: Matrix | None, K: Matrix, stiffness: float | None = None
) -> ComplexArray:
    """All finite roots lambda (rad/s) of lambda^2 M + lambda C + K, matrices (n, n) of any kind.

    By the standard eigenproblem of A = M^-1 K and B = M^-1 C, in coordinates with unit mass if M
    allows them; by `pencil_values` if M is nearly singular. Of real matrices without damping roots
    on the imaginary axis are exactly there, and roots of motions that nothing holds are exactly
    zero. If K is the projection of a larger matrix, whose rounding it carries, `stiffness` is the
    norm of that matrix; `pencil_values` makes no use of it.
    """
    damping = _nonzero(C)
    try:
        normalised = normalised_system(M, damping, K)
        A = normalised.A
        B = normalised.B
        relative_error = normalised.relative_error
    except InputError:  # M is complex or not symmetric, or a mass is light
        condition = float(np.linalg.cond(equilibrated(M)))
        if 1.0 / condition <= ILL_CONDITIONED:
            problem = scaled_problem(M, damping, K)
            values, _ = pencil_values(*problem.arrays())
            return values
        A = np.linalg.solve(M, K)
        B = None if damping is None else np.linalg.solve(M, damping)
        relative_error = 4 * EPS * condition
    if B is None:
        is_hermitian = np.array_equal(A, A.conj().T)
        squares: NDArray  # -lambda^2
        if is_hermitian:
            squares = np.linalg.eigvalsh(A)
        else:
            squares = np.linalg.eigvals(A)
        not_decaying = np.sqrt(-squares.astype(complex))  # of each pair +-lambda, Re lambda >= 0
        values = np.concatenate([not_decaying, -not_decaying])
    else:
        state_matrix, rate = first_order(A, B)
        values = np.asarray(np.linalg.eigvals(state_matrix) * rate, dtype=complex)
    sizes = np.abs(values)
    # how many of the smallest roots are exactly zero
    if stiffness is not None:
        zeros = _count_zeros(M, damping, K, STIFFNESS_ROUNDING * stiffness)
    # rounding moves a zero in a Jordan chain of four by up to EPS^(1/4)
    elif np.min(sizes) <= EPS**0.25 * np.max(sizes):
        zeros = _count_zeros(np.eye(len(M)), B, A, noise_of(A, relative_error))
    else:
        zeros = 0
    values[np.argsort(sizes)[:zeros]] = 0.0
    return values


def _nonzero(C: Matrix | None) -> Matrix | None:
    """C, or None where it is zero."""
    if C is None or not C.any():
        return None
    return C


def _count_zeros(M: Matrix, C: Matrix | None, K: Matrix, noise: float) -> int:
    """How many roots are exactly zero: one for each motion without stiffness, or two if undamped.

    Of a free mass both roots are zero, with a dashpot to the ground one is. Motions without
    stiffness are singular vectors of K with singular values up to `noise`, the rounding of K.
    """
    null, left_null = null_spaces(K, noise)  # columns x with K x = 0, and y with y^H K = 0
    if not null.size:
        return 0
    if _nonzero(C) is None:
        return 2 * zero_roots(K, noise, M)
    # a motion without stiffness has lambda (lambda m + c) = 0. Its root -c / m is a second zero
    # unless c > sqrt(noise m), that is c / m > sqrt(noise / m), how far rounding of K moves zeros
    damping = np.linalg.svd(left_null.conj().T @ (C @ null), compute_uv=False)
    mass = float(np.linalg.norm(left_null.conj().T @ (M @ null), 2))
    return 2 * null.shape[1] - np.count_nonzero(damping > math.sqrt(noise * mass))


def pencil_values(M: Matrix, C: Matrix | None, K: Matrix) -> tuple[ComplexArray, NDArray[np.bool_]]:
    """All finite roots of scaled matrices (n, n), whatever M is, and a mask that is True for roots
    whose size is unknown, see `_finite_values`.

    The roots are eigenvalues s of a pencil F - s E in singular vectors of M. Without damping
    s = -lambda^2, F = K and E = M; with damping s = lambda, and `state_pencil` gives F and E. A
    motion without mass has an infinite eigenvalue or, if it is damped, a finite one (first order).
    """
    nonzero_C = _nonzero(C)  # None without damping
    n = len(M)
    U, masses, Wh = np.linalg.svd(M)
    rank = scaled_rank(M)  # how many motions have mass, whatever units M mixes
    size = divisor(norm_of(K))  # the force unit
    # a rate (1/s) at which M, or C where there is no mass, is as large as K: a power of two
    if rank == 0 and nonzero_C is not None:  # the system is of the first order
        rate = 2.0 ** np.round(np.log2(size / norm_of(nonzero_C)))
    else:
        rate = 2.0 ** np.round(np.log2(size / divisor(masses[0])) / 2)
    # in singular vectors of M, with the time unit 1 / rate: lambda / rate are the roots
    mass = np.diag(np.where(np.arange(n) < rank, masses, 0.0) * (rate**2 / size))
    stiffness = U.conj().T @ (K / size) @ Wh.conj().T
    noise = noise_of(stiffness)
    infinite = n - rank  # number of infinite eigenvalues, one of each motion without mass
    if nonzero_C is None:
        squares, is_unknown = _finite_values(stiffness, mass, infinite)
        zeros = _count_zeros(mass, None, stiffness, noise)
        # a square has two roots +-lambda
        squares[np.argsort(np.abs(squares))[: zeros // 2]] = 0.0
        # 0 - s, not -s: of a real s that has the imaginary part -0, which is below the cut of the
        # square root along the negative real axis and leads to the lower root of a pair
        not_decaying = np.sqrt(0.0 - squares)
        return np.concatenate([not_decaying, -not_decaying]) * rate, np.tile(is_unknown, 2)
    damping = U.conj().T @ (nonzero_C * (rate / size)) @ Wh.conj().T
    if rank < n:
        # a motion without mass that is damped has a finite eigenvalue instead
        dampings = np.linalg.svd(damping[rank:, rank:], compute_uv=False)
        infinite -= rank_of(dampings, norm_of(damping))
    values, is_unknown = _finite_values(*state_pencil(mass, damping, stiffness, rank), infinite)
    zeros = _count_zeros(mass, damping, stiffness, noise)
    values[np.argsort(np.abs(values))[:zeros]] = 0.0
    return values * rate, is_unknown


def _finite_values(F: Matrix, E: Matrix, infinite: int) -> tuple[ComplexArray, NDArray[np.bool_]]:
    """The finite eigenvalues s = alpha / beta of F - s E (N, N), by the QZ algorithm, and a mask
    that is True for those of unknown size.

    At least `infinite` of the N are infinite: those of the least |beta / alpha|, which rounding
    leaves above zero. If `infinite` is not 0, all with a ratio up to 4 EPS are infinite as well.
    Of a finite eigenvalue whose beta is below rounding of E the QZ algorithm sets beta to zero: its
    size is unknown, and it gets the least size that a beta of that rounding gives. If F is real the
    finite ones are exactly conjugate in pairs.
    """
    from scipy.linalg import eigvals

    alpha, beta = eigvals(F, E, homogeneous_eigvals=True)
    with np.errstate(over="ignore"):  # a root at zero has an infinite inverse
        inverses = np.abs(beta) / np.maximum(np.abs(alpha), np.finfo(float).tiny)  # 1 / |s|
    is_finite = (inverses > 4 * EPS) | (infinite == 0)
    is_finite[np.argsort(inverses)[:infinite]] = False
    least_beta = EPS * divisor(norm_of(E))
    values = (alpha / np.where(beta == 0, least_beta, beta))[is_finite].astype(complex)
    if not np.iscomplexobj(F):  # the QZ algorithm puts the lower root of a pair behind the upper
        lower = np.flatnonzero(values.imag < 0)
        values[lower] = values[lower - 1].conj()
    return values, beta[is_finite] == 0


def roots_at(
    M: Matrix,
    C: Matrix | None,
    K: Matrix,
    values: ComplexArray,
    stiffness: float | None = None,
    exact: bool = False,
) -> Roots:
    """Roots of given values (m,), sorted by Im lambda, with unit right and left vectors (n, m).

    By inverse iteration on P at each root. Roots that are too close for a vector each share the
    singular vectors of the smallest singular values of P at their mean, zero roots the null space
    of K. `stiffness` is the norm of the larger matrix whose rounding K carries, if there is one.
    `exact`: values as those of a proof, which lose no digit in P. Small entries of P then count as
    much as large ones, and rows and columns are scaled for them, see `_scaled_null_vectors`.
    """
    ordered = values[np.lexsort((values.real, values.imag))]
    right_vectors = np.zeros((len(M), len(ordered)), dtype=complex)
    left_vectors = right_vectors.copy()

    def add_vectors(group: Indices) -> None:
        """Fill in the vectors of a group of close roots, by their indices in `ordered`.

        They are the columns of `right_vectors` and `left_vectors` (n, roots) with these indices:
        null vectors of K for roots that are zero, else those of P at the mean of the group.
        """
        mean = ordered[group].mean()
        right: NDArray = np.zeros((len(M), 0))
        left = right
        if mean == 0.0 and not exact:
            noise = noise_of(K) if stiffness is None else STIFFNESS_ROUNDING * stiffness
            right, left = null_spaces(K, noise)
        if not right.shape[1]:  # the roots are not zero, or exact, or K is regular to rounding
            P = mean * mean * M + K
            if C is not None:
                P = P + mean * C
            dimension = min(len(group), len(M))  # a root may repeat more often than there are rows
            if exact:
                terms = abs(mean) ** 2 * abs(M) + abs(K)
                if C is not None:
                    terms += abs(mean) * abs(C)
                right, left = _scaled_null_vectors(P, terms, dimension)
            else:
                right, left = _null_vectors(P, dimension)
        # a defective root has fewer vectors than its multiplicity: they are repeated
        repeated = np.arange(len(group)) % right.shape[1]
        right_vectors[:, group] = right[:, repeated]
        left_vectors[:, group] = left[:, repeated]

    list(side_by_side(add_vectors, _clusters(ordered)))  # `list` makes it compute all
    return Roots(ordered, right_vectors, left_vectors)


def _clusters(values: ComplexArray) -> list[Indices]:
    """Indices of neighbouring values that are too close for a vector each."""
    if not len(values):
        return []
    is_gap = np.abs(np.diff(values)) > CLUSTER_DISTANCE * np.abs(values[1:])
    return np.split(np.arange(len(values)), np.flatnonzero(is_gap) + 1)


def _scaled_null_vectors(
    P: ComplexArray, terms: NDArray, count: int
) -> tuple[ComplexArray, ComplexArray]:
    """Unit right and left null vectors (n, count) of P, for which small entries of P count, too.

    `terms` (n, n) are the sizes of the entries of P before terms cancel in them. Scales r of rows
    and c of columns make the largest entry of each row and column of r_i terms_ij c_j about one. A
    right null vector x of r_i P_ij c_j gives c x of P, a left one y gives r y.
    """
    row_scales = 1.0 / divisor(terms.max(axis=1))[:, None]
    column_scales = 1.0 / divisor((row_scales * terms).max(axis=0))[:, None]
    x, y = _null_vectors(row_scales * P * column_scales.T, count)
    right = column_scales * x
    left = row_scales * y
    return right / np.linalg.norm(right, axis=0), left / np.linalg.norm(left, axis=0)


def _null_vectors(P: ComplexArray, count: int) -> tuple[ComplexArray, ComplexArray]:
    """Right and left singular vectors (n, count) of the smallest singular values of P, by inverse
    iteration on one factorisation.

    Where fewer singular values vanish, the first vector repeats.
    """
    rounding = EPS / 2 * (float(np.abs(P).max()) or 1.0)  # smaller pivots are raised to this
    solve_near = solver_near_singular(P, rounding)

    def solve(b: ComplexArray, adjoint: bool) -> ComplexArray:
        """P^-1 b, or if `adjoint` P^-H b, with columns made orthonormal."""
        return np.linalg.qr(solve_near(b, adjoint))[0]

    # the power method with (P^H P)^-1: one vector converges at once, since P is singular to
    # rounding, several in three passes, since their singular values differ in size
    start = np.random.default_rng(len(P)).standard_normal((len(P), 2 * count)).view(complex)
    y = solve(start, adjoint=True)
    for _ in range(1 if count == 1 else 3):
        x = solve(y, adjoint=False)
        y = solve(x, adjoint=True)
    if count > 1:
        residuals = np.linalg.norm(P @ x, axis=0)  # the singular values, the least one first
        # a singular value far above the least, and above 1e-6 of |P|, does not vanish: its vector
        # is no mode
        is_no_mode = residuals > max(100 * residuals[0], 1e-6 * norm_of(P))
        x[:, is_no_mode] = x[:, :1]
        y[:, is_no_mode] = y[:, :1]
    return x, y


def dense_spectrum(M: Matrix, C: Matrix | None, K: Matrix) -> tuple[Eigenvalue, ...]:
    """All finite roots with vectors, backward errors and conditions; matrices (n, n).

    A root of unknown size, see `pencil_values`, gets the residual 1 and infinite rounding, so that
    no verdict rests on it. Raises InputError for an empty row, and if every number is a root.
    """
    problem = scaled_problem(M, C, K)
    matrices = problem.arrays()
    check_regular(*matrices)
    values, is_unknown = pencil_values(*matrices)
    if problem.is_real:
        roots = roots_at(*matrices, values[values.imag >= 0.0]).with_conjugates()
    else:
        roots = roots_at(*matrices, values)
    unknown = values[is_unknown]
    listed = []
    for root in eigenvalues_of(problem, roots):
        if root.value in unknown:  # its value has not been changed since
            root = replace(root, residual=1.0, rounding=math.inf)
        listed.append(root)
    return tuple(listed)


def spectrum_at(problem: ScaledProblem, values: ComplexArray) -> tuple[Eigenvalue, ...]:
    """Roots of exact values (m,) of a small problem: vectors, backward errors and conditions."""
    matrices = problem.arrays()
    return eigenvalues_of(problem, roots_at(*matrices, values, exact=True))
