"""What the article makes of model B3: Eq. (22) as printed, and the friction bounds (23a, b)."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from squeal.article.records import Record
from squeal.model.equations import spring_directions
from squeal.model.pad import Pad


def stiffness(pad: Pad, printed: bool = False, angles: Any = None) -> np.ndarray:
    """K of Eq. (22), shape (3, 3, ...): the two inclined springs about the origin.

    `printed` leaves the k2 term of K33 out, as Eq. (22i) does (finding E1).
    """
    K = spring_stiffness(pad, angles)
    if printed:
        a1, _ = spring_directions(pad, angles)
        K[2, 2] = pad.k1 * a1[2] ** 2
    return K


class Bounds(NamedTuple):
    """Friction bounds (23a, b) and whether mu meets both, as printed and with correct signs.

    `as_printed`: mu < K11/K21 and mu < K31/(h K21). `sign_aware`: R_n > 0 in each pair of rows of
    Eq. (21) with y = theta = delta = 0, that is mu K21/K11 < 1 and mu h K21/K31 < 1.
    """

    bound_23a: Any
    bound_23b: Any
    as_printed: Any
    sign_aware: Any


def bounds(pad: Pad, angles: Any = None) -> Bounds:
    """Eqs. (23a, b) for the pad's mu; `angles` = (alpha1, alpha2) arrays for a map.

    A bound is infinite where K21 = 0 to rounding: friction is not bounded there. A row whose
    stiffness vanishes cannot carry the friction force, so the sign-aware conditions fail there
    (unless mu = 0).
    """
    K = stiffness(pad, angles=angles)
    K11, K21, K31, mu, h = K[0, 0], K[1, 0], K[2, 0], pad.mu, pad.h
    # cos(pi/2) leaves some 1e-17, whose sign would decide a bound by chance
    rounding = 8 * np.finfo(float).eps * (pad.k1 + pad.k2)
    K11, K21 = (np.where(np.abs(entry) <= rounding, 0.0, entry) for entry in (K11, K21))
    K31 = np.where(np.abs(K31) <= rounding * (pad.w + h), 0.0, K31)
    with np.errstate(divide="ignore", invalid="ignore"):
        a = np.where(K21 == 0.0, np.inf, K11 / K21)
        b = np.where(K21 == 0.0, np.inf, K31 / (h * K21))
    row_1 = (K11 - mu * K21 > 0.0) & (K11 > 0.0)
    row_3 = (K31 - mu * h * K21) * np.sign(K31) > 0.0
    sign_aware = row_1 & row_3 if mu > 0.0 else np.ones_like(row_1)
    return Bounds(a, b, (mu < a) & (mu < b), sign_aware)


class Readings(Record):
    """Share of the map where (23a, b) hold as printed, and with correct signs."""

    as_printed: float
    sign_aware: float


@dataclass(frozen=True)
class QuasiStaticMap:
    """Where Eqs. (23a, b) hold: angles (n,) in rad, and two truth tables (n, n).

    The first index runs over alpha1. `as_printed` compares mu with the quotients as they stand;
    `sign_aware` asks for Rn > 0 in each pair of rows of Eq. (21) instead (finding E9).
    """

    angles: np.ndarray
    as_printed: np.ndarray
    sign_aware: np.ndarray

    @property
    def share(self) -> Readings:
        """Share of the map where each reading holds."""
        return Readings(float(self.as_printed.mean()), float(self.sign_aware.mean()))


def quasi_static_map(pad: Pad, n: int) -> QuasiStaticMap:
    """Both readings of Eqs. (23a, b) at the middles of n x n equal cells of (0, pi)^2."""
    angles = math.pi * (np.arange(n) + 0.5) / n
    limits = bounds(pad, tuple(np.meshgrid(angles, angles, indexing="ij")))
    return QuasiStaticMap(angles, np.asarray(limits.as_printed), np.asarray(limits.sign_aware))


def spring_stiffness(pad: Pad, angles: Any = None) -> np.ndarray:
    """K of the two inclined springs about the origin, Eq. (22), shape (3, 3, ...).

    K = k1 a1 a1' + k2 a2 a2', so its rank is at most two.
    """
    a1, a2 = spring_directions(pad, angles)
    K = pad.k1 * np.einsum("i...,j...->ij...", a1, a1)
    return np.asarray(K + pad.k2 * np.einsum("i...,j...->ij...", a2, a2))


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
