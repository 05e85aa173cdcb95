"""The referee over a range of the parameter: what grows between the printed thresholds.

Matrices over an interval of the parameter are balls that hold those of every value in it, so that
one enclosure holds for all. Where it does not suffice the interval is halved.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import NDArray

from squeal.proof.balls import (
    Balls,
)
from squeal.proof.enclosure import companion
from squeal.proof.pieces import Failure, growing_of
from squeal.proof.referee import Proof
from squeal.proof.segments import (
    Basis,
    Expansion,
    bases,
    frequencies_on_axis,
    near_diagonal,
    tallies_above,
    tallies_of_inverses,
    tallies_of_squares,
    tallies_of_values,
)
from squeal.proof.terms import Terms, middle_and_half

NARROWEST = 1e-14  # of the range: a step as short as this is not shortened
SPENT = "the range takes more steps than are made"
AT_END = "a threshold lies at an end of the range, beyond which nothing is counted"
CANCELS = "what begins and what ends to grow at one value may cancel in the count"
MOST_LENGTHENING = 32.0  # a step after a proved one is at most so many times as long
LEAST_LENGTHENING = 1.25  # ... after the first proved one that follows one that is not proved
SHORTENING = 0.5  # a step after one that is not proved is so many times as long
MOST_VALUES_BEYOND = 8  # at which a refutation is searched where no step succeeds
NEARER = 32.0  # each of these lies so many times nearer to where the steps ended than the last
INSIDE_SHARE = 0.4629  # where in a gap growing roots are counted; not half way, where roots often
# touch the axis
ASIDE_SHARE = 1e-3  # of a gap: how far from a threshold that is refuted the search looks again
FIRST_STEP = 1e-8  # of the gap: the first step beside a threshold


class CountBounds(NamedTuple):
    """Bounds of numbers of roots, which hold at every value of an interval.

    least, most: how many roots grow at least and at most; doubtful: how many of those that do not
    grow for certain may grow faster than a rate; reason: why the count is open where it is. Of
    complex matrices only roots above the real axis count, as two each.
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
    """Count the growing roots of one component at all values from low to high, by Gershgorin's
    discs.

    Each basis of `segments.bases` gives bounds. They are tried one after the other until no root is
    doubtful, and the tightest of each number is kept. Where M has columns of zeros, real matrices
    have infinite roots: the inverses of the roots, which are finite, are tried first. rate: in 1/s,
    see `CountBounds`.
    """
    most_roots = 4 * terms.n  # 2n roots, which count as two each of complex matrices
    best = CountBounds(least=0, most=most_roots, doubtful=most_roots)
    try:
        M, C, K = terms.expanded(low, high)
    except ValueError:
        return best._replace(reason="a factor divides by what may be zero")
    _, half = middle_and_half(low, high)
    A = K  # undamped: of K - s M the eigenvalues are s = -lambda^2
    B = M
    if not terms.is_undamped:  # the eigenvalues of A - s B are lambda itself
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
                if terms.is_undamped:
                    by_part = tallies_of_squares(S, half)
                else:
                    by_part = tallies_of_values(S, half, is_hamiltonian=terms.is_gyroscopic)
                tallies = list(itertools.chain(*by_part))
                if pencil.of_inverses:
                    tallies = tallies_of_inverses(S, half, by_part, infinite, terms.is_undamped)
            # each tally is a number of roots with bounds of their real parts
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


def frequency_on_axis(
    terms: Terms, low: float, high: float, omega: float
) -> tuple[float, float] | None:
    """Bounds of the angular frequency (rad/s) of the pair that crosses the imaginary axis between
    two values of the parameter; of several that may cross there, of the one nearest to `omega`.

    None where no enclosure shows a pair, as where a factor divides by what may be zero.
    """
    nearest: tuple[float, float] | None = None
    _, half = middle_and_half(low, high)
    for component in terms.separated().components():
        try:
            M, C, K = component.expanded(low, high)
        except ValueError:  # a factor divides by what may be zero
            continue
        A, B = _first_order_form(M, C, K)
        with np.errstate(all="ignore"):
            for pencil, basis in _pencils_and_bases([_Pencil(A, B)]):
                S = near_diagonal(pencil.A, pencil.B, half, basis)
                if isinstance(S, Failure):
                    continue
                for bounds in frequencies_on_axis(S, half):
                    if nearest is None or _distance(omega, bounds) < _distance(omega, nearest):
                        nearest = bounds
    return nearest


def _distance(value: float, bounds: tuple[float, float]) -> float:
    """How far a value lies outside of bounds, or from the nearer one, negative, inside."""
    low, high = bounds
    return max(low - value, value - high)


