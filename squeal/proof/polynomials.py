"""The changes of what grows over a range of the parameter p by algebra, for few rows and factors
that are rational functions of p.

The determinant, without denominators, is a polynomial in s and p, and each of its irreducible
factors is e(s^2) + s o(s^2). As p varies, a root of it reaches the imaginary axis only where the
resultant of e and o vanishes. Without o the roots come in pairs s, -s at every p, and leave the
axis only where the discriminant of e vanishes. A root reaches zero where the constant coefficient
vanishes, and infinity where the leading one does. Between these values of p the number of growing
roots is constant and is counted exactly; it is also counted at those values that are doubles.
What crosses is identified at such a value itself: a pair +-i omega there has the common root
-omega^2 of e and o, or without o the multiple root of e. Neither rounding nor ratios of stiffnesses
matter.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.proof.balls import Ball, high_end, low_end
from squeal.proof.exact import PRECISION, pieces_of_polynomial
from squeal.proof.pieces import Piece
from squeal.proof.terms import Factor, Terms

try:
    import flint
except ImportError:  # an extra
    flint = None

MOST_DEGREE = 8
"""In p, of the determinant of a component, at least its rows: polynomials take up to two seconds,
those of degree ten ten."""
MOST_BITS = 10_000
"""Of a number in a factor, which a power makes long: a double has at most 1,075."""
ZERO_PRECISION = 4 * PRECISION
"""Bits of the balls of zeros, and of what is computed at them."""
ROOT_ERROR = 2.0**-100
"""Of the smallest root: how well roots are known at zeros."""
OMEGA_BITS = 40
"""So many bits of the frequency of a pair are known; else its change is not certain."""
Polynomial = Any
"""A `flint.fmpq_mpoly` in s and p, or a `flint.fmpz_poly` in one of them."""
Value = Any
"""Of the parameter: a rational number (`flint.fmpq`), or a ball of real numbers (`flint.arb`)."""
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
        The frequency at which the pair crosses the imaginary axis, rad/s; 0 of a root.
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

        None where a component has too many rows, factors that are no rational functions, or entries
        of few digits. None also where changes are not certain: where several coincide that may
        cancel in the count, what crosses is not identified, or a root passes through infinity.
        """
        factors: list[Polynomial] = []
        changes: list[Change] = []
        for component in terms.components():
            if component.n > MOST_DEGREE or not component.is_real:
                return None
            determinant = _determinant_of(component, low, high)
            if not determinant:  # None, or zero at all s and p, where every s is a root
                return None
            _, factors_and_powers = determinant.factor()  # without its constant factor
            for factor, power in factors_and_powers:
                changes_of_factor = _changes_of(factor, low, high)
                if changes_of_factor is None:
                    return None
                factors += [factor] * power
                changes += changes_of_factor * power
        return cls(factors, changes)

    @property
    def passes_zero_together(self) -> bool:
        """Whether a pair, or several roots at one value, begin or end to grow at zero."""
        values = []
        for change in self.changes:
            if change.omega == 0.0:
                values += [change.low] * abs(change.rise)
        return len(set(values)) < len(values)

    def roots_at(self, value: float) -> NDArray[np.complex128]:
        """All finite roots (m,), rad/s, with the exact sign of each real part."""
        roots = []
        for factor in self._factors:
            roots += [piece.centres[0] for piece in _pieces_at(factor, _exactly(value))]
        return np.array(roots, dtype=complex)


class _Zero(NamedTuple):
    """An interval of the parameter with a zero of a polynomial, or with several that overlap.

    multiplicity: of all zeros in it together; ball: holds them, narrower than the interval;
    is_single: whether they are one zero.
    """

    low: float
    high: float
    multiplicity: int
    ball: Ball
    is_single: bool = True


