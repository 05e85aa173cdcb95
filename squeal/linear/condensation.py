"""The finite roots of a system in which some motion has no mass, or hardly any.

They are the roots z of a pencil F - z E: of K - s M without damping, s = -lambda^2, else of the
first-order form, in which a coordinate without mass has no velocity. Where E is singular others are
infinite. T = (F - sigma E)^-1 E has the eigenvalues 1 / (z - sigma), zero for infinite roots. With
constraints these form Jordan chains, so that only a power of T removes them: a few powers leave the
right vectors R of the finite roots, those of the transposed pencil the left ones L. With L E R = 1
the finite roots are the eigenvalues of A = L F R, and dA = L (dF R - dE R A).

More powers leave out roots that are far greater than all others, as those of a light mass, whose
rounding would hide what others do.
"""

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import MatrixError
from squeal.linear.finite_roots import FEW_ROWS, finite_root_count
from squeal.linear.matrices import (
    EPS,
    MCK,
    Array,
    SingularTogetherError,
    StandardProblem,
    divisor,
    norm_of,
)
from squeal.linear.roots import ComplexArray

EXACT_ROWS = 40
"""Rows up to which motions without mass are found in exact arithmetic."""
SHIFTS = (0.83, -1.37, 2.9, -0.21)
"""Values of sigma, over the frequency scale or its square; the one farthest from a root serves."""
GAP = 3e2
"""How many times greater roots are that are left out, if they decay."""
GAP_OF_SQUARES = 1e6
"""... and of s = -lambda^2."""
WIDE = 1e9
"""How many times greater than the least the greatest root is where a gap of sqrt(GAP), or of the
square root of that of squares, suffices: rounding then hides the least roots."""
THROUGH_INFINITY = (
    "M, C and K: a root passes through infinity within the range, as where what holds or damps a "
    "motion without mass vanishes, or grows far faster than others; thresholds can be given of a "
    "range without such values, or those that lie in a `band` (low and high, in Hz)"
)


def state_pencil(M: NDArray, C: NDArray, K: NDArray, heavy: int) -> tuple[NDArray, NDArray]:
    """F and E (n + heavy, n + heavy) of F x = z E x, the first-order form.

    Columns of M from `heavy` on are zero. The state x is the displacements of coordinates with
    mass, their velocities, and the displacements of coordinates without mass.
    """
    n = len(M)
    eye = np.eye(heavy)
    zero = np.zeros((heavy, heavy))
    of_massless = np.zeros((heavy, n - heavy))
    # `heavy` rows say that velocities are z times displacements, n rows are the equations
    E = np.block([[eye, zero, of_massless], [np.zeros((n, heavy)), M[:, :heavy], C[:, heavy:]]])
    F = np.block([[zero, eye, of_massless], [-K[:, :heavy], -C[:, :heavy], -K[:, heavy:]]])
    return F, E


def zero_columns_last(X: NDArray) -> tuple[NDArray, int]:
    """Q (n, n) and the rank r of X (m, n): r columns of X Q are independent, those after them zero.

    The first r columns of X Q are columns of X, times powers of two. The other columns of Q are
    null vectors of X, by Gauss-Jordan elimination with complete pivoting, in fractions for up to
    `EXACT_ROWS` columns: coordinates are often mixed by integers, which leaves exact zeros.
    """
    n = X.shape[1]
    scale = np.exp2(-np.round(np.log2(divisor(np.abs(X).max(axis=0)))))
    reduced: NDArray = X * scale  # the largest entry of each column is about 1
    if n <= EXACT_ROWS:
        reduced = np.vectorize(Fraction, otypes=[object])(reduced)
    rows: list[int] = []
    pivots: list[int] = []  # the column that each row of `rows` was solved for
    while len(rows) < min(X.shape):
        sizes = np.abs(reduced).astype(float)
        sizes[rows] = 0.0  # rows that have their pivots
        row, column = np.unravel_index(np.argmax(sizes), sizes.shape)
        if not sizes[row, column] > 4 * EPS * n:  # rounding may have left what remains
            break
        reduced[row] = reduced[row] / reduced[row, column]
        multiples = reduced[:, column].copy()
        multiples[row] = 0
        reduced -= np.outer(multiples, reduced[row])
        rows.append(int(row))
        pivots.append(int(column))
    rank = len(rows)
    dependent = np.setdiff1d(np.arange(n), pivots)
    Q = np.eye(n)[:, [*pivots, *dependent]]
    # row i now says x_pivot + sum of reduced[i, dependent] x_dependent = 0 for a null vector x
    Q[pivots, rank:] = -reduced[rows][:, dependent].astype(float)
    return scale[:, None] * Q, rank


