"""Invariants of a matrix of three rows, whose signs decide on undamped systems without eigenvalues.

Maps judge arrays of systems by them. With A = M^-1 K and s = -lambda^2 the characteristic
polynomial is s^3 - a s^2 + b s - c. Invariants are built from the diagonal of A and from products
around closed cycles of its entries (a12 a21, a12 a23 a31, ...), which do not change when
coordinates are rescaled. The discriminant is taken from the deviatoric part of A, so that
eigenvalues which lie close together do not cancel; where one of them is far greater than the others
it is split off first, or its rounding would hide what the others do. What is smaller than the bound
of its own rounding, of the entries of A included, counts as zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.linear.matrices import ENTRY_ROUNDING, EPS, Values, divisor


class Bounded(NamedTuple):
    """A number (or array) and a bound of its rounding error."""

    value: Values
    bound: Values


class Cubic(NamedTuple):
    """Invariants of A (3, 3): the coefficients of its cubic and the discriminant."""

    a: Bounded  # trace
    b: Bounded  # sum of the principal minors
    c: Bounded  # determinant
    discriminant: Bounded  # negative with a complex pair
    unresolved: Values  # True where a great root and rounding together hide what the others do


class _Cycles(NamedTuple):
    """Products around closed cycles of the off-diagonal entries of A (3, 3), or of their sizes.

    p12, p13, p23: a12 a21 and the like; p: their sum; t: a12 a23 a31 + a13 a21 a32.
    """

    p12: Values
    p13: Values
    p23: Values
    p: Values
    t: Values

    @staticmethod
    def of(e: Sequence[Values]) -> _Cycles:
        """The cycles of the nine entries of A, row by row."""
        p12 = e[1] * e[3]
        p13 = e[2] * e[6]
        p23 = e[5] * e[7]
        return _Cycles(p12, p13, p23, p12 + p13 + p23, t=e[1] * e[5] * e[6] + e[2] * e[3] * e[7])

    def determinant(self, x: Sequence[Values]) -> Values:
        """Of a matrix with these products and a diagonal x."""
        return x[0] * (x[1] * x[2] - self.p23) - x[1] * self.p13 - x[2] * self.p12 + self.t

    def terms(self, x: Sequence[Values]) -> Values:
        """The sum of the sizes of the terms of the determinant."""
        return x[0] * (x[1] * x[2] + self.p23) + x[1] * self.p13 + x[2] * self.p12 + self.t


def _pair_products(x: Values, y: Values, z: Values) -> Values:
    """x y + x z + y z."""
    return x * y + (x + y) * z


def share_of_largest(errors: NDArray, sizes: NDArray) -> NDArray:
    """The largest error of nine entries (9, ...) over their largest size, or `ENTRY_ROUNDING`."""
    largest = sizes.max(axis=0)
    share = errors.max(axis=0) / divisor(largest)
    return np.maximum(share, ENTRY_ROUNDING)


def invariants(entries: Sequence[Values], errors: Sequence[Values] | None = None) -> Cubic:
    """The coefficients and the discriminant of the characteristic polynomial of A (3, 3).

    Parameters
    ----------
    entries : sequence of nine numbers, or arrays of one shape
        A, row by row, each with a relative error of `ENTRY_ROUNDING`.
    errors : sequence of nine numbers, or arrays of one shape, optional
        How far each entry may be off, if that is more than rounding.
    """
    sizes = [np.abs(x) for x in entries]
    relative_error: Values = ENTRY_ROUNDING
    if errors is not None:
        # all nine entries get one relative error: a small entry with a great error counts as a
        # larger entry
        relative_error = share_of_largest(np.array(errors), np.array(sizes))
        sizes = [
            np.maximum(size, error / relative_error)
            for size, error in zip(sizes, errors, strict=True)
        ]
    diagonal = entries[::4]
    diagonal_sizes = sizes[::4]
    cycles = _Cycles.of(entries)  # p: the sum a12 a21 + a13 a31 + a23 a32
    cycle_sizes = _Cycles.of(sizes)
    # a product of k entries has a relative error of k units: a unit is the error of an entry, and
    # as much for the rounding of products and sums
    unit = 2 * relative_error
    a = Bounded(sum(diagonal), unit * sum(diagonal_sizes))
    b = Bounded(
        _pair_products(*diagonal) - cycles.p,
        2 * unit * (_pair_products(*diagonal_sizes) + cycle_sizes.p),
    )
    c = Bounded(cycles.determinant(diagonal), 3 * unit * cycle_sizes.terms(diagonal_sizes))
    discriminant = _discriminant(diagonal, a, cycles, cycle_sizes, unit)
    unresolved = ~np.isfinite(discriminant.value + discriminant.bound)
    share = 0.03  # of the greatest root: others up to this are far from it
    square = a.value * a.value
    # with a far root s, a is about s, b about s times the sum of the others, and c s times their
    # product
    has_far_root = np.abs(b.value) < share * square
    has_far_root &= np.abs(c.value) < share**2 * np.abs(square * a.value)
    if np.any(has_far_root):
        split, is_known = _split_discriminant(a, b, c)
        # without an error c is exactly 0, and the other roots, 0 and t, are real in any case
        unresolved = np.where(has_far_root, (c.bound > 0.0) & ~is_known, unresolved)
        discriminant = Bounded(
            np.where(has_far_root, split.value, discriminant.value),
            np.where(has_far_root, split.bound, discriminant.bound),
        )
    return Cubic(a, b, c, discriminant, unresolved)


def _discriminant(
    diagonal: Sequence[Values],
    trace: Bounded,
    cycles: _Cycles,
    cycle_sizes: _Cycles,
    unit: Values,
) -> Bounded:
    """The discriminant 4 J2^3 - 27 J3^2 from the invariants J2 and J3 of the deviator of A.

    In the deviator, A less its mean diagonal, eigenvalues that lie close together do not cancel.
    The bound follows from those of J2 and J3 to all orders: of x^3 with an error e it is
    e (3 x^2 + 3 x e + e^2), of x^2 it is e (2 x + e).

    Parameters
    ----------
    diagonal : sequence of three numbers or arrays
        That of A.
    trace : Bounded
        Its sum.
    cycles, cycle_sizes : _Cycles
        Those of the entries of A and of their sizes.
    unit : number or array
        The relative error of a term for each of its factors.
    """
    mean = trace.value / 3
    # this bounds the error of an entry x - mean of the deviator: x is off by at most half of it,
    # and the mean by a third
    error = trace.bound
    e = [x - mean for x in diagonal]  # the diagonal of the deviator
    E = [np.abs(x) for x in e]
    J2 = 0.5 * (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]) + cycles.p
    J3 = cycles.determinant(e)
    sum_E = E[0] + E[1] + E[2]
    squares = 0.5 * (E[0] * E[0] + E[1] * E[1] + E[2] * E[2])
    # where the three e are off by `error` each, sum e^2 / 2 is off by error (sum E + 3/2 error) at
    # most; the rounding of terms with k factors adds k units of their sizes
    error_J2 = error * (sum_E + 1.5 * error) + 2 * unit * (squares + cycle_sizes.p)
    products = _pair_products(*E) + cycle_sizes.p
    # the determinant is off by error times its minors, and by the powers error^2 sum E and error^3
    error_J3 = error * (products + error * (sum_E + error)) + 3 * unit * cycle_sizes.terms(E)
    J2_squared = J2 * J2
    abs_J2 = np.abs(J2)
    bound = (
        4 * error_J2 * (3 * J2_squared + error_J2 * (3 * abs_J2 + error_J2))
        + 27 * error_J3 * (2 * np.abs(J3) + error_J3)
        + 4 * EPS * (4 * abs_J2 * J2_squared + 27 * J3 * J3)
    )
    return Bounded(4 * J2_squared * J2 - 27 * J3 * J3, bound)


def _split_discriminant(a: Bounded, b: Bounded, c: Bounded) -> tuple[Bounded, Values]:
    """The discriminant of a cubic whose greatest root s is real and far from the others.

    The others' sum is t = (b - c/s)/s and their product d = c/s, so that it is
    (t^2 - 4 d) (s^2 - s t + d)^2: nothing of the size of s cancels.

    Parameters
    ----------
    a, b, c : Bounded
        Of s^3 - a s^2 + b s - c.

    Returns
    -------
    discriminant : Bounded
    is_known : bool or array of bool
        Whether it is known to 1e-9 of its terms.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        s = a.value
        for _ in range(4):  # Newton's steps; the start is off by a few per cent
            residual = ((s - a.value) * s + b.value) * s - c.value
            s = s - residual / ((3 * s - 2 * a.value) * s + b.value)
        size = np.abs(s)
        # of s = a - b / s + c / s^2
        relative_error = (a.bound + (b.bound + c.bound / size) / size) / size + 4 * EPS
        t = (b.value - c.value / s) / s  # the others' sum
        d = c.value / s  # and product
        error_t = (b.bound + c.bound / size) / size + np.abs(t) * relative_error
        error_d = c.bound / size + np.abs(d) * relative_error
        terms = t * t + 4 * np.abs(d)
        distances = ((s - t) * s + d) ** 2  # of s to both others, squared
        value = (t * t - 4 * d) * distances
        error = 2 * np.abs(t) * error_t + error_t * error_t + 4 * error_d + 4 * EPS * terms
        # `distances` are about s^4, with four times the relative error of s: twice that is allowed
        bound = error * distances + 8 * relative_error * np.abs(value)
        return Bounded(value, bound), bound <= 1e-9 * terms * distances
