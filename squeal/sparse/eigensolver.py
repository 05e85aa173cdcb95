"""Roots of large sparse systems: all in a region, or the lowest, with the count that proves it.

With lambda = shift + radius / theta the problem reads
theta^2 P(shift) x + theta radius P'(shift) x + radius^2 M x = 0: the roots nearest the shift
become the largest theta. A block Krylov subspace of the companion form, in single precision, gives
rough values of all roots within some distance. In the space of their vectors the full problem has
Ritz pairs; P(shift)^-1, applied to the residuals of all of them at once, adds the directions that
correct them (residual inverse iteration, Neumaier 1985), until right and left vectors solve the
full problem to rounding. One basis gives multiple roots and rigid bodies as the dense problem does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError
from squeal.linear.eigen import Eigenvalue, values_of
from squeal.linear.matrices import Matrix, divisor
from squeal.linear.roots import STIFF
from squeal.numerics.threads import side_by_side
from squeal.sparse.argument_principle import Disc, Rectangle, Region, count_roots, disc_around
from squeal.sparse.dense import STIFFNESS_ROUNDING, dense_values, roots_at
from squeal.sparse.factor import Factor, factorise_at
from squeal.sparse.quadratic import (
    Array,
    Bools,
    ComplexArray,
    Roots,
    ScaledProblem,
    eigenvalues_of,
    multiply,
    report_progress,
)

# What a search for roots may cost, and the errors with which it ends
MOST_COLUMNS = 180  # of a subspace; roots that it does not reach are left to other shifts
BLOCK_SIZE = 3  # vectors of a step: roots of that multiplicity converge at once
RITZ_RESIDUAL = 1e-4  # of a Ritz value that has converged
EXACT_RESIDUAL = 1e-12  # backward error of right vectors with which corrections end
ACCEPTED_RESIDUAL = 2e-9  # ... of left vectors, and of right ones that no longer improve
MOST_CORRECTIONS = 12  # at most
COUNTED_REACH = 1.6  # of a region's radius: roots up to here have to be known for a cheap count
MOST_PARTS = 200  # of a region that are searched before it is refused
MOST_ATTEMPTS = 3  # starts for a region whose count shows missing roots
DENSE_ROWS = 2000  # up to which all roots are computed where few do not suffice
DISTANT = 1.7  # of a disc's radius: Ritz values beyond stand for the unknown roots there
SAME_ROOT = 1e-2  # of a disc's radius: two rough values of one root beyond it may differ by this
FARTHEST = 100.0  # of the radius around a shift: Ritz values beyond are left out
UNCOUNTED_PART = 0.125  # of a region: smaller ones are not halved for a count alone
SMALLEST_PART = 1e-3  # of a region: smaller ones are not halved
SHIFT_OF_LOWEST = 0.3  # of the scale of the lowest roots: where their subspace is built
REACH_OF_LOWEST = 1.5  # how much farther than the lowest roots their subspace has to reach
ENLARGEMENT = 1.5  # of a region around zero until it holds the lowest roots
MOST_ENLARGEMENTS = 12  # at most


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

    def growing(self, most: float = math.inf) -> Iterator[RitzPairs]:
        """Grow block by block, and yield the Ritz pairs from time to time.

        They cost an eigenproblem, and are computed again when the subspace has grown by an eighth.
        Ends when it has more than `most` columns, or is invariant.
        """
        next_size = 2 * self.block  # columns at which Ritz pairs are computed again
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

    def companion(states: NDArray) -> NDArray:
        """The companion form times states [theta x; x] (2n, m), which gives theta states."""
        upper = states[:n]
        return np.vstack([factor.solve(-(slope @ upper + mass @ states[n:])), upper])

    start = np.random.default_rng(seed).standard_normal((2 * n, BLOCK_SIZE)).astype(dtype)
    most = min(MOST_COLUMNS, 2 * n)  # columns; the storage has room for one block beyond
    krylov = BlockArnoldi(companion, start, most + BLOCK_SIZE)
    for ritz in krylov.growing(most):
        sizes = np.maximum(np.abs(ritz.values), np.finfo(float).tiny)
        is_converged = ritz.residuals <= RITZ_RESIDUAL * sizes
        # radius / |theta| is the distance of a root from the shift: up to the nearest one that has
        # not converged all roots are known
        reach = float(np.min(radius / sizes[~is_converged], initial=np.inf))
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


@dataclass(frozen=True, eq=False)
class Modes:
    """The roots in a region, by rising frequency, and how many a count finds there."""

    eigenvalues: tuple[Eigenvalue, ...]
    region: Region
    count: int | None  # None if the roots were not counted, or no count was reached
    roots: Roots = field(repr=False)  # the same in scaled coordinates
    # the rough roots, if those around one shift served the whole region and nothing was counted
    rough: RoughRoots | None = field(default=None, repr=False)
    # the rough values of all shifts, also outside of the region
    rough_values: Sequence[complex] = field(default=(), repr=False)

    @property
    def certified(self) -> bool:
        """True if the count finds exactly as many roots in the region as are listed."""
        return self.count == len(self.eigenvalues)

    @property
    def values(self) -> ComplexArray:
        """The eigenvalues (m,), rad/s."""
        return values_of(self.eigenvalues)


def corrected_roots(
    problem: ScaledProblem,
    factor: Factor,
    basis: Array,
    region: Region,
    exact: float = EXACT_RESIDUAL,
    accepted: float = ACCEPTED_RESIDUAL,
) -> Roots | None:
    """The roots in a region by residual inverse iteration (Neumaier 1985), with vectors; None if it
    does not converge.

    The problem projected onto the basis gives roots and vectors. P^-1 times their residuals, with P
    at one value near all of them, is added to the basis, which then gives better roots, and so on.

    Parameters
    ----------
    problem : ScaledProblem
        n rows.
    factor : Factor
        Of P at a value near the roots.
    basis : ndarray (n, d)
        Real and orthonormal; it nearly holds their right vectors.
    region : Rectangle or Disc
        Where.
    exact, accepted : float
        Corrections end when the backward error of each right vector is at most `exact`, and of each
        left vector, which only conditions and derivatives depend on, at most `accepted`. Once a
        correction has not halved the worst error, limits that are accepted / exact times as large
        suffice: `accepted` for right vectors, accepted^2 / exact for left ones.
    """
    if not basis.size:
        return Roots.none(problem.n)
    V = basis
    M = V.T @ (problem.M @ V)
    C = V.T @ (problem.C @ V)
    K = V.T @ (problem.K @ V)
    _, _, stiffness = problem.norms  # |K|, whose rounding the projected K carries
    worst_before = np.inf
    for _ in range(MOST_CORRECTIONS):
        values = dense_values(M, C, K, stiffness=stiffness)
        values = values[region.contains(values)]
        roots = roots_at(M, C, K, values, stiffness).expanded(V)
        residuals = residuals_of(problem, roots).outside(V)
        # errors over their limits
        right_ratios = np.linalg.norm(residuals.right, axis=0) / exact
        left_ratios = np.linalg.norm(residuals.left, axis=0) / accepted
        worst = max(np.max(right_ratios, initial=0.0), np.max(left_ratios, initial=0.0))
        is_halved = worst <= worst_before / 2
        if worst <= 1.0 or (not is_halved and worst <= accepted / exact):
            return roots
        worst_before = worst
        old = V
        corrections = residuals.corrections(factor, right_ratios > 1.0, left_ratios > 1.0)
        # directions that make up less than 1e-4 of a correction are left to the next one
        V = enlarged(V, corrections, dropped=1e-4)
        new = np.ascontiguousarray(V[:, old.shape[1] :])
        grow = partial(grown, old=old, new=new)
        M, C, K = side_by_side(grow, [M, C, K], [problem.M, problem.C, problem.K])
    return None


class Residuals(NamedTuple):
    """P x and P' conj(y) of right and left vectors x, y of m roots, over a bound of |P|; P' is the
    transpose."""

    right: ComplexArray  # (n, m)
    left: ComplexArray  # (n, m)

    def outside(self, basis: Array) -> Residuals:
        """The parts of the residuals that are orthogonal to a basis (n, d), real and orthonormal.

        They vanish once the basis holds the vectors. The parts in the basis are rounding, and more
        than that where close roots share vectors, see `roots_at`: more directions cannot lessen
        them.
        """
        right = self.right - multiply(basis, multiply(basis.T, self.right))
        left = self.left - multiply(basis, multiply(basis.T, self.left))
        return Residuals(right, left)

    def corrections(self, factor: Factor, of_right: Bools, of_left: Bools) -> ComplexArray:
        """Directions P^-1 r (n, k) that correct some of the right and some of the left vectors, by
        a factor of P near the roots; `of_right`, `of_left` (m,) choose them."""
        columns = [self.right[:, of_right], self.left[:, of_left]]
        return np.hstack(list(side_by_side(factor.solve, columns, [False, True])))


def residuals_of(problem: ScaledProblem, roots: Roots) -> Residuals:
    """Residuals of right and left vectors of roots, relative to a bound of |P| at each root."""
    sizes = divisor(problem.size(roots.values))
    problems = [problem, problem.transposed()]
    vectors = [roots.right, roots.left.conj()]
    images = side_by_side(lambda P, x: P.apply(roots.values, x) / sizes, problems, vectors)
    return Residuals(*images)


def grown(projected: Array, A: Matrix, old: Array, new: Array) -> Array:
    """V' A V of a basis V = [old, new], from `projected` = old' A old."""
    image = A @ new
    return np.block([[projected, old.T @ image], [(A.T @ new).T @ old, new.T @ image]])


def enlarged(basis: Array, columns: NDArray, dropped: float) -> Array:
    """An orthonormal real basis (n, d), enlarged by the real and imaginary parts of columns.

    Directions in which unit columns add less than `dropped` are left out.
    """
    units = columns / divisor(np.linalg.norm(columns, axis=0))
    parts = [units.real, units.imag] if np.iscomplexobj(columns) else [units]
    new, _ = orthogonalise(basis, np.hstack(parts).astype(float), dropped)
    return np.hstack([basis, new])


class _PartRoots(NamedTuple):
    """Roots in and around a part of a region."""

    part: Rectangle
    roots: Roots
    missing: int | None  # how many more a count finds; None if there is no count
    rough: RoughRoots  # from which they were corrected

    @property
    def inside(self) -> Roots:
        """The roots in the part."""
        return self.roots.select(self.part.contains(self.roots.values))


def modes_in(
    problem: ScaledProblem,
    region: Rectangle,
    certify: bool = True,
    start: Array | None = None,
    exact: float = EXACT_RESIDUAL,
) -> Modes:
    """All roots in a rectangle with right and left vectors, and the count that certifies them.

    The region is halved into parts until one Krylov subspace reaches all roots in and around each
    part, and the roots of each are counted, if possible. The count of the region is the sum of
    those of its parts.

    Parameters
    ----------
    problem : ScaledProblem
        n rows.
    region : Rectangle
        Where.
    certify : bool
        Count the roots by the argument principle.
    start : ndarray (n, d), optional
        Orthonormal vectors that nearly hold the modes, which saves corrections.
    exact : float
        Backward error of right vectors with which corrections end, see `corrected_roots`.

    Raises
    ------
    ComputationError
        If the region holds too many roots, or some that rounding hides.
    """
    basis = np.zeros((problem.n, 0)) if start is None else start
    roots = Roots.none(problem.n)
    # how many roots were counted and not computed; None: there is no count of the whole region
    missing = 0 if certify else None
    rough_values: list[complex] = []
    for of_part in _searched_parts(problem, region, certify, basis, exact):
        rough_values += of_part.rough.values.tolist()
        if of_part.missing is None or _any_on_border(of_part, region):
            missing = None  # and stays so
        elif missing is not None:
            missing += of_part.missing
        roots = roots.joined(of_part.inside)
    # `of_part` is now the last part: it is the whole region if that was not halved
    one_shift_served = of_part.part == region and not certify
    return Modes(
        eigenvalues=eigenvalues_of(problem, roots),
        region=region,
        count=None if missing is None else len(roots.values) + missing,
        roots=roots,
        rough=of_part.rough if one_shift_served else None,
        rough_values=rough_values,
    )


def _searched_parts(
    problem: ScaledProblem, region: Rectangle, certify: bool, basis: Array, exact: float
) -> Iterator[_PartRoots]:
    """The parts into which a region is halved, each with its roots; together they are the region.

    A part is halved if no subspace reaches all of its roots. Unless it is small, it is also halved
    if its roots were to be counted (`certify`) and no count was reached. Raises ComputationError
    for a part that would become too small, and after `MOST_PARTS` parts. basis (n, d) and exact:
    `start` and `exact` of `modes_in`.
    """
    root_count = 0  # roots in the parts so far
    pending = [region]
    for _ in range(MOST_PARTS):
        part = pending.pop()
        of_part = _roots_around(problem, part, certify, basis, exact)
        if of_part is None:
            if part.radius <= SMALLEST_PART * region.radius:
                raise ComputationError(
                    f"the roots around {part.centre:.6g} were not found: {STIFF}"
                )
            pending += _halves(part)
            continue
        is_uncounted = certify and of_part.missing is None
        if is_uncounted and part.radius > UNCOUNTED_PART * region.radius:
            pending += _halves(part)  # a count of a smaller part may succeed
            continue
        root_count += len(of_part.inside.values)
        yield of_part
        if not pending:
            return
    raise ComputationError(
        f"the region holds too many roots: {root_count} after {MOST_PARTS} parts; a "
        "narrower band or region is required"
    )


def _any_on_border(of_part: _PartRoots, region: Rectangle) -> bool:
    """True if a root lies where a part borders on another part of the region: rounding then decides
    which of the two counts it."""
    values = of_part.roots.values
    is_around = of_part.part.widened(1e-9).contains(values)
    is_within = of_part.part.widened(-1e-9).contains(values)
    # no other part lies beyond the border of the region
    is_interior = region.widened(-1e-9).contains(values)
    return bool(np.any(is_around & ~is_within & is_interior))


def _halves(region: Rectangle) -> list[Rectangle]:
    """Two parts of a region, cut across its longer side."""
    size = region.size
    share = 0.4837  # not the middle, where symmetry may have put a root
    if size.real > size.imag:
        cut = region.low_real + share * size.real
        return [replace(region, high_real=cut), replace(region, low_real=cut)]
    cut = region.low_imag + share * size.imag
    return [replace(region, high_imag=cut), replace(region, low_imag=cut)]


def _roots_around(
    problem: ScaledProblem, region: Rectangle, certify: bool, start: Array, exact: float
) -> _PartRoots | None:
    """The roots in and around a part of a region, with a count if `certify`; None if the part has
    to be halved.

    The search begins in single precision. It is repeated in double precision from other random
    vectors, up to `MOST_ATTEMPTS` searches in all, if its roots may be incomplete: with `certify`
    if the count differs or stays open, without if there are fewer roots than rough ones. The last
    result is returned. The part has to be halved if the subspace does not reach all roots around
    it, or if no corrections converge.

    start (n, d): an orthonormal basis that nearly holds modes; exact: the backward error of right
    vectors with which corrections end.
    """
    shift = region.off_centre
    # roots known up to a distance r from the shift are known up to r - offset from the centre
    offset = abs(shift - region.centre)
    needed_reach = offset + COUNTED_REACH * region.radius
    basis = start
    latest: _PartRoots | None = None
    for attempt in range(MOST_ATTEMPTS):
        rough = rough_roots_near(
            problem,
            shift,
            region.radius,
            enough=lambda _, reach: reach >= needed_reach,
            seed=attempt,
            single=attempt == 0,
        )
        reach = rough.reach - offset  # from the centre
        if reach < 1.02 * region.radius:  # roots in or at the corners of the part may be unknown
            if attempt == 0 and reach <= 0.3 * region.radius:
                continue  # so short a reach may be due to single precision: once more, in double
            return None
        basis = enlarged(basis, rough.vectors, dropped=1e-6)
        disc = disc_around(region, rough.values, reach)
        # a count needs all roots of the disc; without a count the region and its border are enough
        around = disc if certify else region.widened(1e-6)
        roots = corrected_roots(problem, rough.factor, basis, around, exact)
        if roots is None:
            continue
        count = _count_in_disc(problem, disc, roots, rough) if certify else None
        missing = None if count is None else count - len(roots.values)
        latest = _PartRoots(region, roots, missing, rough)
        # not those within one per cent of the border, which may lie on its other side
        expected = np.sum(region.widened(-0.01).contains(rough.values))
        is_complete = missing == 0 if certify else expected <= len(roots.values)
        if is_complete:
            break
    return latest


def _count_in_disc(
    problem: ScaledProblem, disc: Disc, roots: Roots, rough: RoughRoots
) -> int | None:
    """How many roots lie in a disc by the argument principle; None if determinants leave it open.

    `count_roots` divides det P by the factors z - v of some values v: the `roots` in the disc, and
    outside of it rough roots and distant Ritz values that have not converged. A value outside
    changes no count, be it a root or not, since z - v makes no turn around zero. Distant Ritz
    values save determinants: they stand for the many roots beyond, whose factors in det P they
    roughly cancel, so that eight determinants resolve the quotient in place of 16. Of 150,000
    random sets with a missing root, and a Ritz value right behind it, eight determinants took one
    for complete; without Ritz values five.

    The factor of `rough` lends its memory, and cannot solve afterwards.
    """
    outside = rough.values[~disc.contains(rough.values)]
    known = np.concatenate([roots.values, outside])
    ritz = rough.unconverged
    if problem.is_real:  # det P of conjugate z is conjugate: so should the quotient be
        # conjugates in the disc are among the roots already
        conjugates = known.conj()[~disc.contains(known.conj())]
        distances = np.abs(conjugates[:, None] - outside).min(axis=1, initial=np.inf)
        # a conjugate close to a rough root is that root, as near the zeros of a free motion
        known = np.append(known, conjugates[distances > SAME_ROOT * disc.radius])
        upper = ritz[ritz.imag > 0.0]
        ritz = np.append(upper, upper.conj())
    distant = ritz[np.abs(ritz - disc.centre) > DISTANT * disc.radius]
    return count_roots(problem, disc, np.append(known, distant), rough.factor)


def lowest_modes(problem: ScaledProblem, modes: int, certify: bool = True) -> Modes:
    """All roots of a disc around zero that holds the `modes` lowest with Im lambda >= 0.

    The roots below the real axis are listed with them, of real matrices the conjugates. A rigid
    body has two roots at zero, which count as two modes. The disc ends halfway to the next root, so
    that roots of equal |lambda| are in it together; a count certifies it.

    First a Krylov subspace around zero is built, and enlarged by at most `MOST_ATTEMPTS` - 1 others
    while the count does not confirm its roots. Its roots are returned if the count confirms them.
    They are also returned without a count if none is requested (`certify`), or if none can be made
    and there are more than `DENSE_ROWS` rows. The subspace may not reach the requested modes, or no
    count confirm its roots. Then all roots are computed of up to `DENSE_ROWS` rows; of more rows
    roots are searched in growing squares around zero. Raises ComputationError if there is no root.
    """
    scale = _lowest_frequency_scale(problem)
    # not zero, where P is singular if a rigid body is free, but small beside the lowest roots. A
    # disc around the shift with the radius `reach` holds one around zero with reach - shift
    shift = SHIFT_OF_LOWEST * scale

    def enough(values: ComplexArray, reach: float) -> bool:
        """True if more than twice the requested modes (conjugates come with them) lie well within
        the reach: the disc of the count then ends far from unknown roots, which saves determinants.
        """
        well_within = (reach - shift) / REACH_OF_LOWEST
        return len(values[np.abs(values) < well_within]) > 2 * modes

    basis = np.zeros((problem.n, 0))
    largest = scale  # |lambda| of the requested modes, as far as the subspaces reach
    # each attempt starts from other random vectors, and adds its subspace to the basis
    for attempt in range(MOST_ATTEMPTS):
        rough = rough_roots_near(problem, complex(shift), scale, enough, seed=attempt)
        # directions in which the rough vectors add less are errors of these vectors
        basis = enlarged(basis, rough.vectors, dropped=1e-6)
        values = rough.values
        is_slow = np.abs(values) < shift
        if np.any(is_slow):  # rough values do not tell zeros of free motions from slow modes
            slow = corrected_roots(problem, rough.factor, basis, Disc(shift))
            if slow is None:  # the corrections do not converge in this basis
                continue
            values = np.append(slow.values, values[~is_slow])
        sizes = _sizes_of_modes(problem, values)  # |lambda| of a root of each mode, ascending
        largest = max(largest, float(np.max(sizes[:modes], initial=0.0)))
        reach = rough.reach - shift  # from zero
        reached = sizes[sizes < reach]
        if len(reached) < min(modes, problem.n):
            break  # the subspace does not reach all requested modes
        if np.isinf(reach) and len(rough.values) < 2 * problem.n:
            # the subspace is invariant, so that it reaches everywhere; but of a root of high
            # multiplicity it holds a few copies only
            break
        region = _disc_of_lowest(reached, modes, reach)
        roots = corrected_roots(problem, rough.factor, basis, region)
        if roots is None:
            continue
        count = _count_in_disc(problem, region, roots, rough) if certify else None
        # without a count the roots are returned as they are, unless all can be computed
        is_open = count is None and (not certify or problem.n > DENSE_ROWS)
        if is_open or count == len(roots.values):
            return Modes(eigenvalues_of(problem, roots), region, count, roots)
    if problem.n <= DENSE_ROWS:
        return _lowest_of_all(problem, modes, certify)
    return _lowest_of_squares(problem, modes, largest, certify)


def _rigid_limit(problem: ScaledProblem) -> float:
    """The |lambda| (rad/s) up to which a root may be the zero of a rigid body.

    Rounding of K moves lambda^2 = 0 by up to `STIFFNESS_ROUNDING` times the square of the frequency
    scale, and lambda by the root of that; ten times as much is allowed.
    """
    return 10 * math.sqrt(STIFFNESS_ROUNDING) * problem.frequency_scale


def _sizes_of_modes(problem: ScaledProblem, values: ComplexArray) -> Array:
    """The |lambda|, rising, of the roots that count as modes.

    Of a pair the upper one counts; both count, with |lambda| = 0, if they may be the zeros of a
    rigid body. A real root counts even if its error has put it below the real axis.
    """
    sizes = np.abs(values)
    is_rigid = sizes <= _rigid_limit(problem)
    is_mode = (values.imag >= -RITZ_RESIDUAL * sizes) | is_rigid
    return np.sort(np.where(is_rigid, 0.0, sizes)[is_mode])


def _lowest_frequency_scale(problem: ScaledProblem) -> float:
    """The median |lambda| (rad/s) of at least four of the lowest roots that are no zeros of rigid
    bodies; if there is none, 1e-4 of the problem's frequency scale."""
    rigid = _rigid_limit(problem)
    # far below most roots, and not at zero, even where K is zero
    shift = 1e-4 * (problem.frequency_scale or 1.0)

    def enough(values: ComplexArray, _: float) -> bool:
        return len(values[np.abs(values) > rigid]) >= 4

    rough = rough_roots_near(problem, complex(shift), shift, enough)
    sizes = np.abs(rough.values)
    if not np.any(sizes > rigid):
        return shift
    return float(np.median(sizes[sizes > rigid]))


