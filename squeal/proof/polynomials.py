"""The changes of what grows over a range of the parameter p by algebra, for few rows and factors
that are rational functions of p.

The determinant, without denominators, is a polynomial in s and p, and each of its irreducible
factors is e(s^2) + s o(s^2). As p varies, a root of it reaches the imaginary axis only where the
resultant of e and o vanishes. Without o the roots come in pairs s, -s at every p, and leave the
axis only where the discriminant of e vanishes. A root reaches zero where the constant coefficient
vanishes, and infinity where the leading one does. Between these values of p the number of growing
roots is constant and is counted exactly; it is also counted at those values that are doubles.
Neither rounding nor ratios of stiffnesses matter.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.proof.balls import high_end, low_end
from squeal.proof.exact import PRECISION, pieces_of_polynomial
from squeal.proof.pieces import Piece
from squeal.proof.terms import Terms

try:
    import flint
except ImportError:  # an extra
    flint = None

MOST_DEGREE = 8
"""In p, of the determinant of a component, at least its rows: polynomials take up to two seconds,
those of degree ten ten."""
MOST_BITS = 10_000
"""Of a number in a factor, which a power makes long: a double has at most 1,075."""
BESIDE = 1e-12
"""Of the distance to the next zero: so far beside a zero growing roots are counted."""
Polynomial = Any
"""A `flint.fmpq_mpoly` in s and p, or a `flint.fmpz_poly` in one of them."""
Number = Any
"""A double, an integer, or a rational function."""


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
            if component.n > MOST_DEGREE or not component.is_real:
                return None
            determinant = _determinant_of(component, low, high)
            if not determinant:
                return None
            _, factors_and_powers = determinant.factor()  # without its constant factor
            for factor, power in factors_and_powers:
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
    """An interval of the parameter with a zero of a polynomial, or with several that overlap.

    multiplicity: of all zeros in it together; is_single: whether they are one zero.
    """

    low: float
    high: float
    multiplicity: int
    is_single: bool


def _changes_of(factor: Polynomial, low: float, high: float) -> list[Change] | None:
    """The changes of an irreducible polynomial in a range, None where they are not certain.

    Between two zeros of its critical polynomials one number of roots grows. Around each zero the
    growing roots are counted just below it, at the zero itself where it is a double, and just above
    it; from one count to the next they change. At the low end of the range nothing is counted
    below, so that only roots that begin to grow there are changes.
    """
    leading, *others = _critical_polynomials(factor)
    if _zeros_within(leading, low, high):
        return None
    changes = []
    # a zero that several of them share is listed once, its multiplicities added
    critical: Polynomial = math.prod(others)
    zeros = _zeros_within(critical, low, high)
    for k, zero in enumerate(zeros):
        # roots are counted at a share of the way to the next zero, or to an end of the range. The
        # next double would serve as well, but near 0 it is a fraction of a thousand digits
        next_low = zeros[k + 1].low if k + 1 < len(zeros) else max(high, zero.high)
        last_high = zeros[k - 1].high if k else low
        middle = max((zero.low + zero.high) / 2.0, low)
        is_double = zero.is_single and critical(_exactly(middle)) == 0
        growing = []  # the growing roots below the zero, at it and above it
        if zero.low > low:
            growing.append(_growing_at(factor, zero.low - BESIDE * (zero.low - last_high)))
        elif not is_double:
            return None  # some zero lies beside the end
        if is_double:  # what grows there grows on both sides, so that nothing cancels
            growing.append(_growing_at(factor, middle))
        growing.append(_growing_at(factor, zero.high + BESIDE * (next_low - zero.high)))
        start = max(zero.low, low)
        for before, after in itertools.pairwise(growing):
            rise = len(after) - len(before)
            # several changes may cancel in the count. They cannot if it moves by two for each; nor
            # at a single value beside which nothing grows on one side: all begin, or all end
            may_cancel = zero.multiplicity > 1 and abs(rise) < 2 * zero.multiplicity
            one_side_is_stable = zero.is_single and not (before and after)
            if not is_double and may_cancel and not one_side_is_stable:
                return None
            # the slowest ones have just begun to grow, or are about to end to
            slowest = after[:rise] if rise > 0 else before[:-rise]
            sign = int(np.sign(rise))
            changes_at_zero = []
            for root in slowest:
                if root.imag == 0.0:
                    changes_at_zero.append(Change(start, zero.high, sign, 0.0))
                elif root.imag > 0.0:  # which stands for its conjugate, too
                    changes_at_zero.append(Change(start, zero.high, 2 * sign, root.imag))
            if sum(change.rise for change in changes_at_zero) != rise:
                return None
            changes += changes_at_zero
    return changes


def _zeros_within(polynomial: Polynomial, low: float, high: float) -> list[_Zero]:
    """The zeros of a polynomial within a range, ascending."""
    zeros = []
    with flint.ctx.workprec(PRECISION):
        for root, multiplicity in polynomial.complex_roots():
            zero = _Zero(low_end(root.real), high_end(root.real), multiplicity, True)
            if root.imag == 0 and zero.low <= high and zero.high >= low:
                zeros.append(zero)
    separate: list[_Zero] = []
    for zero in sorted(zeros):
        # intervals end at neighbouring doubles: of two that overlap few doubles tell which is which
        if separate and zero.low <= separate[-1].high:
            before = separate.pop()
            multiplicity = before.multiplicity + zero.multiplicity
            zero = _Zero(before.low, max(before.high, zero.high), multiplicity, False)
        separate.append(zero)
    return separate


def _exactly(value: float) -> Any:
    """A double as a rational number."""
    return flint.fmpq(*value.as_integer_ratio())


def _determinant_of(terms: Terms, low: float, high: float) -> Polynomial | None:
    """det (M s^2 + C s + K), times a power of the common denominator of the factors.

    None if a factor is no rational function of p or has a pole in the range, if entries have few
    digits, and if the degrees are too large.
    """
    ring = flint.fmpq_mpoly_ctx.get(("s", "p"), "lex")
    s, p = ring.gens()
    one = p**0
    denominator = one
    parts = []  # the power of s, the factor and the matrix of each term
    for power, name in enumerate("KCM"):
        for term, X in zip(getattr(terms, name), terms.balls[name], strict=True):
            if not X.has_all_digits:
                return None
            quotient = Quotient(one, one)
            if term.factor is not None:
                try:
                    quotient *= term.factor(Quotient(p, one))
                except (ArithmeticError, ValueError):
                    return None
            denominator *= quotient.denominator / denominator.gcd(quotient.denominator)
            parts.append((power, quotient, X.mid))
    if _zeros_within(_of_parameter(denominator, 0), low, high):
        return None
    rows = [[0 * s] * terms.n for _ in range(terms.n)]
    for power, quotient, matrix in parts:
        factor = quotient.numerator * (denominator / quotient.denominator)
        if terms.n * factor.degrees()[1] > MOST_DEGREE:
            return None
        for i, j in np.argwhere(matrix).tolist():
            rows[i][j] += _exactly(float(matrix[i, j])) * factor * s**power
    return _determinant(rows)


@dataclass(frozen=True, eq=False)
class Quotient:
    """A rational function of the parameter: two polynomials, or rational numbers.

    Its operations raise ArithmeticError or ValueError where the result is no such function, or a
    power so large that it takes long.
    """

    numerator: Polynomial
    denominator: Polynomial

    @staticmethod
    def of(x: Number) -> Quotient:
        """A function as it is, a number exactly."""
        return x if isinstance(x, Quotient) else Quotient(_exactly(x), flint.fmpq(1))

    def __add__(self, other: Number) -> Quotient:
        b = Quotient.of(other)
        numerator = self.numerator * b.denominator + b.numerator * self.denominator
        return Quotient(numerator, self.denominator * b.denominator)

    def __neg__(self) -> Quotient:
        return Quotient(-self.numerator, self.denominator)

    def __sub__(self, other: Number) -> Quotient:
        return self + -other

    def __rsub__(self, other: Number) -> Quotient:
        return -self + other

    def __mul__(self, other: Number) -> Quotient:
        b = Quotient.of(other)
        return Quotient(self.numerator * b.numerator, self.denominator * b.denominator)

    def __truediv__(self, other: Number) -> Quotient:
        b = Quotient.of(other)
        if b.numerator == 0:
            raise ZeroDivisionError
        return Quotient(self.numerator * b.denominator, self.denominator * b.numerator)

    def __rtruediv__(self, other: Number) -> Quotient:
        return Quotient.of(other) / self

    def __pow__(self, exponent: Number) -> Quotient:
        """The power by a whole number; raises ValueError for others, and for a large result."""
        number = Quotient.of(exponent)
        power = number.numerator / number.denominator  # rational; power.q is its denominator
        size = max(_size(self.numerator), _size(self.denominator))
        if power.q != 1 or abs(int(power)) * size > 1.0:
            raise ValueError
        if power < 0:
            return (1 / self) ** -int(power)
        return Quotient(self.numerator ** int(power), self.denominator ** int(power))

    __radd__ = __add__
    __rmul__ = __mul__


def _size(x: Polynomial) -> float:
    """The degree of a polynomial as a share of `MOST_DEGREE`, or the bits of its largest number as
    a share of `MOST_BITS`: the larger one."""
    if isinstance(x, flint.fmpq):
        return float(x.height_bits()) / MOST_BITS
    shares = [float(x.total_degree()) / MOST_DEGREE]
    for number in x.coeffs():
        shares.append(_size(number))
    return max(shares)


def _determinant(rows: list[list[Polynomial]]) -> Polynomial:
    """The determinant of rows of polynomials, by the first row's minors."""
    if not rows:
        return 1
    first, *others = rows
    total = 0 * first[0]
    for k, entry in enumerate(first):
        if entry:
            minor = [row[:k] + row[k + 1 :] for row in others]
            total += (-1) ** k * entry * _determinant(minor)
    return total


