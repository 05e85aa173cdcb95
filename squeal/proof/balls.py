"""Matrices of balls: each entry is known up to a radius, and every operation rounds outwards.

A product of n terms, summed in any order, misses the exact one by at most n u / (1 - n u) times
the product of the absolute values, u = eps/2, and by n times the smallest normal number where it
underflows (Higham, Accuracy and Stability of Numerical Algorithms, 3.1 to 3.6). Radii are products
of non-negative numbers, enlarged by the same bound. Nothing relies on the rounding mode.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.proof import AS_GIVEN, HALF_ULP

try:
    import flint
except ImportError:  # an extra
    flint = None

Floats = NDArray[np.float64]
Factors = float | complex | NDArray
"""Real or complex numbers that numpy broadcasts."""
Ball = Any
"""A `flint.arb`."""
EPS = float(np.finfo(float).eps)
TINY = float(np.finfo(float).tiny)


def magnitude(X: Factors) -> Floats:
    """Upper bounds of the absolute values of real or complex entries."""
    sizes = np.abs(X)
    if np.iscomplexobj(X):
        return sizes * (1.0 + 4.0 * EPS)
    return sizes


def divisor(X: Floats) -> Floats:
    """Numbers to divide by: those that are not above 0 become 1."""
    return np.where(X > 0.0, X, 1.0)


def upper(X: Any, terms: int) -> Any:
    """Upper bounds of sums of so many non-negative products, from their computed values X.

    Rounding takes at most EPS / 2 of X for each term, underflow at most TINY. The eight terms more
    stand for the few roundings of the bound itself, and of what X is made of.
    """
    return X * (1.0 + (terms + 8) * EPS) + (terms + 8) * TINY


def row_sums(X: Floats) -> Floats:
    """Upper bounds (n,) of the sums of non-negative rows (n, m)."""
    return upper(X.sum(axis=1), X.shape[1])


@dataclass(frozen=True, eq=False)
class Balls:
    """All matrices within `rad` of `mid`, entry by entry.

    Parameters
    ----------
    mid : ndarray (n, m)
        Midpoints, real or complex.
    rad : ndarray (n, m)
        Radii, at least 0.
    """

    mid: NDArray
    rad: Floats

    @staticmethod
    def exact(X: NDArray) -> Balls:
        """The matrix itself."""
        return Balls(X, np.zeros(X.shape))

    @property
    def is_zero(self) -> bool:
        """True if the matrix of zeros is the only one."""
        return not self.pattern.any()

    @property
    def pattern(self) -> NDArray[np.bool_]:
        """Which entries (n, m) are not zero for certain."""
        return (self.mid != 0.0) | (self.rad != 0.0)

    @property
    def is_exact(self) -> bool:
        """True if there is one matrix only."""
        return not self.rad.any()

    @property
    def has_all_digits(self) -> bool:
        """True if no radius exceeds half a unit in the last place of its midpoint."""
        return not np.any(self.rad > half_widths(self.mid, HALF_ULP))

    @property
    def is_finite(self) -> bool:
        """True if all midpoints and radii are finite."""
        return bool(np.isfinite(self.mid).all() and np.isfinite(self.rad).all())

    def block(self, rows: NDArray[np.intp]) -> Balls:
        """The rows and columns of some indices."""
        index = np.ix_(rows, rows)
        return Balls(self.mid[index], self.rad[index])

    def scaled(self, exponents: int | NDArray[np.intp]) -> Balls:
        """Entries times 2^exponents; what underflows is covered by the radius."""
        mid = _shifted(self.mid, exponents)
        rad = np.ldexp(self.rad, exponents)
        # a midpoint that does not come back has lost digits to underflow
        midpoint_underflows = _shifted(mid, -exponents) != self.mid
        radius_underflows = (self.rad > 0.0) & (rad < TINY)
        return Balls(mid, np.where(midpoint_underflows | radius_underflows, upper(rad, 1), rad))

    def widened(self, errors: Floats) -> Balls:
        """The balls with radii that are larger by errors (n, m); exact entries stay so without."""
        return Balls(self.mid, np.where(errors > 0.0, upper(self.rad + errors, 2), self.rad))

    def plus(self, other: Balls) -> Balls:
        """The sum."""
        mid = self.mid + other.mid
        return Balls(mid, upper(self.rad + other.rad + EPS * magnitude(mid), 2))

    def minus(self, other: Balls) -> Balls:
        """The difference."""
        return self.plus(Balls(-other.mid, other.rad))

    def times(self, factors: Factors) -> Balls:
        """Entries times real or complex numbers, broadcast."""
        mid = self.mid * factors
        rad = self.rad * magnitude(factors) + 4.0 * EPS * magnitude(mid)
        return Balls(mid, upper(rad, 4))

    def __matmul__(self, other: Balls) -> Balls:
        """The products (n, k) of each matrix with each one (m, k) of the other balls."""
        terms = self.mid.shape[1]
        mid = self.mid @ other.mid
        rounding = (terms + 4) * EPS / 2.0  # of the product, as a share of |self| |other|
        if np.iscomplexobj(mid):
            # each part sums 2 n real products, both parts cost a factor sqrt(2): 2 sqrt(2) < 3
            rounding = 3.0 * rounding
        left = magnitude(self.mid)
        right = magnitude(other.mid)
        rad = left @ upper(other.rad + rounding * right, 2)
        if not self.is_exact:
            rad = rad + self.rad @ upper(right + other.rad, 2)
        return Balls(mid, upper(rad, 4 * terms))

    def bound(self) -> Floats:
        """Upper bounds of the absolute values."""
        return upper(magnitude(self.mid) + self.rad, 2)


def _shifted(X: NDArray, exponents: int | NDArray[np.intp]) -> NDArray:
    """Real or complex entries times 2^exponents."""
    if np.iscomplexobj(X):
        return np.ldexp(X.real, exponents) + 1j * np.ldexp(X.imag, exponents)
    return np.ldexp(X, exponents)


def middle_and_radius(ball: Ball) -> tuple[float, float]:
    """A double near the middle of a ball, and how far the numbers of the ball may lie from it."""
    middle = float(ball.mid())
    deviation = ball - middle
    if deviation.is_zero():
        return middle, 0.0
    return middle, float(np.nextafter(float(deviation.abs_upper()), np.inf))


def in_doubles(rows: Sequence[Sequence[Ball]]) -> Balls:
    """A matrix (n, m) of balls of any precision, with midpoints and radii in doubles."""
    entries = np.array([[middle_and_radius(ball) for ball in row] for row in rows])
    return Balls(mid=entries[:, :, 0], rad=entries[:, :, 1])


def between(low: float, high: float) -> Ball:
    """A ball that holds all numbers between two."""
    return flint.arb(low).union(flint.arb(high))


def low_end(ball: Ball) -> float:
    """A double that is no larger than the numbers of a ball, nearly the least."""
    return float(np.nextafter(float(ball.lower()), -np.inf))


def high_end(ball: Ball) -> float:
    """A double that is no smaller than the numbers of a ball, nearly the largest."""
    return float(np.nextafter(float(ball.upper()), np.inf))


def taylor_coefficients(x: Any, count: int) -> list[Ball]:
    """So many coefficients of a series, or of a constant, with zeros where it has fewer."""
    known = x.coeffs() if isinstance(x, flint.arb_series) else [flint.arb(x)]
    return known[:count] + [flint.arb(0)] * (count - len(known))


def half_widths(X: NDArray, data: str) -> Floats:
    """How far the true entries may lie from given ones.

    Parameters
    ----------
    X : ndarray
        Entries; one that is zero is zero in all data.
    data : str
        `as given`, `half an ulp`, or a number of digits such as `10 digits`: half a unit of the
        last of so many significant ones.

    Raises
    ------
    ValueError
        For any other data.
    """
    if np.iscomplexobj(X):
        sums = half_widths(X.real, data) + half_widths(X.imag, data)
        return np.where(sums > 0.0, upper(sums, 1), 0.0)
    if data == AS_GIVEN:
        return np.zeros(X.shape)
    if data == HALF_ULP:
        smallest = 5e-324  # of all doubles: half of it would be rounded to 0
        return np.where(X == 0.0, 0.0, np.spacing(np.abs(X)) / 2.0 + smallest)
    match = re.fullmatch(r"(\d+) digits", data)
    if match is None:
        raise ValueError(f"{data}: is no kind of data; {AS_GIVEN}, {HALF_ULP} or '10 digits' is")
    sizes = np.abs(X)
    # the logarithm of a power of ten may be rounded to just below a whole number, which would make
    # the half width ten times too small; with 1e-9 it is at most too wide, just below the power
    leading_power = np.floor(np.log10(divisor(sizes)) + 1e-9)
    last_power = leading_power - int(match[1]) + 1
    # the double lies half an ulp from the decimal number
    widths = 0.5 * 10.0**last_power + np.spacing(sizes) / 2.0
    # 100 terms: the power of ten may miss by more than one rounding
    return np.where(X == 0.0, 0.0, upper(widths, 100))


def doubles(X: NDArray[Any]) -> NDArray[Any]:
    """Real or complex numbers as doubles of the same value.

    Raises ValueError where one is none: an integer beyond 2^53, or a longer float.
    """
    if X.dtype.kind == "c":
        return doubles(X.real) + 1j * doubles(X.imag)
    floats = X.astype(float)
    if X.dtype.itemsize > 4 and X.dtype != floats.dtype:  # doubles hold all shorter numbers
        finite = np.isfinite(X)
        # NumPy would round both to one type; as objects of Python the numbers are compared exactly
        if not np.array_equal(X[finite].astype(object), floats[finite].astype(object)):
            raise ValueError(f"matrices: an entry of {X.dtype} has more digits than a double")
    return floats


@dataclass(frozen=True, eq=False)
class Quadratic:
    """All systems M q'' + C q' + K q = 0 with matrices in balls (n, n), real or complex.

    Attributes
    ----------
    M, C, K : Balls
        The matrices.
    data : str
        What is assumed of the entries.
    symmetric, skew : bool
        Whether only those with symmetric M and K, and with a skew C, are meant. Midpoints do not
        say so: a term whose factor passes zero leaves no trace in them.
    """

    M: Balls
    C: Balls
    K: Balls
    data: str = AS_GIVEN
    symmetric: bool = False
    skew: bool = False

    @staticmethod
    def of(M: ArrayLike, C: ArrayLike | None, K: ArrayLike, data: str = AS_GIVEN) -> Quadratic:
        """The system of float matrices (n, n), in balls with the `half_widths` of `data`.

        C is None without damping. `symmetric` and `skew` are read off M, C and K if all are real.

        Raises ValueError unless the matrices are square, of one size, of entries that doubles hold.
        """
        mass = np.asarray(M)
        damping = np.zeros(mass.shape) if C is None else np.asarray(C)
        given = [mass, damping, np.asarray(K)]
        for X in given:
            if X.ndim != 2 or X.shape != (len(mass), len(mass)) or X.dtype.kind not in "biufc":
                raise ValueError(f"matrices: shape {X.shape}, {X.dtype}; (n, n) are required")
        balls = []
        for X in given:
            entries = doubles(X)
            with np.errstate(all="ignore"):
                balls.append(Balls(entries, half_widths(entries, data)))
        M_balls, C_balls, K_balls = balls
        M_is_symmetric = np.array_equal(M_balls.mid, M_balls.mid.T)
        is_symmetric = M_is_symmetric and np.array_equal(K_balls.mid, K_balls.mid.T)
        is_skew = np.array_equal(C_balls.mid, -C_balls.mid.T)
        quadratic = Quadratic(M_balls, C_balls, K_balls, data)
        if not quadratic.is_real:
            return quadratic  # roots of complex matrices have no mirror images
        return replace(quadratic, symmetric=is_symmetric, skew=is_skew)

    @property
    def n(self) -> int:
        """Number of rows."""
        return len(self.M.mid)

    @property
    def parts(self) -> tuple[Balls, Balls, Balls]:
        """M, C and K."""
        return self.M, self.C, self.K

    @property
    def is_real(self) -> bool:
        """True if no entry is complex."""
        return not any(np.iscomplexobj(X.mid) for X in self.parts)

    @property
    def is_undamped(self) -> bool:
        """True if C is zero."""
        return self.C.is_zero

    @property
    def is_hamiltonian(self) -> bool:
        """True if with each root its mirror image at the imaginary axis is one.

        So it is without damping, and with gyroscopic forces beside symmetric M and K.
        """
        return self.is_real and (self.is_undamped or (self.symmetric and self.skew))

    def block(self, rows: NDArray[np.intp]) -> Quadratic:
        """The system of some rows and columns."""
        M, C, K = (X.block(rows) for X in self.parts)
        return replace(self, M=M, C=C, K=K)

    @property
    def is_finite(self) -> bool:
        """True if all entries are finite."""
        return all(X.is_finite for X in self.parts)
