"""All roots in a region of the complex plane, and the count that shows whether one is missing.

A Krylov subspace around a shift in the region gives rough values of the roots (`krylov`), and
corrections make them exact (`corrections`). Neither shows that no root is missing. A count does:
det P(z) is analytic, and along a closed outline its phase makes as many turns as roots lie inside
(the argument principle, `argument_principle`). Divided by the factors z - v of the roots v that are
known inside, det P makes no turn if the list is complete, and its phase changes so little that a
few determinants on a circle are enough.

If the count differs or stays open, the search starts again from other random vectors, in double
precision. If the subspace does not reach all roots of the region, the region is halved, and each
half is searched and counted. What is missing in the end is reported: `Modes.certified` is False.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from squeal.errors import ComputationError
from squeal.linear.eigen import Eigenvalue, values_of
from squeal.linear.roots import STIFF
from squeal.sparse.argument_principle import Disc, Rectangle, Region, count_roots, disc_around
from squeal.sparse.corrections import EXACT_RESIDUAL, corrected_roots, enlarged
from squeal.sparse.krylov import RoughRoots, rough_roots_near
from squeal.sparse.quadratic import Array, ComplexArray, Roots, ScaledProblem, eigenvalues_of

COUNTED_REACH = 1.6  # of a region's radius: roots up to here have to be known for a cheap count
MOST_PARTS = 200  # of a region that are searched before it is refused
MOST_ATTEMPTS = 3  # starts for a region whose count shows missing roots
DISTANT = 1.7  # of a disc's radius: Ritz values beyond stand for the unknown roots there
SAME_ROOT = 1e-2  # of a disc's radius: two rough values of one root beyond it may differ by this
UNCOUNTED_PART = 0.125  # of a region: smaller ones are not halved for a count alone
SMALLEST_PART = 1e-3  # of a region: smaller ones are not halved


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
        count = count_in_disc(problem, disc, roots, rough) if certify else None
        missing = None if count is None else count - len(roots.values)
        latest = _PartRoots(region, roots, missing, rough)
        # not those within one per cent of the border, which may lie on its other side
        expected = np.sum(region.widened(-0.01).contains(rough.values))
        is_complete = missing == 0 if certify else expected <= len(roots.values)
        if is_complete:
            break
    return latest


def count_in_disc(
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