def _disc_of_lowest(sizes: Array, modes: int, reach: float) -> Disc:
    """The disc around zero that holds the lowest modes.

    It ends halfway to the next mode, or to the reach if there is none. sizes: the |lambda| (m,) of
    all modes up to `reach`, sorted; an infinite reach says that there are no others. Raises
    ComputationError without any mode.
    """
    if not len(sizes):
        raise ComputationError("no root was found near zero; a band or region is required")
    last = sizes[min(modes, len(sizes)) - 1]
    beyond = np.min(sizes[sizes > last * (1 + RITZ_RESIDUAL)], initial=reach)
    if np.isinf(beyond):  # any disc that is larger serves
        beyond = 2 * last or 1.0
    return Disc(float(last + beyond) / 2)


def _lowest_of_all(problem: ScaledProblem, modes: int, certify: bool) -> Modes:
    """The lowest modes of a problem of few rows, from all of its roots."""
    M, C, K = problem.arrays()
    all_values = dense_values(M, C, K)
    values = all_values
    if problem.is_real:  # the lower roots follow as conjugates
        values = values[values.imag >= 0.0]
    region = _disc_of_lowest(_sizes_of_modes(problem, values), modes, math.inf)
    roots = roots_at(M, C, K, values[region.contains(values)])
    if problem.is_real:
        roots = roots.with_conjugates()
    count = count_roots(problem, region, all_values) if certify else None
    return Modes(eigenvalues_of(problem, roots), region, count, roots)


