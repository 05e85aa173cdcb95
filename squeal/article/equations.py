"""What the article makes of model B3: Eq. (22) as printed, and the conditions (23a, b)."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from squeal.article.records import Record
from squeal.model.pad import Pad


def stiffness(pad: Pad, printed: bool = False, angles: Any = None) -> np.ndarray:
    """K of Eq. (22), shape (3, 3, ...): the two inclined springs about the origin.

    K = k1 a1 a1' + k2 a2 a2', so its rank is at most two. `printed` leaves the k2 term of K33 out,
    as Eq. (22i) does (finding E1).
    """
    a1, a2 = spring_directions(pad, angles)
    K = pad.k1 * np.einsum("i...,j...->ij...", a1, a1)
    K = np.asarray(K + pad.k2 * np.einsum("i...,j...->ij...", a2, a2))
    if printed:
        K[2, 2] = pad.k1 * a1[2] ** 2
    return K


class Bounds(NamedTuple):
    """Friction bounds (23a, b), and whether mu meets them and the conditions that are complete.

    All are about one restricted state, y = theta = delta = 0 in Eq. (21), whose three rows hold two
    unknowns: K11 x = mu R_n, K21 x = R_n - F_n and K31 x = mu h R_n.

    Attributes
    ----------
    bound_23a, bound_23b
        K11/K21 and K31/(h K21), infinite where K21 = 0.
    as_printed
        mu is below both bounds.
    complete
        The complete necessary conditions: each pair of rows has a solution with R_n > 0, and the x
        of all pairs has one sign. For mu > 0 they are mu K21 < K11, K31 > 0 and mu h K21 < K31.
        They become (23a, b) where K21 > 0.
    """

    bound_23a: Any
    bound_23b: Any
    as_printed: Any
    complete: Any


class Entries(NamedTuple):
    """First column of K, entries that are zero to rounding set to zero: N/m, N/m and N."""

    K11: Any
    K21: Any
    K31: Any


def first_column(pad: Pad, angles: Any = None) -> Entries:
    """K11, K21 and K31 of Eq. (22), which multiply x.

    cos(pi/2) leaves some 1e-17, whose sign would decide a condition by chance. K11 is quadratic in
    the cosines of the spring angles, K21 and K31 are linear.
    """
    K11, K21, K31 = stiffness(pad, angles=angles)[:, 0]
    rounding = 8 * np.finfo(float).eps  # of a cosine, with some operations on it
    size = pad.k1 + pad.k2
    return Entries(
        np.where(rounding**2 * size >= K11, 0.0, K11),
        np.where(np.abs(K21) <= rounding * size, 0.0, K21),
        np.where(np.abs(K31) <= rounding * size * (pad.w + pad.h), 0.0, K31),
    )


def bounds(pad: Pad, angles: Any = None) -> Bounds:
    """Eqs. (23a, b) and the complete conditions for the pad's mu.

    Substitution into the three rows decides where an entry vanishes:

    * mu = 0: x = 0 and R_n = F_n satisfy all rows, so that the complete conditions hold.
    * K11 = 0, both springs upright: nothing balances friction in row 1, and they fail.
    * K31 = 0: nothing balances the moment of friction in row 3, and they fail.
    * K21 = 0: R_n = F_n for every mu. Friction has no bound; K11 > 0 and K31 > 0 remain.

    Parameters
    ----------
    pad
        The parameters; its angles count unless others are given.
    angles
        (alpha1, alpha2) in rad, arrays of one shape for a map.
    """
    K11, K21, K31 = first_column(pad, angles)
    mu = pad.mu
    h = pad.h
    with np.errstate(divide="ignore", invalid="ignore"):
        bound_a = np.where(K21 == 0.0, np.inf, K11 / K21)
        bound_b = np.where(K21 == 0.0, np.inf, K31 / (h * K21))
    complete = (K11 > 0.0) & (mu * K21 < K11) & (K31 > 0.0) & (mu * h * K21 < K31)
    if mu == 0.0:
        complete = np.ones_like(complete)
    return Bounds(bound_a, bound_b, (mu < bound_a) & (mu < bound_b), complete)


def mismatch(pad: Pad) -> float:
    """K31/(h K11) - 1, zero where all three rows can hold at once; NaN where K11 = 0."""
    K11, _, K31 = first_column(pad)
    return math.nan if K11 == 0.0 else float(K31 / (pad.h * K11)) - 1.0


def state_sides(pad: Pad, angles: Any) -> tuple[Any, Any]:
    """On which side of K31 = h K11 the angles lie, and whether R_n > 0 there.

    For mu > 0 the restricted state exists on that curve alone, where row 3 is h times row 1, and
    only where R_n = F_n K11/(K11 - mu K21) is positive. Without friction it exists everywhere.

    Returns
    -------
    above, pressed
        K31 > h K11, and mu K21 < K11: truth tables of the shape of the angles.
    """
    K11, K21, K31 = first_column(pad, angles)
    return pad.h * K11 < K31, pad.mu * K21 < K11


class RowPairs(Record):
    """What two pairs of rows of Eq. (21) give for the restricted state of one pad.

    x_12, R_12: displacement (m) and reaction (N) by rows 1 and 2; x_23, R_23: by rows 2 and 3, NaN
    where a pair has no solution. The state exists where both give the same.
    """

    x_12: float
    R_12: float
    x_23: float
    R_23: float


def row_pairs(pad: Pad) -> RowPairs:
    """Solve rows 1 and 2, then 2 and 3, for (x, R_n) with y = theta = delta = 0."""
    K11, K21, K31 = (float(entry) for entry in first_column(pad))
    assert pad.F_n is not None
    x_12, R_12 = _pair(K11, pad.mu, K21, pad.F_n)
    x_23, R_23 = _pair(K31, pad.mu * pad.h, K21, pad.F_n)
    return RowPairs(x_12, R_12, x_23, R_23)


def _pair(entry: float, friction: float, K21: float, F_n: float) -> tuple[float, float]:
    """x and R_n from entry x = friction R_n and K21 x = R_n - F_n."""
    divisor = entry - friction * K21
    if divisor == 0.0:
        return math.nan, math.nan
    return friction * F_n / divisor, entry * F_n / divisor


class Readings(Record):
    """Share of the map where (23a, b) hold as printed, and where the complete conditions do."""

    as_printed: float
    complete: float


@dataclass(frozen=True)
class QuasiStaticMap:
    """Where Eqs. (23a, b) hold: angles (n,) in rad, and two truth tables (n, n).

    The first index runs over alpha1. `as_printed` compares mu with the quotients as they stand;
    `complete` holds the complete necessary conditions (finding E9).
    """

    angles: np.ndarray
    as_printed: np.ndarray
    complete: np.ndarray

    @property
    def share(self) -> Readings:
        """Share of the map where each reading holds."""
        return Readings(float(self.as_printed.mean()), float(self.complete.mean()))


def quasi_static_map(pad: Pad, n: int) -> QuasiStaticMap:
    """Both readings of Eqs. (23a, b) at the middles of n x n equal cells of (0, pi)^2."""
    angles = math.pi * (np.arange(n) + 0.5) / n
    limits = bounds(pad, tuple(np.meshgrid(angles, angles, indexing="ij")))
    return QuasiStaticMap(angles, np.asarray(limits.as_printed), np.asarray(limits.complete))


def spring_directions(pad: Pad, angles: Any = None) -> tuple[np.ndarray, np.ndarray]:
    """Vectors a1, a2, shape (3, ...): a spring lengthens by -a1.q or a2.q in the first order.

    `angles` replaces (alpha1, alpha2) of the pad, arrays allowed.
    """
    alpha1, alpha2 = (pad.alpha1, pad.alpha2) if angles is None else angles
    d = np.hypot(pad.w, pad.h)
    beta = np.arctan2(pad.h, pad.w)
    a1 = np.array([np.cos(alpha1), np.sin(alpha1), -d * np.sin(alpha1 + beta - pad.theta0)])
    a2 = np.array([np.cos(alpha2), -np.sin(alpha2), -d * np.sin(alpha2 + beta + pad.theta0)])
    return a1, a2


def balanced(pad: Pad, K: np.ndarray) -> np.ndarray:
    """K with rotation measured as w theta, so that all entries are stiffnesses in N/m."""
    scale = np.array([1.0, 1.0, 1.0 / pad.w])
    return np.asarray(scale[:, None] * K * scale[None, :])


def rank(pad: Pad, K: np.ndarray) -> int:
    """Rank of K with rotation measured as w theta.

    Singular values below 1e-13 of the greatest are taken as zero: rounding in Eq. (22) leaves
    some 1e-16, and a stiffness ratio that small means nothing for a pad.
    """
    values = np.linalg.svd(balanced(pad, K), compute_uv=False)
    return int(np.sum(values > 1e-13 * values[0])) if values[0] > 0.0 else 0
