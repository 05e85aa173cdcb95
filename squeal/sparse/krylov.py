"""Rough values of the roots nearest a shift: a block Krylov subspace of the companion form.

With lambda = shift + radius / theta the problem P(lambda) x = 0 reads
theta^2 P(shift) x + theta radius P'(shift) x + radius^2 M x = 0: the roots nearest the shift become
the largest theta. These are eigenvalues of the companion form, a matrix of 2n rows that acts on
[theta x; x] and needs one solution with the factor of P(shift) for each column. Block Arnoldi
builds an orthonormal basis of start, image, image of the image, and so on (Saad, Numerical Methods
for Large Eigenvalue Problems, 2011, chapter 6). The operator in this basis is a small matrix, whose
eigenvalues of the largest size converge first, and whose residuals cost no further product.

The theta that have converged form a disc: up to the nearest one that has not converged, the
`reach`, all roots are known. A root may be missing all the same if the start has no part of its
vector, and of a root whose multiplicity exceeds the block a few copies only are found. So callers
of `rough_roots_near` count the roots and search again from other random vectors (`region_roots`).

The same subspace gives a part of the roots of a small dense problem to rounding, at a fraction of
the price of all (`exact_roots_in`).
"""

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.linear.matrices import Matrix
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.factor import Factor, factorise_at
from squeal.sparse.quadratic import Array, Bools, ComplexArray, ScaledProblem, report_progress

MOST_COLUMNS = 180  # of a subspace; roots that it does not reach are left to other shifts
BLOCK_SIZE = 3  # vectors of a step: roots of that multiplicity converge at once
RITZ_RESIDUAL = 1e-4  # of a Ritz value that has converged
EXACT_RITZ_RESIDUAL = 1e-13  # of one that has converged to rounding
FEWEST_EXACT_COLUMNS = 60  # of a subspace in which some have
SAME_ROOT = 1e-6  # of the radius around a shift: Ritz values that are nearer may be one root
FARTHEST = 100.0  # of the radius around a shift: Ritz values beyond are left out


class RoughRoots(NamedTuple):
    """Rough values of roots around a shift: all within `reach` of it, and some beyond."""

    values: ComplexArray  # (m,) by distance from the shift
    vectors: ComplexArray  # (n, m) of unit length
    unconverged: ComplexArray  # (k,) Ritz values beyond that have not converged to roots
    reach: float  # rad/s; infinite if the subspace holds all roots
    shift: complex  # the requested one, or one close by if P is singular there
    factor: Factor  # of P(shift)


class RitzPairs(NamedTuple):
    """Approximate eigenpairs (m,) of an operator in a Krylov subspace."""

    values: ComplexArray  # (m,)
    coordinates: NDArray  # (m, m) of the vectors, in the first m columns of the basis
    residuals: Array  # (m,), lengths of operator vector - value vector

    @property
    def sizes(self) -> Array:
        """|theta| (m,), at least the smallest double above zero."""
        return np.maximum(np.abs(self.values), np.finfo(float).tiny)

    def are_converged(self, residual: float) -> Bools:
        """True for each value whose residual, relative to its size, is at most `residual`."""
        return self.residuals <= residual * self.sizes

    def reach(self, is_converged: Bools, radius: float) -> float:
        """The distance from the shift, in the unit of `radius`, up to which all roots are known.

        radius / |theta| is the distance of a root: that of the nearest one that has not converged.
        Infinite if all have.
        """
        return float(np.min(radius / self.sizes[~is_converged], initial=np.inf))


