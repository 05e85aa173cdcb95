"""The damping matrix of a pad, which refers to its modes at rest without friction."""

import dataclasses
from functools import lru_cache

import numpy as np

from squeal.equilibrium.path import NO_START, Path, branch_of
from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene
from squeal.model.contact import State
from squeal.model.equations import PadModel, linearise

UNSTABLE = "modal damping ratios need stable modes, and the pad is unstable without friction"


def normalised_damping(damping: Damping, A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The damping matrix B (..., 3, 3) of z'' + B z' + A z = 0, and bools (...): where it exists.

    A is K in coordinates in which the mass matrix is 1, S its symmetric part. Rayleigh's factors
    make B = alpha + beta S. Damping ratios z_i of the modes S v_i = w_i^2 v_i, by rising w_i, make
    B = sum_i 2 z_i w_i v_i v_i', which does not exist where a w_i^2 is negative.
    """
    symmetric = (A + np.swapaxes(A, -1, -2)) / 2
    if damping.rayleigh is not None:
        alpha, beta = damping.rayleigh
        everywhere = np.ones(A.shape[:-2], dtype=bool)
        return alpha * np.eye(3) + beta * symmetric, everywhere
    squares, modes = np.linalg.eigh(symmetric)  # w_i^2, rising, and v_i
    rates = 2 * np.array(damping.ratios) * np.sqrt(np.maximum(squares, 0.0))
    B = modes * rates[..., None, :] @ np.swapaxes(modes, -1, -2)
    # a w_1^2 of 0 may be rounded to a little below it
    return B, squares[..., 0] >= -1e-12 * squares[..., -1]


def normalised_damping_slope(damping: Damping, A: np.ndarray, dA: np.ndarray) -> np.ndarray:
    """The derivative (3, 3) of `normalised_damping` where A (3, 3) changes by dA.

    Modal damping is a function f(w^2) = 2 z w of the symmetric part S of A, z the ratio of a mode.
    By the formula of Daleckii and Krein dB = V (Q * (V' dS V)) V' with the modes V of S, where *
    multiplies entry by entry. Q_ij is (f_i - f_j) / (w_i^2 - w_j^2), or the derivative z / w of f
    for equal frequencies. NaN where two modes of one frequency have different ratios.
    """
    symmetric = (A + A.T) / 2
    change = (dA + dA.T) / 2  # dS
    if damping.rayleigh is not None:
        _, beta = damping.rayleigh
        return beta * change
    squares, modes = np.linalg.eigh(symmetric)  # w_i^2 and V
    w = np.sqrt(np.maximum(squares, 0.0))
    z = np.array(damping.ratios)
    square_differences = np.subtract.outer(squares, squares)  # (3, 3)
    with np.errstate(divide="ignore", invalid="ignore"):
        derivatives = np.where(z > 0.0, z / w, 0.0)
        same_ratio = np.equal.outer(z, z)
        at_one_frequency = np.where(same_ratio, derivatives, np.nan)
        at_two_frequencies = 2 * np.subtract.outer(z * w, z * w) / square_differences
    Q = np.where(square_differences == 0.0, at_one_frequency, at_two_frequencies)
    return modes @ (Q * (modes.T @ change @ modes)) @ modes.T


def damping_matrix(scene: Scene) -> np.ndarray:
    """C (3, 3) in SI units; zero if the scene names no damping.

    Modal ratios and Rayleigh damping refer to the modes, the mass and the stiffness about the
    equilibrium without friction. The matrix is then the same in every linearisation and in every
    contact state of a simulation. Raises ComputationError where a mode with a ratio is unstable,
    or where there is no equilibrium to refer to.
    """
    damping = scene.damping
    if damping is None:
        return np.zeros((3, 3))
    if damping.matrix is not None:
        return np.array(damping.matrix)
    M, _, K = linearise(*without_friction(scene))
    # M is diagonal: in the coordinates sqrt(M) q the mass matrix is 1, K is A and C is B
    root_M = np.sqrt(np.diag(M))
    A = K / np.outer(root_M, root_M)
    B, exists = normalised_damping(damping, A)
    if not exists:
        raise ComputationError(UNSTABLE)
    return root_M[:, None] * B * root_M


def damped_model(scene: Scene) -> PadModel:
    """The scene's pad with its damping matrix. Raises ComputationError, see `damping_matrix`."""
    if scene.damping is None:
        return scene.pad_model
    rows = tuple(map(tuple, damping_matrix(scene).tolist()))
    return dataclasses.replace(scene.pad_model, damping=rows)


def without_friction(scene: Scene) -> tuple[PadModel, np.ndarray, State]:
    """What ratios and Rayleigh damping refer to: the pad without friction, its equilibrium q (3,)
    (SI) and its contact state. Raises ComputationError where there is no such equilibrium."""
    pad = scene.pad
    # parameters that are derived from others are left out, so that they follow these here too
    numbers = {n: float(v) for n, v in pad.given().items() if n not in pad.derived}
    numbers["mu"] = 0.0
    model = scene.pad_model.replace(**numbers)
    q, state = _equilibrium_without_friction(model)
    return model, q.copy(), state


@lru_cache  # all scenes of a continuation over friction or damping refer to the same equilibrium
def _equilibrium_without_friction(model: PadModel) -> tuple[np.ndarray, State]:
    """The equilibrium q (3,) (SI) of a pad whose friction is zero, and its contact state."""
    if model.linear:
        return np.zeros(3), model.full
    path = Path(model, branch_of(model, 0.0))
    if not path.branch.z.size:
        raise ComputationError(f"ratios and rayleigh refer to the pad without friction: {NO_START}")
    z, state = path.at(0.0)
    return path.statics.to_si(z), state
