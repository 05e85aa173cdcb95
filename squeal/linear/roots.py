"""Roots of M q'' + C q' + K q = 0 with vectors, and how far rounding moves each.

That is its backward error times its condition number (`root_rounding`), which grows without limit
where roots coalesce; roots that meet move together, by no more than the m-th root of the relative
error. What acts on a part of the rows and is not acted on by it changes none of its roots: strong
components are solved one by one.

At a flutter boundary two roots coalesce, and computed real parts are noise of the size of the
square root of the machine precision, which their rounding bounds.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError
from squeal.linear.matrices import (
    BEYOND_DOUBLES,
    Array,
    NormalisedSystem,
    components,
    first_order,
    noise_of,
    null_spaces,
    reaches,
    scaled_rank,
    zero_roots,
)

ComplexArray = NDArray[np.complex128]
STIFF = (
    "one stiffness or damping is so much greater than others that rounding of it hides the slow "
    "modes; values that differ by fewer decades are required"
)


def ordered(values: ComplexArray) -> NDArray[np.intp]:
    """Indices (..., m) that sort eigenvalues (..., m) along the last axis as a Spectrum does.

    By rising |Im|, then by falling real part, the conjugate with Im > 0 first.
    """
    # an exact conjugate pair or quadruple has equal |Im|, so the later keys decide within it;
    # of repeated eigenvalues the first is paired with the first conjugate, and so on
    equal = values[..., :, None] == values[..., None, :]
    occurrence = np.sum(np.tril(equal, -1), axis=-1)
    keys = (-values.imag, occurrence, -values.real, np.abs(values.imag))
    return np.lexsort(keys, axis=-1)


def lowest(values: ComplexArray, count: int) -> NDArray[np.intp]:
    """Indices, rising, of the `count` eigenvalues (m,) of least |lambda|, all if there are fewer.

    A large system is searched in a disc around zero, so that by this rule its list is complete.
    """
    return np.sort(np.argsort(np.abs(values), kind="stable")[:count])


def root_rounding(
    values: ComplexArray,
    condition: float | Array,
    error: float | Array,
    size: float | Array,
    rows: int | None = None,
) -> Array:
    """How far rounding moves each eigenvalue (m,) of a matrix.

    One that is far from all others moves by R, the error of the matrix times its own condition. One
    with others within reach, at distances d_j, moves by r with r prod(1 + r / d_j) = R, as the
    determinant, a product of the distances to all roots, is in error. No eigenvalue moves further
    than 2 `size` times the m-th root of the relative error, m being the number of rows (Elsner
    1985).

    Parameters
    ----------
    values : array (m,)
        The eigenvalues.
    condition : float or array (m,)
        Their condition numbers 1 / |y^H x|.
    error : float or array (m,)
        The relative backward error of the matrix.
    size : float or array (m,)
        Its norm.
    rows : int, optional
        The number of its rows, if only some of its eigenvalues are given.

    Returns
    -------
    array (m,)
        In the unit of the eigenvalues.
    """
    matrix_error = np.broadcast_to(size * error, values.shape)
    isolated = np.broadcast_to(matrix_error * condition, values.shape)  # R
    order = rows or max(len(values), 1)
    bound = np.broadcast_to(2 * size * error ** (1 / order), values.shape)
    distances = np.maximum(np.abs(values[:, None] - values), matrix_error[:, None])
    np.fill_diagonal(distances, np.inf)
    rounding = np.minimum(isolated, bound)
    # only eigenvalues with others within reach share the error with these; one at a distance of
    # more than 1000 r would change r by less than a thousandth
    crowded = np.flatnonzero(rounding > 1e-3 * distances.min(axis=1, initial=np.inf))
    if not crowded.size:
        return rounding
    with np.errstate(divide="ignore"):
        log_R = np.log(isolated[crowded])
        log_r = np.log(rounding[crowded])
    for _ in range(16):  # Newton's method for log r + sum log(1 + r / d_j) = log R: convex
        share = np.exp(log_r)[:, None] / distances[crowded]
        excess = log_r + np.log1p(share).sum(axis=1) - log_R
        slope = 1.0 + (share / (1.0 + share)).sum(axis=1)
        log_r -= np.maximum(excess, 0.0) / slope
    # equal roots with independent vectors share no error: each moves by the error of the matrix, as
    # a single root of condition 1 does
    least = np.minimum(isolated, matrix_error)[crowded]
    rounding[crowded] = np.maximum(np.exp(log_r), least)
    return rounding


def square_roots(s: ComplexArray, rounding: Array) -> tuple[ComplexArray, Array]:
    """The roots lambda (...) of s = -lambda^2 that do not decay, and how far rounding moves them.

    A complex pair s within its own rounding is a coalescence: a real double root. Since
    d lambda = ds / (2 |lambda|) a root s that is zero to rounding moves lambda by a square root.
    """
    s = np.where(np.abs(s.imag) <= rounding, s.real, s)
    size = np.abs(s)
    is_zero = size <= rounding
    slope = 1 / (2 * np.sqrt(np.where(is_zero, 1.0, size)))
    return np.sqrt(-s), np.where(is_zero, np.sqrt(rounding), rounding * slope)


class RootsWithRounding(NamedTuple):
    """Eigenvalues (m,) and what is known of them.

    right, left: vectors as columns, of any length; condition: condition numbers; rounding: how far
    rounding moves each, see `root_rounding`.
    """

    values: ComplexArray
    right: ComplexArray
    left: ComplexArray
    condition: Array
    rounding: Array


def assigned(cost: Array) -> NDArray[np.intp]:
    """For each row of a cost matrix (m, k) a column of its own, the cheapest pairs first.

    Of equal pairs the first come first. -1 for rows that are left over where there are more of them
    than columns.
    """
    cheapest = np.argmin(cost, axis=1)
    if len(set(cheapest.tolist())) == len(cheapest):  # no two rows want one column
        return cheapest
    order = np.full(len(cost), -1, dtype=np.intp)
    taken: set[int] = set()
    by_cost = np.unravel_index(np.argsort(cost, axis=None, kind="stable"), cost.shape)
    for i, j in zip(*by_cost, strict=True):
        if order[i] < 0 and int(j) not in taken:
            order[i] = j
            taken.add(int(j))
    return order


def left_vectors(A: Array, values: ComplexArray, right: ComplexArray) -> ComplexArray:
    """Unit left eigenvectors as columns: by the inverse of the right ones or, near a coalescence,
    where that loses digits, by the transpose."""
    singular = np.linalg.svd(right, compute_uv=False)
    if singular[-1] > 1e-6 * singular[0]:
        left = np.linalg.inv(right).conj().T
    else:
        others, left = np.linalg.eig(A.conj().T)
        left = left[:, assigned(np.abs(values[:, None] - others.conj()))]
    return np.asarray(left / np.linalg.norm(left, axis=0), dtype=complex)


def _standard_roots(
    A: Array, relative_error: float, stiffness: Array | None = None
) -> RootsWithRounding:
    """Eigenvalues of a real matrix with their vectors and rounding.

    Zero roots are counted by rank, set to exactly zero and given the vectors of the null spaces.

    Parameters
    ----------
    A : array (m, m)
        The matrix.
    relative_error : float
        That of its entries.
    stiffness : array (m/2, m/2), optional
        The stiffness block of a first-order matrix. Where it is regular there are no zero roots,
        however strong the damping is.
    """
    values, right = (x.astype(complex) for x in np.linalg.eig(A))
    left = left_vectors(A, values, right)
    zeros = 0  # how many roots are zero
    noise = noise_of(A, relative_error)
    if stiffness is None or zero_roots(stiffness, noise_of(stiffness, relative_error)):
        zeros = zero_roots(A, noise)
    smallest = np.argsort(np.abs(values))[:zeros]
    if zeros:
        values[smallest] = 0.0
        null, conull = null_spaces(A, noise)
        column = np.arange(zeros) % null.shape[1]  # a chain repeats its one vector
        right[:, smallest] = null[:, column]
        left[:, smallest] = conull[:, column]
    with np.errstate(divide="ignore"):
        condition = 1.0 / np.abs(np.sum(left.conj() * right, axis=0))
    size = float(np.linalg.norm(A, 2))
    rounding_of_roots = root_rounding(values, condition, 2 * len(A) * relative_error, size)
    rounding_of_roots[smallest] = 0.0  # zeros by rank are exact
    return RootsWithRounding(values, right, left, condition, rounding_of_roots)


def dependence(system: NormalisedSystem) -> NDArray[np.bool_]:
    """Which rows of A and B depend on which unknowns: a mask (n, n), see `matrices.reaches`."""
    pattern = system.A != 0.0
    if system.B is not None:
        pattern |= system.B != 0.0
    return reaches(pattern)


def roots_of(system: NormalisedSystem, reach: NDArray[np.bool_] | None = None) -> RootsWithRounding:
    """The 2n roots lambda (rad/s) of a system, vectors (n, 2n) in mass-normalised coordinates.

    Each strong component of the rows is solved by itself: what acts from one on another would cost
    digits and changes no root. Vectors are zero outside of the component of their root. Roots that
    neither grow nor decay have a real part of at most their rounding, without damping of exactly
    zero. `reach` is `dependence(system)`, if it is known. Raises ComputationError if roots are
    beyond double precision.
    """
    parts = []
    for rows in components(dependence(system) if reach is None else reach):
        part = _roots_of_component(_part_of(system, rows))
        right = np.zeros((len(system.A), len(part.values)), complex)
        left = np.zeros_like(right)
        right[rows] = part.right
        left[rows] = part.left
        parts.append(part._replace(right=right, left=left))
    # side by side: the last axis of each array is that of the roots
    return RootsWithRounding._make(
        np.concatenate(arrays, axis=-1) for arrays in zip(*parts, strict=True)
    )


def _part_of(system: NormalisedSystem, rows: NDArray[np.intp]) -> NormalisedSystem:
    """The system of some rows (k,), without what acts on them from others."""
    within = np.ix_(rows, rows)
    B = None
    if system.B is not None and system.B[within].any():
        B = system.B[within]
    return NormalisedSystem(system.A[within], B, system.T[within], system.relative_error)


def _roots_of_component(system: NormalisedSystem) -> RootsWithRounding:
    """The 2n roots of a system of one strong component with vectors (n, 2n), as `roots_of` gives
    those of a whole system."""
    if system.B is None:
        roots = _undamped_roots(system)
    else:
        n = len(system.A)
        matrix, scale = first_order(system.A, system.B)
        standard = _standard_roots(matrix, system.relative_error, system.A)
        roots = standard._replace(
            values=standard.values * scale,
            right=standard.right[:n],  # of the states (z, z'): the vector itself
            left=standard.left[n:],  # the left one stands in the rows of the equation of motion
            rounding=standard.rounding * scale,
        )
    if not np.isfinite(roots.values).all():
        raise ComputationError(BEYOND_DOUBLES)
    return roots


def _undamped_roots(system: NormalisedSystem) -> RootsWithRounding:
    """Roots lambda (2n,) of a system without damping: of each -s both square roots, in a row."""
    squares = _standard_roots(system.A, system.relative_error)
    not_decaying, rounding = square_roots(squares.values, squares.rounding)
    return RootsWithRounding(
        values=np.asarray(np.ravel([not_decaying, -not_decaying], order="F") + 0.0),
        right=np.repeat(squares.right, 2, axis=1),
        left=np.repeat(squares.left, 2, axis=1),
        condition=np.repeat(squares.condition, 2),
        rounding=np.repeat(rounding, 2),
    )


def hides_slow_roots(
    system: NormalisedSystem, C: Array | None, K: Array, roots: RootsWithRounding | None = None
) -> bool:
    """True if rounding hides slow roots, as beside a light mass, a stiff spring or a strong damper.

    Then some root has fewer than three digits, or the number of zero roots is not the one that
    follows from the ranks of K, and of K and C together. Callers then refuse the system or
    eliminate its nearly massless coordinates.

    Parameters
    ----------
    system : NormalisedSystem
        The system.
    C, K : array (n, n)
        The matrices from which it was made; C may be None.
    roots : RootsWithRounding, optional
        Its roots, if they are known.
    """
    expected_zeros = 0  # that follow from ranks
    for rows in components(dependence(system)):
        block = np.ix_(rows, rows)
        rank = scaled_rank(K[block])
        rank_with_damping = rank
        if C is not None and system.B is not None:
            rank_with_damping = scaled_rank(np.vstack([K[block], C[block]]))
        # each of the n - rank motions without stiffness has a zero root, and a second one if it is
        # without damping too, as n - rank_with_damping of them are
        expected_zeros += 2 * len(rows) - rank - rank_with_damping
    computed = roots or roots_of(system)
    size = np.abs(computed.values)
    has_few_digits = np.any(computed.rounding > 0.005 * size, where=size > 0.0)
    return bool(has_few_digits or np.sum(size == 0) != expected_zeros)