def _lowest_of_squares(problem: ScaledProblem, modes: int, largest: float, certify: bool) -> Modes:
    """The lowest modes from the roots in squares around zero, the first of half width `largest`.

    The squares grow until the disc in one of them, of radius half width, holds `modes` modes. After
    `MOST_ENLARGEMENTS` the roots of the last disc are returned, however few. largest: an estimate
    of the largest |lambda| of these modes, rad/s; certify: whether roots are counted.
    """
    half_width = 1.02 * largest / ENLARGEMENT  # 1.02: the largest root itself lies inside
    for _ in range(MOST_ENLARGEMENTS):
        half_width *= ENLARGEMENT
        # of real matrices the half above the real axis, and the axis: conjugates lie below
        low = -1e-6 * half_width if problem.is_real else -half_width
        square = Rectangle(-half_width, half_width, low, half_width)
        in_square = modes_in(problem, square, certify)
        roots = in_square.roots
        if problem.is_real:
            roots = roots.select(roots.values.imag >= 0.0)
        sizes = _sizes_of_modes(problem, roots.values)
        sizes = sizes[sizes < half_width]  # not those in the corners of the square
        if len(sizes) >= min(modes, problem.n):
            break
    region = _disc_of_lowest(sizes, modes, half_width)
    roots = roots.select(region.contains(roots.values))
    if problem.is_real:
        roots = roots.with_conjugates()
    count = len(roots.values) if in_square.certified else None
    return Modes(eigenvalues_of(problem, roots), region, count, roots)