class Pencil(NamedTuple):
    """F and E (N, N) of F x = z E x, or their derivatives, or bounds of their terms."""

    F: NDArray
    E: NDArray


class Subspaces(NamedTuple):
    """L (m, N) and R (N, m) of the module's head, and the sign of the leading coefficient.

    It is that of det (F - z E) / det (A - z), which changes where a root passes through infinity.
    """

    left: NDArray
    right: NDArray
    sign: float


class FastRootGrowsError(MatrixError):
    """A fast root that was left out grows at some value, so that none may be left out."""


class Condensation:
    """The reduction of a system to its finite roots, at any value of its parameter.

    Its numbers and the start of its iterations are those of some samples of the system. Raises
    MatrixError where every number is a root or none is, and where a root passes through infinity.

    Attributes
    ----------
    size : int
        How many roots are followed, m in shapes.
    frequency_scale : float
        What they are divided by, 1/s; s = -lambda^2 by its square.
    left_out : int
        How many finite roots are left out, as far greater than all others.
    hidden : int
        How many more the equations have, which rounding makes infinite; 0 of more than 40 rows.
    """

    def __init__(self, samples: Sequence[MCK], undamped: bool, all_roots: bool) -> None:
        """Separate motions without mass, balance the pencils, and find how many roots are followed.

        samples: M, C and K, arrays (n, n), at some values of the parameter; undamped: whether z is
        s = -lambda^2; all_roots: whether a fast root may not be left out.
        """
        masses: Array = np.array(samples)[:, 0]
        if np.array_equal(masses[1:], masses[:-1]):  # M does not vary
            masses = masses[:1]
        # coordinates without mass at all samples come last, and rows alike: `_left` M `_right` is
        # zero but for its first `_heavy_rows` rows and `_heavy` columns
        self._right, self._heavy = zero_columns_last(np.concatenate(list(masses)))
        transposed = np.concatenate(list(masses.swapaxes(1, 2)))
        left, self._heavy_rows = zero_columns_last(transposed)
        self._left = left.T
        self._undamped = undamped
        self.frequency_scale = rate = _frequency_scale(samples)
        term_sizes = []  # of lambda^2 M + lambda C + K where |lambda| is the frequency scale
        for matrices in samples:
            M, C, K = map(np.abs, self._transformed(matrices))
            term_sizes.append(rate**2 * M + rate * C + K)
        # balanced before the first-order form is made: its rows that say (velocity) = z times
        # (displacement) would fix the units of both
        rows, columns = _balancing(term_sizes)
        self._left = rows * self._left
        self._right = self._right * columns
        pencils = list(map(self._pencil, samples))
        self._middle = pencils[len(pencils) // 2]
        roots, powers = zip(*map(_finite_roots, pencils), strict=True)
        counts = list(map(len, roots))  # fewer where rounding hides a great root
        self.size: int = min(counts)
        self._powers: int = max(powers)
        self.hidden = 0
        if len(self._left) <= FEW_ROWS:
            lambdas_per_root = 2 if undamped else 1
            M, C, K = self._transformed(samples[len(samples) // 2])
            found = lambdas_per_root * max(counts)
            in_all = finite_root_count(M, C, K, guess=found)
            self.hidden = (in_all - found) // lambdas_per_root
        if not any(counts):
            if self.hidden:
                raise MatrixError(
                    "M, C and K: rounding hides all their roots, as masses or springs differ too "
                    "much in size or entries cancel"
                )
            raise MatrixError(
                "M, C and K: no motion but free ones satisfies them, so that none begins to grow"
            )
        if self.size and not all_roots:
            self._leave_fast_roots(roots)
        self.left_out = max(counts) - self.size
        # where none may be left out, fewer roots at some samples have become infinite there
        if self.left_out and (all_roots or not self.size):
            raise MatrixError(THROUGH_INFINITY)
        self._fix_subspaces()

    def _fix_subspaces(self) -> None:
        """Set the subspaces from which those of all pencils are iterated, and their scale.

        Random ones are iterated for the middle sample. `_reference` (m, N) then fixes the scale of
        all right bases R (N, m) by reference R = 1, so that they vary smoothly with the parameter.
        """
        start = np.random.default_rng(self.size).standard_normal((len(self._middle.E), self.size))
        self._start = Subspaces(start.T, start, sign=0.0)
        self._reference = start.T
        self._start = self._subspaces(self._middle)
        self._reference = self._start.left @ self._middle.E

    def _leave_fast_roots(self, samples: Sequence[ComplexArray]) -> None:
        """Leave out the roots beyond the first great gap of their sizes, if all of them decay.

        Sets `size` and `_powers`: each power of T shrinks the share of the roots beyond the gap by
        the gap, and as many are added as shrink it to rounding.

        samples: the finite roots, over the frequency scale, by rising size at some values of the
        parameter; at some of these rounding may hide the greatest.
        """
        # of the middle sample; at least 1, the frequency scale, so that a root near zero leaves no
        # gap above itself
        sizes = np.maximum(np.abs(samples[len(samples) // 2]), 1.0)
        gaps = (sizes[1:] / sizes[:-1])[: self.size]  # above each root
        great_gap = GAP_OF_SQUARES if self._undamped else GAP
        if sizes[-1] > WIDE * sizes[0]:
            great_gap = math.sqrt(great_gap)
        if not np.any(gaps >= great_gap):
            return
        followed = int(np.argmax(gaps >= great_gap)) + 1  # roots below the first such gap
        if all(self._decay(roots[followed:]) for roots in samples):
            self.size = followed
            # n more powers with gap^-n <= EPS
            self._powers += math.ceil(math.log(EPS) / -math.log(gaps[followed - 1]))

    def _decay(self, fast: ComplexArray) -> bool:
        """True if all fast roots decay or, without damping, are real numbers s = -lambda^2 > 0."""
        if self._undamped:
            return bool(np.all((fast.real > 0.0) & (np.abs(fast.imag) < EPS**0.5 * fast.real)))
        return bool(np.all(fast.real < 0.0))

    def _fast_roots(self, pencil: Pencil, subspaces: Subspaces) -> ComplexArray:
        """The finite roots that were left out, but for those that rounding takes for infinite."""
        if not self.left_out:
            return np.zeros(0, dtype=complex)
        L, R, _ = subspaces
        # null vectors of L E, and of E R from the left, span fast and infinite roots
        right = np.linalg.svd(L @ pencil.E)[2][self.size :].T
        left = np.linalg.svd((pencil.E @ R).T)[2][self.size :]
        return _finite_roots(Pencil(left @ pencil.F @ right, left @ pencil.E @ right))[0]

    def _transformed(self, matrices: MCK, of_terms: bool = False) -> list[NDArray]:
        """L X R of X = M, C and K, whose massless rows and columns come last.

        of_terms: the sums |L| |X| |R| of the sizes of their terms instead.
        """
        transformed = []
        for X in matrices:
            product = self._left @ X @ self._right
            terms = np.abs(self._left) @ np.abs(X) @ np.abs(self._right)
            transformed.append(terms if of_terms else _beyond_rounding(product, terms))
        transformed[0][self._heavy_rows :] = 0.0
        transformed[0][:, self._heavy :] = 0.0
        return transformed

    def _pencil(self, matrices: MCK, of_terms: bool = False, is_derivative: bool = False) -> Pencil:
        """The balanced pencil of M, C and K, with z over the frequency scale.

        of_terms: that of the sums of the sizes of their terms instead, see `_transformed`, which
        bound rounding; is_derivative: of dM, dC and dK.
        """
        M, C, K = self._transformed(matrices, of_terms)
        rate = self.frequency_scale
        F = K
        E = rate**2 * M
        if not self._undamped:
            F, E = state_pencil(rate**2 * M, rate * C, K, self._heavy)
            if is_derivative:  # the rows of velocities are constant
                F[: self._heavy] = 0.0
                E[: self._heavy] = 0.0
        return Pencil(F, E)

    def _subspaces(self, pencil: Pencil) -> Subspaces:
        """The subspaces L and R of the followed roots, by powers of T = (F - sigma E)^-1 E.

        The bases of `_start` are multiplied by T, `_powers` times: R by T of the pencil, L by T of
        the transposed pencil. Their columns then span what T does not shrink, the vectors of the
        followed roots. R is scaled so that it varies smoothly with the parameter, then L by
        L E R = 1. Raises LinAlgError where a followed root is infinite.
        """
        F, E = pencil
        sigma, _ = _shift(pencil)
        shifted = F - sigma * E
        R = self._start.right
        L = self._start.left.T  # (N, m) as R, until the last step
        for _ in range(self._powers):
            # the basis Q of QR spans the same space as the product, but its columns stay
            # independent
            R = np.linalg.qr(np.linalg.solve(shifted, E @ R))[0]
            L = np.linalg.qr(np.linalg.solve(shifted.T, E.T @ L))[0]
        R = R @ np.linalg.inv(self._reference @ R)  # so that reference R = 1
        # entries that are mere rounding, next to the largest of their column, become 0
        R = _beyond_rounding(R, np.abs(R).max(axis=0))
        L = _beyond_rounding(L, np.abs(L).max(axis=0))
        L = np.linalg.solve(L.T @ E @ R, L.T)  # (m, N), so that L E R = 1
        # det(F - sigma E) = c (z_1 - sigma) (z_2 - sigma) ... over all finite roots, and the
        # determinant of L F R - sigma is this product over the followed ones: their signs together
        # give that of c times the factors of the roots that are left out. It changes where a root
        # passes through infinity; `problem` compares it with the sign at the middle sample
        of_followed = L @ F @ R - sigma * np.eye(self.size)
        sign = np.linalg.slogdet(shifted)[0] * np.linalg.slogdet(of_followed)[0]
        return Subspaces(L, R, float(sign))

    def problem(self, matrices: MCK, slopes: MCK, value: float) -> StandardProblem:
        """The eigenproblem of the followed roots for M, C and K with derivatives dM, dC and dK.

        value: of the parameter. The terms of a matrix X that cancel have sizes of about |X| and
        |value dX|, by which rounding of its entries is bounded. Raises MatrixError where a root
        passes through infinity, and FastRootGrowsError where a root that was left out grows.
        """
        pencil = self._pencil(matrices)
        try:
            subspaces = self._subspaces(pencil)
        except np.linalg.LinAlgError:  # a followed root is infinite here
            raise MatrixError(THROUGH_INFINITY) from None
        if subspaces.sign != self._start.sign:
            raise MatrixError(THROUGH_INFINITY)
        if not self._decay(self._fast_roots(pencil, subspaces)):
            raise FastRootGrowsError(THROUGH_INFINITY)
        L, R, _ = subspaces  # (m, N) and (N, m), with L E R = 1
        M, C, K = (abs(X) + abs(value * dX) for X, dX in zip(matrices, slopes, strict=True))
        terms = self._pencil((M, C, K), of_terms=True)
        abs_R = np.abs(R)
        F_sizes = np.abs(L) @ np.abs(terms.F) @ abs_R
        # entries that are mere rounding become 0: they would move roots at zero across the axis
        A = _beyond_rounding(L @ pencil.F @ R, F_sizes)
        sizes = F_sizes + np.abs(L) @ terms.E @ abs_R @ np.abs(A)
        dF, dE = self._pencil(slopes, is_derivative=True)
        # (F - z E) R x = 0 gives dz = y^H L (dF - z dE) R x, and z R x is R A x
        derivative = _beyond_rounding(
            L @ (dF @ R - dE @ R @ A),
            np.abs(L) @ (np.abs(dF) @ abs_R + np.abs(dE) @ abs_R @ np.abs(A)),
        )
        # the pencil has s over the squared frequency scale, but undamped z = s itself
        unit = self.frequency_scale**2 if self._undamped else 1.0
        return StandardProblem(unit * A, unit * derivative, unit * sizes)


def _frequency_scale(samples: Sequence[MCK]) -> float:
    """A power of two, 1/s, near the frequencies of some systems.

    sqrt(K / M), without mass K / C, and 1 without stiffness, by norms in units of rows and columns
    in which entries of K are about one.
    """
    masses, dampings, stiffnesses = zip(*samples, strict=True)
    rows, columns = _balancing(stiffnesses)
    mass = max(norm_of(rows * M * columns) for M in masses)
    damping = max(norm_of(rows * C * columns) for C in dampings)
    stiffness = max(norm_of(rows * K * columns) for K in stiffnesses)
    rate = 1.0
    if stiffness and mass:
        rate = math.sqrt(stiffness / mass)
    elif stiffness and damping:
        rate = stiffness / damping
    return 2.0 ** round(math.log2(rate))


def _balancing(matrices: Sequence[NDArray]) -> tuple[Array, Array]:
    """Factors (n, 1) and (1, n), powers of 2, of rows and columns, so that entries are about one.

    All matrices (n, n) get the same factors: each entry counts by the largest of its sizes in them.

    First the logarithms of all entries are brought near zero by least squares (Curtis and Reid
    1972), whatever the units; then the largest entry of each row and column is brought to about
    one. Rows (k = 0) and columns (k = 1) take turns, eight times and three times: each is then
    balanced for the factors that the others have.
    """
    size = np.max(np.abs(matrices), axis=0)
    used = np.sign(size)  # 1 of entries that are not zero, else 0
    logarithms = np.log2(divisor(size))
    factors = [np.ones((len(size), 1)), np.ones((1, len(size)))]
    for k in (0, 1) * 8:
        scaled = used * (np.log2(factors[0]) + logarithms + np.log2(factors[1]))
        mean = scaled.sum(axis=1 - k, keepdims=True) / divisor(used.sum(axis=1 - k, keepdims=True))
        factors[k] = factors[k] * np.exp2(-mean)
    factors = [np.exp2(np.round(np.log2(factor))) for factor in factors]
    for k in (0, 1) * 3:
        largest = (factors[0] * size * factors[1]).max(axis=1 - k, keepdims=True)
        factors[k] = factors[k] * 0.5 ** np.round(np.log2(divisor(largest)))
    return factors[0], factors[1]


def _beyond_rounding(products: NDArray, terms: Array) -> NDArray:
    """Sums of products (n, n), with zeros where `terms`, sums of their sizes, leave no digit."""
    return np.where(np.abs(products) > 4 * EPS * len(products) * terms, products, 0.0)


def _shift(pencil: Pencil) -> tuple[float, float]:
    """Of `SHIFTS` the one that is farthest from a root, and the condition of the shifted pencil.

    Raises SingularTogetherError where every number is a root.
    """
    F, E = pencil
    conditions = []
    for sigma in SHIFTS:
        conditions.append(float(np.linalg.cond(F - sigma * E)))
    least = float(np.min(np.nan_to_num(conditions, nan=np.inf)))
    if not 4 * EPS * len(F) * least < 1.0:
        raise SingularTogetherError(
            "M, C and K: are singular together at a value of the parameter, as far as rounding "
            "shows, so that every number is a root there; a range without it is required"
        )
    return SHIFTS[conditions.index(least)], least


def _finite_roots(pencil: Pencil) -> tuple[ComplexArray, int]:
    """The finite roots, by rising size, and the power of T that leaves these alone.

    Infinite roots are the zero eigenvalues of T = (F - sigma E)^-1 E. In chains they vanish only
    under a power of it, so T is restricted to its range until it is regular. The power is one more
    than the number of restrictions.
    """
    F, E = pencil
    sigma, condition = _shift(pencil)
    T = np.linalg.solve(F - sigma * E, E)
    errors = 4 * EPS * condition * norm_of(T) * np.ones_like(T)  # by rounding
    powers = 1
    while len(T):
        left, singular, right = np.linalg.svd(T)
        # |u_i|' errors |v_i|: how far rounding may move each singular value
        bounds = np.sum(np.abs(left.T) @ errors * np.abs(right), axis=1)
        kept = singular > bounds
        if kept.all():
            break
        # T = U S V' of the kept singular values: on its range it acts as S^(1/2) V' U S^(1/2), a
        # matrix in which rounding has the least share
        sizes = np.sqrt(singular[kept])
        relative = bounds[kept] / singular[kept]
        T = sizes[:, None] * (right[kept] @ left[:, kept]) * sizes
        # entry i, j is sqrt(s_i s_j) v_i' u_j with |v_i' u_j| <= 1: the relative errors of s_i and
        # s_j, and of their vectors, move it by about their sum at most
        errors = sizes[:, None] * (relative[:, None] + relative) * sizes
        powers += 1
    roots = np.asarray(sigma + 1.0 / np.linalg.eigvals(T), dtype=complex)
    return roots[np.argsort(np.abs(roots))], powers
