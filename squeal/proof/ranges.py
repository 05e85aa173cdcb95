"""The referee over a range of the parameter: what grows between the printed thresholds.

Matrices over an interval of the parameter are balls that hold those of every value in it, so that
one enclosure speaks of all. Where it does not suffice the interval is halved.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import ArrayLike, NDArray

from squeal.proof import AS_GIVEN
from squeal.proof.balls import (
    Balls,
    between,
    divisor,
    doubles,
    half_widths,
    high_end,
    in_doubles,
    middle_and_radius,
    taylor_coefficients,
    upper,
)
from squeal.proof.enclosure import companion, components
from squeal.proof.pieces import Failure, growing_of
from squeal.proof.referee import Proof
from squeal.proof.segments import (
    Basis,
    Expansion,
    bases,
    near_diagonal,
    tallies_above,
    tallies_of_inverses,
    tallies_of_squares,
    tallies_of_values,
)

try:
    import flint
except ImportError:  # an extra
    flint = None

Factor = Callable[[Any], Any]
"""A function of the parameter by + - * / and **; it is given a ball of numbers (`flint.arb`), or a
Taylor series of balls (`flint.arb_series`)."""
Rational = Any
"""A rational number or a matrix of such, `flint.fmpq` or `flint.fmpq_mat`."""
NARROWEST = 1e-14  # of the range: a step that is not shortened
SPENT = "the range takes more steps than are made"
AT_END = "a threshold lies at an end of the range, beyond which nothing is counted"
CANCELS = "what begins and what ends to grow at one value may cancel in the count"
MOST_LENGTHENING = 32.0  # of the length of a step after one that is proved
LEAST_LENGTHENING = 1.25  # ... after one that is not was followed by one that is
SHORTENING = 0.5  # the length of a step after one that is not proved, by that of the latter
MOST_VALUES_BEYOND = 8  # at which a refutation is searched where no step succeeds
NEARER = 32.0  # each of these lies so many times nearer to where the steps ended than the last
INSIDE_SHARE = 0.4629  # of a gap: where what grows is counted; roots often touch the axis half way
ASIDE_SHARE = 1e-3  # of a gap: how far from a threshold that is refuted the search looks again
FIRST_STEP = 1e-8  # of the gap: a step beside a threshold


@dataclass(frozen=True, eq=False)
class Term:
    """A matrix (n, n) and the factor that multiplies it; None for one.

    `errors` (n, n) are how far each entry may be off beyond what `data` of `Terms` says.
    """

    matrix: ArrayLike
    factor: Factor | None = None
    errors: ArrayLike | None = None


@dataclass(frozen=True, eq=False)
class Terms:
    """M, C and K over a parameter, each a sum of terms; C may have none.

    `data` says how the entries of each matrix are known. `balls` are the matrices of the terms by
    the letters, made from these if left out; of a component some of their rows and columns. Needs
    python-flint.

    Raises
    ------
    ImportError
        Without python-flint.
    ValueError
        For entries that no double holds.
    """

    M: Sequence[Term]
    C: Sequence[Term]
    K: Sequence[Term]
    data: str = AS_GIVEN
    balls: Mapping[str, Sequence[Balls]] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        if flint is None:
            raise ImportError("ranges need python-flint", name="flint")
        if self.balls:
            return
        balls: dict[str, list[Balls]] = {"M": [], "C": [], "K": []}
        for name, matrices in balls.items():
            for term in getattr(self, name):
                X = _real_if_possible(doubles(np.asarray(term.matrix)))
                entries = Balls(X, half_widths(X, self.data))
                if term.errors is not None:
                    entries = entries.widened(np.asarray(term.errors))
                matrices.append(entries)
        object.__setattr__(self, "balls", balls)

    @property
    def n(self) -> int:
        """Number of rows."""
        return len(self.balls["M"][0].mid)

    @property
    def matrices(self) -> list[Balls]:
        """The matrices of all terms of M, of C and of K."""
        return list(itertools.chain(*self.balls.values()))

    def mapped(self, change: Callable[[Balls], Balls]) -> Terms:
        """The terms with a map of each matrix."""
        balls: dict[str, list[Balls]] = {}
        for name, matrices in self.balls.items():
            balls[name] = list(map(change, matrices))
        return replace(self, balls=balls)

    @property
    def is_real(self) -> bool:
        """True if no entry is complex."""
        return not any(np.iscomplexobj(X.mid) for X in self.matrices)

    @property
    def is_undamped(self) -> bool:
        """True if C is zero at each value."""
        return all(X.is_zero for X in self.balls["C"])

    @property
    def is_gyroscopic(self) -> bool:
        """True if M and K are symmetric and C is skew at each value."""
        M_and_K = (*self.balls["M"], *self.balls["K"])
        is_symmetric = all(np.array_equal(X.mid, X.mid.T) for X in M_and_K)
        return is_symmetric and all(np.array_equal(X.mid, -X.mid.T) for X in self.balls["C"])

    def components(self) -> list[Terms]:
        """The terms of each strong component, whose roots are those of the system together."""
        terms = []
        for rows in components(self.matrices):
            terms.append(self.mapped(functools.partial(_block_of, rows)))
        return terms

    def separated(self) -> Terms:
        """The terms in coordinates of which those without mass are separate, in balanced units.

        A constant M that is exactly singular has null vectors of rational numbers, so that the
        entries in the new coordinates are exact and the terms are taken as given. If C is one
        constant term, motions without mass are separated further, by the null vectors of their
        damping. The terms as they are where M is regular, varies, is complex or is known to fewer
        than all digits of its doubles.
        """
        mass, *others = self.M
        if others or mass.factor is not None or not self.is_real:
            return self
        if not all(X.has_all_digits for X in self.matrices):
            return self
        M = _rational(self.balls["M"][0].mid)
        right, rank = _null_vectors_last(M)
        if rank == self.n:
            return self
        left = _null_vectors_last(M.transpose())[0]
        if len(self.C) == 1 and self.C[0].factor is None:
            damping = left.transpose() * _rational(self.balls["C"][0].mid) * right
            of_massless = flint.fmpq_mat(np.array(damping.tolist())[rank:, rank:].tolist())
            right = right * _below_ones(rank, _null_vectors_last(of_massless)[0])
            left = left * _below_ones(rank, _null_vectors_last(of_massless.transpose())[0])
        separate = self
        used = np.count_nonzero(right.entries() + left.entries())
        if used > 2 * self.n:  # else both only sort coordinates: they are separate already

            def in_coordinates(X: Balls) -> Balls:
                product = left.transpose() * _rational(X.mid) * right
                return in_doubles(np.vectorize(flint.arb)(product.tolist()))

            separate = replace(self.mapped(in_coordinates), data=AS_GIVEN)
        return separate._balanced()

    def _balanced(self) -> Terms:
        """The terms in units of coordinates, powers of 2, in which largest entries are alike."""
        sizes = np.zeros((self.n, self.n))
        for X in self.matrices:
            bound = X.bound()
            sizes = np.maximum(sizes, bound / max(bound.max(), 1e-300))
        units = np.zeros(self.n, dtype=int)
        for _ in range(4):
            scaled = np.ldexp(sizes, units[:, None] + units)
            largest = np.sqrt(scaled.max(axis=0)) * np.sqrt(scaled.max(axis=1))
            units = units - np.rint(np.log2(divisor(largest)) / 2).astype(int)
        return self.mapped(lambda X: X.scaled(units[:, None] + units))

    def expanded(self, low: float, high: float) -> tuple[Expansion, Expansion, Expansion]:
        """M, C and K about `middle_and_half` of two values of the parameter.

        Raises ValueError where a factor divides by what may be zero.
        """
        # p = middle + d to first order in d, and about every value between, for the second order
        middle, _ = middle_and_half(low, high)
        about_middle = flint.arb_series([flint.arb(middle), 1], prec=2)
        about_all = flint.arb_series([between(low, high), 1], prec=3)
        M, C, K = (self._expansion_of_sum(name, about_middle, about_all) for name in "MCK")
        return M, C, K

    def _expansion_of_sum(self, name: str, about_middle: Any, about_all: Any) -> Expansion:
        """M, C or K, the sum of its terms; entries that are zero in all of them stay zero.

        The Taylor series are those of the parameter: about the middle of an interval to first
        order, and about all values in it at once to the second. The coefficient f''/2 of the latter
        bounds what a factor f has beyond first order, by d^2 (Lagrange's remainder).
        """
        zeros = np.zeros((self.n, self.n))
        values: list[Balls] = []
        slopes: list[Balls] = []
        remainder = zeros
        matrices = self.balls[name]
        for term, X in zip(getattr(self, name), matrices, strict=True):
            if term.factor is None:
                values.append(X)
                continue
            factor, factor_slope = taylor_coefficients(term.factor(about_middle), 2)
            _, _, half_curvature = taylor_coefficients(term.factor(about_all), 3)
            values.append(_multiplied(X, factor))
            slopes.append(_multiplied(X, factor_slope))
            remainder = remainder + X.bound() * high_end(abs(half_curvature))
        # the rounding of sums would make a ball of zeros, too
        is_used = np.any([X.pattern for X in matrices], axis=0)

        def sum_of(balls: list[Balls]) -> Balls:
            if not balls:
                return Balls.exact(zeros)
            X = functools.reduce(Balls.plus, balls)
            return Balls(X.mid, np.where(is_used, X.rad, 0.0))

        return Expansion(
            value=sum_of(values),
            slope=sum_of(slopes),
            remainder=np.where(is_used, upper(remainder, 2 * len(matrices)), 0.0),
        )


def _rational(X: NDArray) -> Rational:
    """A matrix of doubles as one of rational numbers."""

    def exact(value: float) -> Rational:
        return flint.fmpq(*value.as_integer_ratio())

    return flint.fmpq_mat(*X.shape, list(map(exact, X.ravel().tolist())))


def _null_vectors_last(X: Rational) -> tuple[Rational, int]:
    """A regular Q of rational numbers, and the rank of X (n, n).

    The columns of X Q behind the first `rank` are zero: the last columns of Q are null vectors.
    """
    n = X.ncols()
    reduced, rank = X.rref()
    is_used = np.array(reduced.tolist()) != 0
    pivots = is_used[:rank].argmax(axis=1).tolist()
    free = np.setdiff1d(np.arange(n), pivots).tolist()
    Q = flint.fmpq_mat(n, n)
    for place, column in enumerate(pivots + free):
        Q[column, place] = 1
    # in row-reduced form the pivots follow from a free unknown of 1 by its column, negated
    for place, column in enumerate(free, rank):
        for row, pivot in enumerate(pivots):
            Q[pivot, place] = -reduced[row, column]
    return Q, rank


def _below_ones(count: int, Q: Rational) -> Rational:
    """The block diagonal matrix of so many ones and Q."""
    n = count + Q.ncols()
    larger = flint.fmpq_mat(n, n)
    for i in range(n):
        larger[i, i] = 1
    for i in range(count, n):
        for j in range(count, n):
            larger[i, j] = Q[i - count, j - count]
    return larger


def _real_if_possible(X: NDArray) -> NDArray:
    """The entries as real numbers where no imaginary part is other than zero."""
    return X if X.imag.any() else X.real


def _block_of(rows: NDArray[np.intp], X: Balls) -> Balls:
    """Some rows and columns of X, real if they are."""
    block = X.block(rows)
    return replace(block, mid=_real_if_possible(block.mid))


def middle_and_half(low: float, high: float) -> tuple[float, float]:
    """A double near the middle of two, and how far numbers between them may lie from it."""
    if low == high:
        return low, 0.0  # one value, of which nothing moves
    middle = (low + high) / 2.0
    return middle, float(np.nextafter(max(middle - low, high - middle), np.inf))


def _multiplied(X: Balls, factor: Any) -> Balls:
    """Entries times a ball of numbers."""
    middle, radius = middle_and_radius(factor)
    product = X.times(middle)
    return Balls(product.mid, upper(product.rad + np.abs(X.mid) * radius + X.rad * radius, 4))


class CountBounds(NamedTuple):
    """Bounds of numbers of roots, which hold at every value of an interval.

    least, most: how many grow; doubtful: how many others may grow faster than a rate; reason: why
    the count is open where it is. Of complex matrices only roots above the real axis count, as two
    each.
    """

    least: int
    most: int
    doubtful: int
    reason: str = "what grows cannot be told from what does not"

    def allow(self, growing: int) -> bool:
        """True if so many roots may grow."""
        return self.least <= growing <= self.most

    def prove(self, growing: int) -> bool:
        """True if so many roots grow for certain, and others by no more than the rate."""
        return not self.doubtful and self.least == growing <= self.most


def bounds_between(terms: Terms, low: float, high: float, rate: float) -> CountBounds:
    """Count the growing roots of one component at all values between two, by Gershgorin's discs.

    Each basis of `segments.bases` gives bounds. They are tried one after the other until no root is
    doubtful, and the tightest of each number is kept. Where M has columns of zeros, real matrices
    have infinite roots: the inverses of the roots, which are finite, are tried first. rate: see
    `CountBounds`, 1/s.
    """
    roots = 4 * terms.n  # at most: 2n roots, of complex matrices each may count as two
    best = CountBounds(least=0, most=roots, doubtful=roots)
    try:
        M, C, K = terms.expanded(low, high)
    except ValueError:
        return best._replace(reason="a factor divides by what may be zero")
    _, half = middle_and_half(low, high)
    A = K
    B = M
    if not terms.is_undamped:
        A, B = _first_order_form(M, C, K)
    pencils = [_Pencil(A, B)]
    infinite = 0  # a lower bound of the number of infinite roots, whose inverses are zero
    if terms.is_real and not M.pattern.any(axis=0).all():
        infinite = infinite_roots(A, B)
        pencils.insert(0, _Pencil(B, A, of_inverses=True))
    with np.errstate(all="ignore"):
        for pencil, basis in _pencils_and_bases(pencils):
            S = near_diagonal(pencil.A, pencil.B, half, basis)
            if isinstance(S, Failure):
                best = best._replace(reason=S.reason)
                continue
            if not terms.is_real:
                tallies = tallies_above(S, half, are_squares=terms.is_undamped)
            else:
                by_part = tallies_of_values(S, half, is_hamiltonian=terms.is_gyroscopic)
                if terms.is_undamped:
                    by_part = tallies_of_squares(S, half)
                tallies = list(itertools.chain(*by_part))
                if pencil.of_inverses:
                    tallies = tallies_of_inverses(S, half, by_part, infinite, terms.is_undamped)
            least, most = growing_of(tallies)
            doubtful = 0
            for tally in tallies:
                if tally.side != "grows" and tally.high > rate:
                    doubtful += tally.number
            best = CountBounds(
                least=max(best.least, least),
                most=min(best.most, most),
                doubtful=min(best.doubtful, doubtful),
            )
            if not best.doubtful:
                break
    return best


class _Pencil(NamedTuple):
    """A - s B (n, n), whose eigenvalues s are roots or their squares, or the inverses of these."""

    A: Expansion
    B: Expansion
    of_inverses: bool = False


def _pencils_and_bases(pencils: Sequence[_Pencil]) -> Iterator[tuple[_Pencil, Basis]]:
    """Each pencil with each of its bases; without those that cannot be computed."""
    for pencil in pencils:
        with suppress(LinAlgError):
            for basis in bases(pencil.A.value.mid, pencil.B.value.mid):
                yield pencil, basis


def infinite_roots(A: Expansion, B: Expansion) -> int:
    """A lower bound of the number of infinite eigenvalues of A - s B (n, n), for all matrices.

    It is n less the degree of det(A - s B) in s. The degree is at most the largest number of
    entries of B in a product of n entries, one of each row and column, none of which is zero for
    certain: an assignment problem.
    """
    from scipy.optimize import linear_sum_assignment

    n = len(A.remainder)
    degrees = np.where(A.pattern, 0, -2 * n)
    degrees = np.where(B.pattern, 1, degrees)
    degree = int(degrees[linear_sum_assignment(degrees, maximize=True)].sum())
    return n - max(degree, 0)


def _first_order_form(M: Expansion, C: Expansion, K: Expansion) -> tuple[Expansion, Expansion]:
    """A and B (2n - m, 2n - m) of B z' = A z for M, C and K (n, n), m columns of M being zero.

    The states z are the displacements q, and q' / rate of those coordinates that have mass.
    """
    massless = np.asarray(~M.pattern.any(axis=0))
    rate = 1.0  # a power of 2 near sqrt(|K| / |M|), so that both halves of z are about as large
    mass = float(np.max(M.value.bound()))
    stiffness = float(np.max(K.value.bound()))
    if not massless.all() and 0.0 < stiffness / mass < np.inf:
        rate = float(2.0 ** np.round(np.log2(stiffness / mass) / 2.0))
    A_value, B_value = companion(M.value, C.value, K.value, rate, massless=massless)
    A_slope, B_slope = companion(M.slope, C.slope, K.slope, rate, unit=0.0, massless=massless)
    zeros = np.zeros(M.remainder.shape)
    A_remainder, B_remainder = companion(
        Balls(zeros, M.remainder),
        Balls(zeros, C.remainder),
        Balls(zeros, K.remainder),
        rate,
        unit=0.0,
        massless=massless,
    )
    A = Expansion(A_value, A_slope, A_remainder.rad)
    B = Expansion(B_value, B_slope, B_remainder.rad)
    return A, B


class RangeProof:
    """Proofs that one number of roots grows between thresholds, by steps over the parameter.

    Parameters
    ----------
    terms : Terms
        The systems.
    low, high : float
        Ends of the range.
    most : int
        How many intervals each proof looks at before it stays open. One of a single component
        counts by its share of the rows.
    """

    def __init__(self, terms: Terms, low: float, high: float, most: int) -> None:
        separated = terms.separated()
        self.components = separated.components()
        self.rows = terms.n
        self.data = separated.data
        # of each component: how many roots lie on the axis for each that begins to grow; without
        # damping the mirror image of that root begins to decay
        has_images = [each.is_undamped or each.is_gyroscopic for each in self.components]
        self.roots_at_onset = 1 + np.array(has_images)
        self.ends = (low, high)
        self.most = most
        self.intervals_left = 0.0  # `prove` sets this, and the rate of `CountBounds`, 1/s
        self.growth_below = 0.0

    def between(self, low: float, high: float, growing: Sequence[int]) -> Proof:
        """The proof that so many roots of each component grow at all values of a gap.

        A component that is not proved over the whole gap is proved by steps from both ends, where
        thresholds lie and steps must be short, to the middle.
        """
        middle = (low + high) / 2.0
        for number, component in enumerate(self.components):
            if self.intervals_left <= 0.0:
                return self.open_at(middle, SPENT)
            if self._bounds_of(component, low, high).prove(growing[number]):
                continue
            for start in (low, high):
                problem = self._problem_by_steps(number, start, middle, growing)
                if problem is not None:
                    return problem
        return Proof("proved", "enclosure", self.growth_below, data=self.data)

    def _problem_by_steps(
        self, number: int, start: float, end: float, growing: Sequence[int]
    ) -> Proof | None:
        """What is open or refuted of one component from `start` to `end`, which lies above or below
        `start`; None if all is proved.

        A step is lengthened after one that is proved and shortened after one that is not. The next
        steps after a shortened one are lengthened little at first, since the longest possible step
        changes slowly.

        Parameters
        ----------
        number : int
            The index of the component.
        start, end : float
            Values of the parameter.
        growing : sequence of int
            How many roots of each component have to grow all along, conjugates counted.
        """
        component = self.components[number]
        count = growing[number]
        length = abs(end - start)
        narrowest = NARROWEST * max(length, abs(start), abs(end))
        if start not in self.ends:  # beside a threshold
            length = max(FIRST_STEP * length, narrowest)
        sense = 1.0 if end >= start else -1.0
        lengthening = MOST_LENGTHENING  # factor of the length after a step that is proved
        reached = start
        while True:
            step_end = reached + sense * length
            if sense * (end - step_end) <= 0.25 * length:  # no short step is left for the end
                step_end = end
            middle = (reached + step_end) / 2.0
            if self.intervals_left <= 0.0:
                return self.open_at(middle, SPENT)
            bounds = self._bounds_of(component, min(reached, step_end), max(reached, step_end))
            if not bounds.allow(count):
                return self._where_another_count(middle, growing)
            if bounds.prove(count):
                if step_end == end:
                    return None
                reached = step_end
                length *= lengthening
                # from LEAST_LENGTHENING on: 1.25, 1.56, 2.4, 6, 32
                lengthening = min(lengthening**2, MOST_LENGTHENING)
                continue
            length = abs(step_end - reached) * SHORTENING
            lengthening = LEAST_LENGTHENING
            if length < narrowest:
                value = self._refuting_value(component, reached, end, count)
                if value is not None:
                    return self._where_another_count(value, growing)
                return self.open_at(middle, bounds.reason)

    def _refuting_value(
        self, component: Terms, reached: float, end: float, growing: int
    ) -> float | None:
        """A value beyond where no step succeeds at which another number of roots grows for certain.

        Some values are tried, from the end on nearer and nearer; None if none of them is one.
        """
        share = 1.0
        for _ in range(MOST_VALUES_BEYOND):
            share /= NEARER
            value = reached + share * (end - reached)
            if not self._bounds_of(component, value, value).allow(growing):
                return value
        return None

    def _where_another_count(self, where: float, growing: Sequence[int]) -> Proof:
        """The proof where a component has, at a value, another number of growing roots.

        Refuted, or open if the other components may make up for it.
        """
        expected = sum(growing)
        bounds = total(self.bounds(where, where))
        if bounds.allow(expected):
            return self.open_at(where, CANCELS)
        return self.refuted(bounds, expected, where)

    def open_at(self, where: float, reason: str) -> Proof:
        """No answer, as of a value of the parameter the discs do not tell enough."""
        return Proof("open", by="enclosure", data=self.data, reason=reason, where=where)

    def refuted(self, bounds: CountBounds, growing: int, where: float) -> Proof:
        """Another number of roots grows for certain at a value, or near it."""
        reason = f"{bounds.least} to {bounds.most} roots grow, not {growing}"
        if bounds.least == bounds.most:
            reason = f"{bounds.least} roots grow, not {growing}"
        return Proof("refuted", by="enclosure", data=self.data, reason=reason, where=where)

    def bounds(self, low: float, high: float) -> list[CountBounds]:
        """The bounds of each component over an interval."""
        return [bounds_between(c, low, high, self.growth_below) for c in self.components]

    def _bounds_of(self, component: Terms, low: float, high: float) -> CountBounds:
        """The bounds of one component over an interval, which counts as looked at."""
        self.intervals_left -= component.n / self.rows
        return bounds_between(component, low, high, self.growth_below)

    def _most_crossing(self, start: float, stop: float) -> int:
        """How many roots at most pass from decay to growth or back within an interval.

        These are the roots of unknown side over the whole interval, but for those whose side is
        unknown at either end too, such as free motions.
        """
        most = 0
        ends = zip(self.bounds(start, start), self.bounds(stop, stop), strict=True)
        for inside, (below, above) in zip(self.bounds(start, stop), ends, strict=True):
            unknown_throughout = min(below.most - below.least, above.most - above.least)
            most += inside.most - inside.least - unknown_throughout
        return most

    def prove(
        self,
        intervals: Sequence[tuple[float, float]],
        growth_below: float,
        rises: Sequence[int] | None = None,
    ) -> Proof:
        """Whether the number of growing roots changes in the printed intervals and nowhere else.

        A gap is what lies between two intervals, or between an interval and an end of the range.
        The list is proved if all of these hold:

        - The number of growing roots, counted at one value in each gap, differs on both sides of
          each interval.
        - At every value of a gap that number grows for certain, and others by no more than
          `growth_below`.
        - No interval holds two roots more that may cross the axis than its change of number needs.

        It is refuted if at a value or an interval another number grows for certain. `where` is a
        value of the parameter: of an open list where the proof stopped, of a refuted one where a
        search for missing thresholds has to look.

        Parameters
        ----------
        intervals : sequence of (float, float)
            The printed intervals, ascending and disjoint.
        growth_below : float
            A rate, 1/s, above 0.
        rises : sequence of int, optional
            By how much the number of growing roots is printed to rise in each interval.
        """
        low, high = self.ends
        edges = [low]
        for interval in intervals:
            edges += interval
        edges.append(high)
        if any(b < a for a, b in itertools.pairwise(edges)):
            return Proof("refuted", reason="the intervals overlap or leave the range")
        gaps = list(zip(edges[::2], edges[1::2], strict=True))
        self.intervals_left = float(self.most)
        self.growth_below = growth_below
        # first the number of growing roots of each component at one value inside of each gap
        counts: list[list[int]] = []  # one list for each gap
        for a, b in gaps:
            inside = a + INSIDE_SHARE * (b - a)
            bounds_of_components = self.bounds(inside, inside)
            bounds = total(bounds_of_components)
            if bounds.doubtful:
                return self.open_at(inside, bounds.reason)
            counts.append([component.least for component in bounds_of_components])
        # then whether it differs on both sides of each interval, as printed
        for number, (start, stop) in enumerate(intervals):
            below = sum(counts[number])
            above = sum(counts[number + 1])
            rise = rises[number] if rises is not None else None  # None if none is printed
            middle = (start + stop) / 2.0
            if start <= low or stop >= high:
                return self.open_at(middle, AT_END)
            if below == above and rise == 0:
                return self.open_at(middle, CANCELS)
            if below == above or (rise is not None and rise != above - below):
                reason = f"{below} roots grow below a threshold, {above} above"
                gap_start, gap_end = gaps[number + 1]
                where = gap_start + ASIDE_SHARE * (gap_end - gap_start)
                return Proof("refuted", by="enclosure", data=self.data, reason=reason, where=where)
        # then whether it is the same at every value of each gap
        for (a, b), growing in zip(gaps, counts, strict=True):
            # over a whole gap at once `growth_below` may leave room for what a single value refutes
            for value in (a, b):
                bounds = total(self.bounds(value, value))
                if not bounds.allow(sum(growing)):
                    # half way to where the roots were counted
                    beside = (value + a + INSIDE_SHARE * (b - a)) / 2.0
                    return self.refuted(bounds, sum(growing), beside)
            proof = self.between(a, b, growing)
            if proof.status != "proved":
                return proof
        # last whether a rise and a fall within an interval may cancel in the counts beside it
        neighbours = itertools.pairwise(counts)
        for (start, stop), (before, after) in zip(intervals, neighbours, strict=True):
            if self._may_hide_changes(start, stop, np.subtract(after, before)):
                return self.open_at((start + stop) / 2.0, CANCELS)
        return proof

    def _may_hide_changes(self, start: float, stop: float, rises: NDArray[np.intp]) -> bool:
        """Whether in an interval more roots may begin or end to grow than the counts beside it say.

        A root that begins to grow and another that ends to change no count, but take two roots
        more. One root more is allowed, as a divergent root and its mirror image meet at zero.
        rises: by how much the growing roots of each component are more above the interval.
        """
        sizes = abs(rises)
        has_rises_and_falls = sizes.sum() > abs(rises.sum())
        counted = int(self.roots_at_onset @ sizes)
        return has_rises_and_falls or self._most_crossing(start, stop) > counted + 1


def total(bounds: Sequence[CountBounds]) -> CountBounds:
    """The sums of the numbers of all components.

    The reason is that of the first component whose count is open.
    """
    numbers = np.zeros(3, dtype=int)  # the fields of `CountBounds` in their order
    reason = ""
    for component in bounds:
        numbers += component[:3]
        if not reason and component.least < component.most:
            reason = component.reason
    least, most, doubtful = numbers.tolist()
    return CountBounds(least, most, doubtful, reason)
