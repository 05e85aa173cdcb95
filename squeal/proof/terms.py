"""M, C and K as sums of matrices times functions of one parameter, their entries in balls.

`Terms` are the systems that a proof over a range of the parameter judges. They are divided into
strong components, and the coordinates without mass are separated, by exact rational numbers. Over
an interval of the parameter each matrix is a first-order expansion with a bound of the remainder.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.proof import AS_GIVEN
from squeal.proof.balls import (
    Balls,
    between,
    divisor,
    doubles,
    half_widths,
    high_end,
    in_doubles,
    middle_and_radius,
    taylor_coefficients,
    upper,
)
from squeal.proof.enclosure import components
from squeal.proof.segments import Expansion

try:
    import flint
except ImportError:  # an extra
    flint = None

Factor = Callable[[Any], Any]
"""A function of the parameter by + - * / and **; it is given a ball of numbers (`flint.arb`), or a
Taylor series of balls (`flint.arb_series`)."""
Rational = Any
"""A rational number or a matrix of such, `flint.fmpq` or `flint.fmpq_mat`."""


@dataclass(frozen=True, eq=False)
class Term:
    """A matrix (n, n) and the factor that multiplies it; None for one.

    `errors` (n, n) are how far each entry may be off beyond what `data` of `Terms` says.
    """

    matrix: ArrayLike
    factor: Factor | None = None
    errors: ArrayLike | None = None


@dataclass(frozen=True, eq=False)
class Terms:
    """M, C and K over a parameter, each a sum of terms; C may have none.

    `data` says how the entries of each matrix are known (see `balls.half_widths`). `balls` holds
    the matrices of the terms by the names "M", "C" and "K". If left out they are made of the terms;
    of a component they are some rows and columns, in other coordinates other matrices. Needs
    python-flint.

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
    balls: Mapping[str, Sequence[Balls]] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        if flint is None:
            raise ImportError("ranges need python-flint", name="flint")
        if self.balls:
            return
        balls: dict[str, list[Balls]] = {"M": [], "C": [], "K": []}
        for name, matrices in balls.items():
            for term in getattr(self, name):
                X = _real_if_possible(doubles(np.asarray(term.matrix)))
                entries = Balls(X, half_widths(X, self.data))
                if term.errors is not None:
                    entries = entries.widened(np.asarray(term.errors))
                matrices.append(entries)
        object.__setattr__(self, "balls", balls)

    @property
    def n(self) -> int:
        """Number of rows."""
        return len(self.balls["M"][0].mid)

    @property
    def matrices(self) -> list[Balls]:
        """The matrices of all terms of M, of C and of K."""
        return list(itertools.chain(*self.balls.values()))

    def mapped(self, change: Callable[[Balls], Balls]) -> Terms:
        """The terms with each of their matrices changed."""
        balls: dict[str, list[Balls]] = {}
        for name, matrices in self.balls.items():
            balls[name] = list(map(change, matrices))
        return replace(self, balls=balls)

    @property
    def is_real(self) -> bool:
        """True if no entry is complex."""
        return not any(np.iscomplexobj(X.mid) for X in self.matrices)

    @property
    def is_undamped(self) -> bool:
        """True if C is zero at each value."""
        return all(X.is_zero for X in self.balls["C"])

    @property
    def is_gyroscopic(self) -> bool:
        """True if M and K are symmetric and C is skew at each value."""
        M_and_K = (*self.balls["M"], *self.balls["K"])
        is_symmetric = all(np.array_equal(X.mid, X.mid.T) for X in M_and_K)
        return is_symmetric and all(np.array_equal(X.mid, -X.mid.T) for X in self.balls["C"])

    def components(self) -> list[Terms]:
        """The terms of each strong component, whose roots are those of the system together."""
        terms = []
        for rows in components(self.matrices):
            terms.append(self.mapped(functools.partial(_block_of, rows)))
        return terms

    def separated(self) -> Terms:
        """The terms in coordinates of which those without mass are separate, in balanced units.

        Each X of M, C and K becomes left' X right, whose last rows and columns, of the null vectors
        of a constant and exactly singular M, are those without mass. The null vectors are rational
        numbers, so that the new entries are exact and the terms are taken as given. If C is one
        constant term, motions without mass are separated further, by the null vectors of their
        damping. The terms as they are where M is regular, varies, is complex or is known to fewer
        than all digits of its doubles.
        """
        mass, *others = self.M
        if others or mass.factor is not None or not self.is_real:
            return self
        if not all(X.has_all_digits for X in self.matrices):
            return self
        M = _rational(self.balls["M"][0].mid)
        right, rank = _null_vectors_last(M)
        if rank == self.n:
            return self
        left = _null_vectors_last(M.transpose())[0]
        if len(self.C) == 1 and self.C[0].factor is None:
            # of the motions without mass, damping has a matrix of its own, in the last rows and
            # columns: its null vectors, without mass and damping, become the last coordinates
            damping = left.transpose() * _rational(self.balls["C"][0].mid) * right
            of_massless = flint.fmpq_mat(np.array(damping.tolist())[rank:, rank:].tolist())
            right *= _below_identity(rank, _null_vectors_last(of_massless)[0])
            left *= _below_identity(rank, _null_vectors_last(of_massless.transpose())[0])
        separate = self
        nonzeros = np.count_nonzero(right.entries() + left.entries())
        if nonzeros > 2 * self.n:  # else both only sort coordinates: they are separate already

            def in_coordinates(X: Balls) -> Balls:
                product = left.transpose() * _rational(X.mid) * right
                return in_doubles(np.vectorize(flint.arb)(product.tolist()))

            separate = replace(self.mapped(in_coordinates), data=AS_GIVEN)
        return separate._balanced()

    def _balanced(self) -> Terms:
        """The terms in units of coordinates, powers of 2, in which largest entries are alike."""
        sizes = np.zeros((self.n, self.n))
        for X in self.matrices:
            bound = X.bound()
            sizes = np.maximum(sizes, bound / max(bound.max(), 1e-300))
        units = np.zeros(self.n, dtype=int)
        for _ in range(4):
            scaled = np.ldexp(sizes, units[:, None] + units)
            largest = np.sqrt(scaled.max(axis=0)) * np.sqrt(scaled.max(axis=1))
            units = units - np.rint(np.log2(divisor(largest)) / 2).astype(int)
        return self.mapped(lambda X: X.scaled(units[:, None] + units))

    def expanded(self, low: float, high: float) -> tuple[Expansion, Expansion, Expansion]:
        """M, C and K at all values p of the parameter from low to high, about the middle.

        To first order in d = p - middle, with a bound of what is beyond it. Raises ValueError where
        a factor divides by what may be zero.
        """
        # the parameter p = middle + d as a series in d to first order; and a series to second
        # order about a ball of all values between, for the remainder
        middle, _ = middle_and_half(low, high)
        about_middle = flint.arb_series([flint.arb(middle), 1], prec=2)
        about_all = flint.arb_series([between(low, high), 1], prec=3)
        M, C, K = (self._expansion_of_sum(name, about_middle, about_all) for name in "MCK")
        return M, C, K

    def _expansion_of_sum(self, name: str, about_middle: Any, about_all: Any) -> Expansion:
        """M, C or K (the `name`), the sum of its terms; entries that are zero in all of them stay
        zero.

        `about_middle` and `about_all` are Taylor series of the parameter: about the middle of an
        interval to first order, and about all values in it at once to the second. The coefficient
        f''/2 of a factor f of the latter times d^2 bounds what f has beyond first order (Lagrange's
        remainder).
        """
        zeros = np.zeros((self.n, self.n))
        values: list[Balls] = []
        slopes: list[Balls] = []
        remainder = zeros
        matrices = self.balls[name]
        for term, X in zip(getattr(self, name), matrices, strict=True):
            if term.factor is None:
                values.append(X)
                continue
            factor, factor_slope = taylor_coefficients(term.factor(about_middle), 2)
            _, _, half_curvature = taylor_coefficients(term.factor(about_all), 3)
            values.append(_multiplied(X, factor))
            slopes.append(_multiplied(X, factor_slope))
            remainder = remainder + X.bound() * high_end(abs(half_curvature))
        # the rounding of sums would make a ball of zeros, too
        is_used = np.any([X.pattern for X in matrices], axis=0)

        def sum_of(balls: list[Balls]) -> Balls:
            if not balls:
                return Balls.exact(zeros)
            X = functools.reduce(Balls.plus, balls)
            return Balls(X.mid, np.where(is_used, X.rad, 0.0))

        return Expansion(
            value=sum_of(values),
            slope=sum_of(slopes),
            remainder=np.where(is_used, upper(remainder, 2 * len(matrices)), 0.0),
        )