class _Pencil(NamedTuple):
    """A - s B (n, n), whose eigenvalues s are roots lambda, or -lambda^2, or inverses of these."""

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
    # slopes and remainders have no entries of one (`unit`)
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
    most_intervals : int
        How many intervals each proof encloses before it stays open. One of a single component
        counts by its share of the rows.
    """

    def __init__(self, terms: Terms, low: float, high: float, most_intervals: int) -> None:
        separated = terms.separated()
        self.components = separated.components()
        self.rows = terms.n
        self.data = separated.data
        # of each component: how many roots lie on the axis for each that begins to grow; without
        # damping the mirror image of that root begins to decay
        has_images = [c.is_undamped or c.is_gyroscopic for c in self.components]
        self.roots_at_onset = 1 + np.array(has_images)
        self.ends = (low, high)
        self.most_intervals = most_intervals
        self.intervals_left = 0.0  # `prove` sets this, and the rate of `CountBounds`, 1/s
        self.growth_below = 0.0

    def prove_gap(self, low: float, high: float, growing: Sequence[int]) -> Proof:
        """The proof that so many roots of each component grow at all values of a gap.

        A component that is not proved over the whole gap is proved by steps from both ends, where
        thresholds lie and steps must be short, to the middle. The returned proof is the first one
        that is open or refuted, else one that is proved. low, high: the ends of the gap; growing:
        how many roots of each component.
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
        """Prove one component by steps from `start` to `end`, which lies above or below `start`.

        None if all is proved, else the proof that is open or refuted.

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
            How many roots of each component have to grow at all these values, conjugates counted.
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
        """A value between `reached` and `end` at which not `growing` roots grow, for certain.

        The steps ended at `reached`. The first value that is tried lies a share 1 / `NEARER` of the
        way from there to `end`, each further one at this share of the last distance; None if none
        of them refutes.
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
        return self._refuted_by_count(bounds, expected, where)

    def open_at(self, where: float, reason: str) -> Proof:
        """No answer, as at a value of the parameter the discs leave the count open."""
        return Proof("open", by="enclosure", data=self.data, reason=reason, where=where)

    def _refuted(self, reason: str, where: float) -> Proof:
        """The list is wrong at a value, or near it."""
        return Proof("refuted", by="enclosure", data=self.data, reason=reason, where=where)

    def _refuted_by_count(self, bounds: CountBounds, growing: int, where: float) -> Proof:
        """Another number of roots than `growing` grows for certain at a value, or near it."""
        count = f"{bounds.least} to {bounds.most}"
        if bounds.least == bounds.most:
            count = str(bounds.least)
        return self._refuted(f"{count} roots grow, not {growing}", where)

    def bounds(self, low: float, high: float) -> list[CountBounds]:
        """The bounds of each component over an interval."""
        return [bounds_between(c, low, high, self.growth_below) for c in self.components]

    def _bounds_of(self, component: Terms, low: float, high: float) -> CountBounds:
        """The bounds of one component over an interval, which counts as looked at."""
        self.intervals_left -= component.n / self.rows
        return bounds_between(component, low, high, self.growth_below)

    def _most_crossing(self, start: float, stop: float) -> int:
        """How many roots at most pass from decay to growth or back within an interval.

        These are the roots of which the bounds over the whole interval do not say whether they
        grow. Those of unknown side at both ends too, such as free motions, do not count.
        """
        most = 0
        at_ends = zip(self.bounds(start, start), self.bounds(stop, stop), strict=True)
        for within, (at_start, at_stop) in zip(self.bounds(start, stop), at_ends, strict=True):
            unknown_at_start = at_start.most - at_start.least
            unknown_at_stop = at_stop.most - at_stop.least
            most += within.most - within.least - min(unknown_at_start, unknown_at_stop)
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
        self.intervals_left = float(self.most_intervals)
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
                return self._refuted(reason, where)
        # then whether it is the same at every value of each gap
        for (a, b), growing in zip(gaps, counts, strict=True):
            # over a whole gap at once `growth_below` may leave room for what a single value refutes
            for value in (a, b):
                bounds = total(self.bounds(value, value))
                if not bounds.allow(sum(growing)):
                    # half way to where the roots were counted
                    search_from = (value + a + INSIDE_SHARE * (b - a)) / 2.0
                    return self._refuted_by_count(bounds, sum(growing), search_from)
            proof = self.prove_gap(a, b, growing)
            if proof.status != "proved":
                return proof
        # last whether a rise and a fall within an interval may cancel in the counts beside it
        neighbours = itertools.pairwise(counts)
        for (start, stop), (before, after) in zip(intervals, neighbours, strict=True):
            if self._may_hide_changes(start, stop, np.subtract(after, before)):
                return self.open_at((start + stop) / 2.0, CANCELS)
        return proof  # of the last gap: those of all gaps say the same

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
