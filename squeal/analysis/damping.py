"""The damping matrix that a scene asks for; the article's pad has none."""

from __future__ import annotations

import numpy as np

from squeal.equilibrium.find import least_at_zero
from squeal.equilibrium.statics import Statics
from squeal.errors import ComputationError
from squeal.model.linear import Linearisation, about_origin, linearise
from squeal.scene import Scene

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


def damping_matrix(scene: Scene) -> np.ndarray:
    """C (3, 3) in SI units; zero if the scene names no damping.

    Modal ratios refer to the modes without friction, see `modal_damping`. Raises ComputationError
    where such a mode is unstable, or where there is no equilibrium to refer to.
    """
    if scene.damping is None:
        return np.zeros((3, 3))
    if scene.damping.matrix is not None:
        return np.array(scene.damping.matrix)
    assert scene.damping.ratios is not None
    matrices = _without_friction(scene)
    root = np.sqrt(np.diag(matrices.M))
    B, stable = modal_damping(matrices.K / np.outer(root, root), scene.damping.ratios)
    if not stable:
        raise ComputationError(UNSTABLE)
    return np.asarray(root[:, None] * B * root)


def _without_friction(scene: Scene) -> Linearisation:
    model = scene.pad_model.replace(mu=0.0)
    if model.linear:
        return about_origin(model)
    start = least_at_zero(model)
    if start is None:
        raise ComputationError(
            "modal damping ratios refer to the modes without friction, but there is no "
            "equilibrium in contact without friction"
        )
    return linearise(model, Statics.of(model).to_si(start[0]), start[1])
