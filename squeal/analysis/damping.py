"""The damping matrix that a scene asks for; the article's pad has none."""

from __future__ import annotations

import numpy as np

from squeal.equilibrium.find import least_at_zero
from squeal.equilibrium.statics import Statics
from squeal.errors import ComputationError
from squeal.model.equations import PadModel
from squeal.model.linear import Linearisation, about_origin, linearise
from squeal.scene import Scene


def damping_matrix(scene: Scene) -> np.ndarray:
    """C (3, 3) in SI units; zero if the scene names no damping.

    Modal ratios z_i refer to the modes without friction, by rising frequency:
    C = sum_i 2 z_i w_i (M v_i)(M v_i)' with K v_i = w_i^2 M v_i and v_i' M v_i = 1, where K is the
    symmetric part of the stiffness at mu = 0. Raises ComputationError where such a mode is
    unstable, so that it has no damping ratio, or where there is no equilibrium to refer to.
    """
    if scene.damping is None:
        return np.zeros((3, 3))
    if scene.damping.matrix is not None:
        return np.array(scene.damping.matrix)
    matrices = _without_friction(scene)
    root = np.sqrt(np.diag(matrices.M))
    squares, modes = np.linalg.eigh((matrices.K + matrices.K.T) / 2 / np.outer(root, root))
    if squares[0] < -1e-12 * squares[-1]:
        raise ComputationError(
            "modal damping ratios need stable modes, and the pad is unstable without friction"
        )
    vectors = root[:, None] * modes  # M v_i
    rates = 2 * np.array(scene.damping.ratios) * np.sqrt(np.maximum(squares, 0.0))
    return np.asarray(vectors * rates @ vectors.T)


def _without_friction(scene: Scene) -> Linearisation:
    pad = scene.pad.replace(mu=0.0)
    if scene.model == "B3":
        return about_origin(pad, scene.formulation)
    model = PadModel(scene.model, pad, scene.formulation)
    start = least_at_zero(model)
    if start is None:
        raise ComputationError(
            "modal damping ratios refer to the modes without friction, but there is no "
            "equilibrium in contact without friction"
        )
    return linearise(model, Statics.of(model).to_si(start[0]), start[1])
