"""Model B3 and linearisation: Eqs. (21)-(23), and the matrices of complex eigenvalue analysis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from squeal.contact import CONSISTENT, Formulation
from squeal.model import PadModel
from squeal.pad import Pad
from squeal.states import FULL, State


@dataclass(frozen=True)
class Linearisation:
    """M q'' + C q' + K q = 0 about a place of rest, each matrix (3, 3), SI units."""

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray


def linearise(model: PadModel, q: Any, state: State) -> Linearisation:
    """Matrices about q = (x, y, theta) in a contact state, contact and friction included.

    K is minus the derivative of the loads of Eqs. (4)-(6) or (8)-(10), exact to rounding; C is
    zero, since the article's pad has no damping.
    """
    return Linearisation(model.mass_matrix, np.zeros((3, 3)), -model.jacobian(q, state))


def about_origin(pad: Pad, formulation: Formulation = CONSISTENT) -> Linearisation:
    """The article's B3 with its right-hand side linearised too: full contact about the origin."""
    return linearise(PadModel("B3", pad, formulation), np.zeros(3), FULL)


def spring_directions(pad: Pad, angles: Any = None) -> tuple[np.ndarray, np.ndarray]:
    """Vectors a1, a2, shape (3, ...): a spring lengthens by -a1.q or a2.q in the first order.

    `angles` replaces (alpha1, alpha2) of the pad, arrays allowed.
    """
    alpha1, alpha2 = (pad.alpha1, pad.alpha2) if angles is None else angles
    d, beta = np.hypot(pad.w, pad.h), np.arctan2(pad.h, pad.w)
    a1 = np.array([np.cos(alpha1), np.sin(alpha1), -d * np.sin(alpha1 + beta - pad.theta0)])
    a2 = np.array([np.cos(alpha2), -np.sin(alpha2), -d * np.sin(alpha2 + beta + pad.theta0)])
    return a1, a2


def stiffness(pad: Pad, printed: bool = False, angles: Any = None) -> np.ndarray:
    """K of Eq. (22), shape (3, 3, ...): the two inclined springs about the origin.

    K = k1 a1 a1' + k2 a2 a2', so its rank is at most two. `printed` leaves the k2 term of K33
    out, as Eq. (22i) does (finding E1).
    """
    a1, a2 = spring_directions(pad, angles)
    K = pad.k1 * np.einsum("i...,j...->ij...", a1, a1)
    K = K + pad.k2 * np.einsum("i...,j...->ij...", a2, a2)
    if printed:
        K[2, 2] = pad.k1 * a1[2] ** 2
    return np.asarray(K)


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


class Bounds(NamedTuple):
    """Friction bounds (23a, b) and whether mu meets both, as printed and with signs followed.

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