def _critical_polynomials(factor: Polynomial) -> Iterator[Polynomial]:
    """Polynomials in p of an irreducible one in s and p (see the top of the module).

    The first vanishes where a root s reaches infinity; wherever a root reaches the imaginary axis
    or zero one of the others does.
    """
    coefficients = factor.to_dict()  # by the powers of s and p
    powers = sorted({power for power, _ in coefficients})
    parts: list[dict[tuple[int, int], Any]] = [{}, {}]  # of e and o, in s^2 and p
    for (power, power_of_p), value in coefficients.items():
        parts[power % 2][power // 2, power_of_p] = value
    even, odd = map(factor.context().from_dict, parts)
    yield _of_parameter(factor, powers[-1])
    yield _of_parameter(factor, powers[0])
    if even and odd:
        yield _of_parameter(even.resultant(odd, "s"), 0)
    elif even.degrees()[0] > 0:  # each root with its negative
        yield _of_parameter(even.resultant(even.derivative("s"), "s"), 0)


def _of_parameter(polynomial: Polynomial, power: int) -> Polynomial:
    """The coefficient of a power of s, times a number that makes it one of integers."""
    terms = {}  # by the power of p
    for (power_of_s, power_of_p), value in polynomial.to_dict().items():
        if power_of_s == power:
            terms[power_of_p] = value
    coefficients = [terms.get(k, 0) for k in range(max(terms) + 1)]
    return flint.fmpq_poly(coefficients).numer()


def _pieces_at(factor: Polynomial, value: float) -> list[Piece]:
    """The roots at a value of the parameter, each a piece of its own."""
    p = _exactly(value)
    coefficients = [flint.fmpq(0)] * (factor.degrees()[0] + 1)
    for (power, power_of_p), coefficient in factor.to_dict().items():
        coefficients[power] += coefficient * p**power_of_p
    with flint.ctx.workprec(PRECISION):
        return pieces_of_polynomial(flint.fmpq_poly(coefficients).numer(), flint.arb(1))


def _growing_at(factor: Polynomial, value: float) -> list[complex]:
    """The growing roots at a value of the parameter, rad/s, the slowest growth first."""
    pieces = _pieces_at(factor, value)
    roots = [complex(piece.centres[0]) for piece in pieces if piece.side == "grows"]
    return sorted(roots, key=lambda root: root.real)
