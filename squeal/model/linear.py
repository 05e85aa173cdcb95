"""Model B3 and linearisation: Eqs. (21)-(22), and the matrices of complex eigenvalue analysis."""

from typing import Any, NamedTuple

import numpy as np

from squeal.model.equations import PadModel
from squeal.model.law import Touching
from squeal.model.pad import Pad


class Linearisation(NamedTuple):
    """M q'' + C q' + K q = 0 about a place of rest, each matrix (3, 3), SI units, unwritable."""

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray


def linearise(model: PadModel, q: Any, state: Touching) -> Linearisation:
    """Matrices about q = (x, y, theta) in a contact state, contact and friction included.

    K and C are minus the derivatives of the loads of Eqs. (4)-(6) or (8)-(10) by place and
    velocity, exact to rounding; C is zero for the article's pad, which has no damping. About
    several places q (3, n) they are stacks (3, 3, n).
    """
    C, K = 0.0 - model.rate_jacobian(q, state), -model.jacobian(q, state)
    found = Linearisation(model.mass_matrix, C, K)
    for X in found:
        X.flags.writeable = False
    return found


def linearised_at(model: PadModel, q: np.ndarray, state: Touching) -> list[Linearisation]:
    """`linearise` about each of the places q (3, n); parameters of the pad may be arrays (n,)."""
    M, C, K = linearise(model, q, state)
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
