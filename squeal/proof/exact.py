"""Exact roots: doubles are rational numbers, so that det P is a polynomial with integer
coefficients.

It comes from determinants at integers by Newton's interpolation. Its squarefree parts give
multiplicities; their roots are isolated in balls, real ones as such. With p(s) = e(s^2) + s o(s^2)
the roots of gcd(e, o) are the squares of the roots that come with their negative, among them all on
the imaginary axis; what is left has none there, so that the sign of each real part shows at some
precision. No tolerance decides anything. Needs python-flint.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from squeal.proof.balls import Ball, Quadratic, high_end, low_end
from squeal.proof.pieces import INFINITE, Failure, Piece, Side

try:
    import flint

    SQUARE = flint.fmpz_poly([0, 0, 1])  # x^2, to be put into a polynomial
except ImportError:  # an extra
    flint = None

WORK = 2e7
"""Most rows^3 times bits of an entry, which take some two seconds; beyond, nothing is tried."""
PRECISION = 96
"""Bits of the balls, doubled until they show the side of each root."""
MISSING = "the exact means need python-flint, which is not installed"
LARGE = "a component has too many rows, or entries of too many decades, for the exact means"
SINGULAR = "M, C and K are singular together, so that every number is a root"
Integers = list[list[int]]
Integer = Any
"""A `flint.fmpz`."""
Polynomial = Any
"""A `flint.fmpz_poly`."""


def exact_roots(block: Quadratic) -> list[Piece] | Failure:
    """The roots of the midpoints of one component, each a piece of its own.

    Zeros are split off as a power of the variable. The rest has two parts: roots that come with
    their negative, known by their squares, and roots off the imaginary axis.
    """
    if not block.is_finite:
        return Failure(INFINITE)
    if flint is None:
        return Failure(MISSING)
    if block.n**3 > WORK:  # before the integers are made, of which each has a bit at least
        return Failure(LARGE)
    M, C, K, time_exponent = _integers(block)
    if block.n**3 * _bits(M, C, K) > WORK:
        return Failure(LARGE)
    polynomial = _determinant(M, C, K)
    if polynomial.degree() < 0:
        return Failure(SINGULAR)
    with flint.ctx.workprec(PRECISION):
        # the roots of the polynomial are lambda / 2^time_exponent, lambda in rad/s
        return pieces_of_polynomial(polynomial, flint.arb(2) ** time_exponent)


def pieces_of_polynomial(polynomial: Polynomial, scale: Ball) -> list[Piece]:
    """Pieces of lambda = scale * root, scale > 0, of a polynomial other than zero.

    The polynomial p(r) = even(r^2) + r odd(r^2) has r and -r as roots where even and odd vanish.
    """
    zeros = 0  # how many roots are zero
    while polynomial[zeros] == 0:
        zeros += 1
    coefficients = polynomial.coeffs()[zeros:]
    even = flint.fmpz_poly(coefficients[::2])
    odd = flint.fmpz_poly(coefficients[1::2])
    of_opposite_roots = even.gcd(odd)
    others = polynomial.right_shift(zeros) // of_opposite_roots(SQUARE)
    pieces = _of_squares(of_opposite_roots, scale**2) + _off_axis(others, scale)
    zero = flint.arb(0)
    return pieces + [_piece(zero, zero, "axis", real=True)] * zeros


def _integers(block: Quadratic) -> tuple[Integers, Integers, Integers, int]:
    """Integer matrices M, C, K, and an exponent: their roots times 2^exponent are those in rad/s.

    Each entry is an odd integer times a power of two. The change of the unit of time shifts the
    power. Each row of [M, C, K] is then multiplied by the power of two that makes all its entries
    integers, one of them odd; the roots stay.
    """
    largest_mass = float(np.abs(block.M.mid).max())
    largest_stiffness = float(np.abs(block.K.mid).max())
    time_exponent = 0  # of the unit of time that makes M and K about as large
    if largest_mass > 0.0 and largest_stiffness > 0.0:
        time_exponent = round((math.log2(largest_stiffness) - math.log2(largest_mass)) / 2)
    odd_numbers = []
    exponents = []
    # in units of the rate 2^time_exponent: M rate^2, C rate and K, all divided by the rate
    for X, shift in zip(block.parts, (time_exponent, 0, -time_exponent), strict=True):
        fractions, powers = np.frexp(X.mid)
        whole = np.ldexp(fractions, 53).astype(np.int64)
        lowest_bit = np.where(whole == 0, 1, whole & -whole)  # in two's complement, a power of 2
        trailing_zeros = np.log2(lowest_bit).astype(int)
        odd_numbers.append(whole >> trailing_zeros)
        exponents.append(powers.astype(int) - 53 + trailing_zeros + shift)
    is_used = np.array(odd_numbers) != 0  # (3, n, n), as the exponents
    unused = np.iinfo(np.int64).max
    row_exponents = np.where(is_used, np.array(exponents), unused).min(axis=(0, 2))
    matrices = []
    for odd, powers in zip(odd_numbers, exponents, strict=True):
        shifts = np.where(odd != 0, powers - row_exponents[:, None], 0)
        # as objects the integers are Python's, which have no bound
        matrices.append((odd.astype(object) << shifts.astype(object)).tolist())
    M, C, K = matrices
    return M, C, K, time_exponent


def _bits(*matrices: Integers) -> int:
    """The number of bits of the longest entry."""
    longest = 0
    for X in matrices:
        for row in X:
            longest = max(longest, *[v.bit_length() for v in row])
    return longest


def _determinant(M: Integers, C: Integers, K: Integers) -> Polynomial:
    """det(r^2 M + r C + K)."""
    mass, damping, stiffness = map(flint.fmpz_mat, (M, C, K))
    if not damping.rank():  # a polynomial in r^2, of half the degree
        return _interpolated(lambda x: (x * mass + stiffness).det(), len(M))(SQUARE)
    return _interpolated(lambda r: (r * r * mass + r * damping + stiffness).det(), 2 * len(M))


def _interpolated(value: Callable[[int], Integer], degree: int) -> Polynomial:
    """The polynomial with integer coefficients from its values at 0, ..., degree (Newton)."""
    differences = list(map(value, range(degree + 1)))
    for order in range(1, len(differences)):
        # divided differences at integers are integers
        for k in range(len(differences) - 1, order - 1, -1):
            differences[k] = (differences[k] - differences[k - 1]) // order
    polynomial = flint.fmpz_poly([0])
    for node in range(len(differences) - 1, -1, -1):
        polynomial = polynomial * flint.fmpz_poly([-node, 1]) + differences[node]
    return polynomial


def _of_squares(polynomial: Polynomial, scale: Ball) -> list[Piece]:
    """Pieces of both roots lambda of each lambda^2 = scale * root.

    root: of a polynomial that has none at zero; scale: a ball of real numbers, rad^2/s^2.
    """
    pieces = []
    for root, multiplicity in polynomial.complex_roots():
        square = flint.acb(root) * scale  # lambda^2
        is_real = square.imag == 0  # exactly: FLINT gives a real root no imaginary part
        if is_real and square.real < 0:
            size = (-square.real).sqrt()
            # lambda = +-i size: the real part is zero, and no root is real
            pair = [_piece(size * 0, size, "axis", False), _piece(size * 0, -size, "axis", False)]
        else:
            # the principal root, whose real part is positive, exactly real if its square is
            value = square.sqrt()
            growing = _piece(value.real, value.imag, "grows", is_real)
            pair = [growing, _piece(-value.real, -value.imag, "decays", is_real)]
        for piece in pair:
            pieces += [piece] * multiplicity
    return pieces


def _off_axis(polynomial: Polynomial, scale: Ball) -> list[Piece]:
    """Pieces of lambda = scale * root, scale > 0, of a polynomial without imaginary roots.

    The precision is doubled until no ball touches the imaginary axis.
    """
    precision = PRECISION
    while True:
        with flint.ctx.workprec(precision):
            roots = polynomial.complex_roots()
            if not any(root.real.contains(0) for root, _ in roots):
                break
        precision *= 2
    pieces = []
    for root, multiplicity in roots:
        value = flint.acb(root) * scale
        side: Side = "grows" if root.real > 0 else "decays"
        is_real = value.imag == 0  # exactly: FLINT gives a real root no imaginary part
        pieces += [_piece(value.real, value.imag, side, is_real)] * multiplicity
    return pieces


def _piece(x: Ball, y: Ball, side: Side, real: bool) -> Piece:
    """The piece of one root x + i y, known as balls, in a disc whose numbers are doubles."""
    centre = complex(float(x.mid()), float(y.mid()))
    x_error = float((x - centre.real).abs_upper())
    y_error = float((y - centre.imag).abs_upper())
    radius = np.nextafter(math.hypot(x_error, y_error) * (1.0 + 1e-15), np.inf)
    low = 0.0
    high = 0.0
    if side != "axis":
        low = low_end(x)
        high = high_end(x)
    return Piece(np.array([centre]), np.array([radius]), low, high, side, real, "exact")
