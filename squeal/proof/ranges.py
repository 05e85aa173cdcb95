"""The referee over a range of the parameter: what grows between the printed thresholds.

Matrices over an interval of the parameter are balls that hold those of every value in it, so that
one enclosure speaks of all. Where it does not suffice the interval is halved.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from squeal.proof.balls import (
    AS_GIVEN,
    Balls,
    Quadratic,
    half_widths,
    middle_and_radius,
    upper,
)
from squeal.proof.pieces import Failure, growing_counts
from squeal.proof.referee import Proof, enclosed, unstable_count

try:
    import flint
except ImportError:  # an extra
    flint = None

Factor = Callable[[Any], Any]
"""A function of the parameter by + - * / and **; it is given a ball of numbers (`flint.arb`)."""
Provider = Callable[[float, float], tuple[Quadratic, ...] | Failure]
"""Systems that together hold all whose parameter lies between two numbers."""
NARROWEST = 1e-14  # of the range: an interval that is not halved
MOST_INTERVALS = 4000  # of one gap


@dataclass(frozen=True, eq=False)
class Term:
    """A matrix (n, n) and the factor that multiplies it; None for one."""

    matrix: ArrayLike
    factor: Factor | None = None


@dataclass(frozen=True, eq=False)
class Terms:
    """A provider of M, C and K that are sums of terms; C may have none.

    `data` says how the entries of each matrix are known. Needs python-flint. Raises ImportError
    without it.
    """

    M: Sequence[Term]
    C: Sequence[Term]
    K: Sequence[Term]
    data: str = AS_GIVEN
    _given: dict[str, list[np.ndarray]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if flint is None:
            raise ImportError("ranges need python-flint", name="flint")
        given = {}
        for name in "MCK":
            given[name] = [np.asarray(term.matrix, float) for term in getattr(self, name)]
        object.__setattr__(self, "_given", given)

    def __call__(self, low: float, high: float) -> tuple[Quadratic, ...]:
        parameter = flint.arb(low).union(flint.arb(high))
        M, C, K = (self._sum(name, parameter) for name in "MCK")
        symmetric = all(np.array_equal(X, X.T) for name in "MK" for X in self._given[name])
        skew = all(np.array_equal(X, -X.T) for X in self._given["C"])
        return (Quadratic(M, C, K, self.data, symmetric, skew),)

    def _sum(self, name: str, parameter: Any) -> Balls:
        """The sum of terms; entries that are zero in all of them stay zero."""
        shape = self._given["M"][0].shape
        total = Balls(np.zeros(shape), np.zeros(shape))
        used = np.zeros(shape, dtype=bool)
        for term, X in zip(getattr(self, name), self._given[name], strict=True):
            added = Balls(X, half_widths(X, self.data))
            if term.factor is not None:
                added = _multiplied(added, term.factor(parameter))
            total = added if not used.any() else total.plus(added)
            used |= X != 0.0
        return Balls(total.mid, np.where(used, total.rad, 0.0))


def _multiplied(X: Balls, factor: Any) -> Balls:
    """Entries times a ball of numbers."""
    middle, radius = middle_and_radius(flint.arb(factor))
    product = X.times(middle)
    return Balls(product.mid, upper(product.rad + np.abs(X.mid) * radius + X.rad * radius, 4))


def prove_gap(
    provider: Provider,
    low: float,
    high: float,
    unstable: int,
    growth_below: float,
    cuts: Sequence[float] = (),
    most: int = MOST_INTERVALS,
) -> Proof:
    """Whether `unstable` roots grow at every value between two, and others by no more than a rate.

    Proved is that at each value at most so many roots grow faster than `growth_below`, and that at
    least so many grow, or decay by no more than that. Refuted is an interval in which another
    number grows for certain.

    Parameters
    ----------
    provider : callable
        Low and high value of the parameter to all systems between them.
    low, high : float
        Ends of the gap.
    unstable : int
        How many roots are said to grow.
    growth_below : float
        A rate, 1/s, above 0.
    cuts : sequence of float
        Ascending values at which the gap is cut before it is halved.
    most : int
        How many intervals are looked at before the answer stays open.
    """
    for end in (low, high):
        systems = provider(end, end)
        if not isinstance(systems, Failure):
            bounds = _bounds(systems, growth_below)
            if not bounds.least <= unstable <= bounds.most:
                return _refuted(bounds, unstable, systems[0].data, end)
    narrowest = NARROWEST * max(high - low, abs(low), abs(high))
    edges = [low, *(cut for cut in cuts if low < cut < high), high]
    waiting = list(itertools.pairwise(edges))[::-1]
    most += len(waiting)
    looked = 0
    while waiting:
        a, b = waiting.pop()
        looked += 1
        middle = (a + b) / 2.0
        systems = provider(a, b)
        if isinstance(systems, Failure):
            reason = systems.reason
        else:
            bounds = _bounds(systems, growth_below)
            data = systems[0].data
            if not bounds.least <= unstable <= bounds.most:
                return _refuted(bounds, unstable, data, middle)
            if bounds.fast <= unstable <= bounds.not_decaying:
                continue
            reason = bounds.reason
        if b - a <= narrowest or looked + len(waiting) >= most:
            return Proof("open", "enclosure", reason=reason, where=middle)
        waiting += [(middle, b), (a, middle)]
    return Proof("proved", "enclosure", growth_below, data)


def _refuted(bounds: _Bounds, unstable: int, data: str, where: float) -> Proof:
    """Another number of roots grows for certain."""
    words = f"{bounds.least} to {bounds.most} roots grow, not {unstable}"
    if bounds.least == bounds.most:
        words = f"{bounds.least} roots grow, not {unstable}"
    return Proof("refuted", "enclosure", data=data, reason=words, where=where)


class _Bounds(NamedTuple):
    """Numbers of roots of systems that together hold all over an interval.

    least, most: bounds of how many grow; fast: at most so many grow faster than a rate;
    not_decaying: at least so many grow, or decay by no more than it.
    """

    least: int
    most: int
    fast: int
    not_decaying: int
    reason: str


def _bounds(systems: Sequence[Quadratic], rate: float) -> _Bounds:
    """The numbers that hold for each of the systems."""
    each = []
    for system in systems:
        finding = enclosed(system)
        pieces = finding.pieces
        least, most = growing_counts(pieces)
        fast = growing_counts(pieces, rate)[1]
        not_decaying = growing_counts(pieces, -rate)[0]
        reason = "what grows cannot be told from what does not"
        if finding.failure is not None:
            most = fast = 2 * system.n
            reason = finding.failure.reason
        each.append(_Bounds(least, most, fast, not_decaying, reason))
    return _Bounds(
        min(one.least for one in each),
        max(one.most for one in each),
        max(one.fast for one in each),
        min(one.not_decaying for one in each),
        each[0].reason,
    )


def prove_thresholds(
    provider: Provider,
    low: float,
    high: float,
    intervals: Sequence[tuple[float, float]],
    growth_below: float,
    counts: Sequence[int] | None = None,
    cuts: Sequence[float] = (),
    most: int = MOST_INTERVALS,
) -> Proof:
    """Whether the number of growing roots changes in the printed intervals and nowhere else.

    Proved is that it differs between the gaps on both sides of each interval, where it is counted
    in the middle, and each gap as `prove_gap` has it.

    Parameters
    ----------
    provider : callable
        Low and high value of the parameter to all systems between them.
    low, high : float
        Ends of the range.
    intervals : sequence of (float, float)
        The printed intervals, ascending and disjoint.
    growth_below : float
        A rate, 1/s, above 0.
    counts : sequence of int, optional
        The printed numbers of growing roots in the gaps, one more than there are intervals.
    cuts, most
        As `prove_gap` takes them.
    """
    edges = [low, *(end for interval in intervals for end in interval), high]
    if any(b < a for a, b in itertools.pairwise(edges)):
        return Proof("refuted", reason="the intervals overlap or leave the range")
    gaps = list(zip(edges[::2], edges[1::2], strict=True))
    found = []
    data = ""
    for a, b in gaps:
        middle = (a + b) / 2.0
        systems = provider(middle, middle)
        if isinstance(systems, Failure):
            return Proof("open", reason=systems.reason, where=middle)
        counted = [unstable_count(system) for system in systems]
        if len({count.lower for count in counted} | {count.upper for count in counted}) > 1:
            reason = counted[0].reason or "it is not known which matrices hold"
            return Proof("open", "enclosure", reason=reason, where=middle)
        found.append(counted[0].lower)
        if data != AS_GIVEN:  # the exact means know the doubles only
            data = counted[0].data
    for number, (start, _) in enumerate(gaps[1:], start=1):
        if found[number] == found[number - 1]:
            words = f"{found[number]} roots grow on both sides of a threshold"
            return Proof("refuted", "enclosure", data=data, reason=words, where=start)
    for number, (a, b) in enumerate(gaps):
        if counts is not None and counts[number] != found[number]:
            words = f"{found[number]} roots grow, not {counts[number]}"
            return Proof("refuted", "enclosure", data=data, reason=words, where=(a + b) / 2.0)
        proof = prove_gap(provider, a, b, found[number], growth_below, cuts, most)
        if proof.status != "proved":
            return proof
    return Proof("proved", "enclosure", growth_below, data)