def _changes_of(factor: Polynomial, low: float, high: float) -> list[Change] | None:
    """The changes of an irreducible polynomial in a range, None where they are not certain.

    Between two zeros of its critical polynomials one number of roots grows. The growing roots are
    counted in the middle between neighbouring zeros, and at each zero that is a double; from one
    count to the next they change. At the low end of the range nothing is counted below, so that
    only roots that begin to grow there are changes. Changes are not certain if a root passes
    infinity, or if several changes at one zero may cancel in the counts.
    """
    leading, *others = _critical_polynomials(factor)
    if _zeros_within(leading, low, high):
        return None
    changes = []
    # a zero that several of them share is listed once, its multiplicities added
    critical: Polynomial = math.prod(others)
    zeros = _zeros_within(critical, low, high)
    starts = [low]  # of the intervals between zeros
    stops = []
    for zero in zeros:
        stops.append(zero.low)
        starts.append(zero.high)
    stops.append(high)
    between = []  # the number of growing roots in each of them
    for start, stop in zip(starts, stops, strict=True):
        # the interval of a zero at the end of the range may reach beyond it
        middle = max(start, start / 2.0 + stop / 2.0)
        between.append(_growing_number(factor, _exactly(middle)))
    for zero, (below, above) in zip(zeros, itertools.pairwise(between), strict=True):
        value = zero.ball
        middle = _exactly(max((zero.low + zero.high) / 2.0, low))
        is_double = zero.is_single and critical(middle) == 0
        numbers = []  # of growing roots: below the zero, at it and above it
        if zero.low > low:
            numbers.append(below)
        elif not is_double:
            return None  # some zero lies beside the end
        if is_double:  # what grows there grows on both sides, so that nothing cancels
            value = middle
            numbers.append(_growing_number(factor, value))
        numbers.append(above)
        start = max(zero.low, low)
        for before, after in itertools.pairwise(numbers):
            rise = after - before
            # several changes may cancel in the count. They cannot if it moves by two for each; nor
            # at a single value beside which nothing grows on one side: all begin, or all end
            may_cancel = zero.multiplicity > 1 and abs(rise) < 2 * zero.multiplicity
            one_side_is_stable = zero.is_single and not (before and after)
            if not is_double and may_cancel and not one_side_is_stable:
                return None
            if not rise:
                continue
            crossings = _crossings(factor, value, rise, is_double)
            if crossings is None:
                return None
            for crossing in crossings:
                changes.append(Change(start, zero.high, crossing.rise, crossing.omega))
    return changes


def _zeros_within(polynomial: Polynomial, low: float, high: float) -> list[_Zero]:
    """The zeros of a polynomial within a range of the parameter, ascending.

    Zeros whose intervals overlap are one `_Zero`, with the sum of their multiplicities.
    """
    zeros = []
    with flint.ctx.workprec(ZERO_PRECISION):
        for root, multiplicity in polynomial.complex_roots():
            value = root.real
            zero = _Zero(low_end(value), high_end(value), multiplicity, ball=value)
            if root.imag == 0 and zero.low <= high and zero.high >= low:
                zeros.append(zero)
        separate: list[_Zero] = []
        for zero in sorted(zeros, key=lambda zero: zero.low):
            # the ends of an interval are the doubles next to the zero: between two zeros whose
            # intervals overlap there is hardly a double at which roots could be counted
            if separate and zero.low <= separate[-1].high:
                before = separate.pop()
                multiplicity = before.multiplicity + zero.multiplicity
                ball = before.ball.union(zero.ball)
                end = max(before.high, zero.high)
                zero = _Zero(before.low, end, multiplicity, ball, is_single=False)
            separate.append(zero)
    return separate


class _Crossing(NamedTuple):
    """A root or a pair that crosses the imaginary axis: by how much it makes the number of growing
    roots rise, and its frequency, rad/s."""

    rise: int
    omega: float


