"""Model B3 and linearisation: Eqs. (21)-(22), and the matrices of complex eigenvalue analysis."""

from typing import Any, NamedTuple

import numpy as np

from squeal.model.equations import PadModel
from squeal.model.law import Touching
from squeal.model.pad import Pad
from squeal.model.states import State


class Linearisation(NamedTuple):
    """M q'' + C q' + K q = 0 about a place of rest, each matrix (3, 3), SI units, unwritable."""

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray


def _matrices(model: PadModel, q: Any, state: Touching) -> Linearisation:
    """`linearise` about one place or several, as stacks (3, 3, n) but for M."""
    C, K = 0.0 - model.rate_jacobian(q, state), -model.jacobian(q, state)
    found = Linearisation(model.mass_matrix, C, K)
    for X in found:
        X.flags.writeable = False
    return found


def linearise(model: PadModel, q: Any, state: State) -> Linearisation:
    """Matrices about q = (x, y, theta) in a contact state, contact and friction included.

    K and C are minus the derivatives of the loads of Eqs. (4)-(6) or (8)-(10) by place and
    velocity, exact to rounding; C is zero for the article's pad, which has no damping.
    """
    return _matrices(model, q, state)


def linearised_at(model: PadModel, q: np.ndarray, state: Touching) -> list[Linearisation]:
    """`linearise` about each of the places q (3, n); parameters of the pad may be arrays (n,)."""
    M, C, K = _matrices(model, q, state)
    return [Linearisation(M, C[:, :, i], K[:, :, i]) for i in range(q.shape[1])]


def about_origin(model: PadModel) -> Linearisation:
    """Matrices in full contact about the origin; of B3, the article's with its right-hand side
    linearised too."""
    return linearise(model, np.zeros(3), model.full)


def spring_directions(pad: Pad, angles: Any = None) -> tuple[np.ndarray, np.ndarray]:
    """Vectors a1, a2, shape (3, ...): a spring lengthens by -a1.q or a2.q in the first order.

    `angles` replaces (alpha1, alpha2) of the pad, arrays allowed.
    """
    alpha1, alpha2 = (pad.alpha1, pad.alpha2) if angles is None else angles
    d, beta = np.hypot(pad.w, pad.h), np.arctan2(pad.h, pad.w)
    a1 = np.array([np.cos(alpha1), np.sin(alpha1), -d * np.sin(alpha1 + beta - pad.theta0)])
    a2 = np.array([np.cos(alpha2), -np.sin(alpha2), -d * np.sin(alpha2 + beta + pad.theta0)])
    return a1, a2


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