def _rational(X: NDArray) -> Rational:
    """A matrix of doubles as one of rational numbers."""

    def exact(value: float) -> Rational:
        return flint.fmpq(*value.as_integer_ratio())

    return flint.fmpq_mat(*X.shape, list(map(exact, X.ravel().tolist())))


def _null_vectors_last(X: Rational) -> tuple[Rational, int]:
    """A regular Q of rational numbers, and the rank of X (n, n).

    The columns of X Q behind the first `rank` are zero: the last columns of Q are null vectors.
    """
    n = X.ncols()
    reduced, rank = X.rref()
    is_used = np.array(reduced.tolist()) != 0
    pivots = is_used[:rank].argmax(axis=1).tolist()
    free = np.setdiff1d(np.arange(n), pivots).tolist()
    Q = flint.fmpq_mat(n, n)
    for column, unknown in enumerate(pivots + free):
        Q[unknown, column] = 1
    # in row-reduced form an unknown of `free` that is 1 gives each pivot by its column, negated
    for column, unknown in enumerate(free, rank):
        for row, pivot in enumerate(pivots):
            Q[pivot, column] = -reduced[row, unknown]
    return Q, rank


def _below_identity(count: int, Q: Rational) -> Rational:
    """The block diagonal matrix of the identity (count, count) and Q."""
    n = count + Q.ncols()
    larger = flint.fmpq_mat(n, n)
    for i in range(n):
        larger[i, i] = 1
    for i in range(count, n):
        for j in range(count, n):
            larger[i, j] = Q[i - count, j - count]
    return larger


def _real_if_possible(X: NDArray) -> NDArray:
    """The entries as real numbers where no imaginary part is other than zero."""
    return X if X.imag.any() else X.real


def _block_of(rows: NDArray[np.intp], X: Balls) -> Balls:
    """Some rows and columns of X, real if they are."""
    block = X.block(rows)
    return replace(block, mid=_real_if_possible(block.mid))


def middle_and_half(low: float, high: float) -> tuple[float, float]:
    """A double near the middle of two, and how far numbers between them may lie from it at most."""
    if low == high:
        return low, 0.0
    middle = (low + high) / 2.0
    return middle, float(np.nextafter(max(middle - low, high - middle), np.inf))


def _multiplied(X: Balls, factor: Any) -> Balls:
    """Entries times a ball of numbers."""
    middle, radius = middle_and_radius(factor)
    product = X.times(middle)
    return Balls(product.mid, upper(product.rad + np.abs(X.mid) * radius + X.rad * radius, 4))