class BlockArnoldi:
    """An orthonormal basis of a block Krylov subspace, and an operator in it.

    The operator has been applied to the first `applied` of the `size` columns V, which gives the
    Arnoldi relation: operator V[:, :applied] = V H. If it adds no column the subspace is invariant.
    """

    def __init__(
        self, operator: Callable[[NDArray], NDArray], start: NDArray, columns: int
    ) -> None:
        first, _ = orthogonalise(start[:, :0], operator(start))
        self.operator = operator
        self.block = start.shape[1]
        self.applied = 0
        self.size = first.shape[1]
        self._storage = np.zeros((len(start), columns), start.dtype, order="F")
        self._storage[:, : self.size] = first
        self._coordinates: list[NDArray] = []  # of the images of each block: columns of H

    @property
    def basis(self) -> NDArray:
        """Orthonormal columns (n, size)."""
        return self._storage[:, : self.size]

    def grow(self) -> None:
        """Apply the operator to the columns to which it has not been applied."""
        new, coordinates = orthogonalise(self.basis, self.operator(self.basis[:, self.applied :]))
        self._coordinates.append(coordinates)
        self.applied = self.size
        self.size += new.shape[1]
        while self.size > self._storage.shape[1]:  # double it
            self._storage = np.hstack([self._storage, np.zeros_like(self._storage)])
        self._storage[:, self.applied : self.size] = new

    def growing(self, most: float = math.inf, first: int = 0) -> Iterator[RitzPairs]:
        """Grow block by block, and yield the Ritz pairs from time to time.

        They cost an eigenproblem. It is solved at `first` columns, two blocks at least, and again
        when the subspace has grown by an eighth. Ends when it has more than `most` columns, or is
        invariant.
        """
        next_size = max(first, 2 * self.block)  # columns at which Ritz pairs are computed
        can_grow = True
        while can_grow:
            self.grow()
            can_grow = self.applied < self.size <= most
            if self.applied >= next_size or not can_grow:
                next_size = self.applied + max(2 * self.block, self.applied // 8)
                yield self._ritz_pairs()

    def _ritz_pairs(self) -> RitzPairs:
        """The eigenpairs of the operator's projection onto the subspace, the square part of H.

        The rows of H below it are the parts of operator V outside of the subspace, from which the
        residuals follow.
        """
        H = np.zeros((self.size, self.applied), self._storage.dtype)
        end = 0
        # block upper Hessenberg: the columns of each further block are longer by a block
        for coordinates in self._coordinates:
            start = end
            end += coordinates.shape[1]
            H[: len(coordinates), start:end] = coordinates
        square = H[: self.applied].astype(np.result_type(H, float))  # in double precision
        theta, vectors = np.linalg.eig(square)
        # V is orthonormal: |operator V x - theta V x| is the length of the lower rows of H times x
        residuals = np.linalg.norm(H[self.applied :] @ vectors, axis=0)
        return RitzPairs(theta, vectors, residuals)


def rough_roots_near(
    problem: ScaledProblem,
    shift: complex,
    radius: float,
    enough: Callable[[ComplexArray, float], bool],
    seed: int = 0,
    single: bool = False,
) -> RoughRoots:
    """Rough values of the roots near a shift, by block Arnoldi with P(shift)^-1.

    They are shift + radius / theta of the largest eigenvalues theta of the companion form, see the
    head of this module.

    Parameters
    ----------
    problem : ScaledProblem
        n rows.
    shift : complex
        rad/s.
    radius : float
        The distance from the shift (rad/s) that becomes |theta| = 1.
    enough : callable
        Called with the converged roots (m,), by distance from the shift, and the reach (rad/s):
        True ends the search. Otherwise the subspace grows to at most `MOST_COLUMNS`.
    seed : int
        Of the random vectors from which the subspace starts.
    single : bool
        Compute in single precision, at half the time and memory.

    Returns
    -------
    RoughRoots
        The converged roots and the reach, up to which all roots are among them; other values within
        `FARTHEST` radii; and the factor of P at the shift that was used in fact.
    """
    n = problem.n
    report_progress(f"factorising {n} rows at {shift:.6g}")
    # where P(shift) is singular another shift close by serves
    used_shift, factor = factorise_at(problem, shift, single)
    dtype = factor.dtype
    slope = (radius * problem.slope(used_shift)).astype(dtype)
    mass = (radius**2 * problem.M).astype(dtype)

    most = min(MOST_COLUMNS, 2 * n)
    krylov = _companion_subspace(factor.solve, slope, mass, most, seed)
    for ritz in krylov.growing(most):
        sizes = ritz.sizes
        is_converged = ritz.are_converged(RITZ_RESIDUAL)
        reach = ritz.reach(is_converged, radius)
        nearest = np.flatnonzero(is_converged)[np.argsort(-sizes[is_converged])]
        all_theta: ComplexArray = ritz.values.astype(complex)
        theta = all_theta[nearest]
        values = used_shift + radius / theta
        if len(values) and enough(values, reach):
            break
    chosen = ritz.coordinates[:, nearest].astype(np.result_type(dtype, np.complex64))
    states = krylov.basis[:, : krylov.applied]
    # a state holds theta x above x: x is taken from the longer half, which has the smaller error
    vectors = np.where(np.abs(theta) >= 1.0, states[:n] @ chosen, states[n:] @ chosen)
    vectors /= np.linalg.norm(vectors, axis=0)
    unconverged = used_shift + radius / all_theta[~is_converged & (sizes > 1.0 / FARTHEST)]
    return RoughRoots(values, vectors, unconverged, reach, used_shift, factor)


def exact_roots_in(
    M: Matrix, C: Matrix | None, K: Matrix, region: Rectangle
) -> ComplexArray | None:
    """The roots (m,) of a dense problem in a region, to rounding, by block Arnoldi from one shift.

    None if a subspace of a quarter of the companion form's dimension does not reach all of the
    region: then it holds so many roots that all are computed at the same price. None, too, if a
    root repeats so often that the block may lack copies of it.

    Parameters
    ----------
    M, C, K : ndarray (n, n)
        Not scaled by units; C may be None.
    region : Rectangle
        Its sides are in rad/s.
    """
    from scipy.linalg import lu_factor, lu_solve

    n = len(M)
    shift = region.off_centre
    radius = region.radius + abs(shift - region.centre)  # the whole region lies within
    P = shift * shift * M + K
    slope = 2 * shift * M
    if C is not None:
        P = P + shift * C
        slope = slope + C
    factor = lu_factor(P, check_finite=False)
    most = n // 2
    krylov = _companion_subspace(
        lambda b: lu_solve(factor, b, check_finite=False), radius * slope, radius**2 * M, most
    )
    for ritz in krylov.growing(most, FEWEST_EXACT_COLUMNS):
        is_converged = ritz.are_converged(EXACT_RITZ_RESIDUAL)
        if ritz.reach(is_converged, radius) > radius:
            break
    else:
        return None
    values = shift + radius / ritz.values[is_converged]
    inside = values[region.contains(values)]
    distances = np.abs(inside[:, None] - inside)
    copies = np.sum(distances <= SAME_ROOT * radius, axis=1)
    if np.max(copies, initial=0) >= BLOCK_SIZE:
        return None
    return inside


def _companion_subspace(
    solve: Callable[[NDArray], NDArray], slope: NDArray, mass: NDArray, most: int, seed: int = 0
) -> BlockArnoldi:
    """The Krylov subspace of the companion form in the head of this module, from random vectors.

    `solve` applies P(shift)^-1 to columns; slope = radius P'(shift) and mass = radius^2 M are
    (n, n), of the precision in which all is computed. It has room for `most` columns and a block.
    """
    n = slope.shape[0]

    def companion(states: NDArray) -> NDArray:
        """The companion form times states [theta x; x] (2n, m), which gives theta states."""
        upper = states[:n]
        return np.vstack([solve(-(slope @ upper + mass @ states[n:])), upper])

    start = np.random.default_rng(seed).standard_normal((2 * n, BLOCK_SIZE)).astype(slope.dtype)
    return BlockArnoldi(companion, start, most + BLOCK_SIZE)


def orthogonalise(
    basis: NDArray, columns: NDArray, dropped: float = 0.0
) -> tuple[NDArray, NDArray]:
    """The directions that columns (n, m) add to an orthonormal basis (n, d), and coordinates.

    Returns orthonormal columns (n, k), k <= m, orthogonal to the basis too, and the coordinates
    (d + k, m) of the given columns in [basis, new]. Directions that are rounding, and those that
    add less than `dropped`, are left out. By Gram-Schmidt and a QR factorisation with pivoting; a
    singular value decomposition of nearly parallel columns, as of a defective root, may not
    converge.
    """
    from scipy.linalg import qr

    size = float(np.linalg.norm(columns))
    remainder = columns
    inside = np.zeros((basis.shape[1], columns.shape[1]), columns.dtype)
    for _ in range(2):  # the second pass restores orthogonality to rounding
        part = (remainder.conj().T @ basis).conj().T  # basis^H remainder, without a copy of basis
        remainder = remainder - basis @ part
        inside = inside + part
    new, triangle, order = qr(remainder, mode="economic", pivoting=True, check_finite=False)
    lengths = np.abs(np.diag(triangle))
    least = max(4 * np.finfo(columns.dtype).eps * size, dropped)
    rank = np.count_nonzero(lengths > least)
    new = new[:, :rank]
    # small remainders are orthogonal to the basis to fewer digits only
    if np.any(lengths[:rank] < 1e-3 * size):
        new = new - basis @ (new.conj().T @ basis).conj().T
        new /= np.linalg.norm(new, axis=0)
    in_given_order = np.argsort(order)  # undoes the pivoting of the columns
    return new, np.vstack([inside, triangle[:rank, in_given_order]])
