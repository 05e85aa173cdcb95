"""The referee over a range of the parameter p by algebra, for few rows and factors a + b p.

The determinant is a polynomial e(s^2) + s o(s^2) in s and p. With the parameter a root reaches the
imaginary axis only where the resultant of e and o vanishes. Roots that come with their negative at
every p leave it only where their discriminant vanishes. A root reaches zero where the constant
coefficient vanishes, and infinity where the leading one does. Between these values of p one number
of roots grows, which is counted exactly. Neither rounding nor ratios of stiffnesses matter.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from squeal.proof.balls import between, high_end, low_end, taylor_coefficients
from squeal.proof.exact import PRECISION, pieces_of
from squeal.proof.ranges import AT_END, CANCELS, Factor, Terms
from squeal.proof.referee import Proof

try:
    import flint
except ImportError:  # an extra
    flint = None

IS_PART = "a printed interval holds a part of that of its threshold"
MOST_ROWS = 6
"""Of a component: beyond, polynomials take too long."""
Polynomial = Any
"""A `flint.fmpq_mpoly` in s and p, or a `flint.fmpz_poly` in one of them."""


class Critical(NamedTuple):
    """A narrow interval of the parameter with at most so many events: roots that reach the axis."""

    low: float
    high: float
    most: int


class ExactRange:
    """How many roots grow at every value of a range of the parameter.

    Attributes
    ----------
    critical : list of Critical
        Ascending intervals, outside of which no root reaches the axis.
    touched_end : float or None
        An end of the range that an interval touches.
    values : list of float
        Values beside and between the intervals.
    unstable : list of int
        How many roots grow at these values; empty if an end is touched.
    """

    def __init__(self, determinants: Sequence[Polynomial], low: float, high: float) -> None:
        """determinants: of each component, not zero."""
        product = flint.fmpz_poly([1])
        for determinant in determinants:
            for polynomial in _critical_polynomials(determinant):
                product = product * polynomial
        with flint.ctx.workprec(PRECISION):
            zeros = [zero for zero in product.complex_roots() if zero[0].imag == 0]
        zeros.sort(key=lambda zero: float(zero[0].real.mid()))
        self.critical: list[Critical] = []
        edges = [low]
        for zero, multiplicity in zeros:
            each = Critical(low_end(zero.real), high_end(zero.real), multiplicity)
            if each.high < low or each.low > high:
                continue
            if self.critical and each.low <= self.critical[-1].high:  # no double lies between
                before = self.critical.pop()
                each = Critical(before.low, each.high, before.most + multiplicity)
                del edges[-2:]
            self.critical.append(each)
            edges += [each.low, each.high]
        edges.append(high)
        self.touched_end: float | None = None
        if edges[1] <= low:
            self.touched_end = low
        elif edges[-2] >= high:
            self.touched_end = high
        self.values = (np.add(edges[::2], edges[1::2]) / 2.0).tolist()
        self.unstable: list[int] = []
        if self.touched_end is None:
            self.unstable += [sum(_growing(each, p) for each in determinants) for p in self.values]

    @classmethod
    def of(cls, terms: Terms, low: float, high: float) -> ExactRange | None:
        """That of systems whose mass matrix is singular throughout; None of any others."""
        determinants = []
        degree = 0
        for component in terms.components():
            if component.n > MOST_ROWS or not component.is_real:
                return None
            determinant = _determinant_of(component, low, high)
            if not determinant:
                return None
            degree += determinant.degrees()[0]
            determinants.append(determinant)
        if degree == 2 * terms.n:
            return None
        return cls(determinants, low, high)

    def prove(
        self,
        intervals: Sequence[tuple[float, float]],
        growth_below: float,
        rises: Sequence[int],
    ) -> Proof:
        """As `RangeProof.prove`, of the entries as they are given; intervals are disjoint.

        `where` of a wrong interval is its middle.
        """
        if self.touched_end is not None:
            return Proof("open", "exact", reason=AT_END, where=self.touched_end)
        unstable = self.unstable
        found: list[list[int]] = [[] for _ in intervals]  # rises within each interval
        for k, (start, stop, most) in enumerate(self.critical):
            rise = unstable[k + 1] - unstable[k]
            # of several events only a rise of two each excludes that some cancel
            if most > 1 and abs(rise) < 2 * most:
                return Proof("open", "exact", reason=CANCELS, where=start)
            holding = [each for each, (a, b) in enumerate(intervals) if a <= start and stop <= b]
            if rise and not holding:
                if any(a <= stop and start <= b for a, b in intervals):
                    return Proof("open", "exact", reason=IS_PART, where=start)
                reason = f"{unstable[k]} roots grow below {start:.9g} and {unstable[k + 1]} above"
                return Proof("refuted", "exact", reason=reason, where=self.values[k + 1])
            if rise:
                found[holding[0]].append(rise)
        for (start, stop), expected, rises_within in zip(intervals, rises, found, strict=True):
            middle = (start + stop) / 2.0
            if expected and not rises_within:
                reason = f"no root begins or ends to grow from {start:.9g} to {stop:.9g}"
                return Proof("refuted", "exact", reason=reason, where=middle)
            if rises_within != [expected]:
                return Proof("open", "exact", reason=CANCELS, where=middle)
        return Proof("proved", "exact", growth_below)


def _determinant_of(terms: Terms, low: float, high: float) -> Polynomial | None:
    """det (M s^2 + C s + K); None if a factor is not a + b p, or if entries have few digits."""
    ring = flint.fmpq_mpoly_ctx.get(("s", "p"), "lex")
    s, p = ring.gens()
    rows = [[0 * s] * terms.n for _ in range(terms.n)]
    for power, name in enumerate("KCM"):
        for term, X in zip(getattr(terms, name), terms.balls[name], strict=True):
            coefficients = _affine(term.factor, low, high)
            if coefficients is None or not X.has_all_digits:
                return None
            constant, slope = coefficients
            factor = (constant + slope * p) * s**power
            for i, j in np.argwhere(X.mid).tolist():
                entry = flint.fmpq(*float(X.mid[i, j]).as_integer_ratio())
                rows[i][j] += entry * factor
    return _determinant(rows)


def _affine(factor: Factor | None, low: float, high: float) -> list[Any] | None:
    """Rational numbers a and b of a factor a + b p; None of any other factor.

    It has to be that between the range and p = 0 as well, where a and b are taken.
    """
    if factor is None:
        return [flint.fmpq(1), flint.fmpq(0)]
    try:
        values = between(min(low, 0.0), max(high, 0.0))
        bend = taylor_coefficients(factor(flint.arb_series([values, 1], prec=3)), 3)[2]
        coefficients = taylor_coefficients(factor(flint.arb_series([0, 1], prec=2)), 2)
    except (ValueError, ZeroDivisionError):  # it divides by what may be zero
        return None
    if bend != 0 or not all(x.is_exact() for x in coefficients):
        return None
    rational = []
    for x in coefficients:
        mantissa, exponent = x.man_exp()
        rational.append(flint.fmpq(mantissa) * flint.fmpq(2) ** int(exponent))
    return rational


def _determinant(rows: list[list[Polynomial]]) -> Polynomial:
    """The determinant of rows of polynomials, by the first row's minors."""
    if not rows:
        return 1
    first, *others = rows
    total = 0 * first[0]
    for k, entry in enumerate(first):
        if entry:
            minor = [row[:k] + row[k + 1 :] for row in others]
            total = total + (-1) ** k * entry * _determinant(minor)
    return total


