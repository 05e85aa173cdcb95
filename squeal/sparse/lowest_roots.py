"""The lowest roots: those of a disc around zero that holds a requested number of modes.

The radius of that disc is not known before the roots are. A few rough roots next to zero give the
scale of the lowest frequencies. A Krylov subspace around a shift on that scale then grows until it
reaches more than the requested modes, corrections make its roots exact, and the disc ends halfway
to the next root, where a count of its roots is cheap (`region_roots` says how roots are counted and
why some may be missing).

The zeros of rigid bodies are a multiple root, which rounding of K spreads around zero; each motion
of a rigid body counts as two modes. Where the subspace does not reach, or no count confirms its
roots, all roots of a problem of few rows are computed, and those in growing squares around zero of
a larger one.
"""

import math

import numpy as np

from squeal.errors import ComputationError
from squeal.sparse.argument_principle import Disc, Rectangle, count_roots
from squeal.sparse.corrections import corrected_roots, enlarged
from squeal.sparse.dense import STIFFNESS_ROUNDING, dense_values, roots_at
from squeal.sparse.krylov import RITZ_RESIDUAL, rough_roots_near
from squeal.sparse.quadratic import Array, ComplexArray, ScaledProblem, eigenvalues_of
from squeal.sparse.region_roots import MOST_ATTEMPTS, Modes, count_in_disc, modes_in

DENSE_ROWS = 2000  # up to which all roots are computed where few do not suffice
SHIFT_OF_LOWEST = 0.3  # of the scale of the lowest roots: where their subspace is built
REACH_OF_LOWEST = 1.5  # how much farther than the lowest roots their subspace has to reach
ENLARGEMENT = 1.5  # of a region around zero until it holds the lowest roots
MOST_ENLARGEMENTS = 12  # at most


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
        count = count_in_disc(problem, region, roots, rough) if certify else None
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