def _crossings(
    factor: Polynomial, value: Value, rise: int, is_exact: bool
) -> list[_Crossing] | None:
    """What crosses the imaginary axis where the number of growing roots changes; None where it is
    not certain.

    Something crosses. If the axis holds one place for it, all is there. Of several places the
    speeds d(Re s)/dp tell what begins and what ends to grow.

    Parameters
    ----------
    factor : Polynomial
        The irreducible polynomial in s and p.
    value : Value
        Where it changes.
    rise : int
        By how much the number rises; it is not zero.
    is_exact : bool
        Whether nothing cancels in the rise. Otherwise all has to begin, or all to end to grow.
    """
    sign = int(np.sign(rise))
    with flint.ctx.workprec(ZERO_PRECISION):
        places = _places_on_axis(factor, value)  # angular frequencies of at least 0
        if places is None:
            return None
        if places == [0]:
            if abs(rise) == 1 or not _are_real_beside_zero(factor, value):
                return [_Crossing(rise, 0.0)]
            return [_Crossing(sign, 0.0)] * 2
        crossing = places
        if len(places) == 1:  # all pairs of the rise cross at the one place
            crossing = places * (abs(rise) // 2)
        else:
            speeds = [_speed(factor, place, value) for place in places]
            if any(speed.contains(0) for speed in speeds):
                return None
            crossing = [p for p, speed in zip(places, speeds, strict=True) if speed * rise > 0]
            if not is_exact and len(crossing) < len(places):
                return None
    crossings = []
    for place in crossing:
        roots = 1 if place == 0 else 2  # of a pair one for its conjugate
        crossings.append(_Crossing(sign * roots, float(place.mid())))
    if sum(crossing.rise for crossing in crossings) != rise:
        return None
    return crossings


def _speed(factor: Polynomial, omega: Ball, value: Value) -> Ball:
    """d(Re s)/dp of the root s = i omega at a value of the parameter."""
    root = flint.acb(0, omega)
    slopes = []
    for variable in ("s", "p"):
        coefficients = _coefficients_at(factor.derivative(variable), value)
        slopes.append(flint.acb_poly(coefficients)(root))
    by_root, by_parameter = slopes
    return (-by_parameter / by_root).real


def _places_on_axis(factor: Polynomial, value: Value) -> list[Ball] | None:
    """The frequencies (rad/s) at which roots may cross the imaginary axis, 0 for roots that pass
    through zero.

    value: of the parameter, a rational number, or a ball around one that is not rational; of a ball
    the list may hold frequencies at which nothing crosses. None where they are not isolated, and
    where several roots pass through zero. Two may at a rational value beside which it is certain
    whether they are real (see `_are_real_beside_zero`).
    """
    even, second = _halves(factor)  # e and o, or the derivative of e if there is no o
    even_at = _coefficients_at(even, value)
    second_at = _coefficients_at(second, value)
    if isinstance(value, flint.fmpq):
        common = flint.fmpq_poly(even_at).gcd(flint.fmpq_poly(second_at))
        squares = [square for square, _ in common.complex_roots()]
    else:
        isolated = _common_roots(flint.arb_poly(even_at), flint.arb_poly(second_at))
        if isolated is None:
            return None
        squares = isolated
    places = []
    for square in squares:  # s^2 of a root that meets its negative
        # complex, real or zero (see below): it does not cross as a pair
        if not square.imag.contains(0) or square.real > 0 or square == 0:
            continue
        omega = (-square.real).sqrt()
        if not square.real < 0 or omega.rel_accuracy_bits() < OMEGA_BITS:
            return None
        places.append(omega)
    if flint.arb(even_at[0]).contains(0):
        are_several = flint.arb(second_at[0]).contains(0)
        if are_several and _are_real_beside_zero(factor, value) is None:
            return None
        places.append(flint.arb(0))
    return places


def _are_real_beside_zero(factor: Polynomial, value: Value) -> bool | None:
    """Whether two roots that are both zero at a value p0 are real where both grow.

    They are the roots of a s^2 + b s + c to leading order, with b and c by the powers m and k of
    p - p0: a pair if c is the larger, k < 2 m; real if b is, k > 2 m; else b^2 - 4 a c tells. None
    where that is zero, where p0 is no rational number, and where it is not two roots that pass.
    """
    if not isinstance(value, flint.fmpq):
        return None
    distance = flint.fmpq_poly([value, 1])  # p by its distance from p0
    parts = [flint.fmpq_poly()] * (factor.degrees()[0] + 1)  # the coefficients of the powers of s
    for (power, power_of_p), coefficient in factor.to_dict().items():
        parts[power] += coefficient * distance**power_of_p
    c, b, a, *_ = parts
    if a[0] == 0:
        return None
    if not b:
        return False
    k = _order(c)
    m = _order(b)
    if k != 2 * m:
        return k > 2 * m
    discriminant = b[m] ** 2 - 4 * a[0] * c[k]
    return None if discriminant == 0 else discriminant > 0


def _order(polynomial: Polynomial) -> int:
    """The lowest power with a coefficient that is not zero."""
    return next(power for power, x in enumerate(polynomial.coeffs()) if x)


def _common_roots(even: Polynomial, second: Polynomial) -> list[Ball] | None:
    """Balls of roots of one of two polynomials of balls that may be roots of the other one too.

    Roots are those of `second`, or of `even` if `second` does not serve. A polynomial serves if its
    leading coefficient differs from zero for sure, and its roots can be isolated; None if neither
    does.
    """
    for polynomial, other in ((second, even), (even, second)):
        if polynomial[polynomial.degree()].contains(0):
            continue
        try:
            sizes = [abs(root) for root in polynomial.complex_roots()]
            smallest = min([size.mid() for size in sizes if not size.contains(0)], default=1)
            roots = polynomial.complex_roots(tol=ROOT_ERROR * smallest)
        except ValueError:  # the roots are not isolated
            continue
        return [root for root in roots if other(root).contains(0)]
    return None


def _exactly(value: float) -> Value:
    """A double as a rational number."""
    return flint.fmpq(*value.as_integer_ratio())


def _determinant_of(terms: Terms, low: float, high: float) -> Polynomial | None:
    """det (M s^2 + C s + K), each row times the common denominator of the factors.

    None if a factor is no rational function of p or has a pole in the range from low to high, if
    entries have few digits, and if the degrees are too large.
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
            # the least common multiple of the denominators so far
            denominator *= quotient.denominator / denominator.gcd(quotient.denominator)
            parts.append((power, quotient, X.mid))
    # the denominator, a polynomial in s and p without s, as one in p: where it is zero is a pole
    if _zeros_within(_of_parameter(denominator, 0), low, high):
        return None
    rows = [[0 * s] * terms.n for _ in range(terms.n)]
    for power, quotient, matrix in parts:
        factor = quotient.numerator * (denominator / quotient.denominator)
        if terms.n * factor.degrees()[1] > MOST_DEGREE:  # degrees in s and p
            return None
        for i, j in np.argwhere(matrix).tolist():
            rows[i][j] += _exactly(float(matrix[i, j])) * factor * s**power
    return _determinant(rows)


def poles(factor: Factor, low: float, high: float) -> list[float]:
    """The values of the parameter within a range at which a rational function divides by zero; none
    of a function that is not rational."""
    _, p = flint.fmpq_mpoly_ctx.get(("s", "p"), "lex").gens()
    try:
        quotient = Quotient(p**0, p**0) * factor(Quotient(p, p**0))
    except (ArithmeticError, ValueError):
        return []
    zeros = _zeros_within(_of_parameter(quotient.denominator, 0), low, high)
    return [(zero.low + zero.high) / 2.0 for zero in zeros]


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
    powers = sorted({power for power, _ in factor.to_dict()})  # of s
    yield _of_parameter(factor, powers[-1])
    yield _of_parameter(factor, powers[0])
    even, second = _halves(factor)
    if even and second:
        yield _of_parameter(even.resultant(second, "s"), 0)


def _halves(factor: Polynomial) -> tuple[Polynomial, Polynomial]:
    """e and o of a polynomial e(s^2) + s o(s^2), as polynomials in s^2 and p.

    Where o is zero, so that each root comes with its negative, the derivative of e stands for it.
    """
    parts: list[dict[tuple[int, int], Any]] = [{}, {}]
    for (power, power_of_p), value in factor.to_dict().items():
        parts[power % 2][power // 2, power_of_p] = value
    even, odd = map(factor.context().from_dict, parts)
    return even, odd or even.derivative("s")


def _of_parameter(polynomial: Polynomial, power: int) -> Polynomial:
    """The coefficient of a power of s, times a number that makes it one of integers."""
    terms = {}  # by the power of p
    for (power_of_s, power_of_p), value in polynomial.to_dict().items():
        if power_of_s == power:
            terms[power_of_p] = value
    coefficients = [terms.get(k, 0) for k in range(max(terms) + 1)]
    return flint.fmpq_poly(coefficients).numer()


def _coefficients_at(polynomial: Polynomial, value: Value) -> list[Value]:
    """The coefficients of the powers of s at a value of the parameter."""
    coefficients = [flint.fmpq(0)] * (polynomial.degrees()[0] + 1)
    for (power, power_of_p), coefficient in polynomial.to_dict().items():
        coefficients[power] += coefficient * value**power_of_p
    return coefficients


def _pieces_at(factor: Polynomial, value: Value) -> list[Piece]:
    """The roots at a value of the parameter, a rational number, each a piece of its own."""
    coefficients = flint.fmpq_poly(_coefficients_at(factor, value))
    with flint.ctx.workprec(PRECISION):
        return pieces_of_polynomial(coefficients.numer(), flint.arb(1))


def _growing_number(factor: Polynomial, value: Value) -> int:
    """How many roots grow at a value of the parameter, a rational number."""
    return sum(piece.side == "grows" for piece in _pieces_at(factor, value))
