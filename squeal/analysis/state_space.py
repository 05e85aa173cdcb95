"""The linearised pad as a state space of python-control."""

import warnings

import control
import numpy as np
from control import StateSpace

from squeal.analysis.pads import analyse
from squeal.errors import InputWarning
from squeal.io.scene import Scene
from squeal.linear.matrices import state_matrices
from squeal.schema import public

STATES = ["x", "y", "theta", "x_dot", "y_dot", "theta_dot"]


@public
def state_space(scene: Scene, mu: float | None = None) -> StateSpace:
    """A scene's pad about its sliding equilibrium as a :class:`control.StateSpace`.

    Friction mu is the scene's own if left out. Inputs are a force along and normal to the surface
    (N) and a moment (N m) on the pad, outputs are x, y (m) and theta (rad) from the equilibrium;
    the poles are the eigenvalues. Warns (InputWarning) of what speaks against the equilibrium.
    Raises InputError for a mu that is not allowed, ComputationError if no steady sliding exists.
    """
    analysis = analyse(scene if mu is None else scene.replace(mu=mu))
    for words in analysis.warnings:
        warnings.warn(words, InputWarning, stacklevel=3)
    A, B = state_matrices(*analysis.matrices)
    labels = {"inputs": ["force x", "force y", "moment"], "outputs": STATES[:3], "states": STATES}
    return control.ss(A, B, np.eye(3, 6), np.zeros((3, 3)), name=scene.model, **labels)
