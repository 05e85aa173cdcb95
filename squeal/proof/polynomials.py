"""The changes of what grows over a range of the parameter p by algebra, for few rows and factors
a + b p.

The determinant is a polynomial in s and p, and each of its irreducible factors is
e(s^2) + s o(s^2). With the parameter a root of it reaches the imaginary axis only where the
resultant of e and o vanishes. Without o roots come with their negative at every p, and leave the
axis only where the discriminant of e vanishes. A root reaches zero where the constant coefficient
vanishes, and infinity where the leading one does. Between these values of p one number of roots
grows, which is counted exactly. Neither rounding nor ratios of stiffnesses matter.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.proof.balls import between, high_end, low_end, taylor_coefficients
from squeal.proof.exact import PRECISION, pieces_of
from squeal.proof.pieces import Piece
from squeal.proof.ranges import Factor, Terms

try:
    import flint
except ImportError:  # an extra
    flint = None

MOST_ROWS = 8
"""Of a component: its polynomials take up to two seconds, those of ten rows ten."""
BESIDE = 1e-12
"""Of the distance to the next zero: so far beside a zero growing roots are counted."""
Polynomial = Any
"""A `flint.fmpq_mpoly` in s and p, or a `flint.fmpz_poly` in one of them."""


class Change(NamedTuple):
    """Where a root, or a pair, begins or ends to grow.

    Attributes
    ----------
    low, high : float
        The value of the parameter lies between these; nearly always they are neighbours.
    rise : int
        1 or 2 where a root or a pair begins to grow, -1 or -2 where it ends to.
    omega : float
        The frequency of the pair, rad/s; 0 of a root. It is that of the slowest growing one beside
        the change, which no proof identifies with the pair.
    """

    low: float
    high: float
    rise: int
    omega: float


class ExactRange:
    """How many roots grow at every value of a range of the parameter.

    Attributes
    ----------
    changes : list of Change
        By rising value; between two of them one number of roots grows.
    """

    def __init__(self, factors: Sequence[Polynomial], changes: Sequence[Change]) -> None:
        """factors: the irreducible ones of the determinant."""
        self._factors = factors
        self.changes = sorted(changes)

    @classmethod
    def of(cls, terms: Terms, low: float, high: float) -> ExactRange | None:
        """The changes in a range.

        None where a component has too many rows, other factors, or entries of few digits; and where
        changes are not certain, as several coincide that may cancel in the count, or a root passes
        through infinity.
        """
        factors: list[Polynomial] = []
        changes: list[Change] = []
        for component in terms.components():
            if component.n > MOST_ROWS or not component.is_real:
                return None
            determinant = _determinant_of(component, low, high)
            if not determinant:
                return None
            for factor, power in determinant.factor()[1]:
                changes_of_factor = _changes_of(factor, low, high)
                if changes_of_factor is None:
                    return None
                factors += [factor] * power
                changes += changes_of_factor * power
        return cls(factors, changes)

    def roots_at(self, value: float) -> NDArray[np.complex128]:
        """All finite roots (m,), rad/s, with the exact sign of each real part."""
        roots = []
        for factor in self._factors:
            roots += [piece.centres[0] for piece in _pieces_at(factor, value)]
        return np.array(roots, dtype=complex)


class _Zero(NamedTuple):
    """An interval of the parameter with zeros of polynomials that no double separates."""

    low: float
    high: float
    multiplicity: int


def _changes_of(factor: Polynomial, low: float, high: float) -> list[Change] | None:
    """The changes of an irreducible polynomial in a range, None where they are not certain.

    At the low end of the range those of roots that begin to grow there.
    """
    leading, *others = _critical_polynomials(factor)
    if _zeros_within([leading], low, high):
        return None
    changes = []
    zeros = _zeros_within(others, low, high)
    for k, zero in enumerate(zeros):
        # between two zeros one number of roots grows; the neighbouring double would do as well, but
        # beside 0 it takes a thousand digits
        next_low = zeros[k + 1].low if k + 1 < len(zeros) else max(high, zero.high)
        above = _growing_at(factor, zero.high + BESIDE * (next_low - zero.high))
        if zero.low > low:
            last_high = zeros[k - 1].high if k else low
            below = _growing_at(factor, zero.low - BESIDE * (zero.low - last_high))
            most = zero.multiplicity
        else:
            if sum(_order_at(polynomial, low) for polynomial in others) < zero.multiplicity:
                return None  # some zero lies beside the end
            below = _growing_at(factor, low)  # what lies on the axis there does not grow yet
            most = 1  # nothing can cease to grow in the range
        rise = len(above) - len(below)
        # of several changes only a rise of two each excludes that some cancel
        if most > 1 and abs(rise) < 2 * most:
            return None
        # the slowest ones have just begun to grow, or are about to end to
        slowest = above[:rise] if rise > 0 else below[:-rise]
        sign = int(np.sign(rise))
        start = max(zero.low, low)
        of_zero = []
        for root in slowest:
            if root.imag == 0.0:
                of_zero.append(Change(start, zero.high, sign, 0.0))
            elif root.imag > 0.0:  # which stands for its conjugate, too
                of_zero.append(Change(start, zero.high, 2 * sign, root.imag))
        if sum(change.rise for change in of_zero) != rise:
            return None
        changes += of_zero
    return changes


def _zeros_within(polynomials: Sequence[Polynomial], low: float, high: float) -> list[_Zero]:
    """The zeros of some polynomials within a range, ascending."""
    zeros = []
    with flint.ctx.workprec(PRECISION):
        for polynomial in polynomials:
            for root, multiplicity in polynomial.complex_roots():
                zero = _Zero(low_end(root.real), high_end(root.real), multiplicity)
                if root.imag == 0 and zero.low <= high and zero.high >= low:
                    zeros.append(zero)
    separate: list[_Zero] = []
    for zero in sorted(zeros):
        if separate and zero.low <= separate[-1].high:  # no double lies between
            before = separate.pop()
            multiplicity = before.multiplicity + zero.multiplicity
            zero = _Zero(before.low, max(before.high, zero.high), multiplicity)
        separate.append(zero)
    return separate


def _order_at(polynomial: Polynomial, value: float) -> int:
    """The order of the zero of a polynomial at a value, 0 where it is none."""
    exact_value = _exactly(value)
    order = 0
    while polynomial(exact_value) == 0:
        polynomial = polynomial.derivative()
        order += 1
    return order


def _exactly(value: float) -> Any:
    """A double as a rational number."""
    return flint.fmpq(*value.as_integer_ratio())


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
                rows[i][j] += _exactly(float(X.mid[i, j])) * factor
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
    # a ball that holds 0 differs from 0 neither certainly nor not at all
    if not (bend == 0 and all(x.is_exact() for x in coefficients)):
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


def _critical_polynomials(factor: Polynomial) -> Iterator[Polynomial]:
    """Polynomials in p of an irreducible one: the first vanishes where a root reaches infinity,
    another one wherever a root reaches the axis or zero."""
    powers = sorted({power for power, _ in factor.to_dict()})
    parts: list[dict[tuple[int, int], Any]] = [{}, {}]  # of e and o, in s^2 and p
    for (power, of_p), value in factor.to_dict().items():
        parts[power % 2][power // 2, of_p] = value
    even, odd = map(factor.context().from_dict, parts)
    yield _of_parameter(factor, powers[-1])
    yield _of_parameter(factor, powers[0])
    if even and odd:
        yield _of_parameter(even.resultant(odd, "s"), 0)
    elif even.degrees()[0] > 0:  # each root with its negative
        yield _of_parameter(even.resultant(even.derivative("s"), "s"), 0)


def _of_parameter(polynomial: Polynomial, power: int) -> Polynomial:
    """The coefficient of a power of s, times a number that makes it one of integers."""
    terms = {of_p: value for (of_s, of_p), value in polynomial.to_dict().items() if of_s == power}
    coefficients = [terms.get(k, 0) for k in range(max(terms) + 1)]
    return flint.fmpq_poly(coefficients).numer()


def _pieces_at(factor: Polynomial, value: float) -> list[Piece]:
    """The roots at a value of the parameter, each a piece of its own."""
    p = _exactly(value)
    coefficients = [flint.fmpq(0)] * (factor.degrees()[0] + 1)
    for (power, of_p), coefficient in factor.to_dict().items():
        coefficients[power] += coefficient * p**of_p
    with flint.ctx.workprec(PRECISION):
        return pieces_of(flint.fmpq_poly(coefficients).numer(), flint.arb(1))


def _growing_at(factor: Polynomial, value: float) -> list[complex]:
    """The growing roots at a value of the parameter, rad/s, the slowest growth first."""
    pieces = _pieces_at(factor, value)
    roots = [complex(piece.centres[0]) for piece in pieces if piece.side == "grows"]
    return sorted(roots, key=lambda root: root.real)
