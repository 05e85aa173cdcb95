"""The linearised pad as state spaces of python-control."""

import warnings

import control
import numpy as np
from control import StateSpace

from squeal.analysis.pads import Analysis, analyse, held_system
from squeal.errors import ComputationError, InputWarning
from squeal.io.scene import Scene, the_scene
from squeal.linear.matrices import state_matrices

STATES = ("x", "y", "theta", "x_dot", "y_dot", "theta_dot")


def _analysed(scene: Scene, mu: float | None) -> Analysis:
    """The analysis at mu; its warnings, for which a state space has no place, are given at once."""
    scene = the_scene(scene)
    analysis = analyse(scene if mu is None else scene.replace(mu=mu))
    for words in analysis.warnings:
        warnings.warn(words, InputWarning, stacklevel=4)
    return analysis


def state_space(scene: Scene, mu: float | None = None) -> StateSpace:
    """A scene's pad about its sliding equilibrium at a friction mu, its own if left out.

    Inputs are a force along and normal to the surface (N) and a moment (N m) on the pad, outputs
    are x, y (m) and theta (rad) from the equilibrium; the poles are the eigenvalues. Warns
    (InputWarning) of what speaks against the equilibrium. Raises InputError for a mu that is not
    allowed, ComputationError if no steady sliding exists.
    """
    A, B = state_matrices(*_analysed(scene, mu).matrices)
    words = {"inputs": ["force x", "force y", "moment"], "outputs": list(STATES[:3])}
    D = np.zeros((3, 3))
    return control.ss(A, B, np.eye(3, 6), D, name=scene.model, states=list(STATES), **words)


def friction_plant(scene: Scene, mu: float | None = None) -> StateSpace:
    """The pad without friction, and where friction acts on it: a plant with two inputs.

    It is taken about the equilibrium at mu (the scene's own if left out), which is held. Inputs
    are a force against x (N) and a moment against theta (N m), outputs the normal reaction (N) and
    the moment (N m) of friction of coefficient 1, both from the equilibrium; where friction acts at
    two levels, as at the edges of a tilted pad, the moment is no multiple of the force. Friction is
    negative feedback of mu in both channels: the poles are then the eigenvalues. Warns as
    `state_space` does.

    Raises ComputationError where friction is no such gain, as with a coefficient that falls with
    speed.
    """
    system = held_system(scene, _analysed(scene, mu))
    (M, C, K), (_, C1, K1), (*_, middle) = (map(np.asarray, system(p)) for p in (0.0, 1.0, 0.37))
    bent = np.abs(K + 0.37 * (K1 - K) - middle).max() / max(np.abs(K).max(), np.abs(K1).max())
    if bent > 1e-10 or np.abs(C1 - C).max() > 1e-10 * np.abs(C).max():
        raise ComputationError(
            "friction is no plain gain here: stiffness or damping is not linear in mu"
        )
    A, B = state_matrices(M, C, K)
    output = np.hstack([-(K1 - K)[[0, 2]], np.zeros((2, 3))])
    words = {
        "inputs": ["force against x", "moment against theta"],
        "outputs": ["normal reaction", "friction moment over mu"],
    }
    D = np.zeros((2, 2))
    return control.ss(A, -B[:, [0, 2]], output, D, name="friction", states=list(STATES), **words)
