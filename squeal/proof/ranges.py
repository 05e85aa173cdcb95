"""The referee over a range of the parameter: what grows between the printed thresholds.

Matrices over an interval of the parameter are balls that hold those of every value in it, so that
one enclosure speaks of all. Where it does not suffice the interval is halved.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import ArrayLike

from squeal.proof.balls import (
    AS_GIVEN,
    EPS,
    Balls,
    doubles,
    half_widths,
    middle_and_radius,
    upper,
)
from squeal.proof.enclosure import companion
from squeal.proof.pieces import Failure, growing_of, strong_parts
from squeal.proof.referee import Proof
from squeal.proof.segments import (
    Expansion,
    bases,
    moving,
    tallies_above,
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
NARROWEST = 1e-14  # of the range: a step that is not shortened
MOST_INTERVALS = 4000
SPENT = "the range takes more steps than are made"
AT_END = "a threshold lies at an end of the range, beyond which nothing is counted"
CANCELS = "what begins and what ends to grow at one value cancel in the count"
LONGER = 32.0  # than the last one: a step after one that is proved
SHORTER = 0.35  # ... and after one that is not
AHEAD = 8  # values that are looked at beyond a place where no step succeeds
INSIDE = 0.4629  # of a gap: where what grows is counted; roots often touch the axis half way
ASIDE = 1e-3  # of a gap: how far from a threshold that is refuted the search looks again
FIRST = 1e-8  # of the gap: a step beside a threshold


@dataclass(frozen=True, eq=False)
class Term:
    """A matrix (n, n) and the factor that multiplies it; None for one."""

    matrix: ArrayLike
    factor: Factor | None = None


@dataclass(frozen=True, eq=False)
class Terms:
    """M, C and K over a parameter, each a sum of terms; C may have none.

    `data` says how the entries of each matrix are known. Needs python-flint.

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
    _balls: dict[str, list[Balls]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if flint is None:
            raise ImportError("ranges need python-flint", name="flint")
        balls: dict[str, list[Balls]] = {name: [] for name in "MCK"}
        for name in "MCK":
            for term in getattr(self, name):
                X = doubles(np.asarray(term.matrix))
                if not X.imag.any():
                    X = X.real
                balls[name].append(Balls(X, half_widths(X, self.data)))
        object.__setattr__(self, "_balls", balls)

    @property
    def n(self) -> int:
        """Number of rows."""
        return len(self._balls["M"][0].mid)

    @property
    def is_real(self) -> bool:
        """True if no entry is complex."""
        return not any(np.iscomplexobj(X.mid) for name in "MCK" for X in self._balls[name])

    @property
    def is_symmetric(self) -> bool:
        """True if M and K are symmetric at each value."""
        return all(np.array_equal(X.mid, X.mid.T) for name in "MK" for X in self._balls[name])

    @property
    def is_skew(self) -> bool:
        """True if C is skew at each value."""
        return all(np.array_equal(X.mid, -X.mid.T) for X in self._balls["C"])

    @property
    def is_undamped(self) -> bool:
        """True if C is zero at each value."""
        return not any(X.mid.any() for X in self._balls["C"])

    def components(self) -> list[Terms]:
        """The terms of each strong component of the pattern of all terms."""
        pattern = sum(np.abs(X.mid) for name in "MCK" for X in self._balls[name]) > 0.0
        each = []
        for rows in strong_parts(pattern):
            M, C, K = (
                [
                    Term(X.mid[np.ix_(rows, rows)], term.factor)
                    for term, X in zip(getattr(self, name), self._balls[name], strict=True)
                ]
                for name in "MCK"
            )
            each.append(Terms(M, C, K, self.data))
        return each

    def expanded(self, low: float, high: float) -> tuple[Expansion, Expansion, Expansion]:
        """M, C and K around the middle of two values, with Lagrange's remainder.

        Raises ValueError where a factor divides by what may be zero.
        """
        middle = flint.arb_series([flint.arb((low + high) / 2.0), 1], prec=2)
        between = flint.arb_series([flint.arb(low).union(flint.arb(high)), 1], prec=3)
        M, C, K = (self._sum(name, middle, between) for name in "MCK")
        return M, C, K

    def _sum(self, name: str, middle: Any, between: Any) -> Expansion:
        """The sum of terms; entries that are zero in all of them stay zero."""
        none = np.zeros((self.n, self.n))
        value = Balls.exact(none)
        slope = Balls.exact(none)
        rest = none
        for term, X in zip(getattr(self, name), self._balls[name], strict=True):
            if term.factor is None:
                value = value.plus(X)
                continue
            level, rise = _coefficients(term.factor(middle))[:2]
            bend = _coefficients(term.factor(between))[2]
            value = value.plus(_multiplied(X, level))
            slope = slope.plus(_multiplied(X, rise))
            rest = rest + X.bound() * float(np.nextafter(float(bend.abs_upper()), np.inf))
        used = sum((np.abs(X.mid) for X in self._balls[name]), none) > 0.0
        return Expansion(
            Balls(value.mid, np.where(used, value.rad, 0.0)),
            Balls(slope.mid, np.where(used, slope.rad, 0.0)),
            np.where(used, upper(rest, 2 * len(self._balls[name])), 0.0),
        )


def _coefficients(value: Any) -> list[Any]:
    """The first three coefficients (balls) of a series, or of a constant."""
    if not isinstance(value, flint.arb_series):
        value = flint.arb_series([flint.arb(value)])
    return [value[k] for k in range(3)]


def _multiplied(X: Balls, factor: Any) -> Balls:
    """Entries times a ball of numbers."""
    middle, radius = middle_and_radius(factor)
    product = X.times(middle)
    return Balls(product.mid, upper(product.rad + np.abs(X.mid) * radius + X.rad * radius, 4))


class Bounds(NamedTuple):
    """Numbers of roots over an interval.

    least, most: bounds of how many grow; doubtful: of so many it is not certain that they grow, and
    they may grow faster than a rate; not_decaying: at least so many grow, or decay by no more than
    it. Of complex matrices only roots above the real axis count, as two each.
    """

    least: int
    most: int
    doubtful: int
    not_decaying: int
    reason: str = "what grows cannot be told from what does not"

    def allow(self, unstable: int) -> bool:
        """True if so many roots may grow."""
        return self.least <= unstable <= self.most

    def prove(self, unstable: int) -> bool:
        """True if so many roots grow, but for some that grow or decay by no more than the rate."""
        return not self.doubtful and self.allow(unstable) and unstable <= self.not_decaying


def bounds_between(terms: Terms, low: float, high: float, rate: float) -> Bounds:
    """The numbers of one component at all values between two."""
    roots = 4 * terms.n  # complex ones may all lie above the real axis
    known = Bounds(0, roots, roots, 0)
    try:
        M, C, K = terms.expanded(low, high)
    except ValueError:
        return known._replace(reason="a factor divides by what may be zero")
    half = float(np.nextafter((high - low) / 2.0 * (1.0 + 8.0 * EPS), np.inf))
    A = K
    B = M
    if not terms.is_undamped:
        A, B = _states(M, C, K)
    with np.errstate(all="ignore"), suppress(LinAlgError):
        for basis in bases(A.value.mid, B.value.mid):
            found = moving(A, B, half, basis)
            if isinstance(found, Failure):
                known = known._replace(reason=found.reason)
                continue
            if not terms.is_real:
                each = tallies_above(found, half, terms.is_undamped)
            elif terms.is_undamped:
                each = tallies_of_squares(found, half)
            else:
                each = tallies_of_values(found, half, terms.is_symmetric and terms.is_skew)
            least, most = growing_of(each)
            doubtful = sum(one.number for one in each if one.side != "grows" and one.high > rate)
            known = Bounds(
                max(known.least, least),
                min(known.most, most),
                min(known.doubtful, doubtful),
                max(known.not_decaying, growing_of(each, -rate)[0]),
            )
            if not known.doubtful:
                break
    return known


def _states(M: Expansion, C: Expansion, K: Expansion) -> tuple[Expansion, Expansion]:
    """A and B (2n, 2n) of the states (q, q' / rate)."""
    rate = 1.0
    mass = float(np.max(M.value.bound()))
    stiffness = float(np.max(K.value.bound()))
    if mass > 0.0 and 0.0 < stiffness / mass < np.inf:  # a mass of zero is bounded by 1e-323
        rate = float(2.0 ** np.round(np.log2(stiffness / mass) / 2.0))
    values = companion(M.value, C.value, K.value, rate)
    slopes = companion(M.slope, C.slope, K.slope, rate, 0.0)
    none = np.zeros(M.rest.shape)
    M_rest, C_rest, K_rest = (Balls(none, X.rest) for X in (M, C, K))
    rests = companion(M_rest, C_rest, K_rest, rate, 0.0)
    parts = zip(values, slopes, rests, strict=True)
    A, B = (Expansion(value, slope, rest.rad) for value, slope, rest in parts)
    return A, B


class _Walk:
    """Intervals of the parameter that are looked at one after the other, at most `most` in all, of
    a range with these ends."""

    def __init__(
        self, terms: Terms, growth_below: float, most: int, ends: tuple[float, float]
    ) -> None:
        self.components = terms.components()
        self.moving = self.components
        """Those whose number of growing roots is looked at, step by step."""
        self.settled = 0  # roots that grow of the others, at all values between two
        self.data = terms.data
        self.growth_below = growth_below
        self.left = most
        self.ends = ends

    def gap(self, low: float, high: float, unstable: int) -> Proof:
        """The proof between two values, from both ends to the middle."""
        middle = (low + high) / 2.0
        for start in (low, high):
            self._settle(min(start, middle), max(start, middle))
            proof = self._steps(start, middle, unstable)
            if proof.status != "proved":
                break
        self.moving = self.components
        self.settled = 0
        return proof

    def _settle(self, low: float, high: float) -> None:
        """Leave out components of which as many roots grow at all values between two."""
        self.moving = []
        self.settled = 0
        self.left -= 1
        for component in self.components:
            bounds = bounds_between(component, low, high, self.growth_below)
            if bounds.least == bounds.most and bounds.prove(bounds.least):
                self.settled += bounds.least
            else:
                self.moving.append(component)

    def _steps(self, start: float, end: float, unstable: int) -> Proof:
        """The proof from one value to another, above or below it."""
        narrowest = NARROWEST * max(abs(end - start), abs(start), abs(end))
        length = abs(end - start)
        if start not in self.ends:  # beside a threshold
            length = max(FIRST * length, narrowest)
        way = 1.0 if end >= start else -1.0
        at = start
        while True:
            beyond = at + way * length
            if way * (end - beyond) <= 0.25 * length:
                beyond = end
            where = (at + beyond) / 2.0
            if self.left <= 0:
                return Proof("open", "enclosure", reason=SPENT, where=where)
            bounds = self.bounds(min(at, beyond), max(at, beyond))
            self.left -= 1
            if not bounds.allow(unstable):
                return self._refuted(bounds, unstable, where)
            if bounds.prove(unstable):
                if beyond == end:
                    return Proof("proved", "enclosure", self.growth_below, self.data)
                at = beyond
                length *= LONGER
                continue
            length = abs(beyond - at) * SHORTER
            if length < narrowest:
                return self._ahead(at, end, unstable) or Proof(
                    "open", "enclosure", reason=bounds.reason, where=where
                )

    def _ahead(self, at: float, end: float, unstable: int) -> Proof | None:
        """A refutation by a value between where no step succeeds and the end, if there is one."""
        share = 1.0
        for _ in range(AHEAD):
            share /= LONGER
            value = at + share * (end - at)
            bounds = self.bounds(value, value)
            if not bounds.allow(unstable):
                return self._refuted(bounds, unstable, value)
        return None

    def _refuted(self, bounds: Bounds, unstable: int, where: float) -> Proof:
        """Another number of roots grows for certain."""
        words = f"{bounds.least} to {bounds.most} roots grow, not {unstable}"
        if bounds.least == bounds.most:
            words = f"{bounds.least} roots grow, not {unstable}"
        return Proof("refuted", "enclosure", data=self.data, reason=words, where=where)

    def bounds(self, low: float, high: float) -> Bounds:
        """The numbers over an interval."""
        settled = Bounds(self.settled, self.settled, 0, self.settled)
        each = [settled]
        for component in self.moving:
            each.append(bounds_between(component, low, high, self.growth_below))
        vague = next((one for one in each if one.least < one.most), settled)
        return Bounds(
            sum(one.least for one in each),
            sum(one.most for one in each),
            sum(one.doubtful for one in each),
            sum(one.not_decaying for one in each),
            vague.reason,
        )


def prove_thresholds(
    terms: Terms,
    low: float,
    high: float,
    intervals: Sequence[tuple[float, float]],
    growth_below: float,
    rises: Sequence[int] | None = None,
    most: int = MOST_INTERVALS,
) -> Proof:
    """Whether the number of growing roots changes in the printed intervals and nowhere else.

    Proved is that it differs between the gaps on both sides of each interval, where it is counted
    inside, and that in each gap as many roots grow at every value, and others by no more
    than `growth_below`. Refuted is a value or interval at which another number grows for certain.

    Parameters
    ----------
    terms : Terms
        The systems.
    low, high : float
        Ends of the range.
    intervals : sequence of (float, float)
        The printed intervals, ascending and disjoint.
    growth_below : float
        A rate, 1/s, above 0.
    rises : sequence of int, optional
        By how much the number of growing roots is printed to rise in each interval.
    most : int
        How many intervals are looked at before the answer stays open.
    """
    edges = [low, *(end for interval in intervals for end in interval), high]
    if any(b < a for a, b in itertools.pairwise(edges)):
        return Proof("refuted", reason="the intervals overlap or leave the range")
    gaps = list(zip(edges[::2], edges[1::2], strict=True))
    walk = _Walk(terms, growth_below, most, (low, high))
    found = []
    for a, b in gaps:
        inside = a + INSIDE * (b - a)
        bounds = walk.bounds(inside, inside)
        if bounds.doubtful:
            return Proof("open", "enclosure", reason=bounds.reason, where=inside)
        found.append(bounds.least)
    for number, (below, above) in enumerate(itertools.pairwise(found)):
        interval = intervals[number]
        if interval[0] <= low or interval[1] >= high:
            reason = AT_END
        elif rises is not None and below == above and rises[number] == 0:
            reason = CANCELS
        else:
            reason = ""
        if reason:
            where = (interval[0] + interval[1]) / 2.0
            return Proof("open", "enclosure", data=terms.data, reason=reason, where=where)
        if below == above or (rises is not None and rises[number] != above - below):
            words = f"{below} roots grow below a threshold, {above} above"
            start, stop = gaps[number + 1]
            where = start + ASIDE * (stop - start)
            return Proof("refuted", "enclosure", data=terms.data, reason=words, where=where)
    for number, (a, b) in enumerate(gaps):
        proof = walk.gap(a, b, found[number])
        if proof.status != "proved":
            return proof
    return Proof("proved", "enclosure", growth_below, terms.data)
