"""Exact roots: doubles are rational numbers, so that det P is a polynomial with integer
coefficients.

It comes from the characteristic polynomial of an integer matrix where M is diagonal, else from
determinants at integers by Newton's interpolation. Its squarefree parts give multiplicities; their
roots are isolated in balls, real ones as such. With p(s) = e(s^2) + s o(s^2) the roots of
gcd(e, o) are the squares of the roots that come with their negative, among them all on the
imaginary axis; what is left has none there, so that the sign of each real part shows at some
precision. No tolerance decides anything. Needs python-flint.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from squeal.proof.balls import Quadratic
from squeal.proof.pieces import INFINITE, Failure, Piece, Side

try:
    import flint
except ImportError:  # an extra
    flint = None

WORK = 2e7  # rows^3 times bits of an entry: some two seconds
SHORT = 200  # bits of a common denominator, up to which the characteristic polynomial is faster
PRECISION = 96  # bits, at first
MISSING = "the exact means need python-flint, which is not installed"
LARGE = "a component has too many rows, or entries of too many decades, for the exact means"
SINGULAR = "M, C and K are singular together, so that every number is a root"
Integers = list[list[int]]
Polynomial = Any
"""A `flint.fmpz_poly`."""
Ball = Any
"""A `flint.arb` or `flint.acb`."""


def exact_roots(block: Quadratic) -> list[Piece] | Failure:
    """The roots of the midpoints of one component, each a piece of its own."""
    if not block.is_finite:
        return Failure(INFINITE)
    if flint is None:
        return Failure(MISSING)
    if block.n**3 > WORK:
        return Failure(LARGE)
    M, C, K, turn = _integers(block)
    if block.n**3 * _bits(M, C, K) > WORK:
        return Failure(LARGE)
    polynomial, unit = _undamped(M, K) if block.is_undamped else _damped(M, C, K)
    if polynomial.degree() < 0:
        return Failure(SINGULAR)
    zeros = next(k for k, v in enumerate(polynomial.coeffs()) if v != 0)
    polynomial = polynomial.right_shift(zeros)
    with flint.ctx.workprec(PRECISION):
        scale = flint.arb(2) ** turn / unit
        if block.is_undamped:
            zeros = 2 * zeros
            # the roots are those of -lambda^2
            pieces = _of_squares(polynomial, -scale * flint.arb(2) ** turn)
        else:
            parts = polynomial.coeffs()
            even, odd = flint.fmpz_poly(parts[::2]), flint.fmpz_poly(parts[1::2])
            common = even.gcd(odd)
            pieces = _of_squares(common, scale**2)
            pieces += _off_axis(polynomial // common(flint.fmpz_poly([0, 0, 1])), scale)
        nothing = flint.arb(0)
        return pieces + [_piece(nothing, nothing, "axis", True)] * zeros


def _integers(block: Quadratic) -> tuple[Integers, Integers, Integers, int]:
    """Integer matrices M, C, K in another unit of time, 2^-turn, rows times powers of two."""
    sizes = [float(np.abs(X.mid).max()) for X in block.parts]
    turn = 0
    if sizes[0] and sizes[2]:
        turn = round((math.log2(sizes[2]) - math.log2(sizes[0])) / 2)
    numbers, exponents = [], []
    for X, shift in zip(block.parts, (turn, 0, -turn), strict=True):
        shares, powers = np.frexp(X.mid)
        whole = np.ldexp(shares, 53).astype(np.int64)
        trailing = np.log2(np.where(whole == 0, 1, whole & -whole)).astype(int)
        numbers.append(whole >> trailing)
        exponents.append(powers.astype(int) - 53 + trailing + shift)
    used = np.array(numbers) != 0
    lowest = np.where(used, np.array(exponents), np.iinfo(np.int64).max).min(axis=(0, 2))
    rows = range(block.n)
    matrices = []
    for whole, powers in zip(numbers, exponents, strict=True):
        matrix = []
        for i in rows:
            entries = zip(whole[i].tolist(), powers[i].tolist(), strict=True)
            matrix.append([v << (e - int(lowest[i])) if v else 0 for v, e in entries])
        matrices.append(matrix)
    return matrices[0], matrices[1], matrices[2], turn


def _bits(*matrices: Integers) -> int:
    """The length of the longest entry."""
    return max(abs(v).bit_length() for X in matrices for row in X for v in row)


def _common_multiple(M: Integers) -> int:
    """The least common multiple of a regular diagonal, 0 for any other matrix or a long one."""
    n = len(M)
    if any(M[i][j] for i in range(n) for j in range(n) if i != j):
        return 0
    multiple = math.lcm(*(M[i][i] for i in range(n)))
    return multiple if multiple.bit_length() <= SHORT else 0


def _undamped(M: Integers, K: Integers) -> tuple[Polynomial, int]:
    """A multiple of det(K - s M), and the unit in which its roots are counted."""
    n = len(M)
    multiple = _common_multiple(M)
    if multiple:
        rows = [[v * (multiple // M[i][i]) for v in K[i]] for i in range(n)]
        return flint.fmpz_mat(rows).charpoly(), multiple
    mass, stiffness = flint.fmpz_mat(M), flint.fmpz_mat(K)
    return _interpolated([(stiffness - s * mass).det() for s in range(n + 1)]), 1


def _damped(M: Integers, C: Integers, K: Integers) -> tuple[Polynomial, int]:
    """A multiple of det(s^2 M + s C + K), and the unit in which its roots are counted."""
    n = len(M)
    multiple = _common_multiple(M)
    if multiple:
        rows = [[int(j == n + i) for j in range(2 * n)] for i in range(n)]
        for i in range(n):
            factor = -(multiple // M[i][i])
            rows.append([v * factor * multiple for v in K[i]] + [v * factor for v in C[i]])
        return flint.fmpz_mat(rows).charpoly(), multiple
    mass, damping, stiffness = flint.fmpz_mat(M), flint.fmpz_mat(C), flint.fmpz_mat(K)
    values = [(s * s * mass + s * damping + stiffness).det() for s in range(2 * n + 1)]
    return _interpolated(values), 1


def _interpolated(values: list[Any]) -> Polynomial:
    """The polynomial with integer coefficients that has values at 0, 1, 2, ..."""
    rest = list(values)
    for order in range(1, len(rest)):
        # divided differences at integers are integers
        for k in range(len(rest) - 1, order - 1, -1):
            rest[k] = (rest[k] - rest[k - 1]) // order
    polynomial = flint.fmpz_poly([0])
    for node in range(len(rest) - 1, -1, -1):
        polynomial = polynomial * flint.fmpz_poly([-node, 1]) + rest[node]
    return polynomial


def _of_squares(polynomial: Polynomial, scale: Ball) -> list[Piece]:
    """Pieces of both roots lambda of each lambda^2 = scale * root, none of which is zero."""
    if polynomial.degree() < 1:
        return []
    pieces = []
    pair: list[tuple[Ball, Ball, Side]]
    for root, multiplicity in polynomial.complex_roots():
        square = flint.acb(root) * scale
        is_real = square.imag == 0
        if is_real and square.real < 0:
            size = (-square.real).sqrt()
            pair = [(size * 0, size, "axis"), (size * 0, -size, "axis")]
            real = False
        elif is_real:
            size = square.real.sqrt()
            pair = [(size, size * 0, "grows"), (-size, size * 0, "decays")]
            real = True
        else:
            value = square.sqrt()
            pair = [(value.real, value.imag, "grows"), (-value.real, -value.imag, "decays")]
            real = False
        for x, y, side in pair:
            pieces += [_piece(x, y, side, real)] * multiplicity
    return pieces


def _off_axis(polynomial: Polynomial, scale: Ball) -> list[Piece]:
    """Pieces of the roots lambda = scale * root, scale > 0, of a polynomial without imaginary
    roots."""
    if polynomial.degree() < 1:
        return []
    precision = PRECISION
    roots: list[tuple[Ball, int]] = []
    while not roots:
        with flint.ctx.workprec(precision):
            found = polynomial.complex_roots()
            if all(root.real > 0 or root.real < 0 for root, _ in found):
                roots = found
        precision *= 2
    pieces = []
    for root, multiplicity in roots:
        value = flint.acb(root) * scale
        side: Side = "grows" if root.real > 0 else "decays"
        is_real = value.imag == 0  # exactly: FLINT gives a real root no imaginary part
        pieces += [_piece(value.real, value.imag, side, is_real)] * multiplicity
    return pieces


def _piece(x: Ball, y: Ball, side: Side, real: bool) -> Piece:
    """A piece of one root in a ball."""
    centre = complex(float(x.mid()), float(y.mid()))
    misses = [float((v - at).abs_upper()) for v, at in ((x, centre.real), (y, centre.imag))]
    radius = np.nextafter(math.hypot(*misses) * (1.0 + 1e-15), np.inf)
    low, high = 0.0, 0.0
    if side != "axis":
        low = float(np.nextafter(float(x.lower()), -np.inf))
        high = float(np.nextafter(float(x.upper()), np.inf))
    return Piece(np.array([centre]), np.array([radius]), low, high, side, real, "exact")