def _critical_polynomials(determinant: Polynomial) -> Iterator[Polynomial]:
    """Polynomials in p that vanish wherever a root reaches the axis, zero or infinity."""
    powers = sorted({power for power, _ in determinant.to_dict()})
    parts: list[dict[tuple[int, int], Any]] = [{}, {}]  # of e and o, in s^2 and p
    for (power, of_p), value in determinant.to_dict().items():
        power -= powers[0]  # zeros at every p
        parts[power % 2][power // 2, of_p] = value
    even, odd = map(determinant.context().from_dict, parts)
    paired = even.gcd(odd)
    for power in {powers[0], powers[-1]}:
        yield _of_parameter(determinant, power)
    if odd:
        yield _of_parameter((even / paired).resultant(odd / paired, "s"), 0)
    paired = paired / paired.gcd(paired.derivative("s"))
    if paired.degrees()[0]:
        yield _of_parameter(paired.resultant(paired.derivative("s"), "s"), 0)


def _of_parameter(polynomial: Polynomial, power: int) -> Polynomial:
    """The coefficient of a power of s, times a number that makes it one of integers."""
    terms = {of_p: value for (of_s, of_p), value in polynomial.to_dict().items() if of_s == power}
    coefficients = [terms.get(k, 0) for k in range(max(terms) + 1)]
    return flint.fmpq_poly(coefficients).numer()


def _growing(determinant: Polynomial, value: float) -> int:
    """How many roots grow at a value of the parameter."""
    p = flint.fmpq(*value.as_integer_ratio())
    terms = determinant.to_dict()
    coefficients = [flint.fmpq(0)] * (determinant.degrees()[0] + 1)
    for (power, of_p), coefficient in terms.items():
        coefficients[power] += coefficient * p**of_p
    polynomial = flint.fmpq_poly(coefficients).numer()
    zeros = 0
    while polynomial[zeros] == 0:
        zeros += 1
    with flint.ctx.workprec(PRECISION):
        pieces = pieces_of(polynomial.right_shift(zeros), flint.arb(1))
    return sum(piece.side == "grows" for piece in pieces)
