"""The damping matrix that a scene asks for; the article's pad has none.

Ratios and Rayleigh damping refer to the modes, the mass and the stiffness of the pad about its
equilibrium without friction. The matrix is then one and the same everywhere: in every
linearisation, and in every contact state of a simulation.
"""

import dataclasses

import numpy as np

from squeal.equilibrium.branch import NO_START
from squeal.equilibrium.find import least_at_zero
from squeal.equilibrium.statics import Statics
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.model.contact import State
from squeal.model.equations import PadModel, about_origin, linearise

UNSTABLE = "modal damping ratios need stable modes, and the pad is unstable without friction"


def modal_damping(A: np.ndarray, ratios: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """B (..., 3, 3) that gives the modes of z'' + A z = 0 these damping ratios, and where it can.

    B = sum_i 2 z_i w_i v_i v_i' with A v_i = w_i^2 v_i, v_i' v_i = 1, by rising w_i, where A is
    the symmetric part of what is given. The second result (...) is false where a mode is
    unstable, so that it has no damping ratio.
    """
    squares, modes = np.linalg.eigh((A + np.swapaxes(A, -1, -2)) / 2)
    rates = 2 * np.array(ratios) * np.sqrt(np.maximum(squares, 0.0))
    B = modes * rates[..., None, :] @ np.swapaxes(modes, -1, -2)
    return B, squares[..., 0] >= -1e-12 * squares[..., -1]


def modal_damping_slope(A: np.ndarray, dA: np.ndarray, ratios: tuple[float, ...]) -> np.ndarray:
    """The derivative (3, 3) of `modal_damping` where A (3, 3) changes by dA.

    The formula of Daleckii and Krein for a function of a symmetric matrix. NaN where two modes of
    one frequency have different ratios, which then tell no direction apart.
    """
    squares, modes = np.linalg.eigh((A + A.T) / 2)
    w = np.sqrt(np.maximum(squares, 0.0))
    z = np.array(ratios)
    with np.errstate(divide="ignore", invalid="ignore"):
        quotients = 2 * np.subtract.outer(z * w, z * w) / np.subtract.outer(squares, squares)
        same = np.subtract.outer(squares, squares) == 0.0
        alike = np.where(np.equal.outer(z, z), np.where(z > 0.0, z / w, 0.0), np.nan)
    quotients = np.where(same, alike, quotients)
    inner = modes.T @ ((dA + dA.T) / 2) @ modes
    return np.asarray(modes @ (quotients * inner) @ modes.T)


def rayleigh_damping(A: np.ndarray, factors: tuple[float, ...]) -> np.ndarray:
    """B (..., 3, 3) = alpha + beta A for z'' + A z = 0, A its symmetric part; alpha in 1/s, beta
    in s. A mode of frequency w then has the damping ratio (alpha/w + beta w)/2."""
    alpha, beta = factors
    return np.asarray(alpha * np.eye(3) + beta * (A + np.swapaxes(A, -1, -2)) / 2)


def damping_matrix(scene: Scene) -> np.ndarray:
    """C (3, 3) in SI units; zero if the scene names no damping.

    Modal ratios and Rayleigh damping refer to the modes without friction, see `modal_damping`
    and `rayleigh_damping`. Raises ComputationError where a mode with a ratio is unstable, or
    where there is no equilibrium to refer to.
    """
    damping = scene.damping
    if damping is None:
        return np.zeros((3, 3))
    if damping.matrix is not None:
        return np.array(damping.matrix)
    model, q, state = without_friction(scene)
    matrices = about_origin(model) if model.linear else linearise(model, q, state)
    root = np.sqrt(np.diag(matrices.M))
    A = matrices.K / np.outer(root, root)
    if damping.ratios is None:
        assert damping.rayleigh is not None
        B = rayleigh_damping(A, damping.rayleigh)
    else:
        B, stable = modal_damping(A, damping.ratios)
        if not stable:
            raise ComputationError(UNSTABLE)
    return np.asarray(root[:, None] * B * root)


def damped_model(scene: Scene) -> PadModel:
    """The scene's pad with its damping matrix. Raises ComputationError, see `damping_matrix`."""
    if scene.damping is None:
        return scene.pad_model
    rows = tuple(map(tuple, damping_matrix(scene).tolist()))
    return dataclasses.replace(scene.pad_model, damping=rows)


def without_friction(scene: Scene) -> tuple[PadModel, np.ndarray, State]:
    """What ratios and Rayleigh damping refer to: the pad without friction, its place q (3,) in SI
    units, its contact. Raises ComputationError where there is no such place."""
    model = scene.pad_model.replace(mu=0.0)
    if model.linear:
        return model, np.zeros(3), model.full
    start = least_at_zero(model)
    if start is None:
        raise ComputationError(
            f"modal damping ratios and Rayleigh damping refer to the pad without friction, but "
            f"{NO_START}"
        )
    return model, Statics.of(model).to_si(start[0]), start[1]
